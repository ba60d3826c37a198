//! Presliding by elasto-plastic bristles, on an axis whose friction model is static.
//!
//! F = s level(v) + viscous, s the share of the level that bristles of deflection z_ss carry: the elasto-plastic model of
//! `core` with a level of one, and a damping of d times its stiffness. In steady sliding s = sgn(v), and F is that of the
//! model. Where the model has bristles, their z_ss adds up.
//!
//! Source: Dupont, Hayward, Armstrong, Altpeter, "Single state elastoplastic friction models", IEEE TAC 47(5), 2002.

use super::{Effect, Entry, Kind, Parameter};
use crate::contact::{Contact, Levels};
use bristle_core::friction::{ElastoPlastic, Friction, Motion, elasto_plastic};
use bristle_core::stribeck::Stribeck;

struct Presliding {
    z_ss_rad: f64,
    breakaway_ratio: f64,
    damping_s: f64,
}

/// A friction model on bristles, in place of its own.
struct OnBristles {
    inner: Box<dyn Contact>,
    levels: Levels,
    bristles: ElastoPlastic<f64, Stribeck<f64>>,
    state: elasto_plastic::State<f64>,
}

impl Presliding {
    /// Bristles of a level of one. None for numbers that the model cannot take, such as a deflection below a picometre.
    fn bristles(&self, z_ss_rad: f64) -> Option<ElastoPlastic<f64, Stribeck<f64>>> {
        let stiffness = 1.0 / z_ss_rad;
        let damping = stiffness * self.damping_s;
        let curve = Stribeck::constant(1.0).ok()?;
        ElastoPlastic::new(curve, stiffness, damping, 0.0, self.breakaway_ratio).ok()
    }
}

impl Effect for Presliding {
    fn contact(&self, mut inner: Box<dyn Contact>) -> Box<dyn Contact> {
        if self.bristles(self.z_ss_rad).is_none() {
            return inner;
        }
        let levels = Levels::of(inner.as_ref());
        // Far longer than any transient. From here on only its steady state is asked for.
        for _ in 0..10 {
            inner.step(Motion {
                velocity_rad_s: 1.0,
                applied_nm: 0.0,
                dt_s: 1.0,
            });
        }
        match self.bristles(self.z_ss_rad + inner.deflection_rad().abs()) {
            Some(bristles) => Box::new(OnBristles {
                inner,
                levels,
                bristles,
                state: elasto_plastic::State::default(),
            }),
            None => inner,
        }
    }
}

impl Contact for OnBristles {
    fn step(&mut self, motion: Motion<f64>) -> f64 {
        let share = self.bristles.step(&mut self.state, motion);
        let inner_nm = if self.inner.holds_at_rest() {
            self.inner.step(Motion {
                applied_nm: f64::MAX.copysign(share),
                ..motion
            })
        } else {
            self.inner.steady_state_nm(motion.velocity_rad_s)
        };
        if inner_nm == 0.0 {
            return share * self.levels.stiction_nm;
        }
        let level = inner_nm.abs().min(self.levels.stiction_nm);
        share * level + (inner_nm - level.copysign(inner_nm))
    }

    fn deflection_rad(&self) -> f64 {
        self.state.z_rad
    }

    fn holds_at_rest(&self) -> bool {
        false
    }

    fn steady_state_nm(&self, velocity_rad_s: f64) -> f64 {
        self.inner.steady_state_nm(velocity_rad_s)
    }

    fn rescale(&mut self, times: f64) {
        self.bristles.rescale(&mut self.state, times);
    }

    fn fastest_rate_1_s(&self, inertia_kg_m2: f64) -> f64 {
        let per_inertia = self.levels.stiction_nm / inertia_kg_m2;
        let stiffness = self.bristles.stiffness_nm_rad() * per_inertia;
        stiffness
            .sqrt()
            .max(self.bristles.damping_nm_s_rad() * per_inertia)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.presliding",
    model: "F with s(z) for sgn(v), dz/dt = v (1 - alpha(z, v) |z|/z_ss)",
    parameters: &[
        Parameter::new(["z_ss_rad", "z_ss_m"], Kind::Size, |scale| {
            scale.either([1e-3, 2e-2], [1e-6, 1e-4])
        }),
        Parameter::same("breakaway_ratio", Kind::Shape, |_| [0.0, 0.9]).or(0.7),
        Parameter::same("damping_s", Kind::Shape, |_| [1e-4, 1e-2]).or(1e-3),
    ],
    build: |values, _| {
        Box::new(Presliding {
            z_ss_rad: values[0].abs(),
            breakaway_ratio: values[1].clamp(0.0, 0.99),
            damping_s: values[2].max(0.0),
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
        let effect = (ENTRY.build)(&[1e-2, 0.5, 0.0], Unit::Rotary);
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
    fn adds_to_bristles_that_are_there() {
        let effect = (ENTRY.build)(&[2e-3, 0.7, 0.0], Unit::Rotary);
        let mut contact = effect.contact(testing::bristles());
        for _ in 0..1000 {
            contact.step(at(1.0));
        }
        // 0.02 N m/10 N m/rad and 2 mrad.
        assert!((contact.deflection_rad() - 4e-3).abs() < 1e-9);
    }
}
