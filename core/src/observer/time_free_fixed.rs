//! The discrete time-free observer in 32-bit fixed point.
//!
//! The law and the source are those of [`super::time_free`], the scaling that of
//! [`crate::friction::elasto_plastic_fixed`]. Counts are exact here, so z is the same bit for bit whatever the distance
//! travelled.

use core::hint::cold_path;

use crate::error::{ParameterError, require};
use crate::friction::elasto_plastic_fixed::{ElastoPlasticFixed, Share};
use fixed::types::I16F16;

/// The observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeFreeFixed {
    friction: ElastoPlasticFixed,
    largest_step: u32,
}

/// Deflection, and how many samples were rejected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// z, counts.
    pub z_counts: I16F16,
    /// Samples whose step was not believed; the deflection was kept.
    pub rejected: u32,
}

impl TimeFreeFixed {
    /// The model, and the longest step in counts that an axis can make in a sample.
    ///
    /// # Errors
    /// A longest step outside 1 to 16383 counts.
    pub fn new(friction: ElastoPlasticFixed, largest_step: i32) -> Result<Self, ParameterError> {
        require(
            "largest_step_counts",
            f64::from(largest_step),
            (1..1 << 14).contains(&largest_step),
            "1 to 16383",
        )?;
        Ok(Self {
            friction,
            largest_step: largest_step.unsigned_abs(),
        })
    }

    /// Takes the step in counts since the last sample and a filtered speed in counts per sample, and gives z in counts.
    #[inline]
    pub fn step(&self, state: &mut State, step_counts: i32, speed: I16F16) -> I16F16 {
        if step_counts.unsigned_abs() > self.largest_step {
            cold_path();
            state.rejected = state.rejected.saturating_add(1);
            return state.z_counts;
        }
        let z = state.z_counts;
        if step_counts == 0 {
            return z;
        }
        let dq = I16F16::from_bits(step_counts << 16);
        let place = self.friction.place(speed.saturating_abs());
        let share = self
            .friction
            .share_along(z, self.friction.per_z_ss(place), dq);
        let next = if share >= Share::ONE {
            self.friction.z_ss_along(place, z)
        } else {
            let elastic = Share::ONE.wrapping_sub(self.friction.alpha(share).wrapping_mul(share));
            let moved = (i64::from(dq.to_bits()) * i64::from(elastic.to_bits())) >> 29;
            z.saturating_add(I16F16::from_bits(moved as i32))
        };
        state.z_counts = self.friction.within(next);
        state.z_counts
    }
}
