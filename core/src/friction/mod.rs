//! Friction models, one a file, each with its parameters, state, steady-state curve and source.
//!
//! Sign: friction torque is counted positive against positive velocity, so that J dv/dt = u - F.

pub mod elasto_plastic;
pub mod elasto_plastic_fixed;
mod presliding;

pub use elasto_plastic::ElastoPlastic;

use crate::Real;

/// What a friction model sees of one time step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion<T> {
    /// Velocity during the step.
    pub velocity_rad_s: T,
    /// Sum of all torques but friction; models that are defined at rest by the applied torque need it.
    pub applied_nm: T,
    /// Length of the step.
    pub dt_s: T,
}

/// A friction model: parameters that do not change, and a state that a step advances.
pub trait Friction<T: Real> {
    /// What the model remembers; its default is at rest without load.
    type State: Clone + Default;

    /// The torque at rest is defined by the applied torque, at a velocity of exactly zero. Who integrates the axis must
    /// bring a velocity that changes sign to zero first.
    const HOLDS_AT_REST: bool;

    /// Advances the state by one step and gives the friction torque in it, N m.
    fn step(&self, state: &mut Self::State, motion: Motion<T>) -> T;

    /// Friction torque after a long time at constant velocity, N m. At zero velocity: zero.
    fn steady_state_nm(&self, velocity_rad_s: T) -> T;

    /// Mean deflection of the bristles z, rad; zero for models without one.
    fn deflection_rad(&self, state: &Self::State) -> T {
        let _ = state;
        T::ZERO
    }
}
