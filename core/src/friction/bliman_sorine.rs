//! The Bliman-Sorine models: linear systems over the path length s = integral |v| dt; torque N m,
//! distance rad.
//!
//! dx/ds = A x + B sgn v, F = C x. First order: A = -1/eps, B = f1/eps. Second order: a fast branch
//! of f1 over eta eps less a slow one of f2 over eps, so that friction overshoots f1 - f2 on its
//! way.
//!
//! Source: Aktas, ITU 2002, eqs. 2.12-2.15; Bliman and Sorine 1995, Proc. 3rd European Control
//! Conf., 1833-1838. The first order is Dahl's model of exponent 1 with sigma = f1/eps.
//!
//! # The step
//! Over a step of path length ds at one sign of v each branch is x+ = x e^-r + f sgn(v) (1 - e^-r),
//! r = ds/eps, exact for any step. The torque given is the mean of F over ds: its product with ds
//! is the very work of the continuous model. An end value would not do for the second order, whose
//! F may rise and fall within a step.
//!
//! Energy: from rest, sum F dq >= 0 for f2 < f1 and eta < 1, as then the real part of the transfer
//! function, f1/(1 + eta^2 a^2) - f2/(1 + a^2), is positive at every a = eps w.

use super::{Friction, Motion};
use crate::Real;
use crate::error::{ParameterError, not_negative, positive, require};

/// First- or second-order Bliman-Sorine model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlimanSorine<T> {
    fast_nm: T,
    fast_rad: T,
    slow_nm: T,
    slow_rad: T,
}

/// Torque of the two branches; the slow one is zero in the first order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlimanSorineState<T> {
    fast_nm: T,
    slow_nm: T,
}

/// (1 - e^-r)/r, without the cancellation at small r.
#[inline]
fn mean_decay<T: Real>(r: T) -> T {
    if r >= T::of(0.125) {
        return (T::ONE - (-r).exp()) / r;
    }
    // Its series in nested form; the first term left out is 0.125^9/10! = 2e-15.
    let mut sum = T::ONE;
    for k in (2..=9).rev() {
        sum = T::ONE - r / T::of_count(k) * sum;
    }
    sum
}

/// Moves a branch by `r` distances towards `target` and gives its mean on the way.
#[inline]
fn branch<T: Real>(x: &mut T, target: T, r: T) -> T {
    let mean = mean_decay(r);
    let done = (r * mean).least(T::ONE);
    let start = *x;
    *x = (start * (T::ONE - done) + target * done).within(target.abs().most(start.abs()));
    start * mean + target * (T::ONE - mean)
}

impl<T: Real> BlimanSorine<T> {
    /// First order: Coulomb friction f1 approached over the distance eps.
    ///
    /// # Errors
    /// Either not above zero.
    pub fn first_order(coulomb_nm: T, distance_rad: T) -> Result<Self, ParameterError> {
        let distance = positive("distance_rad", distance_rad)?;
        Ok(Self {
            fast_nm: positive("coulomb_nm", coulomb_nm)?,
            fast_rad: distance,
            slow_nm: T::ZERO,
            slow_rad: distance,
        })
    }

    /// Second order: a fast branch f1 over eta eps less a slow branch f2 over eps.
    ///
    /// # Errors
    /// f1 or eps not above zero, f2 not from zero to below f1, eta not between 0 and 1.
    pub fn second_order(
        fast_nm: T,
        slow_nm: T,
        eta: T,
        distance_rad: T,
    ) -> Result<Self, ParameterError> {
        positive("fast_nm", fast_nm)?;
        not_negative("slow_nm", slow_nm)?;
        require("slow_nm", slow_nm, slow_nm < fast_nm, "below fast_nm")?;
        require(
            "eta",
            eta,
            eta >= T::of(1e-3) && eta <= T::of(0.999),
            "from 0.001 to 0.999",
        )?;
        positive("distance_rad", distance_rad)?;
        Ok(Self {
            fast_nm,
            fast_rad: positive("eta distance_rad", eta * distance_rad)?,
            slow_nm,
            slow_rad: distance_rad,
        })
    }

    /// Friction in steady sliding, f1 - f2.
    #[inline]
    pub fn coulomb_nm(&self) -> T {
        self.fast_nm - self.slow_nm
    }

    /// Peak of the friction of an axis that starts from rest without load.
    pub fn break_away_nm(&self) -> T {
        let eta = self.fast_rad / self.slow_rad;
        if self.slow_nm <= T::ZERO || eta >= T::ONE {
            return self.fast_nm;
        }
        // At the peak e^-(s/eps) = y.
        let y = (eta * self.slow_nm / self.fast_nm).powf(eta / (T::ONE - eta));
        self.coulomb_nm() + self.slow_nm * y * (T::ONE - eta)
    }

    /// Largest friction after any motion: the peak after a reversal from steady sliding.
    ///
    /// The impulse response changes sign once, so the worst input reverses once.
    pub fn largest_nm(&self) -> T {
        self.break_away_nm() + self.break_away_nm() - self.coulomb_nm()
    }
}

impl<T: Real> Friction<T> for BlimanSorine<T> {
    type State = BlimanSorineState<T>;
    const HOLDS_AT_REST: bool = false;

    #[inline]
    fn step(&self, state: &mut BlimanSorineState<T>, motion: Motion<T>) -> T {
        if !motion.is_usable() {
            return state.fast_nm + state.slow_nm;
        }
        let sense = motion.velocity_rad_s.sgn();
        let ds = motion.velocity_rad_s.abs() * motion.dt_s;
        let most = T::ONE / T::EPSILON;
        let fast = branch(
            &mut state.fast_nm,
            sense * self.fast_nm,
            (ds / self.fast_rad).least(most),
        );
        let slow = branch(
            &mut state.slow_nm,
            -sense * self.slow_nm,
            (ds / self.slow_rad).least(most),
        );
        fast + slow
    }

    #[inline]
    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        self.coulomb_nm() * velocity_rad_s.sgn()
    }

    fn rescale(&self, state: &mut BlimanSorineState<T>, times: T) {
        state.fast_nm = state.fast_nm * times;
        state.slow_nm = state.slow_nm * times;
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
    fn mean_decay_has_no_seam_and_no_cancellation() {
        for r in [0.0_f64, 1e-12, 1e-3, 0.1249, 0.1251, 1.0, 40.0] {
            let exact = if r == 0.0 { 1.0 } else { -(-r).exp_m1() / r };
            // Four roundings above the seam divided by r = 0.125; 2e-15 of the series below it.
            assert!((mean_decay(r) - exact).abs() < 1e-14, "r = {r}");
        }
    }

    #[test]
    fn steps_of_any_length_end_at_the_same_state_with_the_same_work() {
        let f = BlimanSorine::second_order(0.03, 0.01, 0.2, 2e-3).unwrap();
        let (mut one, mut many) = (BlimanSorineState::default(), BlimanSorineState::default());
        for v in [1.0, -1.0, 3.0] {
            let torque = f.step(&mut one, at(v, 1e-3));
            let mean = (0..1000)
                .map(|_| f.step(&mut many, at(v, 1e-6)))
                .sum::<f64>()
                / 1000.0;
            // A thousand roundings of 0.03 N m.
            let limit = 1000.0 * 0.03 * f64::EPSILON;
            assert!((torque - mean).abs() < limit);
            assert!((one.fast_nm - many.fast_nm).abs() < limit);
            assert!((one.slow_nm - many.slow_nm).abs() < limit);
        }
    }

    #[test]
    fn first_order_is_dahls_exponential() {
        let f = BlimanSorine::first_order(0.02, 2e-3).unwrap();
        let mut s = BlimanSorineState::default();
        f.step(&mut s, at(1.0, 2e-3));
        assert!((s.fast_nm - 0.02 * (1.0 - (-1.0_f64).exp())).abs() < 1e-17);
        assert_eq!((f.break_away_nm(), f.largest_nm()), (0.02, 0.02));
    }

    #[test]
    fn peaks_are_where_the_formulas_put_them() {
        let f = BlimanSorine::second_order(0.03, 0.01, 0.2, 2e-3).unwrap();
        let mut s = BlimanSorineState::default();
        let mut peak = |v: f64| {
            (0..400_000)
                .map(|_| f.step(&mut s, at(v, 1e-7)) * v)
                .fold(0.0, f64::max)
        };
        // 20 distances first, so that e^-20 of the slow branch is left. The peak is flat: half a
        // step of 1e-7/(eta eps) = 2.5e-4, squared, times f1.
        let limit = 0.03 * 2.5e-4 * 2.5e-4;
        assert!((peak(1.0) - f.break_away_nm()).abs() < limit);
        assert!((peak(-1.0) - f.largest_nm()).abs() < limit);
        assert!(f.largest_nm() > f.break_away_nm() && f.break_away_nm() > f.coulomb_nm());
    }

    #[test]
    fn refuses_what_means_nothing_and_keeps_its_state() {
        assert!(BlimanSorine::first_order(0.02, 0.0).is_err());
        assert!(BlimanSorine::second_order(0.02, 0.02, 0.5, 1e-3).is_err());
        assert!(BlimanSorine::second_order(0.02, 0.01, 1.0, 1e-3).is_err());
        let f = BlimanSorine::first_order(0.02, 2e-3).unwrap();
        let mut s = BlimanSorineState::default();
        f.step(&mut s, at(1.0, 2e-3));
        let kept = s;
        assert_eq!(f.step(&mut s, at(f64::NAN, 1e-3)), s.fast_nm);
        assert_eq!(s, kept);
    }
}
