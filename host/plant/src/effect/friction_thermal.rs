//! Friction that falls as the axis warms up: lubricant thins, preload changes.
//!
//! F (1 - g (1 - exp(-t/T)) - c P), t since the start of the record, P the power that friction dissipates through the same
//! first-order lag: T dP/dt = |F v| - P. The first is warmth that comes with time, as of a drive that is on; the second is
//! friction's own, which an axis at rest loses again.
//!
//! Sources: Bittencourt, Wernholt, Sander-Tavallaey, Brogardh, "An extended friction model to capture load and temperature
//! effects in robot joints", IEEE/RSJ IROS, 2010, with a warm-up in place of a thermometer; Simoni, Beschi, Legnani, Visioli,
//! "Friction modeling with temperature effects for industrial robot manipulators", IEEE/RSJ IROS, 2015, for the heat of friction.

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Thermal {
    fall_share: f64,
    warm_up_s: f64,
    fall_1_w: f64,
    power_w: f64,
}

impl Effect for Thermal {
    fn changes_level(&self) -> bool {
        true
    }

    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let warm = -(-now.time_s.max(0.0) / self.warm_up_s).exp_m1();
        let falls = self.fall_share * warm + self.fall_1_w * self.power_w;
        let falls_to_nm = friction_nm * (1.0 - falls).max(0.0);
        let power_w = (falls_to_nm * now.motion.load_velocity_rad_s).abs();
        self.power_w += (power_w - self.power_w) * (now.step_s / self.warm_up_s).min(1.0);
        falls_to_nm
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.thermal",
    model: "F (1 - g (1 - exp(-t/T)) - c P), T dP/dt = |F v| - P",
    parameters: &[
        Parameter::same("fall_share", Kind::Size, |_| [0.0, 0.6]),
        Parameter::same("warm_up_s", Kind::Shape, |_| [1.0, 300.0]).or(60.0),
        Parameter::same("fall_1_w", Kind::Size, |scale| {
            // Six tenths at a fifth of the power at top speed.
            [0.0, 3.0 / (scale.coulomb_nm * scale.top_speed_rad_s)]
        }),
    ],
    build: |values, _| {
        Box::new(Thermal {
            fall_share: values[0].min(1.0),
            warm_up_s: values[1].max(f64::MIN_POSITIVE),
            fall_1_w: values[2].max(0.0),
            power_w: 0.0,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn falls_over_time_by_the_same_share_at_any_level() {
        let mut effect = (ENTRY.build)(&[0.4, 20.0, 0.0], Unit::Rotary);
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

    #[test]
    fn falls_with_the_power_of_friction_and_comes_back_at_rest() {
        let mut effect = (ENTRY.build)(&[0.0, 2.0, 0.5], Unit::Rotary);
        let mut after = |velocity_rad_s: f64, seconds: f64| {
            let mut now = Instant {
                step_s: 1e-3,
                ..Instant::default()
            };
            now.motion.load_velocity_rad_s = velocity_rad_s;
            (0..(seconds * 1e3) as usize).fold(0.0, |_, _| effect.friction(&now, 0.1))
        };
        // Ten time constants at F v = 0.1 F rad/s: F/0.1 = 1 - 0.5 F, thus 0.1/1.05 at 1 rad/s, whichever way.
        for v in [1.0, -1.0] {
            let steady_nm = after(v, 20.0);
            assert!((steady_nm - 0.1 / 1.05).abs() < 1e-6, "{steady_nm}");
        }
        // e^-10 of it is left after a rest as long.
        assert!((after(0.0, 20.0) - 0.1).abs() < 1e-6);
    }
}
