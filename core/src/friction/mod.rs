//! Friction models, one a file, each with its parameters, state, steady-state curve and source.
//!
//! Sign: friction torque is counted positive against positive velocity, so that J dv/dt = u - F.

pub mod armstrong;
pub mod bliman_sorine;
pub mod bristle;
pub mod coulomb;
pub mod dahl;
pub mod elasto_plastic;
pub mod elasto_plastic_fixed;
pub mod karnopp;
pub mod lugre;
mod presliding;
pub mod stiction;

pub use elasto_plastic::ElastoPlastic;

use crate::Real;
use crate::error::{ParameterError, require};

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

impl<T: Real> Motion<T> {
    /// Whether a model can take the step: all finite, up to 1e30 rad/s, and from 0 to 1e6 s long.
    ///
    /// The limits keep every product of a model finite in f32. A model that is given anything else
    /// leaves its state as it is and answers with the torque that state holds at rest without load.
    #[inline]
    pub fn is_usable(&self) -> bool {
        self.velocity_rad_s.abs() <= T::of(1e30)
            && self.applied_nm.is_finite()
            && self.dt_s >= T::ZERO
            && self.dt_s <= T::of(1e6)
    }

    /// Torque of a model that is defined at rest by the applied torque, up to `hold_nm`, and else by velocity.
    #[inline]
    pub(crate) fn hold_or_slide(&self, hold_nm: T, slide: impl FnOnce(T) -> T) -> T {
        if !self.is_usable() {
            T::ZERO
        } else if self.velocity_rad_s == T::ZERO {
            self.applied_nm.within(hold_nm)
        } else {
            slide(self.velocity_rad_s)
        }
    }

    /// Displacement in the step, limited to what bristles of deflection `z_max` can tell apart.
    ///
    /// Beyond `z_max` / epsilon the deflection is at its steady state, and products would overflow.
    #[inline]
    pub(crate) fn displacement_rad(&self, z_max: T) -> T {
        (self.velocity_rad_s * self.dt_s).within(z_max / T::EPSILON)
    }
}

/// Passes on a stiffness that gives deflections whose squares f32 can hold.
fn stiffness<T: Real>(
    stiffness_nm_rad: T,
    least_nm: T,
    largest_nm: T,
) -> Result<T, ParameterError> {
    require(
        "stiffness_nm_rad",
        stiffness_nm_rad,
        stiffness_nm_rad > T::ZERO
            && least_nm / stiffness_nm_rad >= T::of(1e-12)
            && largest_nm / stiffness_nm_rad <= T::of(1e6),
        "above zero and give deflections (friction / stiffness) of 1e-12 to 1e6 rad",
    )
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

    /// Advances by a step that may be long beside what the state needs to change, and gives the mean friction torque over it,
    /// N m. `level_nm` is that of dry friction in sliding at this velocity, where it is known already.
    ///
    /// Where a model does not say better, the torque half-way.
    fn mean_over(&self, state: &mut Self::State, motion: Motion<T>, level_nm: Option<T>) -> T {
        let _ = level_nm;
        let half = Motion {
            dt_s: T::of(0.5) * motion.dt_s,
            ..motion
        };
        let friction_nm = self.step(state, half);
        self.step(state, half);
        friction_nm
    }

    /// Friction torque after a long time at constant velocity, N m. At zero velocity: zero.
    fn steady_state_nm(&self, velocity_rad_s: T) -> T;

    /// Mean deflection of the bristles z, rad; zero for models without one.
    fn deflection_rad(&self, state: &Self::State) -> T {
        let _ = state;
        T::ZERO
    }

    /// Multiplies the deflection of the bristles and the load that they bear; nothing for models without bristles.
    fn rescale(&self, state: &mut Self::State, times: T) {
        let _ = (state, times);
    }
}
