//! Any friction model of `core`, running: parameters and state behind one type, for an axis chosen at run time.

use bristle_core::friction::{Friction, Motion};

/// A friction model with its state.
pub trait Contact: Send {
    /// Advances by one step and gives the friction torque, N m.
    fn step(&mut self, motion: Motion<f64>) -> f64;
    /// Bristle deflection, rad.
    fn deflection_rad(&self) -> f64;
    /// See [`Friction::HOLDS_AT_REST`].
    fn holds_at_rest(&self) -> bool;
    /// Friction torque after a long time at constant velocity, N m.
    fn steady_state_nm(&self, velocity_rad_s: f64) -> f64;
}

struct Running<F: Friction<f64>> {
    model: F,
    state: F::State,
}

impl<F> Contact for Running<F>
where
    F: Friction<f64> + Send,
    F::State: Send,
{
    fn step(&mut self, motion: Motion<f64>) -> f64 {
        self.model.step(&mut self.state, motion)
    }

    fn deflection_rad(&self) -> f64 {
        self.model.deflection_rad(&self.state)
    }

    fn holds_at_rest(&self) -> bool {
        F::HOLDS_AT_REST
    }

    fn steady_state_nm(&self, velocity_rad_s: f64) -> f64 {
        self.model.steady_state_nm(velocity_rad_s)
    }
}

/// A model at rest without load.
pub fn contact<F>(model: F) -> Box<dyn Contact>
where
    F: Friction<f64> + Send + 'static,
    F::State: Send,
{
    Box::new(Running {
        model,
        state: F::State::default(),
    })
}
