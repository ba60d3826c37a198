//! Torque ripple: the torque constant varies with the rotor's angle.
//!
//! u (1 + A w(n q + p)), w a sine with harmonics. It grows with torque, which tells it from cogging.
//!
//! Source: Jahns, Soong, "Pulsating torque minimization techniques for permanent magnet AC motor drives", IEEE Trans. Ind.
//! Electron. 43(2), 1996.

use super::wave::Wave;
use super::{Effect, Entry, Instant, Kind, Parameter};

struct Ripple {
    amplitude_share: f64,
    wave: Wave,
}

impl Effect for Ripple {
    fn actuator(&mut self, now: &Instant) -> f64 {
        now.torque_nm * (1.0 + self.amplitude_share * self.wave.at(now.motion.position_rad))
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "actuator.ripple",
    model: "u (1 + A w(n q + p)), w(x) = sin x + harmonics",
    parameters: &[
        Parameter::same("amplitude_share", Kind::Size, |_| [0.01, 0.3]),
        Parameter::ORDER,
        Parameter::PHASE,
        Parameter::SECOND_SINE,
        Parameter::SECOND_COSINE,
        Parameter::THIRD_SINE,
        Parameter::THIRD_COSINE,
    ],
    build: |values, unit| {
        Box::new(Ripple {
            amplitude_share: values[0],
            wave: Wave::new(unit, values[1], values[2], &values[3..]),
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::at;
    use super::*;
    use crate::unit::Unit;
    use std::f64::consts::TAU;

    #[test]
    fn repeats_with_its_order_and_grows_with_torque() {
        let mut effect = (ENTRY.build)(&[0.1, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0], Unit::Rotary);
        let mut added = |q, torque_nm| {
            let now = Instant {
                torque_nm,
                ..at(q, 1.0)
            };
            effect.actuator(&now) - torque_nm
        };
        let top = TAU / 24.0;
        assert_eq!(added(top, 0.0), 0.0);
        assert!((added(top, 0.5) - 0.05).abs() < 1e-15);
        assert!((added(top, -1.0) + 0.1).abs() < 1e-15);
        assert!((added(top + TAU / 6.0, 0.5) - 0.05).abs() < 1e-15);
        assert!((added(top + TAU / 12.0, 0.5) + 0.05).abs() < 1e-15);
    }
}
