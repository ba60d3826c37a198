//! Stribeck hump: at low speed friction rises above Coulomb friction, on an axis whose model has F_S = F_C.
//!
//! F + (F_S/F_C - 1) exp(-|v/v_s|^d) F_C sgn(F).
//!
//! Source: Bo, Pavelescu, "The friction-speed relation and its influence on the critical velocity of stick-slip motion",
//! Wear 82(3), 1982; Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, eq. 8.

use super::{Effect, Entry, Instant, Kind, Parameter, Plain};

struct StribeckHump {
    rise_share: f64,
    velocity_rad_s: f64,
    exponent: f64,
    coulomb_nm: f64,
}

impl Effect for StribeckHump {
    fn begin(&mut self, plain: &Plain) {
        self.coulomb_nm = plain.levels.coulomb_nm;
    }

    fn changes_level(&self) -> bool {
        true
    }

    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let speed = now.motion.load_velocity_rad_s.abs() / self.velocity_rad_s;
        let left = (-speed.powf(self.exponent)).exp();
        let coulomb = friction_nm.clamp(-self.coulomb_nm, self.coulomb_nm);
        friction_nm + self.rise_share * left * coulomb
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.stribeck",
    model: "F + rise F_C exp(-|v/v_s|^d) sgn(F)",
    parameters: &[
        Parameter::same("rise_share", Kind::Size, |_| [0.1, 1.0]),
        Parameter::new(
            ["stribeck_velocity_rad_s", "stribeck_velocity_m_s"],
            Kind::Shape,
            |scale| {
                let v = scale.stribeck_velocity_rad_s;
                [0.2 * v, 5.0 * v]
            },
        )
        .or(0.1),
        Parameter::same("exponent", Kind::Shape, |_| [0.5, 2.0]).or(2.0),
    ],
    build: |values, _| {
        Box::new(StribeckHump {
            rise_share: values[0],
            velocity_rad_s: values[1].abs().max(f64::MIN_POSITIVE),
            exponent: values[2].max(0.0),
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
    fn is_a_hump_at_low_speed() {
        let mut effect = (ENTRY.build)(&[0.5, 0.2, 2.0], Unit::Rotary);
        effect.begin(&PLAIN);
        let mut added =
            |v: f64| effect.friction(&at(0.0, v), 0.03 * v.signum()) - 0.03 * v.signum();
        // Half of Coulomb friction, not of the whole, which has viscous friction in it.
        assert!((added(1e-9) - 0.5 * 0.02).abs() < 1e-15);
        assert!((added(-1e-9) + 0.5 * 0.02).abs() < 1e-15);
        assert!((added(0.2) - 0.5 * 0.02 * (-1.0_f64).exp()).abs() < 1e-15);
        assert_eq!(added(20.0), 0.0);
    }
}
