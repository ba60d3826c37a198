//! An end stop: a one-sided stiff contact beyond a place.
//!
//! tau - k x (x/x_0)^h beyond q_0, x = q - q_0 + T v, with `damping_s` T; it pushes and never pulls. `side` below zero puts the stop
//! at the lower end. Round faces harden: h = 1/2 is Hertz's contact, with k what it is at a depth of x_0.
//!
//! Source: Kelvin-Voigt contact without its pull: Hunt, Crossley, "Coefficient of restitution interpreted as damping in
//! vibroimpact", ASME J. Appl. Mech. 42(2), 1975, for why the pull is left out and for powers of the depth.

use super::{Effect, Entry, Instant, Kind, Parameter};

/// Depth at which one that hardens is as stiff as it says, rad or m.
const HARDENS_ABOUT: f64 = 0.01;

struct EndStop {
    stiffness_nm_rad: f64,
    position_rad: f64,
    side: f64,
    damping_s: f64,
    hardening: f64,
}

impl Effect for EndStop {
    fn mechanics(&mut self, now: &Instant) -> f64 {
        let depth = self.side * (now.motion.position_rad - self.position_rad);
        if depth <= 0.0 {
            return 0.0;
        }
        let closing = self.side * now.motion.velocity_rad_s;
        let pressed = (depth + self.damping_s * closing).max(0.0);
        let hardens = if self.hardening > 0.0 {
            (pressed / HARDENS_ABOUT).powf(self.hardening)
        } else {
            1.0
        };
        -self.side * self.stiffness_nm_rad * pressed * hardens
    }

    fn fastest_rate_1_s(&self, inertia_kg_m2: f64) -> f64 {
        let natural_2 = self.stiffness_nm_rad.abs() / inertia_kg_m2;
        natural_2.sqrt().max(natural_2 * self.damping_s)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "mechanics.end_stop",
    model: "tau - k x (x/0.01)^h, x = q - q_0 + T v, beyond q_0",
    parameters: &[
        Parameter::new(["stiffness_nm_rad", "stiffness_n_m"], Kind::Size, |scale| {
            // What the top torque presses it in, as a part of the stroke: from a rubber bumper to steel.
            [0.03, 1e-5].map(|part| scale.top_torque_nm / (part * scale.stroke_rad()))
        }),
        Parameter::new(["position_rad", "position_m"], Kind::Stop, |scale| {
            [scale.lowest_rad, scale.highest_rad]
        }),
        Parameter::same("side", Kind::Side, |_| [-1.0, 1.0]).or(1.0),
        Parameter::same("damping_s", Kind::Shape, |_| [1e-5, 1e-2]).or(1e-4),
        Parameter::same("hardening", Kind::Detail, |_| [0.0, 1.0]),
    ],
    build: |values, _| {
        Box::new(EndStop {
            stiffness_nm_rad: values[0],
            position_rad: values[1],
            side: if values[2] < 0.0 { -1.0 } else { 1.0 },
            damping_s: values[3].max(0.0),
            hardening: values[4].max(0.0),
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::{self, at};
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn acts_only_beyond_its_place_and_only_outward() {
        let mut upper = (ENTRY.build)(&[100.0, 0.5, 1.0, 1e-3, 0.0], Unit::Rotary);
        assert_eq!(upper.mechanics(&at(0.499, 50.0)), 0.0);
        assert!((upper.mechanics(&at(0.51, 0.0)) + 1.0).abs() < 1e-12);
        assert!((upper.mechanics(&at(0.51, 10.0)) + 2.0).abs() < 1e-12);
        assert_eq!(upper.mechanics(&at(0.51, -50.0)), 0.0);
        let mut lower = (ENTRY.build)(&[100.0, -0.5, -1.0, 1e-3, 0.0], Unit::Rotary);
        assert_eq!(lower.mechanics(&at(-0.499, -50.0)), 0.0);
        assert!((lower.mechanics(&at(-0.51, 0.0)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn round_faces_harden_with_the_root_of_the_depth() {
        let mut round = (ENTRY.build)(&[100.0, 0.5, 1.0, 0.0, 0.5], Unit::Rotary);
        let mut at_depth = |depth: f64| round.mechanics(&at(0.5 + depth, 0.0));
        assert!((at_depth(HARDENS_ABOUT) + 1.0).abs() < 1e-12);
        assert!((at_depth(4.0 * HARDENS_ABOUT) + 8.0).abs() < 1e-12);
    }

    #[test]
    fn an_axis_comes_to_rest_on_it() {
        let effect = (ENTRY.build)(&[1e4, 0.05, 1.0, 1e-4, 0.0], Unit::Rotary);
        let mut axis = testing::axis(testing::coulomb(), vec![effect]);
        // 1e-4 kg m^2 on 1e4 N m/rad turns at 1e4 rad/s: 50 steps in 0.1 ms keep 2 % of that a step.
        assert_eq!(axis.config().steps, 50);
        for _ in 0..20_000 {
            axis.advance(0.05);
        }
        let motion = axis.truth().motion;
        assert!(motion.velocity_rad_s.abs() < 1e-6);
        // Pressed in by between torque less and torque plus friction.
        let depth = motion.position_rad - 0.05;
        assert!((3e-6..=7e-6).contains(&depth), "{depth:e}");
    }
}
