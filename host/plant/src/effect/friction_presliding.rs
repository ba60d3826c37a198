//! Presliding by bristles, on an axis whose friction model is static.
//!
//! The elasto-plastic model of `core`, or LuGre's, which creeps under any load, with the steady state of the axis's own: bristles that
//! bend by z_ss in slow sliding, less where that level falls with speed, with a damping of d times their stiffness. Where the model
//! has bristles, their z_ss adds up.
//!
//! Sources: Dupont, Hayward, Armstrong, Altpeter, "Single state elastoplastic friction models", IEEE TAC 47(5), 2002; Canudas de
//! Wit, Olsson, Astrom, Lischinsky, "A new model for control of systems with friction", IEEE TAC 40(3), 1995.

use super::{Effect, Entry, Kind, Parameter};
use crate::contact::{Contact, Levels, contact};
use crate::levelled::Levelled;
use bristle_core::friction::Motion;
use bristle_core::friction::elasto_plastic::ElastoPlastic;
use bristle_core::friction::lugre::{Damping, LuGre};
use bristle_core::stribeck::Stribeck;

struct Presliding {
    z_ss_rad: f64,
    breakaway_ratio: f64,
    damping_s: f64,
    sticks: bool,
}

/// A friction model on bristles, in place of its own.
struct OnBristles {
    inner: Box<dyn Contact>,
    bristles: Levelled,
    creep_rad_s: f64,
    viscous_nm_s_rad: f64,
    fastest: Rates,
}

/// Stiffness and damping of bristles.
struct Rates {
    stiffness_nm_rad: f64,
    damping_nm_s_rad: f64,
}

impl Presliding {
    /// Bristles of a model's break-away level, and how stiff they are. None for numbers that the model cannot take, such as a
    /// deflection below a picometre.
    fn bristles(&self, stiction_nm: f64, z_ss_rad: f64) -> Option<(Box<dyn Contact>, Rates)> {
        let stiffness_nm_rad = stiction_nm / z_ss_rad;
        let damping_nm_s_rad = stiffness_nm_rad * self.damping_s;
        let curve = Stribeck::constant(stiction_nm).ok()?;
        let bristles = if self.sticks {
            let ratio = self.breakaway_ratio;
            contact(ElastoPlastic::new(curve, stiffness_nm_rad, damping_nm_s_rad, 0.0, ratio).ok()?)
        } else {
            let damping = Damping::Constant {
                nm_s_rad: damping_nm_s_rad,
            };
            contact(LuGre::new(curve, stiffness_nm_rad, damping, 0.0).ok()?)
        };
        let rates = Rates {
            stiffness_nm_rad,
            damping_nm_s_rad,
        };
        Some((bristles, rates))
    }
}

impl Effect for Presliding {
    fn contact(&self, mut inner: Box<dyn Contact>) -> Box<dyn Contact> {
        let levels = Levels::of(inner.as_ref());
        if self.bristles(levels.stiction_nm, self.z_ss_rad).is_none() {
            return inner;
        }
        // Far longer than any transient: how far its own bristles bend. From here on only its steady state is asked for.
        for _ in 0..10 {
            inner.step(Motion {
                velocity_rad_s: 1.0,
                applied_nm: 0.0,
                dt_s: 1.0,
            });
        }
        let z_ss_rad = self.z_ss_rad + inner.deflection_rad().abs();
        match self.bristles(levels.stiction_nm, z_ss_rad) {
            Some((bristles, fastest)) => Box::new(OnBristles {
                viscous_nm_s_rad: levels.viscous_nm_s_rad,
                creep_rad_s: levels.creep_rad_s,
                bristles: Levelled::new(bristles),
                inner,
                fastest,
            }),
            None => inner,
        }
    }
}

impl OnBristles {
    /// Level of dry friction, N m.
    fn dry_nm(&self, velocity_rad_s: f64) -> f64 {
        let speed_rad_s = velocity_rad_s.abs().max(self.creep_rad_s);
        self.inner.steady_state_nm(speed_rad_s) - self.viscous_nm_s_rad * speed_rad_s
    }
}

impl Contact for OnBristles {
    fn step(&mut self, motion: Motion<f64>) -> f64 {
        let dry_nm = self.dry_nm(motion.velocity_rad_s);
        self.bristles.step(motion, dry_nm) + self.viscous_nm_s_rad * motion.velocity_rad_s
    }

    fn mean_over(&mut self, motion: Motion<f64>, _: Option<f64>) -> f64 {
        let dry_nm = self.dry_nm(motion.velocity_rad_s);
        self.bristles.mean_over(motion, dry_nm) + self.viscous_nm_s_rad * motion.velocity_rad_s
    }

    fn deflection_rad(&self) -> f64 {
        self.bristles.deflection_rad()
    }

    fn holds_at_rest(&self) -> bool {
        false
    }

    fn steady_state_nm(&self, velocity_rad_s: f64) -> f64 {
        self.inner.steady_state_nm(velocity_rad_s)
    }

    fn rescale(&mut self, times: f64) {
        self.bristles.rescale(times);
    }

    fn fastest_rate_1_s(&self, inertia_kg_m2: f64) -> f64 {
        let Rates {
            stiffness_nm_rad,
            damping_nm_s_rad,
        } = self.fastest;
        (stiffness_nm_rad / inertia_kg_m2)
            .sqrt()
            .max(damping_nm_s_rad / inertia_kg_m2)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.presliding",
    model: "F with sigma0 z + sigma1 dz/dt for its dry part, dz/dt = v (1 - alpha(z, v) |z|/z_ss(v)), alpha 1 unless it sticks",
    parameters: &[
        Parameter::new(["z_ss_rad", "z_ss_m"], Kind::Size, |scale| {
            scale.either([1e-3, 2e-2], [1e-6, 1e-4])
        }),
        Parameter::same("breakaway_ratio", Kind::Shape, |_| [0.0, 0.9]).or(0.7),
        Parameter::same("damping_s", Kind::Shape, |_| [1e-4, 1e-2]).or(1e-3),
        Parameter::same("sticks", Kind::Form, |_| [0.0, 1.0]).or(1.0),
    ],
    build: |values, _| {
        Box::new(Presliding {
            z_ss_rad: values[0].abs(),
            breakaway_ratio: values[1].clamp(0.0, 0.99),
            damping_s: values[2].max(0.0),
            sticks: values[3] >= 0.5,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;
    use crate::unit::Unit;

    fn at(velocity_rad_s: f64) -> Motion<f64> {
        Motion {
            velocity_rad_s,
            applied_nm: 0.0,
            dt_s: 2e-3,
        }
    }

    #[test]
    fn is_a_spring_up_to_break_away_and_the_model_in_sliding() {
        let effect = (ENTRY.build)(&[1e-2, 0.5, 0.0, 1.0], Unit::Rotary);
        let mut contact = effect.contact(testing::viscous(1e-3));
        assert!(!contact.holds_at_rest());
        // 1 mrad a step: friction is 0.02 N m of each 10 mrad up to half of that.
        for k in 1..=5 {
            let friction = contact.step(at(0.5));
            let viscous = 0.5e-3;
            assert!(
                (friction - 0.002 * f64::from(k)).abs() <= viscous + 1e-12,
                "{friction}"
            );
        }
        for _ in 0..1000 {
            contact.step(at(0.5));
        }
        assert!((contact.step(at(0.5)) - 0.0205).abs() < 1e-12);
        // Back by 1 mrad: the spring gives way by a tenth of the level, where a static model has turned round.
        let back = contact.step(at(-0.5));
        assert!((back - 0.018).abs() < 1e-3, "{back}");
    }

    #[test]
    fn creeps_in_its_other_form_as_dahl_does() {
        let effect = (ENTRY.build)(&[1e-2, 0.5, 0.0, 0.0], Unit::Rotary);
        let mut contact = effect.contact(testing::viscous(0.0));
        // 1 mrad a step, implicit: what is missing from 0.02 N m falls by 10/11 in each.
        for k in 1..=20 {
            let friction = contact.step(at(0.5));
            let expected = 0.02 * (1.0 - (10.0_f64 / 11.0).powi(k));
            assert!((friction - expected).abs() < 1e-12, "{friction} {expected}");
        }
    }

    #[test]
    fn adds_to_bristles_that_are_there() {
        let effect = (ENTRY.build)(&[2e-3, 0.7, 0.0, 1.0], Unit::Rotary);
        let mut contact = effect.contact(testing::bristles());
        for _ in 0..1000 {
            contact.step(at(1.0));
        }
        // 0.02 N m/10 N m/rad and 2 mrad.
        assert!((contact.deflection_rad() - 4e-3).abs() < 1e-9);
    }
}
