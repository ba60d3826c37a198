//! Karnopp's model: a band of velocity around zero that counts as rest; torque N m over velocity
//! rad/s.
//!
//! Source: Aktas, ITU 2002, eq. 2.6; Karnopp 1985, ASME J. Dyn. Sys. 107, 100-103. The print takes
//! the larger of the applied torque and F_C + F_S in the band, which would drive the axis, and
//! gives the sliding terms opposite signs. Right, and here: the smaller of applied torque and F_S,
//! which is the whole level at rest and not an addition to F_C; and F_C sgn v + a v outside.
//!
//! In the band the torques balance, so momentum stays what it was: a body that enters the band
//! would creep on at up to Dv for ever. Karnopp integrates momentum and takes the velocity as zero
//! while it is in the band, so position stands still. A torque alone cannot do that. Who integrates
//! the axis calls [`Karnopp::taken_velocity_rad_s`] and moves the position by that, or sets the
//! velocity itself to it; [`Friction::HOLDS_AT_REST`] tells him so. Then no work is done in the
//! band. With the raw velocity the model would return energy there, as friction follows the applied
//! torque whichever way the body creeps.

use super::{Friction, Motion};
use crate::Real;
use crate::error::{ParameterError, not_negative, positive, require};

/// Rest inside |v| < Dv, Coulomb and viscous friction outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Karnopp<T> {
    coulomb_nm: T,
    stiction_nm: T,
    viscous_nm_s_rad: T,
    band_rad_s: T,
}

impl<T: Real> Karnopp<T> {
    /// The levels in motion and at rest, viscous friction, and the half width Dv of the band.
    ///
    /// # Errors
    /// Coulomb friction or the band not above zero, stiction below Coulomb friction, viscous
    /// friction below zero.
    pub fn new(
        coulomb_nm: T,
        stiction_nm: T,
        viscous_nm_s_rad: T,
        band_rad_s: T,
    ) -> Result<Self, ParameterError> {
        Ok(Self {
            coulomb_nm: positive("coulomb_nm", coulomb_nm)?,
            stiction_nm: require(
                "stiction_nm",
                stiction_nm,
                stiction_nm >= coulomb_nm,
                "at least coulomb_nm",
            )?,
            viscous_nm_s_rad: not_negative("viscous_nm_s_rad", viscous_nm_s_rad)?,
            band_rad_s: positive("band_rad_s", band_rad_s)?,
        })
    }

    /// The velocity that moves the position: zero in the band.
    #[inline]
    pub fn taken_velocity_rad_s(&self, velocity_rad_s: T) -> T {
        if velocity_rad_s.abs() < self.band_rad_s {
            T::ZERO
        } else {
            velocity_rad_s
        }
    }
}

impl<T: Real> Friction<T> for Karnopp<T> {
    type State = ();
    const HOLDS_AT_REST: bool = true;

    #[inline]
    fn step(&self, _: &mut (), motion: Motion<T>) -> T {
        if !motion.is_usable() {
            T::ZERO
        } else if self.taken_velocity_rad_s(motion.velocity_rad_s) == T::ZERO {
            motion.applied_nm.within(self.stiction_nm)
        } else {
            self.steady_state_nm(motion.velocity_rad_s)
        }
    }

    /// Zero in the band as well: without applied torque nothing is to be balanced there.
    #[inline]
    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        let velocity = self.taken_velocity_rad_s(velocity_rad_s);
        self.coulomb_nm * velocity.sgn() + self.viscous_nm_s_rad * velocity
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> Karnopp<f64> {
        Karnopp::new(0.5, 0.75, 0.25, 0.01).unwrap()
    }

    fn at(velocity_rad_s: f64, applied_nm: f64) -> Motion<f64> {
        Motion {
            velocity_rad_s,
            applied_nm,
            dt_s: 1e-4,
        }
    }

    #[test]
    fn balances_the_applied_torque_in_the_band() {
        let f = model();
        for v in [-0.009, 0.0, 0.009] {
            assert_eq!(f.step(&mut (), at(v, 0.625)), 0.625);
            assert_eq!(f.step(&mut (), at(v, -1.0)), -0.75);
        }
    }

    #[test]
    fn slides_outside_the_band_against_the_velocity() {
        let f = model();
        assert_eq!(f.step(&mut (), at(2.0, -9.0)), 1.0);
        assert_eq!(f.step(&mut (), at(-2.0, 9.0)), -1.0);
        assert_eq!(f.step(&mut (), at(0.01, 0.0)), 0.5 + 0.25 * 0.01);
    }

    #[test]
    fn a_creeping_body_stands_when_its_taken_velocity_moves_it() {
        let f = model();
        let (mut v, mut q) = (0.5_f64, 0.0_f64);
        let mut rest_at = None;
        for _ in 0..10_000 {
            v += (0.4 - f.step(&mut (), at(v, 0.4))) / 0.01 * 1e-4;
            q += f.taken_velocity_rad_s(v) * 1e-4;
            if f.taken_velocity_rad_s(v) == 0.0 {
                assert_eq!(*rest_at.get_or_insert(q), q);
            }
        }
        // The momentum is still there: that is what the taken velocity is for.
        assert!(v > 0.0);
        assert!(rest_at.is_some(), "never came to rest, v = {v}");
    }

    #[test]
    fn refuses_what_means_nothing() {
        assert!(Karnopp::new(0.5, 0.4, 0.0, 0.01).is_err());
        assert!(Karnopp::new(0.5, 0.6, 0.0, 0.0).is_err());
        assert_eq!(model().step(&mut (), at(f64::NAN, 0.1)), 0.0);
    }
}
