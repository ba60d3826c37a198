//! The discrete time-free observer: bristle deflection from displacement alone, without a clock or a torque.
//!
//! z' = z + dq - |dq| alpha z/z_ss while alpha |z|/z_ss < 1, else sgn(z) z_ss(v).
//!
//! Source: Hayward, Armstrong, "A new computational model of friction applied to haptic rendering", LNCIS 250, 2000;
//! thesis (Aktas, ITU 2002) eqs. 4.22-4.35. The print drops the factor z in 4.22 and 4.23 and has w_k for w_(k+1) on
//! the left of 4.32; the law above is the right one, written for z = q - w in steps of q.
//!
//! Three things go beyond the source. Without a step z stays, even where a changed velocity puts it past z_ss. A step longer than z_ss overshoots under its law for one sample; here |z| never
//! leaves z_max. And the direction in alpha is that of the step itself, since the velocity may come from a filter that
//! reverses later.
//!
//! Velocity only sets the place on the Stribeck curve. It has to be a filtered one: the difference quotient of a single
//! count is rad_per_count/T, which on a coarse encoder lies beyond the whole curve. The Luenberger-like observer's
//! estimate serves; see `Tick`.

use core::hint::cold_path;

use super::Luenberger;
use crate::error::{ParameterError, positive};
use crate::friction::ElastoPlastic;
use crate::real::Real;
use crate::stribeck::Curve;

/// The observer over an elasto-plastic model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeFree<T, C> {
    friction: ElastoPlastic<T, C>,
    rad_per_count: T,
    largest_step_rad: T,
}

/// Deflection, and how many samples were rejected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    /// z, rad.
    pub z_rad: T,
    /// Samples whose input was not believed; the deflection was kept.
    pub rejected: u32,
}

impl<T: Real, C: Curve<T>> TimeFree<T, C> {
    /// The model, the angle of a count, and the longest step an axis can make in a sample.
    ///
    /// # Errors
    /// An angle or step not above zero.
    pub fn new(
        friction: ElastoPlastic<T, C>,
        rad_per_count: T,
        largest_step_rad: T,
    ) -> Result<Self, ParameterError> {
        Ok(Self {
            friction,
            rad_per_count: positive("rad_per_count", rad_per_count)?,
            largest_step_rad: positive("largest_step_rad", largest_step_rad)?,
        })
    }

    /// Over the model, the count and the longest step of the other observer.
    pub fn beside(luenberger: &Luenberger<T, C>) -> Self
    where
        C: Copy,
    {
        Self {
            friction: *luenberger.friction(),
            rad_per_count: luenberger.settings().rad_per_count,
            largest_step_rad: luenberger.largest_step_rad(),
        }
    }

    /// The friction model inside.
    pub fn friction(&self) -> &ElastoPlastic<T, C> {
        &self.friction
    }

    /// Takes the step in counts since the last sample and a filtered velocity, and gives z at this sample, rad.
    #[inline]
    pub fn step(&self, state: &mut State<T>, step_counts: i32, velocity_rad_s: T) -> T {
        let dq = T::of_count(step_counts) * self.rad_per_count;
        if !(velocity_rad_s.is_finite() && dq.abs() <= self.largest_step_rad) {
            cold_path();
            state.rejected = state.rejected.saturating_add(1);
            return state.z_rad;
        }
        if step_counts != 0 {
            let z_ss = self.friction.z_ss_rad(velocity_rad_s.abs());
            state.z_rad = follow(&self.friction, state.z_rad, step_counts, dq, z_ss);
        }
        state.z_rad
    }

    /// Plastic displacement w = q - z within the turn that the encoder is in, rad (4.24, 4.25).
    ///
    /// Within the turn, because a whole w grows with travel as q does.
    pub fn plastic_rad(&self, state: &State<T>, counts_in_turn: i32) -> T {
        T::of_count(counts_in_turn) * self.rad_per_count - state.z_rad
    }
}

/// z after a step that is believed and not zero, rad, at the velocity of a z_ss.
#[inline]
pub(crate) fn follow<T: Real, C: Curve<T>>(
    friction: &ElastoPlastic<T, C>,
    z: T,
    step_counts: i32,
    dq: T,
    z_ss: T,
) -> T {
    // Counted positive in the direction of the step.
    let along = if step_counts < 0 { -z } else { z };
    let next = if along <= friction.breakaway_ratio() * z_ss {
        z + dq
    } else if along >= z_ss {
        z_ss.copysign(z)
    } else {
        let share = along / z_ss;
        z + dq * (T::ONE - friction.alpha(share) * share)
    };
    next.within(friction.z_max_rad())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stribeck::{Shape, Stribeck};

    fn observer(ratio: f64) -> TimeFree<f64, Stribeck<f64>> {
        let shape = Shape::Gaussian {
            velocity_rad_s: 0.3,
        };
        let curve = Stribeck::new(0.020, 0.026, shape).unwrap();
        let friction = ElastoPlastic::new(curve, 10.53, 0.076, 0.0029, ratio).unwrap();
        TimeFree::new(friction, core::f64::consts::TAU / 16384.0, 1.0).unwrap()
    }

    #[test]
    fn slides_at_steady_deflection_and_reverses_elastically() {
        let observer = observer(0.7);
        let mut state = State::default();
        for _ in 0..200 {
            observer.step(&mut state, 1, 3.0);
        }
        let z_ss = observer.friction().z_ss_rad(3.0);
        // 4.34: the fixed point is z_ss.
        assert!((state.z_rad - z_ss).abs() < 1e-12);
        let sliding = state.z_rad;
        let back = observer.step(&mut state, -1, -3.0);
        assert_eq!(back, sliding - core::f64::consts::TAU / 16384.0);
    }

    #[test]
    fn rejects_what_cannot_be() {
        let observer = observer(0.7);
        let mut state = State::default();
        observer.step(&mut state, 2, 0.0);
        let z = state.z_rad;
        assert_eq!(observer.step(&mut state, 1, f64::NAN), z);
        assert_eq!(observer.step(&mut state, i32::MAX, 0.0), z);
        assert_eq!(observer.step(&mut state, i32::MIN, 0.0), z);
        assert_eq!(state.rejected, 3);
    }
}
