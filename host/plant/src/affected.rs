//! Friction of a contact with what effects make of it.
//!
//! An effect says what becomes of friction in sliding, or at break-away. Static friction is no more than that; bristles
//! slide at the level that becomes of theirs.

use crate::contact::Contact;
use crate::effect::{Effect, Instant};
use crate::levelled::Levelled;
use bristle_core::friction::Motion;

/// A contact and its level as effects have it.
pub struct Affected {
    contact: Levelled,
    levelled: bool,
    means: bool,
}

impl Affected {
    /// A contact that these effects act on.
    pub fn new(contact: Box<dyn Contact>, effects: &[Box<dyn Effect>]) -> Self {
        Self {
            levelled: !contact.holds_at_rest()
                && effects.iter().any(|effect| effect.changes_level()),
            contact: Levelled::new(contact),
            means: false,
        }
    }

    /// The same, of which a step gives the mean friction over it in place of that at its end. A record's steps are long: at break-away and
    /// reversals the bristles bend within few of them, and what friction is wrong by there looks like a coupling that is not there.
    pub fn of_means(contact: Box<dyn Contact>, effects: &[Box<dyn Effect>]) -> Self {
        Self {
            means: true,
            ..Self::new(contact, effects)
        }
    }

    /// Friction torque of a step, N m, on what moves with the load's velocity.
    #[inline]
    pub fn step(&mut self, effects: &mut [Box<dyn Effect>], now: &Instant, applied_nm: f64) -> f64 {
        if self.levelled {
            return self.on_bristles(effects, now, applied_nm);
        }
        let velocity_rad_s = now.motion.load_velocity_rad_s;
        // A model that holds at rest is asked for its break-away there, so that effects change that and not the balance.
        let held = !effects.is_empty()
            && self.holds_at_rest()
            && self.contact.own().steady_state_nm(velocity_rad_s) == 0.0;
        let friction_nm = self.own(Motion {
            velocity_rad_s,
            applied_nm: if held {
                f64::MAX.copysign(applied_nm)
            } else {
                applied_nm
            },
            dt_s: now.step_s,
        });
        let friction_nm = changed(effects, now, friction_nm);
        if held && applied_nm.abs() <= friction_nm.abs() {
            applied_nm
        } else {
            friction_nm
        }
    }

    fn on_bristles(
        &mut self,
        effects: &mut [Box<dyn Effect>],
        now: &Instant,
        applied_nm: f64,
    ) -> f64 {
        let velocity_rad_s = now.motion.load_velocity_rad_s;
        let level_nm = self.contact.level_nm(velocity_rad_s);
        let side = self.side(velocity_rad_s, now.step_s);
        let becomes_nm = side * changed(effects, now, side * level_nm);
        let motion = Motion {
            velocity_rad_s,
            applied_nm,
            dt_s: now.step_s,
        };
        if self.means {
            self.contact.mean_over(motion, becomes_nm)
        } else {
            self.contact.step(motion, becomes_nm)
        }
    }

    /// One step at its own level.
    #[inline]
    fn own(&mut self, motion: Motion<f64>) -> f64 {
        if self.means {
            self.contact.mean_own(motion)
        } else {
            self.contact.step_own(motion)
        }
    }

    /// Which way the bristles are bent at the end of a step.
    fn side(&self, velocity_rad_s: f64, step_s: f64) -> f64 {
        let z_rad = self.deflection_rad();
        (z_rad + velocity_rad_s * step_s).signum()
    }

    /// Bends the bristles of a stiffness until they bear a torque; gives the friction torque of the step that does, N m.
    pub fn bear(&mut self, torque_nm: f64, stiffness_nm_rad: f64, step_s: f64) -> f64 {
        self.own(Motion {
            velocity_rad_s: torque_nm / stiffness_nm_rad / step_s,
            applied_nm: torque_nm,
            dt_s: step_s,
        })
    }

    /// Lets bristles of a stiffness that slip however little they are bent slip by so much to and fro, at a velocity.
    pub fn slip(&mut self, slips_rad: f64, velocity_rad_s: f64, stiffness_nm_rad: f64) {
        let level_nm = self.contact.level_nm(velocity_rad_s);
        let kept = (-stiffness_nm_rad * slips_rad / level_nm).exp();
        self.contact.rescale(kept);
    }

    /// Bristle deflection, rad.
    pub fn deflection_rad(&self) -> f64 {
        self.contact.deflection_rad()
    }

    /// Whether effects change the level of its bristles: then its friction is not its own with something added.
    pub fn levelled(&self) -> bool {
        self.levelled
    }

    /// See [`Contact::holds_at_rest`].
    pub fn holds_at_rest(&self) -> bool {
        self.contact.own().holds_at_rest()
    }
}

/// What effects make of friction in sliding, N m.
pub fn changed(effects: &mut [Box<dyn Effect>], now: &Instant, friction_nm: f64) -> f64 {
    effects.iter_mut().fold(friction_nm, |friction_nm, effect| {
        effect.friction(now, friction_nm)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::build;
    use crate::effect::testing::{PLAIN, SAMPLE_S, at, bristles};
    use crate::unit::Unit;
    use std::collections::BTreeMap;

    /// The axis's bristles, 0.02 N m, 10 N m/rad, 0.02 N m s/rad and 1e-3 viscous, under an effect.
    fn under(id: &str, parameters: &[(&str, f64)]) -> impl FnMut(f64, u32) -> (f64, f64) {
        let values: BTreeMap<String, f64> = parameters
            .iter()
            .map(|(n, x)| (n.to_string(), *x))
            .collect();
        let mut effects = vec![build(id, &values, Unit::Rotary).unwrap()];
        effects[0].begin(&PLAIN);
        let mut affected = Affected::new(bristles(), &effects);
        let mut time_s = 0.0;
        // Friction at the end, N m, and by how far the bristles bent, rad.
        move |velocity_rad_s, samples| {
            let before_rad = affected.deflection_rad();
            let mut friction_nm = 0.0;
            for _ in 0..samples {
                let mut now = at(0.0, velocity_rad_s);
                now.step_s = SAMPLE_S;
                now.time_s = time_s;
                time_s += SAMPLE_S;
                friction_nm = affected.step(&mut effects, &now, 0.0);
            }
            (friction_nm, affected.deflection_rad() - before_rad)
        }
    }

    #[test]
    fn bristles_are_as_stiff_and_slide_at_another_level() {
        let mut step = under("friction.asymmetry", &[("share", 0.2)]);
        for v in [0.1, -0.1] {
            // Half a millirad of 2 mrad, there and back.
            let (friction_nm, bent_rad) = step(v, 50);
            assert!((bent_rad - v * 50.0 * SAMPLE_S).abs() < 1e-15, "{bent_rad}");
            let spring_nm = if v > 0.0 { 10.0 * bent_rad } else { 0.0 };
            assert!((friction_nm - spring_nm - 0.021 * v).abs() < 1e-12);
        }
        // 0.02 N m, a fifth more and a fifth less; after 50 of the larger z_ss e^-50 is left of what was before.
        for (v, level_nm) in [(1.0, 0.024), (-1.0, -0.016)] {
            let (friction_nm, _) = step(v, 1200);
            assert!(
                (friction_nm - level_nm - 1e-3 * v).abs() < 1e-12,
                "{friction_nm}"
            );
        }
    }

    #[test]
    fn bristles_that_slip_to_and_fro_let_go() {
        let mut affected = Affected::new(bristles(), &[]);
        affected.bear(0.01, 10.0, SAMPLE_S);
        let bent_rad = affected.deflection_rad();
        // Half of it by ln 2 of the 2 mrad that they slide at.
        affected.slip(2e-3 * 2.0_f64.ln(), 0.0, 10.0);
        let left = affected.deflection_rad() / bent_rad;
        assert!((left - 0.5).abs() < 1e-6, "{left}");
    }

    #[test]
    fn what_is_bent_stays_bent_while_the_level_changes() {
        let mut step = under(
            "friction.thermal",
            &[("fall_share", 0.5), ("warm_up_s", 0.1)],
        );
        let (bends_nm, _) = step(0.1, 50);
        // A second at rest, in which the level falls by half: the spring's torque stays, the damping's goes.
        let (rests_nm, bent_rad) = step(0.0, 10_000);
        assert!(
            (bends_nm - 0.021 * 0.1 - rests_nm).abs() < 1e-12,
            "{rests_nm}"
        );
        assert!(bent_rad.abs() < 1e-15);
        // The fall is e^-10 short of a half, of viscous friction too.
        let (slides_nm, _) = step(1.0, 1200);
        assert!((slides_nm - 0.5 * 0.021).abs() < 2e-5, "{slides_nm}");
    }
}
