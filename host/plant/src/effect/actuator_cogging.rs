//! Cogging: a torque of the rotor's angle alone, there with and without current.
//!
//! u + A w(n q + p), w a sine with harmonics, n a multiple of slots or poles. Several orders are several effects.
//!
//! Source: Hanselman, "Brushless Permanent Magnet Motor Design", 2nd ed., ch. 5.

use super::wave::Wave;
use super::{Effect, Entry, Instant, Kind, Parameter};

struct Cogging {
    amplitude_nm: f64,
    wave: Wave,
}

impl Effect for Cogging {
    fn actuator(&mut self, now: &Instant) -> f64 {
        now.torque_nm + self.amplitude_nm * self.wave.at(now.motion.position_rad)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "actuator.cogging",
    model: "u + A w(n q + p), w(x) = sin x + harmonics",
    parameters: &[
        Parameter::new(["amplitude_nm", "amplitude_n"], Kind::Size, |scale| {
            [0.0, 0.5 * scale.coulomb_nm]
        }),
        // A multiple of slots or poles: four at least.
        Parameter::new(["order_per_rev", "order_per_m"], Kind::Order, |scale| {
            scale.either([4.0, 200.0], [1.0, 500.0])
        })
        .or(1.0),
        Parameter::PHASE,
        Parameter::SECOND_SINE,
        Parameter::SECOND_COSINE,
        Parameter::THIRD_SINE,
        Parameter::THIRD_COSINE,
    ],
    build: |values, unit| {
        Box::new(Cogging {
            amplitude_nm: values[0],
            wave: Wave::new(unit, values[1], values[2], &values[3..]),
        })
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn repeats_with_its_order_whatever_the_torque() {
        let mut effect = (ENTRY.build)(&[0.02, 24.0, 0.3, 0.0, 0.0, 0.0, 0.0], Unit::Rotary);
        let mut added = |position_rad, torque_nm| {
            let mut now = Instant {
                torque_nm,
                ..Instant::default()
            };
            now.motion.position_rad = position_rad;
            effect.actuator(&now) - torque_nm
        };
        let pitch = std::f64::consts::TAU / 24.0;
        let here = added(0.1, 0.0);
        // Rounding of a sine of some rad.
        assert!((added(0.1 + pitch, 0.0) - here).abs() < 1e-16);
        assert!((added(0.1, 5.0) - here).abs() < 1e-15);
        assert!((added(0.1 + 0.5 * pitch, 0.0) + here).abs() < 1e-16);
    }

    #[test]
    fn a_linear_order_counts_per_metre() {
        let mut effect = (ENTRY.build)(&[1.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0], Unit::Linear);
        let mut now = Instant::default();
        now.motion.position_rad = 1.0 / 16.0;
        assert!((effect.actuator(&now) - 1.0).abs() < 1e-15);
    }
}
