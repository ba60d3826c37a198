//! Bristles that slide at another level than their own, and are as stiff as before.
//!
//! With z = s y, the model of y at the velocity v/s is that of z at v with s times the level of dry friction, and its
//! friction is s times that of y. So s is what makes s g(v/s) the level asked for, with g the model's own; as s changes y
//! is rescaled, so that z and the torque in presliding have no step.

use crate::contact::{Contact, Levels};
use bristle_core::friction::Motion;

/// Least and most that becomes of the level: friction stays friction.
const TIMES: [f64; 2] = [0.02, 50.0];

/// A contact with bristles, and how many times its own level it slides at.
pub struct Levelled {
    contact: Box<dyn Contact>,
    creep_rad_s: f64,
    viscous_nm_s_rad: f64,
    times: f64,
}

impl Levelled {
    /// A contact at its own level.
    pub fn new(contact: Box<dyn Contact>) -> Self {
        let levels = Levels::of(contact.as_ref());
        Self {
            creep_rad_s: levels.creep_rad_s,
            viscous_nm_s_rad: levels.viscous_nm_s_rad,
            times: 1.0,
            contact,
        }
    }

    /// The contact without a change of level.
    pub fn own(&self) -> &dyn Contact {
        self.contact.as_ref()
    }

    /// Its own level at a velocity, viscous friction with it, N m; at rest that of a creep.
    pub fn level_nm(&self, velocity_rad_s: f64) -> f64 {
        let speed_rad_s = velocity_rad_s.abs().max(self.creep_rad_s);
        self.contact.steady_state_nm(speed_rad_s)
    }

    /// Advances by one step in which the level at its velocity, viscous friction with it, is another one; gives the
    /// friction torque, N m.
    #[inline]
    pub fn step(&mut self, motion: Motion<f64>, becomes_nm: f64) -> f64 {
        let (own, _) = self.put(motion, becomes_nm);
        self.times * self.contact.step(own)
    }

    /// The same for [`Contact::mean_over`].
    pub fn mean_over(&mut self, motion: Motion<f64>, becomes_nm: f64) -> f64 {
        let (own, own_nm) = self.put(motion, becomes_nm);
        self.times * self.contact.mean_over(own, Some(own_nm))
    }

    /// Puts it to a level; gives the motion as its own bristles see it, and their level, N m.
    #[inline]
    fn put(&mut self, motion: Motion<f64>, becomes_nm: f64) -> (Motion<f64>, f64) {
        let speed_rad_s = motion.velocity_rad_s.abs().max(self.creep_rad_s);
        // One step of s = level/g(v/s): from step to step it follows what little the level changes.
        let own_rad_s = speed_rad_s / self.times;
        let own_nm = self.contact.steady_state_nm(own_rad_s) - self.viscous_nm_s_rad * own_rad_s;
        let own_nm = own_nm.max(f64::MIN_POSITIVE);
        let dry_nm = becomes_nm - self.viscous_nm_s_rad * speed_rad_s;
        let times = (dry_nm / own_nm).clamp(TIMES[0], TIMES[1]);
        self.contact.rescale(self.times / times);
        self.times = times;
        let own = Motion {
            velocity_rad_s: motion.velocity_rad_s / times,
            applied_nm: motion.applied_nm / times,
            dt_s: motion.dt_s,
        };
        (own, own_nm)
    }

    /// Advances by one step at its own level.
    pub fn step_own(&mut self, motion: Motion<f64>) -> f64 {
        self.contact.step(motion)
    }

    /// The same for [`Contact::mean_over`].
    pub fn mean_own(&mut self, motion: Motion<f64>) -> f64 {
        self.contact.mean_over(motion, None)
    }

    /// Bristle deflection, rad.
    pub fn deflection_rad(&self) -> f64 {
        self.times * self.contact.deflection_rad()
    }

    /// See [`Contact::rescale`].
    pub fn rescale(&mut self, times: f64) {
        self.contact.rescale(times);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::contact;
    use bristle_core::friction::elasto_plastic::ElastoPlastic;
    use bristle_core::stribeck::{Shape, Stribeck};

    #[test]
    fn slides_at_the_level_asked_for_whatever_the_stribeck_curve() {
        let shape = Shape::Gaussian {
            velocity_rad_s: 0.3,
        };
        let curve = Stribeck::new(0.020, 0.030, shape).unwrap();
        let own = || contact(ElastoPlastic::new(curve, 10.0, 0.02, 1e-3, 0.7).unwrap());
        for share in [0.6, 1.5] {
            let mut levelled = Levelled::new(own());
            for v in [0.05, 0.2, 0.4, 1.0] {
                let asked_nm = share * levelled.level_nm(v);
                let mut friction_nm = 0.0;
                for _ in 0..20_000 {
                    let motion = Motion {
                        velocity_rad_s: v,
                        applied_nm: 0.0,
                        dt_s: 1e-4,
                    };
                    friction_nm = levelled.step(motion, asked_nm);
                }
                // 0.1 rad at 0.05 rad/s, 22 times the largest z_ss: e^-22 of 0.045 N m is left.
                let wrong_nm = friction_nm - asked_nm;
                assert!(wrong_nm.abs() < 1e-10, "{share} {v}: {wrong_nm:e}");
            }
        }
    }
}
