//! Friction that grows with the torque through a gear, screw or bearing.
//!
//! F + mu |tau - J_m a| sgn(F), with J_m what is accelerated before the contact.
//!
//! Source: Dohring, Lee, Newman, "A load-dependent transmission friction model", IEEE ICRA, 1993.

use super::{Effect, Entry, Instant, Kind, Parameter, Plain};

struct Load {
    share: f64,
    motor_inertia_kg_m2: f64,
    coulomb_nm: f64,
}

impl Effect for Load {
    fn begin(&mut self, plain: &Plain) {
        self.coulomb_nm = plain.levels.coulomb_nm;
    }

    fn changes_level(&self) -> bool {
        true
    }

    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let through = now.torque_nm - self.motor_inertia_kg_m2 * now.acceleration_rad_s2;
        let coulomb = self.coulomb_nm.max(f64::MIN_POSITIVE);
        let sign = (friction_nm / coulomb).clamp(-1.0, 1.0);
        friction_nm + self.share * through.abs() * sign
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.load",
    model: "F + mu |tau - J_m a| sgn(F)",
    parameters: &[
        Parameter::same("share", Kind::Size, |_| [0.02, 0.3]),
        Parameter::new(
            ["motor_inertia_kg_m2", "motor_mass_kg"],
            Kind::Shape,
            |scale| [0.0, scale.inertia_kg_m2],
        ),
    ],
    build: |values, _| {
        Box::new(Load {
            share: values[0],
            motor_inertia_kg_m2: values[1],
            coulomb_nm: 0.0,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::{PLAIN, at};
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn grows_with_what_passes_the_contact_either_way() {
        let mut effect = (ENTRY.build)(&[0.1, 1e-4], Unit::Rotary);
        effect.begin(&PLAIN);
        let mut added = |torque_nm, acceleration_rad_s2, f: f64| {
            let now = Instant {
                torque_nm,
                acceleration_rad_s2,
                ..at(0.0, f.signum())
            };
            effect.friction(&now, f) - f
        };
        assert!((added(0.5, 0.0, 0.03) - 0.05).abs() < 1e-15);
        assert!((added(0.5, 1000.0, 0.03) - 0.04).abs() < 1e-15);
        assert!((added(-0.5, 0.0, -0.03) + 0.05).abs() < 1e-15);
        assert!((added(-0.5, 0.0, 0.03) - 0.05).abs() < 1e-15);
        // Half of Coulomb friction in presliding: half of it.
        assert!((added(0.5, 0.0, 0.01) - 0.025).abs() < 1e-15);
    }
}
