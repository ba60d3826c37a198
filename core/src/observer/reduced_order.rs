//! The linear reduced-order observer: the part w of a linear system's state that is not measured.
//!
//! dy/dt = A11 y + A12 w + B1 u, dw/dt = A21 y + A22 w + B2 u, and
//! dw^/dt = A22 w^ + A21 y + B2 u + L (dy/dt - A11 y - A12 w^ - B1 u).
//!
//! Source: Luenberger, IEEE TAC 16(6), 1971; thesis (Aktas, ITU 2002) eqs. 4.1-4.6. The source removes dy/dt by the
//! change of variable z = w^ - L y (4.5); here one sample is written in steps of y instead, which is the same and
//! needs no absolute y in f32:
//!
//! w' = w + T (A22 w + A21 y + B2 u) + L (y' - y - T (A11 y + A12 w + B1 u)).
//!
//! y counts from where the model was linearised. Where A11 and A21 are zero it does not enter at all.

use super::stability::{GainError, LARGEST_GROWTH, Regime, nearest_passing, spectral_radius};
use crate::real::Real;

/// The system, split into the measured output and the `N` states to be observed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct System<T, const N: usize> {
    /// dy/dt by y, 1/s.
    pub a11: T,
    /// dy/dt by w.
    pub a12: [T; N],
    /// dw/dt by y.
    pub a21: [T; N],
    /// dw/dt by w.
    pub a22: [[T; N]; N],
    /// dy/dt by u.
    pub b1: T,
    /// dw/dt by u.
    pub b2: [T; N],
}

impl<T: Real> System<T, 1> {
    /// A rigid axis held by its bristles: y = q, w = v, J dv/dt = u - sigma0 q - (sigma1 + sigma2) v (2.28). With
    /// stiffness zero, an axis with viscous friction.
    pub fn rigid_axis(inertia_kg_m2: T, stiffness_nm_rad: T, damping_nm_s_rad: T) -> Self {
        Self {
            a11: T::ZERO,
            a12: [T::ONE],
            a21: [-stiffness_nm_rad / inertia_kg_m2],
            a22: [[-damping_nm_s_rad / inertia_kg_m2]],
            b1: T::ZERO,
            b2: [T::ONE / inertia_kg_m2],
        }
    }
}

/// The observer of `N` states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReducedOrder<T, const N: usize> {
    system: System<T, N>,
    gain: [T; N],
    sample_time_s: T,
}

/// Observed part of the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<T, const N: usize> {
    /// w^.
    pub w: [T; N],
    /// Samples that were not finite; the state was kept.
    pub rejected: u32,
}

impl<T: Real, const N: usize> Default for State<T, N> {
    fn default() -> Self {
        Self {
            w: [T::ZERO; N],
            rejected: 0,
        }
    }
}

impl<T: Real, const N: usize> ReducedOrder<T, N> {
    /// Builds the observer if I + T (A22 - L A12) has all eigenvalues inside the unit circle.
    ///
    /// # Errors
    /// A gain under which the error does not die out. The nearest passing value is given for the first element of L
    /// with the others kept.
    pub fn new(system: System<T, N>, gain: [T; N], sample_time_s: T) -> Result<Self, GainError> {
        let growth_with = |first: f64| growth(&system, &gain, first, sample_time_s.to_f64());
        let first = gain.first().copied().unwrap_or(T::ZERO).to_f64();
        let growth = growth_with(first);
        if growth < LARGEST_GROWTH {
            return Ok(Self {
                system,
                gain,
                sample_time_s,
            });
        }
        Err(GainError {
            gain: "l1_1_s",
            value: first,
            regime: Regime::Linear,
            growth,
            nearest: nearest_passing(first, 1.0 / sample_time_s.to_f64(), |l| {
                growth_with(l) < LARGEST_GROWTH
            }),
        })
    }

    /// Takes y at the last sample, its step since, and the mean input during it; gives w at this sample.
    #[inline]
    pub fn step(&self, state: &mut State<T, N>, y: T, y_step: T, u: T) -> [T; N] {
        let System {
            a11,
            a12,
            a21,
            a22,
            b1,
            b2,
        } = &self.system;
        let t = self.sample_time_s;
        let innovation = y_step - t * (*a11 * y + dot(a12, &state.w) + *b1 * u);
        let mut next = state.w;
        let rows = a22.iter().zip(a21).zip(b2).zip(&self.gain);
        for (x, (((a22, a21), b2), l)) in next.iter_mut().zip(rows) {
            *x += t * (dot(a22, &state.w) + *a21 * y + *b2 * u) + *l * innovation;
        }
        if next.iter().all(|x| x.is_finite()) {
            state.w = next;
        } else {
            state.rejected = state.rejected.saturating_add(1);
        }
        state.w
    }
}

#[inline]
fn dot<T: Real, const N: usize>(a: &[T; N], b: &[T; N]) -> T {
    a.iter().zip(b).fold(T::ZERO, |sum, (x, y)| sum + *x * *y)
}

fn growth<T: Real, const N: usize>(
    system: &System<T, N>,
    gain: &[T; N],
    first_gain: f64,
    sample_time_s: f64,
) -> f64 {
    let mut error = [[0.0; N]; N];
    let rows = error.iter_mut().zip(&system.a22).zip(gain).enumerate();
    for (i, ((row, a22), l)) in rows {
        let l = if i == 0 { first_gain } else { l.to_f64() };
        for (j, ((cell, a22), a12)) in row.iter_mut().zip(a22).zip(&system.a12).enumerate() {
            let identity = if i == j { 1.0 } else { 0.0 };
            *cell = identity + sample_time_s * (a22.to_f64() - l * a12.to_f64());
        }
    }
    spectral_radius(error)
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1e-4;

    #[test]
    fn follows_the_axis_it_models() {
        let system = System::rigid_axis(2.5246e-5, 10.53, 0.0789);
        let observer = ReducedOrder::new(system, [1700.0], T).unwrap();
        let mut state = State::default();
        let (mut q, mut v) = (0.0, 0.1);
        for k in 0..2000 {
            let u = 1e-3 * (f64::from(k) * 0.05).sin();
            // The same Euler step, so that the error follows its matrix exactly.
            let dq = T * v;
            v += T * (system.a21[0] * q + system.a22[0][0] * v + system.b2[0] * u);
            observer.step(&mut state, q, dq, u);
            q += dq;
        }
        // 1 - T (0.0789/J + 1700) = 0.52; nothing is left of 0.1 rad/s after 2000 samples but rounding.
        assert!((state.w[0] - v).abs() < 1e-12, "{} {v}", state.w[0]);
    }

    #[test]
    fn refuses_a_gain_beyond_the_sample_time() {
        let system = System::rigid_axis(2.5246e-5, 10.53, 0.0789);
        let error = ReducedOrder::new(system, [17_000.0], T).unwrap_err();
        // -1 < 1 - T (0.0789/J + l): l < 2/T - 3125.2.
        let edge = 2.0 / T - 0.0789 / 2.5246e-5;
        assert!((error.nearest.unwrap() - edge).abs() < 0.1, "{error}");
        assert!(ReducedOrder::new(system, [error.nearest.unwrap()], T).is_ok());
    }

    #[test]
    fn observes_two_inertias_from_the_motor_side() {
        // w = (v_motor, q_load, v_load); q_load relative to the motor, so that nothing grows with travel.
        let (j, k, b) = (2.5e-5, 20.0, 5e-3);
        let system = System::<f64, 3> {
            a11: 0.0,
            a12: [1.0, 0.0, 0.0],
            a21: [0.0; 3],
            a22: [
                [-b / j, k / j, b / j],
                [-1.0, 0.0, 1.0],
                [b / j, -k / j, -b / j],
            ],
            b1: 0.0,
            b2: [1.0 / j, 0.0, 0.0],
        };
        let observer = ReducedOrder::new(system, [1000.0, 0.0, 500.0], T).unwrap();
        let mut state = State::default();
        let mut w = [0.3, 1e-4, -0.2];
        for _ in 0..20_000 {
            let dq = T * w[0];
            let rate = system.a22.map(|row| dot(&row, &w));
            observer.step(&mut state, 0.0, dq, 1e-3);
            for i in 0..3 {
                w[i] += T * (rate[i] + system.b2[i] * 1e-3);
            }
        }
        for i in 0..3 {
            // 2 s of decay leave rounding on a velocity that has grown to 40 rad/s.
            assert!((state.w[i] - w[i]).abs() < 1e-9 * w[2].abs(), "{i}");
        }
    }

    #[test]
    fn keeps_its_state_through_bad_input() {
        let system = System::rigid_axis(1.0_f32, 0.0, 1.0);
        let observer = ReducedOrder::new(system, [10.0], 1e-3).unwrap();
        let mut state = State::default();
        let before = observer.step(&mut state, 0.0, 1e-3, 0.5);
        assert_eq!(observer.step(&mut state, 0.0, f32::NAN, 0.5), before);
        assert_eq!(observer.step(&mut state, 0.0, 0.0, f32::INFINITY), before);
        assert_eq!(state.rejected, 2);
    }
}
