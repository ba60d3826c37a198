//! Any friction model of `core`, running: parameters and state behind one type, for an axis chosen at run time.

use bristle_core::friction::{Friction, Motion};

/// A friction model with its state.
pub trait Contact: Send {
    /// Advances by one step and gives the friction torque, N m.
    fn step(&mut self, motion: Motion<f64>) -> f64;
    /// See [`Friction::mean_over`].
    fn mean_over(&mut self, motion: Motion<f64>, level_nm: Option<f64>) -> f64;
    /// Bristle deflection, rad.
    fn deflection_rad(&self) -> f64;
    /// See [`Friction::HOLDS_AT_REST`].
    fn holds_at_rest(&self) -> bool;
    /// Friction torque after a long time at constant velocity, N m.
    fn steady_state_nm(&self, velocity_rad_s: f64) -> f64;
    /// See [`Friction::rescale`].
    fn rescale(&mut self, times: f64);
    /// The fastest rate of an inertia on it, where it is stiffer than what the axis was cut into steps for, 1/s.
    fn fastest_rate_1_s(&self, inertia_kg_m2: f64) -> f64 {
        let _ = inertia_kg_m2;
        0.0
    }
}

/// Where the steady-state curve of a friction model lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Levels {
    /// A speed just off rest, rad/s: the lowest quarter decade from 1 nrad/s at which the model slides.
    pub creep_rad_s: f64,
    /// Level at that speed, N m.
    pub stiction_nm: f64,
    /// Lowest level at any speed, N m: Coulomb friction, with what little of viscous friction the Stribeck fall leaves.
    pub coulomb_nm: f64,
    /// Viscous friction, N m s/rad.
    pub viscous_nm_s_rad: f64,
}

impl Levels {
    /// Of a model.
    pub fn of(contact: &dyn Contact) -> Self {
        let speeds = (0..=48).map(|k| 1e-9 * 10_f64.powf(0.25 * f64::from(k)));
        let mut levels = speeds
            .map(|v| (v, contact.steady_state_nm(v).abs()))
            .filter(|(_, level)| *level > 0.0);
        let (creep_rad_s, stiction_nm) = levels.next().unwrap_or((1e-9, 0.0));
        Self {
            creep_rad_s,
            stiction_nm,
            coulomb_nm: levels.fold(stiction_nm, |low, (_, level)| low.min(level)),
            viscous_nm_s_rad: viscous_nm_s_rad(contact),
        }
    }
}

/// A speed at which nothing is left of any Stribeck curve, rad/s.
const FAST_RAD_S: f64 = 1e3;

/// Viscous friction of a model.
fn viscous_nm_s_rad(contact: &dyn Contact) -> f64 {
    let fast_nm = [1.0, 2.0].map(|times| contact.steady_state_nm(times * FAST_RAD_S));
    (fast_nm[1] - fast_nm[0]) / FAST_RAD_S
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

    fn mean_over(&mut self, motion: Motion<f64>, level_nm: Option<f64>) -> f64 {
        self.model.mean_over(&mut self.state, motion, level_nm)
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

    fn rescale(&mut self, times: f64) {
        self.model.rescale(&mut self.state, times);
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

#[cfg(test)]
mod tests {
    use super::*;
    use bristle_core::friction::karnopp::Karnopp;
    use bristle_core::friction::stiction::GeneralStatic;
    use bristle_core::stribeck::{Shape, Stribeck};

    #[test]
    fn levels_are_those_of_the_curve() {
        let shape = Shape::Gaussian {
            velocity_rad_s: 0.3,
        };
        let curve = Stribeck::new(0.020, 0.026, shape).unwrap();
        let inner = contact(GeneralStatic::new(curve, 1e-4).unwrap());
        let levels = Levels::of(inner.as_ref());
        assert!((levels.stiction_nm - 0.026).abs() < 1e-12);
        // At 3 v_s the fall is down to exp(-9) and viscous friction adds 1e-4.
        assert!((levels.coulomb_nm - 0.020).abs() < 1.2e-4, "{levels:?}");
        let band = contact(Karnopp::new(0.02, 0.03, 1e-4, 0.01).unwrap());
        let levels = Levels::of(band.as_ref());
        assert!(levels.creep_rad_s >= 0.01 && (levels.coulomb_nm - 0.02).abs() < 1e-5);
    }
}
