//! Inertia that changes: a payload picked up during the record, and a mechanism whose inertia varies with position.
//!
//! J(q, t) = J (1 + share from t_0 on + A sin(n q + p)); (J(q) v)' = tau + J'(q) v^2/2, so that J a = tau - J'(q) v^2/2. A
//! payload is picked up without a blow.
//!
//! Source: Lagrange's equation of one coordinate; Craig, "Introduction to Robotics", 3rd ed., section 6.8.

use super::{Effect, Entry, Instant, Kind, Parameter, Plain};

struct InertiaChange {
    share: f64,
    start_s: f64,
    amplitude_share: f64,
    wave_rad: f64,
    phase_rad: f64,
    inertia_kg_m2: f64,
}

impl Effect for InertiaChange {
    fn begin(&mut self, plain: &Plain) {
        self.inertia_kg_m2 = plain.inertia_kg_m2;
    }

    fn mechanics(&mut self, now: &Instant) -> f64 {
        let angle = self.wave_rad * now.motion.position_rad + self.phase_rad;
        let slope = self.inertia_kg_m2 * self.amplitude_share * self.wave_rad * angle.cos();
        -0.5 * slope * now.motion.velocity_rad_s.powi(2)
    }

    fn inertia(&mut self, now: &Instant) -> f64 {
        let payload = if now.time_s >= self.start_s {
            self.share
        } else {
            0.0
        };
        let angle = self.wave_rad * now.motion.position_rad + self.phase_rad;
        // A mechanism keeps some inertia everywhere.
        (1.0 + payload + self.amplitude_share * angle.sin()).max(0.05)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "mechanics.inertia_change",
    model: "J (1 + share (t >= t_0) + A sin(n q + p)) a + J A n cos(n q + p) v^2/2",
    parameters: &[
        Parameter::same("share", Kind::Size, |_| [0.0, 1.0]),
        Parameter::same("start_s", Kind::Onset, |scale| [0.0, scale.duration_s]),
        Parameter::same("amplitude_share", Kind::Size, |_| [0.0, 0.5]),
        Parameter::ORDER,
        Parameter::PHASE,
    ],
    build: |values, unit| {
        Box::new(InertiaChange {
            share: values[0],
            start_s: values[1],
            amplitude_share: values[2],
            wave_rad: unit.wave_rad(values[3]),
            phase_rad: values[4],
            inertia_kg_m2: 0.0,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn acceleration_falls_when_a_payload_is_picked_up() {
        let effect = (ENTRY.build)(&[0.5, 0.1, 0.0, 1.0, 0.0], Unit::Rotary);
        let mut axis = testing::axis(testing::free(), vec![effect]);
        let mut gain = || {
            let before = axis.truth().motion.velocity_rad_s;
            for _ in 0..1000 {
                axis.advance(0.01);
            }
            (axis.truth().motion.velocity_rad_s - before) / 0.1
        };
        let (before, after) = (gain(), gain());
        // 0.01 N m on 1e-4 kg m^2, then on half as much again; the friction left is 1e-9 of that.
        assert!((before - 100.0).abs() < 1e-4, "{before}");
        assert!((after - 100.0 / 1.5).abs() < 1e-4, "{after}");
    }

    #[test]
    fn inertia_over_position_keeps_energy() {
        let effect = (ENTRY.build)(&[0.0, 0.0, 0.5, 2.0, 0.3], Unit::Rotary);
        let mut axis = testing::axis(testing::free(), vec![effect]).starting_at(0.0, 10.0);
        let energy = |q: f64, v: f64| (1.0 + 0.5 * (2.0 * q + 0.3).sin()) * v * v;
        let start = energy(0.0, 10.0);
        let (mut worst, mut slowest) = (0.0_f64, 10.0_f64);
        for _ in 0..10_000 {
            axis.advance(0.0);
            let motion = axis.truth().motion;
            let now = energy(motion.position_rad, motion.velocity_rad_s);
            worst = worst.max((now / start - 1.0).abs());
            slowest = slowest.min(motion.velocity_rad_s);
        }
        // First order in the angle that a step travels, 2 x 10 rad/s x 5 us.
        assert!(worst < 1e-3, "{worst:e}");
        assert!(slowest < 9.0, "{slowest}");
    }
}
