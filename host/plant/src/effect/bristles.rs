//! Friction whose sign is a deflection: a share from -1 to 1 of the level takes the place of the sign of velocity.
//!
//! F = s level(v) + what the inner model has beyond its level at rest. In steady sliding s = sgn(v), and F is that of the
//! inner model.

use crate::contact::{Contact, Levels};
use bristle_core::friction::Motion;

/// Bristles by their share of the level.
pub(super) trait Bristles: Send {
    /// Advances by a step; the share of the level that they carry, with their own damping.
    fn share(&mut self, motion: &Motion<f64>) -> f64;
    /// rad
    fn deflection_rad(&self) -> f64;
    /// Multiplies it, and the share that goes with it.
    fn rescale(&mut self, times: f64);
    /// Steepest slope of the share over deflection, 1/rad, and of the share over its rate, s/rad.
    fn slopes(&self) -> [f64; 2];
}

/// A friction model on bristles, in place of its own.
pub(super) struct OnBristles<B> {
    inner: Box<dyn Contact>,
    levels: Levels,
    bristles: B,
}

impl<B: Bristles + 'static> OnBristles<B> {
    /// Puts a model on bristles made for the deflection that it has in steady sliding, rad: zero of a static model.
    pub fn wrap(mut inner: Box<dyn Contact>, make: impl FnOnce(f64) -> B) -> Box<dyn Contact> {
        let levels = Levels::of(inner.as_ref());
        // Far longer than any transient. From here on only its steady state is asked for.
        for _ in 0..10 {
            inner.step(Motion {
                velocity_rad_s: 1.0,
                applied_nm: 0.0,
                dt_s: 1.0,
            });
        }
        let bristles = make(inner.deflection_rad().abs());
        Box::new(Self {
            inner,
            levels,
            bristles,
        })
    }
}

impl<B: Bristles> Contact for OnBristles<B> {
    fn step(&mut self, motion: Motion<f64>) -> f64 {
        let share = self.bristles.share(&motion);
        let inner_nm = if self.inner.holds_at_rest() {
            self.inner.step(Motion {
                applied_nm: f64::MAX.copysign(share),
                ..motion
            })
        } else {
            self.inner.steady_state_nm(motion.velocity_rad_s)
        };
        if inner_nm == 0.0 {
            return share * self.levels.stiction_nm;
        }
        let level = inner_nm.abs().min(self.levels.stiction_nm);
        share * level + (inner_nm - level.copysign(inner_nm))
    }

    fn deflection_rad(&self) -> f64 {
        self.bristles.deflection_rad()
    }

    fn holds_at_rest(&self) -> bool {
        false
    }

    fn steady_state_nm(&self, velocity_rad_s: f64) -> f64 {
        self.inner.steady_state_nm(velocity_rad_s)
    }

    fn rescale(&mut self, times: f64) {
        self.bristles.rescale(times);
    }

    fn fastest_rate_1_s(&self, inertia_kg_m2: f64) -> f64 {
        let [stiffness, damping] = self.bristles.slopes();
        let per_inertia = self.levels.stiction_nm / inertia_kg_m2;
        (stiffness * per_inertia).sqrt().max(damping * per_inertia)
    }
}
