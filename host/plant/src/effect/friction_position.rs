//! Coulomb friction that varies along the travel: tight spots of a screw, a seal, a guide.
//!
//! F_C becomes F_C (1 + A sin(n q + p) + B q), at least zero; with sgn(v), which tells it from cogging.
//!
//! Source: Armstrong-Helouvry, "Control of Machines with Friction", Kluwer, 1991, ch. 4.

use super::{Effect, Entry, Instant, Kind, Parameter, Plain};

struct Position {
    amplitude_share: f64,
    wave_rad: f64,
    phase_rad: f64,
    slope_1_rad: f64,
    coulomb_nm: f64,
}

impl Effect for Position {
    fn begin(&mut self, plain: &Plain) {
        self.coulomb_nm = plain.levels.coulomb_nm;
    }

    fn changes_level(&self) -> bool {
        true
    }

    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let q = now.motion.load_position_rad;
        let wave = self.amplitude_share * (self.wave_rad * q + self.phase_rad).sin();
        let coulomb = friction_nm.clamp(-self.coulomb_nm, self.coulomb_nm);
        friction_nm + (wave + self.slope_1_rad * q).max(-1.0) * coulomb
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.position",
    model: "F + F_C (A sin(n q + p) + B q) sgn(F)",
    parameters: &[
        Parameter::same("amplitude_share", Kind::Size, |_| [0.0, 0.5]),
        Parameter::ORDER,
        Parameter::PHASE,
        Parameter::new(["slope_1_rad", "slope_1_m"], Kind::Size, |scale| {
            let most = 0.5 / scale.stroke_rad();
            [-most, most]
        }),
    ],
    build: |values, unit| {
        Box::new(Position {
            amplitude_share: values[0],
            wave_rad: unit.wave_rad(values[1]),
            phase_rad: values[2],
            slope_1_rad: values[3],
            coulomb_nm: f64::INFINITY,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::{PLAIN, at};
    use super::*;
    use crate::unit::Unit;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn is_a_wave_over_position_that_turns_with_direction() {
        let mut effect = (ENTRY.build)(&[0.5, 3.0, 0.0, 0.0], Unit::Rotary);
        effect.begin(&PLAIN);
        let mut added = |q, f: f64| effect.friction(&at(q, f.signum()), f) - f;
        let top = PI / 6.0;
        assert!((added(top, 0.03) - 0.01).abs() < 1e-15);
        assert!((added(top, -0.03) + 0.01).abs() < 1e-15);
        assert!((added(top + TAU / 3.0, 0.03) - 0.01).abs() < 1e-15);
        assert!((added(top + PI / 3.0, 0.03) + 0.01).abs() < 1e-15);
    }

    #[test]
    fn its_slope_goes_on_and_never_turns_friction_round() {
        let mut effect = (ENTRY.build)(&[0.0, 1.0, 0.0, 0.1], Unit::Linear);
        effect.begin(&PLAIN);
        assert!((effect.friction(&at(2.0, 1.0), 0.02) - 0.024).abs() < 1e-15);
        assert!(effect.friction(&at(-50.0, 1.0), 0.02).abs() < 1e-15);
    }
}
