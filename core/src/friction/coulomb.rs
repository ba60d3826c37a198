//! Coulomb friction, alone and with viscous friction; torque N m over velocity rad/s.
//!
//! Source: Aktas, ITU 2002, the equation before 2.3 and eq. 2.3; Coulomb, "Theorie des machines
//! simples", 1785. Eq. 2.3 lacks the sign of the velocity on its Coulomb part, which is F_C sgn v
//! here.
//!
//! At rest the print leaves the torque undefined. Here friction balances the applied torque up to
//! F_C, which is the only value that neither starts the axis nor lets it creep.

use super::{Friction, Motion};
use crate::Real;
use crate::error::{ParameterError, not_negative, positive};

/// F_C sgn v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coulomb<T> {
    coulomb_nm: T,
}

impl<T: Real> Coulomb<T> {
    /// Friction of `coulomb_nm` at every speed.
    ///
    /// # Errors
    /// Coulomb friction not above zero.
    pub fn new(coulomb_nm: T) -> Result<Self, ParameterError> {
        Ok(Self {
            coulomb_nm: positive("coulomb_nm", coulomb_nm)?,
        })
    }
}

impl<T: Real> Friction<T> for Coulomb<T> {
    type State = ();
    const HOLDS_AT_REST: bool = true;

    #[inline]
    fn step(&self, _: &mut (), motion: Motion<T>) -> T {
        motion.hold_or_slide(self.coulomb_nm, |v| self.steady_state_nm(v))
    }

    #[inline]
    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        self.coulomb_nm * velocity_rad_s.sgn()
    }
}

/// F_C sgn v + F_v v.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoulombViscous<T> {
    coulomb: Coulomb<T>,
    viscous_nm_s_rad: T,
}

impl<T: Real> CoulombViscous<T> {
    /// Coulomb friction and a part that grows with speed.
    ///
    /// # Errors
    /// Coulomb friction not above zero, or viscous friction below it.
    pub fn new(coulomb_nm: T, viscous_nm_s_rad: T) -> Result<Self, ParameterError> {
        Ok(Self {
            coulomb: Coulomb::new(coulomb_nm)?,
            viscous_nm_s_rad: not_negative("viscous_nm_s_rad", viscous_nm_s_rad)?,
        })
    }
}

impl<T: Real> Friction<T> for CoulombViscous<T> {
    type State = ();
    const HOLDS_AT_REST: bool = true;

    #[inline]
    fn step(&self, state: &mut (), motion: Motion<T>) -> T {
        if !motion.is_usable() {
            return T::ZERO;
        }
        // The viscous part is zero at rest, so the order of the two does not matter there.
        self.coulomb.step(state, motion) + self.viscous_nm_s_rad * motion.velocity_rad_s
    }

    #[inline]
    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        self.coulomb.steady_state_nm(velocity_rad_s) + self.viscous_nm_s_rad * velocity_rad_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(velocity_rad_s: f64, applied_nm: f64) -> Motion<f64> {
        Motion {
            velocity_rad_s,
            applied_nm,
            dt_s: 1e-4,
        }
    }

    #[test]
    fn holds_at_rest_up_to_coulomb_friction() {
        let f = Coulomb::new(0.5).unwrap();
        assert_eq!(f.step(&mut (), at(0.0, 0.25)), 0.25);
        assert_eq!(f.step(&mut (), at(0.0, -0.75)), -0.5);
        assert_eq!(f.step(&mut (), at(1e-12, -0.75)), 0.5);
    }

    #[test]
    fn viscous_part_opposes_motion_both_ways() {
        let f = CoulombViscous::new(0.5, 0.25).unwrap();
        assert_eq!(f.step(&mut (), at(2.0, 0.0)), 1.0);
        assert_eq!(f.step(&mut (), at(-2.0, 0.0)), -1.0);
        assert_eq!(f.step(&mut (), at(0.0, 0.125)), 0.125);
    }

    #[test]
    fn a_broken_input_gives_no_torque() {
        let f = CoulombViscous::new(0.5, 0.25).unwrap();
        assert_eq!(f.step(&mut (), at(f64::NAN, 0.1)), 0.0);
        assert_eq!(f.step(&mut (), at(0.0, f64::INFINITY)), 0.0);
    }

    #[test]
    fn refuses_what_means_nothing() {
        assert!(Coulomb::new(0.0).is_err());
        assert!(CoulombViscous::new(0.5, -0.1).is_err());
        assert!(CoulombViscous::new(0.5, f64::NAN).is_err());
    }
}
