//! Play in a gear, screw or coupling: part of the inertia, and friction with it or not, is only driven once the play is
//! crossed.
//!
//! As `mechanics.compliance`, with no torque while |e| < b/2 and a flank that pushes and never pulls. With the flanks in
//! contact it resonates at `frequency_hz`, which should lie above what the record shows.
//!
//! Source: Nordin, Galic, Gutman, "New models for backlash and gear play", Int. J. Adapt. Control Signal Process. 11(1),
//! 1997.

use super::{Coupling, Effect, Entry, Kind, Parameter};
use std::f64::consts::TAU;

struct Backlash {
    gap_rad: f64,
    load_share: f64,
    frequency_hz: f64,
    damping_ratio: f64,
    friction_on_motor: bool,
}

impl Effect for Backlash {
    fn coupling(&self, inertia_kg_m2: f64) -> Option<Coupling> {
        (self.gap_rad > 0.0).then(|| {
            let reduced = Coupling::reduced_kg_m2(inertia_kg_m2, self.load_share);
            let stiffness = reduced * (TAU * self.frequency_hz).powi(2);
            Coupling {
                gap_rad: self.gap_rad,
                ..Coupling::new(
                    inertia_kg_m2,
                    self.load_share,
                    stiffness,
                    self.damping_ratio,
                    self.friction_on_motor,
                )
            }
        })
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "mechanics.backlash",
    model: "as mechanics.compliance, T = 0 while |q - q_l| < b/2",
    parameters: &[
        Parameter::new(["gap_rad", "gap_m"], Kind::Size, |scale| {
            scale.either([3.5e-4, 8.7e-2], [5e-6, 1e-3])
        }),
        Parameter::same("load_share", Kind::Shape, |_| [0.1, 0.9]).or(0.5),
        Parameter::same("frequency_hz", Kind::Shape, |_| [50.0, 500.0]).or(300.0),
        Parameter::same("damping_ratio", Kind::Shape, |_| [0.01, 0.5]).or(0.1),
        Parameter::FRICTION_ON_MOTOR,
    ],
    build: |values, _| {
        Box::new(Backlash {
            gap_rad: values[0],
            load_share: values[1],
            frequency_hz: values[2].abs().max(1.0),
            damping_ratio: values[3],
            friction_on_motor: values[4] >= 0.5,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn the_motor_is_alone_until_the_play_is_crossed() {
        let effect = (ENTRY.build)(&[0.02, 0.6, 300.0, 0.1, 0.0], Unit::Rotary);
        let mut axis = testing::axis(testing::coulomb(), vec![effect]);
        let mut alone_s = 0.0;
        // A sample before the flank at 0.01, at up to 2.3 rad/s.
        while axis.truth().motion.position_rad < 0.0097 {
            axis.advance(0.01);
            alone_s += testing::SAMPLE_S;
            assert_eq!(axis.truth().motion.load_velocity_rad_s, 0.0);
            assert!(alone_s < 0.1, "it must get there");
        }
        // 0.01 N m, less than friction, moves 0.4 of the inertia by half the play: sqrt(2 q J/tau).
        let expected = (2.0 * 0.0097 * 0.4e-4 / 0.01_f64).sqrt();
        assert!((alone_s - expected).abs() < 2.0 * testing::SAMPLE_S);
        // It comes to rest on the flank, against friction, and the other flank is a whole play away.
        for _ in 0..20_000 {
            axis.advance(0.01);
        }
        let right = axis.truth().motion;
        for _ in 0..20_000 {
            axis.advance(-0.01);
        }
        let left = axis.truth().motion;
        let width = right.position_rad - left.position_rad;
        let twist = 2.0 * 0.01 / (0.24e-4 * (TAU * 300.0).powi(2));
        let slid = right.load_position_rad - left.load_position_rad;
        assert!((width - 0.02 - twist - slid).abs() < 1e-5, "{width} {slid}");
    }
}
