//! Coulomb friction that varies along the travel: tight spots of a screw, a seal, a guide.
//!
//! F_C becomes F_C (1 + A w(n q + p) + B q), w a sine with harmonics, at least zero; with sgn(v), which tells it from cogging.
//! Where `coulomb_only` is 0, all of dry friction varies so, what the Stribeck curve has beyond F_C with it.
//!
//! Source: Armstrong-Helouvry, "Control of Machines with Friction", Kluwer, 1991, ch. 4.

use super::wave::Wave;
use super::{Effect, Entry, Instant, Kind, Parameter, Plain};

struct Position {
    amplitude_share: f64,
    wave: Wave,
    slope_1_rad: f64,
    coulomb_only: bool,
    coulomb_nm: f64,
    viscous_nm_s_rad: f64,
}

impl Effect for Position {
    fn begin(&mut self, plain: &Plain) {
        self.coulomb_nm = plain.levels.coulomb_nm;
        self.viscous_nm_s_rad = plain.levels.viscous_nm_s_rad;
    }

    fn changes_level(&self) -> bool {
        true
    }

    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let q = now.motion.load_position_rad;
        let wave = self.amplitude_share * self.wave.at(q);
        let varies_nm = if self.coulomb_only {
            friction_nm.clamp(-self.coulomb_nm, self.coulomb_nm)
        } else {
            friction_nm - self.viscous_nm_s_rad * now.motion.load_velocity_rad_s
        };
        friction_nm + (wave + self.slope_1_rad * q).max(-1.0) * varies_nm
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.position",
    model: "F + F_C (A w(n q + p) + B q) sgn(F), w(x) = sin x + harmonics",
    parameters: &[
        Parameter::same("amplitude_share", Kind::Size, |_| [0.0, 0.5]),
        Parameter::ORDER,
        Parameter::PHASE,
        Parameter::new(["slope_1_rad", "slope_1_m"], Kind::Size, |scale| {
            let most = 0.5 / scale.stroke_rad();
            [-most, most]
        }),
        Parameter::SECOND_SINE,
        Parameter::SECOND_COSINE,
        Parameter::THIRD_SINE,
        Parameter::THIRD_COSINE,
        Parameter::same("coulomb_only", Kind::Form, |_| [0.0, 1.0]).or(1.0),
    ],
    build: |values, unit| {
        Box::new(Position {
            amplitude_share: values[0],
            wave: Wave::new(unit, values[1], values[2], &values[4..]),
            slope_1_rad: values[3],
            coulomb_only: values[8] >= 0.5,
            coulomb_nm: f64::INFINITY,
            viscous_nm_s_rad: 0.0,
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
        let mut effect =
            (ENTRY.build)(&[0.5, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], Unit::Rotary);
        effect.begin(&PLAIN);
        let mut added = |q, f: f64| effect.friction(&at(q, f.signum()), f) - f;
        let top = PI / 6.0;
        assert!((added(top, 0.03) - 0.01).abs() < 1e-15);
        assert!((added(top, -0.03) + 0.01).abs() < 1e-15);
        assert!((added(top + TAU / 3.0, 0.03) - 0.01).abs() < 1e-15);
        assert!((added(top + PI / 3.0, 0.03) + 0.01).abs() < 1e-15);
    }

    #[test]
    fn all_of_dry_friction_may_vary() {
        let values = [0.5, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let mut effect = (ENTRY.build)(&values, Unit::Rotary);
        effect.begin(&PLAIN);
        let friction_nm = 0.03 + PLAIN.levels.viscous_nm_s_rad;
        let added = effect.friction(&at(PI / 6.0, 1.0), friction_nm) - friction_nm;
        assert!((added - 0.015).abs() < 1e-15);
    }

    #[test]
    fn its_slope_goes_on_and_never_turns_friction_round() {
        let mut effect =
            (ENTRY.build)(&[0.0, 1.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 1.0], Unit::Linear);
        effect.begin(&PLAIN);
        assert!((effect.friction(&at(2.0, 1.0), 0.02) - 0.024).abs() < 1e-15);
        assert!(effect.friction(&at(-50.0, 1.0), 0.02).abs() < 1e-15);
    }
}
