//! Friction that falls as the axis warms up: lubricant thins, preload changes.
//!
//! F (1 - g (1 - exp(-t/T))), t since the start of the record.
//!
//! Source: Bittencourt, Wernholt, Sander-Tavallaey, Brogardh, "An extended friction model to capture load and temperature
//! effects in robot joints", IEEE/RSJ IROS, 2010; here with the first-order warm-up in time in place of a thermometer.

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Thermal {
    fall_share: f64,
    warm_up_s: f64,
}

impl Effect for Thermal {
    fn changes_level(&self) -> bool {
        true
    }

    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let warm = -(-now.time_s.max(0.0) / self.warm_up_s).exp_m1();
        friction_nm * (1.0 - self.fall_share * warm)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.thermal",
    model: "F (1 - g (1 - exp(-t/T)))",
    parameters: &[
        Parameter::same("fall_share", Kind::Size, |_| [0.0, 0.6]),
        Parameter::same("warm_up_s", Kind::Shape, |_| [1.0, 300.0]).or(60.0),
    ],
    build: |values, _| {
        Box::new(Thermal {
            fall_share: values[0].min(1.0),
            warm_up_s: values[1].max(f64::MIN_POSITIVE),
        })
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn falls_over_time_by_the_same_share_at_any_level() {
        let mut effect = (ENTRY.build)(&[0.4, 20.0], Unit::Rotary);
        let mut share = |time_s, friction: f64| {
            let now = Instant {
                time_s,
                ..Instant::default()
            };
            effect.friction(&now, friction) / friction
        };
        assert_eq!(share(0.0, 0.02), 1.0);
        let once = 1.0 - 0.4 * (1.0 - (-1.0_f64).exp());
        assert!((share(20.0, 0.02) - once).abs() < 1e-15);
        assert!((share(20.0, -0.5) - once).abs() < 1e-15);
        assert!((share(1e4, 0.02) - 0.6).abs() < 1e-15);
    }
}
