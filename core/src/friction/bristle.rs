//! The bristle model of Haessig and Friedland: N bonds that bend as springs, snap and form again; N
//! m and rad.
//!
//! F = sigma0 sum (x_i - b_i); a bond that is bent by delta_s snaps.
//!
//! Source: Aktas, ITU 2002, eq. 2.11; Haessig and Friedland 1991, ASME J. Dyn. Sys. 113, 354-362.
//! Neither says how the new place is distributed. Here it is uniform over the reach of the bond,
//! -delta_s to delta_s, which gives in steady sliding a bend of density (1 + y)/2 at y =
//! bend/delta_s: mean friction N sigma0 delta_s/3, and a scatter of sqrt(2/N) of it. The first
//! bonds lie in pairs of opposite bend, so that the axis starts without load.
//!
//! The torque given is the mean over the displacement of the step, so its product with dq is the
//! exact work of the springs: what is not stored in them was lost as bonds snapped. A step beyond
//! 16 delta_s is not followed bond by bond: friction is the mean, and the bends are drawn from the
//! steady density.
//!
//! The model has no damping of its own: an axis held by it rings on. As friction depends on
//! displacement alone, the sliding friction is the same at every speed.

use super::{Friction, Motion, stiffness};
use crate::Real;
use crate::error::{ParameterError, positive};

/// Times that a bond may snap within one followed step.
///
/// A new bond is one reach further on average, so 16 reaches are 16 times; that 64 do not suffice
/// happens in less than one of 1e20 steps, and costs the rest of that step its friction.
const SNAPS: u32 = 64;

/// `N` bonds of the same stiffness and reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bristle<T, const N: usize> {
    stiffness_nm_rad: T,
    reach_rad: T,
    seed: u32,
}

/// Bend of every bond, and the generator that places new ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BristleState<T, const N: usize> {
    bend_rad: [T; N],
    /// Zero: not placed yet. A default state cannot know the seed.
    generator: u32,
}

impl<T: Real, const N: usize> Default for BristleState<T, N> {
    fn default() -> Self {
        Self {
            bend_rad: [T::ZERO; N],
            generator: 0,
        }
    }
}

/// Marsaglia's xorshift of 32 bits, 0 to below 1. All 24 bits used are exact in f32 and f64.
#[inline]
fn draw<T: Real>(generator: &mut u32) -> T {
    let mut x = *generator;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    *generator = x;
    T::of_count((x >> 8) as i32) / T::of(16_777_216.0)
}

impl<T: Real, const N: usize> Bristle<T, N> {
    /// Stiffness sigma0 of one bond, its reach delta_s, and a seed for the places.
    ///
    /// # Errors
    /// Stiffness not above zero, or a reach outside 1e-12 to 1e6 rad.
    pub fn new(stiffness_nm_rad: T, reach_rad: T, seed: u32) -> Result<Self, ParameterError> {
        const { assert!(N >= 1 && N <= 65_536, "1 to 65536 bonds") };
        positive("reach_rad", reach_rad)?;
        let torque = stiffness_nm_rad * reach_rad;
        Ok(Self {
            stiffness_nm_rad: stiffness(stiffness_nm_rad, torque, torque)?,
            reach_rad,
            seed,
        })
    }

    /// Friction with every bond bent to its reach, which no motion exceeds.
    pub fn largest_nm(&self) -> T {
        T::of_count(N as i32) * self.stiffness_nm_rad * self.reach_rad
    }

    /// Energy of the bent bonds, J.
    pub fn stored_j(&self, state: &BristleState<T, N>) -> T {
        let mut sum = T::ZERO;
        for &bend in &state.bend_rad {
            sum += bend * bend;
        }
        sum * self.stiffness_nm_rad / T::of(2.0)
    }

    /// A state with its bonds in place. The first step does the same to a default state.
    pub fn placed(&self) -> BristleState<T, N> {
        let mut state = BristleState {
            bend_rad: [T::ZERO; N],
            // Odd multiples spread near seeds apart; the generator must not be zero.
            generator: self.seed.wrapping_mul(0x9E37_79B9) | 1,
        };
        for pair in state.bend_rad.chunks_exact_mut(2) {
            let bend = self.reach_rad * draw::<T>(&mut state.generator);
            if let [one, other] = pair {
                (*one, *other) = (bend, -bend);
            }
        }
        state
    }

    fn sum_nm(&self, state: &BristleState<T, N>) -> T {
        let mut sum = T::ZERO;
        for &bend in &state.bend_rad {
            sum += bend;
        }
        self.stiffness_nm_rad * sum
    }
}

impl<T: Real, const N: usize> Friction<T> for Bristle<T, N> {
    type State = BristleState<T, N>;
    const HOLDS_AT_REST: bool = false;

    fn step(&self, state: &mut BristleState<T, N>, motion: Motion<T>) -> T {
        if state.generator == 0 {
            *state = self.placed();
        }
        let usable = motion.is_usable();
        let dq = motion.velocity_rad_s * motion.dt_s;
        if !usable || dq == T::ZERO {
            return self.sum_nm(state);
        }
        let (sense, travel, reach) = (dq.sgn(), dq.abs(), self.reach_rad);
        let two = T::of(2.0);
        let BristleState {
            bend_rad,
            generator,
        } = state;
        if travel > T::of(16.0) * reach {
            for bend in bend_rad.iter_mut() {
                *bend = sense * reach * (two * draw::<T>(generator).sqrt() - T::ONE);
            }
            return self.steady_state_nm(sense);
        }
        let mut sum = T::ZERO;
        for bend in bend_rad.iter_mut() {
            let mut at = *bend * sense;
            let mut left = travel;
            for _ in 0..SNAPS {
                if at + left < reach {
                    sum += left / travel * (at + left / two);
                    at += left;
                    break;
                }
                let part = reach - at;
                sum += part / travel * (at + part / two);
                left -= part;
                at = reach * (two * draw::<T>(generator) - T::ONE);
            }
            *bend = at * sense;
        }
        (sense * self.stiffness_nm_rad * sum).within(self.largest_nm())
    }

    /// Mean over the displacement; friction scatters about it by sqrt(2/N).
    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        self.largest_nm() / T::of(3.0) * velocity_rad_s.sgn()
    }

    fn deflection_rad(&self, state: &BristleState<T, N>) -> T {
        let mut sum = T::ZERO;
        for &bend in &state.bend_rad {
            sum += bend;
        }
        sum / T::of_count(N as i32)
    }

    fn rescale(&self, state: &mut BristleState<T, N>, times: T) {
        for bend in &mut state.bend_rad {
            *bend = *bend * times;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 24;

    fn at(velocity_rad_s: f64, dt_s: f64) -> Motion<f64> {
        Motion {
            velocity_rad_s,
            applied_nm: 0.0,
            dt_s,
        }
    }

    fn model(seed: u32) -> Bristle<f64, N> {
        Bristle::new(2.0, 1e-3, seed).unwrap()
    }

    #[test]
    fn starts_without_load_and_bends_as_a_spring() {
        let f = model(1);
        let mut s = f.placed();
        assert_eq!(f.step(&mut s, at(0.0, 1e-4)), 0.0);
        // No bond is within 1e-9 of its reach; the mean over the step is half of its end.
        let torque = f.step(&mut s, at(1e-5, 1e-4));
        assert!((torque - 24.0 * 2.0 * 1e-9 / 2.0).abs() < 1e-15);
    }

    #[test]
    fn mean_and_scatter_in_sliding_are_as_derived() {
        let f = model(7);
        let mut s = BristleState::default();
        let steps = 400_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..steps {
            let torque = f.step(&mut s, at(1.0, 1e-5));
            sum += torque;
            squares += torque * torque;
        }
        let mean = sum / f64::from(steps);
        let scatter = (squares / f64::from(steps) - mean * mean).sqrt() / mean;
        // 4000 reaches of travel, about as many independent samples of scatter sqrt(2/24): 0.5 %,
        // taken four times.
        assert!((mean / f.steady_state_nm(1.0) - 1.0).abs() < 0.02, "{mean}");
        // The scatter of a scatter is its part 1/sqrt(2 4000) = 1.1 %, taken four times.
        let expected = (2.0_f64 / 24.0).sqrt();
        assert!((scatter / expected - 1.0).abs() < 0.05, "{scatter}");
    }

    #[test]
    fn the_seed_decides() {
        let run = |seed| {
            let mut s = BristleState::default();
            (0..1000)
                .map(|_| model(seed).step(&mut s, at(1.0, 1e-5)))
                .sum::<f64>()
        };
        assert_eq!(run(3), run(3));
        assert_ne!(run(3), run(4));
        assert!(run(0).is_finite());
    }

    #[test]
    fn a_long_step_gives_the_mean_and_the_steady_density() {
        let f = Bristle::<f64, 4096>::new(2.0, 1e-3, 5).unwrap();
        let mut s = BristleState::default();
        assert_eq!(f.step(&mut s, at(-1e6, 1.0)), f.steady_state_nm(-1.0));
        // Four standard deviations of a mean of 4096: 4 sqrt(2/4096) of reach/3.
        let mean = f.deflection_rad(&s);
        assert!((mean / (-1e-3 / 3.0) - 1.0).abs() < 4.0 * (2.0_f64 / 4096.0).sqrt());
    }

    #[test]
    fn refuses_what_means_nothing_and_keeps_its_state() {
        assert!(Bristle::<f64, N>::new(0.0, 1e-3, 1).is_err());
        assert!(Bristle::<f64, N>::new(1.0, -1e-3, 1).is_err());
        let f = model(1);
        let mut s = f.placed();
        f.step(&mut s, at(1.0, 1e-4));
        let kept = s;
        f.step(&mut s, at(f64::NAN, 1e-4));
        assert_eq!(s, kept);
    }
}
