//! Dahl's model: friction as a function of displacement alone; torque N m, displacement rad.
//!
//! dF/dx = sigma |1 - F/F_C sgn v|^a sgn(1 - F/F_C sgn v), a >= 0.
//!
//! Source: Aktas, ITU 2002, eqs. 2.9 and 2.10; Dahl 1968, "A solid friction model", Aerospace Corp.
//! TOR-0158, and Dahl 1976, AIAA J. 14, 1675-1682. The print raises 1 - F/F_C sgn v itself to the
//! power, which has no real value once the base is negative; here its sign is kept outside the
//! power. With |F| <= F_C, which every step holds, it never is negative.
//!
//! # The step
//! With u = 1 - F/F_C sgn v the equation is du/d|q| = -(sigma/F_C) u^a, which has a solution in
//! closed form for every a, so a step of any length lands on the curve: u stays between 0 and 2 and
//! |F| <= F_C. Only a = 1 is advanced by the implicit form that LuGre shares, which costs no
//! elementary function; it lags the exact exponential by half a step.
//!
//! Energy: along a step F sgn v never falls, so the torque at its end does at least the work of the
//! curve. On the curve F dq - d(F^2/2 sigma) = F sgn(v) (1 - u^a) |dq|, never negative as u < 1
//! exactly when F sgn v > 0. So sum F dq >= (F_end^2 - F_0^2)/(2 sigma) for every exponent and
//! every step.

use super::{Friction, Motion, presliding, stiffness};
use crate::Real;
use crate::error::{ParameterError, positive, require};

/// Dahl's model with any exponent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dahl<T> {
    stiffness_nm_rad: T,
    coulomb_nm: T,
    exponent: T,
}

/// Deflection F/sigma.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DahlState<T> {
    z_rad: T,
}

impl<T: Real> Dahl<T> {
    /// Stiffness sigma, Coulomb friction F_C and the exponent: 0 for a spring that slips at F_C, 1
    /// for the common curve.
    ///
    /// # Errors
    /// Stiffness or friction not above zero or out of proportion; an exponent that is not from 0 to
    /// 16, or so near to 1 that the root 1/(1 - a) of its solution would lose the digits of f32.
    pub fn new(stiffness_nm_rad: T, coulomb_nm: T, exponent: T) -> Result<Self, ParameterError> {
        positive("coulomb_nm", coulomb_nm)?;
        // A little less than 0.05, so that 0.95 and 1.05 pass however they are rounded.
        let far_from_one = (exponent - T::ONE).abs() >= T::of(0.0499);
        Ok(Self {
            stiffness_nm_rad: stiffness(stiffness_nm_rad, coulomb_nm, coulomb_nm)?,
            coulomb_nm,
            exponent: require(
                "exponent",
                exponent,
                exponent >= T::ZERO
                    && exponent <= T::of(16.0)
                    && (exponent == T::ONE || far_from_one),
                "1, or from 0 to 16 and at least 0.05 from 1",
            )?,
        })
    }

    /// Deflection in sliding, F_C/sigma.
    #[inline]
    fn z_ss_rad(&self) -> T {
        self.coulomb_nm / self.stiffness_nm_rad
    }

    /// What is left of u after a displacement of `x` times z_ss.
    #[inline]
    fn left_of(&self, u: T, x: T) -> T {
        if u <= T::ZERO || x == T::ZERO {
            return u;
        }
        // (1 + b x u^b)^(-1/b) with b = a - 1, factored so that no power of a small u can overflow.
        let b = self.exponent - T::ONE;
        let base = T::ONE + b * x * u.powf(b);
        u * base.most(T::ZERO).powf(-T::ONE / b)
    }
}

impl<T: Real> Friction<T> for Dahl<T> {
    type State = DahlState<T>;
    const HOLDS_AT_REST: bool = false;

    #[inline]
    fn step(&self, state: &mut DahlState<T>, motion: Motion<T>) -> T {
        if motion.is_usable() {
            let z_ss = self.z_ss_rad();
            let dq = motion.displacement_rad(z_ss);
            state.z_rad = if self.exponent == T::ONE {
                presliding::advance(state.z_rad, dq, T::ONE, z_ss, z_ss)
            } else if dq == T::ZERO {
                state.z_rad
            } else {
                let u = T::ONE - state.z_rad / z_ss * dq.sgn();
                let left = self.left_of(u, dq.abs() / z_ss);
                (z_ss * dq.sgn() * (T::ONE - left)).within(z_ss)
            };
        }
        // z_ss is rounded, so its product with the stiffness may pass F_C by the last place.
        (self.stiffness_nm_rad * state.z_rad).within(self.coulomb_nm)
    }

    #[inline]
    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        self.coulomb_nm * velocity_rad_s.sgn()
    }

    #[inline]
    fn deflection_rad(&self, state: &DahlState<T>) -> T {
        state.z_rad
    }

    fn rescale(&self, state: &mut DahlState<T>, times: T) {
        state.z_rad = state.z_rad * times;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(velocity_rad_s: f64, dt_s: f64) -> Motion<f64> {
        Motion {
            velocity_rad_s,
            applied_nm: 0.0,
            dt_s,
        }
    }

    #[test]
    fn one_step_and_many_end_on_the_same_curve() {
        for exponent in [0.0, 0.5, 2.0, 3.0] {
            let f = Dahl::new(10.0, 0.02, exponent).unwrap();
            let (mut one, mut many) = (DahlState::default(), DahlState::default());
            for v in [1.0, -2.0] {
                f.step(&mut one, at(v, 1e-3));
                for _ in 0..1000 {
                    f.step(&mut many, at(v, 1e-6));
                }
                // A thousand roundings of z_ss = 2e-3, each of 2e-16.
                let error = (one.z_rad - many.z_rad).abs();
                assert!(error < 1000.0 * 2e-3 * 2.3e-16, "a = {exponent}: {error:e}");
            }
        }
    }

    #[test]
    fn follows_the_differential_equation() {
        for exponent in [0.5, 1.0, 2.0, 4.0] {
            let f = Dahl::new(10.0, 0.02, exponent).unwrap();
            let (mut s, mut torque) = (DahlState::default(), 0.0_f64);
            for v in [1.0_f64, -1.0] {
                for _ in 0..20_000 {
                    let u = 1.0 - torque / 0.02 * v;
                    torque += 10.0 * u.abs().powf(exponent).copysign(u) * v * 1e-7;
                    f.step(&mut s, at(v, 1e-7));
                }
                // Explicit Euler against it at dq/z_ss = 5e-5; the slope changes by up to 2^a a on
                // the way.
                let limit = 0.02 * 5e-5 * 16.0 * exponent;
                assert!((10.0 * s.z_rad - torque).abs() < limit, "a = {exponent}");
            }
        }
    }

    #[test]
    fn exponent_zero_is_a_spring_that_slips() {
        let f = Dahl::new(10.0, 0.02, 0.0).unwrap();
        let mut s = DahlState::default();
        assert!((f.step(&mut s, at(1.0, 1e-3)) - 0.01).abs() < 1e-17);
        assert_eq!(f.step(&mut s, at(1.0, 5e-3)), 0.02);
        assert!((f.step(&mut s, at(-1.0, 1e-3)) - 0.01).abs() < 1e-17);
    }

    #[test]
    fn no_step_passes_coulomb_friction() {
        for exponent in [0.0, 0.5, 0.95, 1.0, 1.05, 2.0, 16.0] {
            let f = Dahl::new(10.0_f32, 0.02, exponent).unwrap();
            let mut s = DahlState::default();
            for v in [1e30_f32, -1e30, 1e-30, -3.0, 1e20, 0.0, f32::NAN, -1.0] {
                let motion = Motion {
                    velocity_rad_s: v,
                    applied_nm: 0.0,
                    dt_s: 1e3,
                };
                let torque = f.step(&mut s, motion);
                assert!(torque.abs() <= 0.02, "a = {exponent}, v = {v}: {torque}");
            }
        }
    }

    #[test]
    fn refuses_what_means_nothing() {
        assert!(Dahl::new(10.0, 0.02, -0.5).is_err());
        assert!(Dahl::new(10.0, 0.02, 1.001).is_err());
        assert!(Dahl::new(10.0, 0.0, 1.0).is_err());
        assert!(Dahl::new(f64::INFINITY, 0.02, 1.0).is_err());
    }
}
