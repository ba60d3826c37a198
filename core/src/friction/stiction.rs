//! Static friction with a higher level at rest: stiction over Coulomb friction, and the general
//! static curve.
//!
//! Torque N m over velocity rad/s. Source: Aktas, ITU 2002, eqs. 2.4 and 2.5; Morin 1833 for the
//! higher level at rest, Stribeck 1902 for the curve between. Eq. 2.4 covers rest only; in motion
//! [`Stiction`] slides at F_C sgn v.

use super::{Friction, Motion};
use crate::Real;
use crate::error::{ParameterError, not_negative, positive, require};
use crate::stribeck::Curve;

/// Holds the applied torque up to F_S at rest, slides at F_C.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stiction<T> {
    coulomb_nm: T,
    stiction_nm: T,
}

impl<T: Real> Stiction<T> {
    /// Friction of `coulomb_nm` in motion and up to `stiction_nm` at rest.
    ///
    /// # Errors
    /// Coulomb friction not above zero, or stiction below it.
    pub fn new(coulomb_nm: T, stiction_nm: T) -> Result<Self, ParameterError> {
        Ok(Self {
            coulomb_nm: positive("coulomb_nm", coulomb_nm)?,
            stiction_nm: require(
                "stiction_nm",
                stiction_nm,
                stiction_nm >= coulomb_nm,
                "at least coulomb_nm",
            )?,
        })
    }
}

impl<T: Real> Friction<T> for Stiction<T> {
    type State = ();
    const HOLDS_AT_REST: bool = true;

    #[inline]
    fn step(&self, _: &mut (), motion: Motion<T>) -> T {
        motion.hold_or_slide(self.stiction_nm, |v| self.steady_state_nm(v))
    }

    #[inline]
    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        self.coulomb_nm * velocity_rad_s.sgn()
    }
}

/// Any Stribeck curve with viscous friction: g(|v|) sgn v + F_v v in motion, up to the curve's
/// stiction at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeneralStatic<T, C> {
    curve: C,
    viscous_nm_s_rad: T,
}

impl<T: Real, C: Curve<T>> GeneralStatic<T, C> {
    /// A curve and the viscous friction on top of it.
    ///
    /// # Errors
    /// Viscous friction below zero.
    pub fn new(curve: C, viscous_nm_s_rad: T) -> Result<Self, ParameterError> {
        Ok(Self {
            curve,
            viscous_nm_s_rad: not_negative("viscous_nm_s_rad", viscous_nm_s_rad)?,
        })
    }
}

impl<T: Real, C: Curve<T>> Friction<T> for GeneralStatic<T, C> {
    type State = ();
    const HOLDS_AT_REST: bool = true;

    #[inline]
    fn step(&self, _: &mut (), motion: Motion<T>) -> T {
        motion.hold_or_slide(self.curve.stiction_nm(), |v| self.steady_state_nm(v))
    }

    #[inline]
    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        self.curve.level_nm(velocity_rad_s.abs()) * velocity_rad_s.sgn()
            + self.viscous_nm_s_rad * velocity_rad_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stribeck::{Shape, Stribeck};

    fn at(velocity_rad_s: f64, applied_nm: f64) -> Motion<f64> {
        Motion {
            velocity_rad_s,
            applied_nm,
            dt_s: 1e-4,
        }
    }

    fn general() -> GeneralStatic<f64, Stribeck<f64>> {
        let shape = Shape::Gaussian {
            velocity_rad_s: 0.3,
        };
        GeneralStatic::new(Stribeck::new(0.5, 0.75, shape).unwrap(), 0.25).unwrap()
    }

    #[test]
    fn holds_more_at_rest_than_in_motion() {
        let f = Stiction::new(0.5, 0.75).unwrap();
        assert_eq!(f.step(&mut (), at(0.0, -0.625)), -0.625);
        assert_eq!(f.step(&mut (), at(0.0, 2.0)), 0.75);
        assert_eq!(f.step(&mut (), at(-1e-9, 2.0)), -0.5);
    }

    #[test]
    fn general_model_follows_its_curve() {
        let f = general();
        assert_eq!(f.step(&mut (), at(0.0, 2.0)), 0.75);
        assert_eq!(f.step(&mut (), at(0.0, 0.625)), 0.625);
        // exp(-1) of the fall at v_s.
        let expected = 0.5 + 0.25 * (-1.0_f64).exp() + 0.25 * 0.3;
        assert!((f.step(&mut (), at(0.3, 0.0)) - expected).abs() < 1e-15);
        assert_eq!(
            f.step(&mut (), at(-0.3, 0.0)),
            -f.step(&mut (), at(0.3, 0.0))
        );
    }

    #[test]
    fn a_broken_input_gives_no_torque() {
        assert_eq!(general().step(&mut (), at(f64::NAN, 0.1)), 0.0);
        assert_eq!(
            Stiction::new(0.5, 0.75)
                .unwrap()
                .step(&mut (), at(0.0, f64::NAN)),
            0.0
        );
    }

    #[test]
    fn refuses_what_means_nothing() {
        assert!(Stiction::new(0.5, 0.4).is_err());
        assert!(Stiction::new(-0.5, 0.4).is_err());
        assert!(GeneralStatic::new(Stribeck::constant(0.5).unwrap(), -1.0).is_err());
    }
}
