//! A torque constant that is off, and one that falls as the iron saturates.
//!
//! tau = (1 + e) u/(1 + (f |u|)^n). The share e alone cannot be told from a common factor on inertia and friction without a
//! torque sensor.
//!
//! Source: Hendershot, Miller, "Design of Brushless Permanent-Magnet Machines", Motor Design Books, 2010, ch. 7 (torque
//! per ampere under saturation): to first order in u with an exponent n of 1, below which it falls early and levels off, as an amplifier's does, and
//! above which late.

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Gain {
    share: f64,
    fall_1_nm: f64,
    exponent: f64,
}

impl Effect for Gain {
    fn actuator(&mut self, now: &Instant) -> f64 {
        let u = now.torque_nm;
        (1.0 + self.share) * u / (1.0 + (self.fall_1_nm * u.abs()).powf(self.exponent))
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "actuator.gain",
    model: "(1 + e) u/(1 + (f |u|)^n)",
    parameters: &[
        Parameter::same("share", Kind::Size, |_| [-0.15, 0.15]),
        Parameter::new(["fall_1_nm", "fall_1_n"], Kind::Size, |scale| {
            [0.0, 0.3 / scale.top_torque_nm]
        }),
        Parameter::same("exponent", Kind::Shape, |_| [0.5, 2.0]).or(1.0),
    ],
    build: |values, _| {
        Box::new(Gain {
            share: values[0],
            fall_1_nm: values[1].max(0.0),
            exponent: values[2],
        })
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    fn per_command(share: f64, fall_1_nm: f64, torque_nm: f64) -> f64 {
        falling(share, fall_1_nm, 1.0, torque_nm)
    }

    fn falling(share: f64, fall_1_nm: f64, exponent: f64, torque_nm: f64) -> f64 {
        let mut effect = (ENTRY.build)(&[share, fall_1_nm, exponent], Unit::Rotary);
        let now = Instant {
            torque_nm,
            ..Instant::default()
        };
        effect.actuator(&now) / torque_nm
    }

    #[test]
    fn is_in_proportion_and_falls_with_torque_either_way() {
        assert!((per_command(0.1, 0.0, 0.01) - 1.1).abs() < 1e-15);
        assert!((per_command(0.1, 0.0, -5.0) - 1.1).abs() < 1e-15);
        assert!((per_command(0.0, 0.1, 1e-9) - 1.0).abs() < 1e-9);
        assert!((per_command(0.0, 0.1, 2.0) - 1.0 / 1.2).abs() < 1e-15);
        assert!((per_command(0.0, 0.1, -2.0) - 1.0 / 1.2).abs() < 1e-15);
    }

    #[test]
    fn falls_earlier_or_later() {
        assert!((falling(0.0, 0.25, 0.5, 1.0) - 1.0 / 1.5).abs() < 1e-15);
        assert!((falling(0.0, 0.25, 2.0, -1.0) - 1.0 / 1.0625).abs() < 1e-15);
        assert!((falling(0.1, 0.0, 0.5, 1.0) - 1.1).abs() < 1e-15);
    }
}
