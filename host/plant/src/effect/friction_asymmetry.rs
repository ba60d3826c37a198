//! Friction that differs by direction: Coulomb friction larger by a share one way and smaller by it the other, and a
//! difference of viscous friction.
//!
//! F + share F_C + c |v|.
//!
//! Source: Armstrong-Helouvry, "Control of Machines with Friction", Kluwer, 1991, ch. 4 (left and right friction of the
//! same joint identified apart).

use super::{Effect, Entry, Instant, Kind, Parameter, Plain};

struct Asymmetry {
    share: f64,
    viscous_nm_s_rad: f64,
    coulomb_nm: f64,
}

impl Effect for Asymmetry {
    fn begin(&mut self, plain: &Plain) {
        self.coulomb_nm = plain.levels.coulomb_nm;
    }

    fn changes_level(&self) -> bool {
        true
    }

    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        // The size of friction, not the sign of velocity: the two agree in sliding, and bristles turn round with the former.
        friction_nm
            + self.share * friction_nm.abs().min(self.coulomb_nm)
            + self.viscous_nm_s_rad * now.motion.load_velocity_rad_s.abs()
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.asymmetry",
    model: "F + share F_C + c |v|",
    parameters: &[
        Parameter::same("share", Kind::Size, |_| [-0.4, 0.4]),
        Parameter::new(["viscous_nm_s_rad", "viscous_n_s_m"], Kind::Size, |scale| {
            let most = 0.4 * scale.coulomb_nm / scale.top_speed_rad_s;
            [-most, most]
        }),
    ],
    build: |values, _| {
        Box::new(Asymmetry {
            share: values[0],
            viscous_nm_s_rad: values[1],
            coulomb_nm: f64::INFINITY,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::{PLAIN, at};
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn is_more_one_way_and_less_the_other() {
        let mut effect = (ENTRY.build)(&[0.2, 0.0], Unit::Rotary);
        effect.begin(&PLAIN);
        let now = Instant::default();
        // A fifth of Coulomb friction, however much viscous friction is on top.
        assert!((effect.friction(&now, 0.03) - 0.034).abs() < 1e-15);
        assert!((effect.friction(&now, -0.03) + 0.026).abs() < 1e-15);
        assert_eq!(effect.friction(&now, 0.0), 0.0);
    }

    #[test]
    fn its_viscous_part_grows_with_speed_either_way() {
        let mut effect = (ENTRY.build)(&[0.0, 1e-3], Unit::Rotary);
        for (v, friction) in [(5.0, 0.02), (-5.0, -0.02)] {
            let added = effect.friction(&at(0.0, v), friction) - friction;
            assert!((added - 5e-3).abs() < 1e-15);
        }
    }
}
