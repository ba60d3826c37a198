//! Friction that grows with the torque through a gear, screw or bearing.
//!
//! F + mu |tau - J_m a| sgn(F), with J_m what is accelerated before the contact. The load is that of the last two milliseconds:
//! taken at once it would depend on the friction that it makes, and where bristles are damped that is unstable at speed.
//!
//! Source: Dohring, Lee, Newman, "A load-dependent transmission friction model", IEEE ICRA, 1993.

use super::{Effect, Entry, Instant, Kind, Parameter, Plain};

/// Time in which a contact takes up its load, s.
const LOADS_S: f64 = 2e-3;

struct Load {
    share: f64,
    motor_inertia_kg_m2: f64,
    coulomb_nm: f64,
    through_nm: f64,
}

impl Effect for Load {
    fn begin(&mut self, plain: &Plain) {
        self.coulomb_nm = plain.levels.coulomb_nm;
    }

    fn changes_level(&self) -> bool {
        true
    }

    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let through_nm = now.torque_nm - self.motor_inertia_kg_m2 * now.acceleration_rad_s2;
        self.through_nm += (through_nm - self.through_nm) * now.step_s / (LOADS_S + now.step_s);
        let coulomb = self.coulomb_nm.max(f64::MIN_POSITIVE);
        let sign = (friction_nm / coulomb).clamp(-1.0, 1.0);
        friction_nm + self.share * self.through_nm.abs() * sign
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.load",
    model: "F + mu |l| sgn(F), l = tau - J_m a through a lag of 2 ms",
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
            through_nm: 0.0,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::{PLAIN, at};
    use super::*;
    use crate::affected::Affected;
    use crate::contact::{Levels, contact};
    use crate::unit::Unit;
    use bristle_core::friction::elasto_plastic::ElastoPlastic;
    use bristle_core::stribeck::Stribeck;

    #[test]
    fn grows_with_what_passes_the_contact_either_way() {
        let mut effect = (ENTRY.build)(&[0.1, 1e-4], Unit::Rotary);
        effect.begin(&PLAIN);
        let mut added = |torque_nm, acceleration_rad_s2, f: f64| {
            let now = Instant {
                torque_nm,
                acceleration_rad_s2,
                step_s: 1.0,
                ..at(0.0, f.signum())
            };
            // A second is 500 times what the load takes: of 501^-8 of it nothing is left.
            (0..8).fold(0.0, |_, _| effect.friction(&now, f) - f)
        };
        assert!((added(0.5, 0.0, 0.03) - 0.05).abs() < 1e-15);
        assert!((added(0.5, 1000.0, 0.03) - 0.04).abs() < 1e-15);
        assert!((added(-0.5, 0.0, -0.03) + 0.05).abs() < 1e-15);
        assert!((added(-0.5, 0.0, 0.03) - 0.05).abs() < 1e-15);
        // Half of Coulomb friction in presliding: half of it.
        assert!((added(0.5, 0.0, 0.01) - 0.025).abs() < 1e-15);
    }

    #[test]
    fn does_not_shake_itself_on_bristles_at_speed() {
        // Bristles bend within 0.1 ms, and their damping bears ten times what they do: the torque of one step must not be the load of the next.
        let curve = Stribeck::constant(0.2).unwrap();
        let bristles = contact(ElastoPlastic::new(curve, 60.0, 0.16, 7e-3, 0.6).unwrap());
        let mut effects: Vec<Box<dyn Effect>> = vec![(ENTRY.build)(&[0.2, 8e-4], Unit::Rotary)];
        let inertia_kg_m2 = 1e-3;
        effects[0].begin(&Plain {
            inertia_kg_m2,
            levels: Levels::of(bristles.as_ref()),
        });
        let mut affected = Affected::new(bristles, &effects);
        let (velocity_rad_s, torque_nm) = (20.0, 0.4);
        let mut now = at(0.0, velocity_rad_s);
        (now.step_s, now.torque_nm) = (2e-5, torque_nm);
        let friction_nm: Vec<f64> = (0..20_000)
            .map(|_| {
                let friction_nm = affected.step(&mut effects, &now, torque_nm);
                now.acceleration_rad_s2 = (torque_nm - friction_nm) / inertia_kg_m2;
                friction_nm
            })
            .collect();
        // F = 0.34 + 0.2 (0.4 - 0.8 (0.4 - F)), where it stays.
        let stays_nm = (0.34 + 0.2 * 0.2 * torque_nm) / (1.0 - 0.2 * 0.8);
        for friction_nm in &friction_nm[10_000..] {
            assert!((friction_nm - stays_nm).abs() < 1e-9, "{friction_nm}");
        }
    }
}
