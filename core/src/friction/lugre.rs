//! The LuGre model: mean deflection of bristles under a Stribeck curve; torque N m, deflection rad.
//!
//! dz/dt = v - sigma0 |v| z/g(|v|), F = sigma0 z + sigma1(v) dz/dt + sigma2 v.
//!
//! Source: Aktas, ITU 2002, eqs. 2.16-2.22; Canudas de Wit, Olsson, Astrom and Lischinsky 1995,
//! IEEE Trans. Autom. Control 40, 419-425; the damping that falls with speed is Olsson's (thesis,
//! Lund 1996). The print uses g for a torque in 2.16 and for a deflection in 2.21; here it is a
//! torque, and the deflection is z_ss = g/sigma0.
//!
//! # What the step promises
//! The deflection is advanced implicitly over the displacement dq = v dt: z+ = (z + dq) z_ss /
//! (z_ss + |dq|). That is a weighted mean of z and z_ss sgn v, so |z| <= F_S/sigma0 for any input
//! and the fixed point is exact for any step. From the same equation dz/dt = v (z_ss - z sgn
//! v)/(z_ss + |dq|). It equals (z+ - z)/dt but has no difference of near numbers and needs no
//! division by dt.
//!
//! Energy: write p for z+ - z. The spring does sigma0 z+ dq = sigma0 z+ p + sigma0 z+^2 |dq|/z_ss,
//! and z+ p is at least (z+^2 - z^2)/2. The damping term is sigma1 dq^2/dt (1 - z+ sgn(v)/z_ss), at
//! least -sigma1 dq^2/dt (F_S/F_C - 1). So the sum of F v dt is at least sigma0 (z_end^2 - z_0^2)/2
//! in discrete time too whenever sigma2 >= sigma1 (F_S/F_C - 1), the condition of Barabanov and
//! Ortega 2000, IEEE Trans. Autom. Control 45, 675-686. [`LuGre::is_passive`] tests it.

use super::{Friction, Motion, presliding, stiffness};
use crate::Real;
use crate::error::{ParameterError, not_negative, positive};
use crate::stribeck::Curve;

/// Damping of the bristles sigma1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Damping<T> {
    /// The same at every speed.
    Constant {
        /// sigma1, N m s/rad.
        nm_s_rad: T,
    },
    /// sigma1 exp(-(v/v_d)^2): bristles that slip are not damped.
    Falling {
        /// sigma1 at rest, N m s/rad.
        nm_s_rad: T,
        /// v_d
        velocity_rad_s: T,
    },
}

impl<T: Real> Damping<T> {
    /// sigma1 at a velocity, N m s/rad.
    #[inline]
    pub fn at_nm_s_rad(&self, velocity_rad_s: T) -> T {
        match *self {
            Self::Constant { nm_s_rad } => nm_s_rad,
            Self::Falling {
                nm_s_rad,
                velocity_rad_s: fall,
            } => {
                let x = velocity_rad_s / fall;
                nm_s_rad * (-(x * x)).exp()
            }
        }
    }

    /// Passes on damping whose numbers mean something.
    fn checked(self) -> Result<Self, ParameterError> {
        match self {
            Self::Constant { nm_s_rad } => {
                not_negative("bristle_damping_nm_s_rad", nm_s_rad)?;
            }
            Self::Falling {
                nm_s_rad,
                velocity_rad_s,
            } => {
                not_negative("bristle_damping_nm_s_rad", nm_s_rad)?;
                positive("bristle_damping_velocity_rad_s", velocity_rad_s)?;
            }
        }
        Ok(self)
    }
}

/// Mean deflection z of the bristles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LuGreState<T> {
    z_rad: T,
}

/// The LuGre model over any Stribeck curve.
///
/// ```
/// use bristle_core::friction::lugre::{Damping, LuGre, LuGreState};
/// use bristle_core::friction::{Friction, Motion};
/// use bristle_core::stribeck::{Shape, Stribeck};
/// let g = Stribeck::new(0.020_f64, 0.026, Shape::Gaussian { velocity_rad_s: 0.3 })?;
/// let model = LuGre::new(g, 10.53_f64, Damping::Constant { nm_s_rad: 0.076 }, 0.0029)?;
/// let mut state = LuGreState::default();
/// let motion = Motion { velocity_rad_s: 1.0, applied_nm: 0.0, dt_s: 1e-4 };
/// let torque = (0..1000).map(|_| model.step(&mut state, motion)).last().unwrap();
/// assert!((torque - model.steady_state_nm(1.0)).abs() < 1e-9);
/// # Ok::<(), bristle_core::ParameterError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LuGre<T, C> {
    curve: C,
    stiffness_nm_rad: T,
    damping: Damping<T>,
    viscous_nm_s_rad: T,
}

impl<T: Real, C: Curve<T>> LuGre<T, C> {
    /// Curve g, stiffness sigma0, damping sigma1 and viscous friction sigma2.
    ///
    /// # Errors
    /// Stiffness not above zero or out of proportion to the curve, damping or viscous friction
    /// below zero.
    pub fn new(
        curve: C,
        stiffness_nm_rad: T,
        damping: Damping<T>,
        viscous_nm_s_rad: T,
    ) -> Result<Self, ParameterError> {
        let stiffness_nm_rad =
            stiffness(stiffness_nm_rad, curve.coulomb_nm(), curve.stiction_nm())?;
        Ok(Self {
            curve,
            stiffness_nm_rad,
            damping: damping.checked()?,
            viscous_nm_s_rad: not_negative("viscous_nm_s_rad", viscous_nm_s_rad)?,
        })
    }

    /// Largest deflection, F_S/sigma0.
    #[inline]
    pub fn z_max_rad(&self) -> T {
        self.curve.stiction_nm() / self.stiffness_nm_rad
    }

    /// Whether sigma2 >= sigma1 (F_S/F_C - 1), so that the model can never return more than it has
    /// stored.
    ///
    /// Necessary and sufficient for constant damping; sufficient for falling damping.
    pub fn is_passive(&self) -> bool {
        let damping = self.damping.at_nm_s_rad(T::ZERO);
        let ratio = self.curve.stiction_nm() / self.curve.coulomb_nm();
        self.viscous_nm_s_rad >= damping * (ratio - T::ONE)
    }
}

impl<T: Real, C: Curve<T>> Friction<T> for LuGre<T, C> {
    type State = LuGreState<T>;
    const HOLDS_AT_REST: bool = false;

    #[inline]
    fn step(&self, state: &mut LuGreState<T>, motion: Motion<T>) -> T {
        if !motion.is_usable() {
            return self.stiffness_nm_rad * state.z_rad;
        }
        let v = motion.velocity_rad_s;
        let z = state.z_rad;
        let z_ss = self.curve.level_nm(v.abs()) / self.stiffness_nm_rad;
        let z_max = self.z_max_rad();
        let dq = motion.displacement_rad(z_max);
        state.z_rad = presliding::advance(z, dq, T::ONE, z_ss, z_max);
        let z_rate = v * ((z_ss - v.sgn() * z) / (z_ss + v.abs() * motion.dt_s));
        self.stiffness_nm_rad * state.z_rad
            + self.damping.at_nm_s_rad(v) * z_rate
            + self.viscous_nm_s_rad * v
    }

    fn mean_over(&self, state: &mut LuGreState<T>, motion: Motion<T>, level_nm: Option<T>) -> T {
        if !motion.is_usable() {
            return self.stiffness_nm_rad * state.z_rad;
        }
        let v = motion.velocity_rad_s;
        let z_max = self.z_max_rad();
        let dq = motion.displacement_rad(z_max);
        let (sense, before) = (dq.sgn(), state.z_rad);
        if sense == T::ZERO {
            return self.stiffness_nm_rad * before;
        }
        let level_nm = level_nm.unwrap_or_else(|| self.curve.level_nm(v.abs()));
        let z_ss = level_nm / self.stiffness_nm_rad;
        let (next, mean) = presliding::decay(sense * before, dq.abs(), T::ONE, z_ss);
        state.z_rad = (sense * next).within(z_max);
        self.stiffness_nm_rad * sense * mean
            + self.damping.at_nm_s_rad(v) * v * (sense * next - before) / dq
            + self.viscous_nm_s_rad * v
    }

    #[inline]
    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        self.curve.level_nm(velocity_rad_s.abs()) * velocity_rad_s.sgn()
            + self.viscous_nm_s_rad * velocity_rad_s
    }

    #[inline]
    fn deflection_rad(&self, state: &LuGreState<T>) -> T {
        state.z_rad
    }

    fn rescale(&self, state: &mut LuGreState<T>, times: T) {
        state.z_rad = state.z_rad * times;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stribeck::{Shape, Stribeck};

    fn model(damping: Damping<f64>) -> LuGre<f64, Stribeck<f64>> {
        let shape = Shape::Gaussian {
            velocity_rad_s: 0.3,
        };
        LuGre::new(
            Stribeck::new(0.020, 0.026, shape).unwrap(),
            10.53,
            damping,
            0.0029,
        )
        .unwrap()
    }

    const CONSTANT: Damping<f64> = Damping::Constant { nm_s_rad: 0.076 };

    fn at(velocity_rad_s: f64, dt_s: f64) -> Motion<f64> {
        Motion {
            velocity_rad_s,
            applied_nm: 0.0,
            dt_s,
        }
    }

    #[test]
    fn small_motion_is_a_spring_with_damping() {
        // Eq. 2.18: sigma0 dz + (sigma1 + sigma2) dv; the first step off the origin, to first order
        // in dq/z_ss = 5e-5.
        let f = model(CONSTANT);
        let mut s = LuGreState::default();
        let (v, dt) = (1e-3, 1e-4);
        let expected = 10.53 * v * dt + (0.076 + 0.0029) * v;
        assert!((f.step(&mut s, at(v, dt)) / expected - 1.0).abs() < 1e-4);
    }

    #[test]
    fn damping_term_is_the_rate_of_the_deflection() {
        let f = model(CONSTANT);
        let mut s = LuGreState::default();
        for i in 0..200 {
            let (v, dt) = (f64::from(i - 100) * 1e-2, 1e-3);
            let before = s.z_rad;
            let torque = f.step(&mut s, at(v, dt));
            let expected = 10.53 * s.z_rad + 0.076 * (s.z_rad - before) / dt + 0.0029 * v;
            // Rounding of the difference: 2e-3 * 2e-16 / 1e-3 rad/s, times sigma1.
            assert!((torque - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn falling_damping_is_gone_when_sliding() {
        let falling = Damping::Falling {
            nm_s_rad: 0.076,
            velocity_rad_s: 0.1,
        };
        let (mut a, mut b) = (LuGreState::default(), LuGreState::default());
        let fast = at(1.0, 1e-5);
        let with = model(CONSTANT).step(&mut a, fast);
        let without = model(falling).step(&mut b, fast);
        assert!(with - without > 0.07, "{with} {without}");
        assert_eq!(a, b);
    }

    #[test]
    fn no_time_and_no_sense_leave_the_state() {
        let f = model(CONSTANT);
        let mut s = LuGreState { z_rad: 1e-3 };
        assert!(f.step(&mut s, at(0.5, 0.0)).is_finite());
        // z z_ss/z_ss rounds twice.
        assert!((s.z_rad - 1e-3).abs() < 1e-18);
        let kept = s;
        for bad in [
            at(f64::NAN, 1e-4),
            at(f64::INFINITY, 1e-4),
            at(1.0, -1e-4),
            at(1.0, f64::NAN),
        ] {
            assert_eq!(f.step(&mut s, bad), 10.53 * s.z_rad);
            assert_eq!(s, kept);
        }
    }

    #[test]
    fn refuses_what_means_nothing() {
        let g = Stribeck::constant(0.02).unwrap();
        let none = Damping::Constant { nm_s_rad: 0.0 };
        assert!(LuGre::new(g, 0.0, none, 0.0).is_err());
        assert!(LuGre::new(g, 1e-30, none, 0.0).is_err());
        assert!(LuGre::new(g, 1.0, Damping::Constant { nm_s_rad: -1.0 }, 0.0).is_err());
        assert!(LuGre::new(g, 1.0, none, f64::NAN).is_err());
        assert!(LuGre::new(g, 1.0, none, 0.0).unwrap().is_passive());
        assert!(!model(CONSTANT).is_passive());
    }
}
