//! Controllers of a drive: a stiff cascade with an integral, a soft one without.

use crate::axis::Axis;
use crate::draw::Draw;

/// Reference of a closed loop at a sample.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Target {
    pub(crate) q: f64,
    pub(crate) v: f64,
    pub(crate) a: f64,
}

/// Position and velocity gains of a loop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gains {
    position: f64,
    velocity: f64,
    integral: f64,
    inertia: f64,
    filter_rad_s: f64,
}

impl Gains {
    /// Stiff, as machine tools are tuned.
    pub(crate) fn stiff(axis: &Axis, draw: &mut Draw) -> Self {
        let bandwidth = (axis.rate_hz * draw.even(0.03, 0.07)).min(draw.even(120.0, 300.0));
        Self {
            position: bandwidth / draw.even(4.0, 6.0),
            velocity: axis.inertia * bandwidth,
            integral: axis.inertia * bandwidth * bandwidth / draw.even(6.0, 12.0),
            inertia: axis.inertia * draw.even(0.8, 1.1),
            filter_rad_s: 5.0 * bandwidth,
        }
    }

    /// Soft, as robots that may be touched are; friction leaves a visible error.
    pub(crate) fn soft(axis: &Axis, draw: &mut Draw) -> Self {
        let bandwidth = (axis.rate_hz * 0.04).min(draw.even(25.0, 60.0));
        Self {
            position: bandwidth / draw.even(2.0, 4.0),
            velocity: axis.inertia * bandwidth,
            integral: 0.0,
            inertia: 0.0,
            filter_rad_s: 8.0 * bandwidth,
        }
    }

    /// Keeps a driven axis from wandering off, and no more.
    pub(crate) fn centring(axis: &Axis) -> Self {
        let bandwidth = 4.0;
        Self {
            position: bandwidth / 3.0,
            velocity: axis.inertia * bandwidth,
            integral: 0.0,
            inertia: 0.0,
            filter_rad_s: 40.0,
        }
    }
}

/// State of a loop.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Loop {
    last: Option<f64>,
    velocity: f64,
    integral: f64,
}

impl Loop {
    /// Torque for a measured position.
    pub(crate) fn torque(
        &mut self,
        gains: &Gains,
        target: Target,
        measured: f64,
        step_s: f64,
        limit: f64,
    ) -> f64 {
        let raw = self.last.map_or(0.0, |last| (measured - last) / step_s);
        self.last = Some(measured);
        let kept = libm::exp(-gains.filter_rad_s * step_s);
        self.velocity = kept * self.velocity + (1.0 - kept) * raw;
        let wanted = target.v + gains.position * (target.q - measured);
        let error = wanted - self.velocity;
        let free = gains.velocity * error + self.integral + gains.inertia * target.a;
        // The integral waits while the drive gives all it has.
        if free.abs() < limit {
            self.integral += gains.integral * error * step_s;
        }
        free.clamp(-limit, limit)
    }
}
