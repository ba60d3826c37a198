//! Position and speed loop in torque mode: a proportional position loop around a proportional-integral speed loop, with
//! the reference's own velocity fed forward.

use crate::error::{ParameterError, not_negative, positive};
use crate::experiment::Reference;
use crate::real::Real;

/// Crossover of the speed loop where nobody asks for another one, rad/s: 50 Hz.
pub const BANDWIDTH_RAD_S: f64 = 100.0 * core::f64::consts::PI;
/// Position gain and rate of the integral as a part of that crossover, which keeps the loops apart.
pub const FIFTH: f64 = 0.2;

/// Gains and limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cascade<T> {
    position_gain_1_s: T,
    velocity_gain_nm_s_rad: T,
    /// Of an error of 1 rad/s, in a tick.
    integral_gain_nm_s_rad: T,
    torque_limit_nm: T,
}

/// Integral of the speed error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    integral_nm: T,
}

impl<T: Real> State<T> {
    /// Adds to the torque of the loop from the next tick on. It stands with the integral, which costs the tick nothing, and
    /// within the room that the limit leaves to both.
    #[inline(always)]
    pub(crate) fn add(&mut self, torque_nm: T) {
        let sum = self.integral_nm + torque_nm;
        if sum.is_finite() {
            self.integral_nm = sum;
        }
    }
}

impl<T: Real> Cascade<T> {
    /// Position gain, 1/s; speed gain, N m s/rad; rate of the speed loop's integral, 1/s; torque limit, N m.
    ///
    /// # Errors
    /// A negative gain, or a limit or sample time not above zero.
    pub fn new(
        position_gain_1_s: T,
        velocity_gain_nm_s_rad: T,
        velocity_integral_1_s: T,
        torque_limit_nm: T,
        sample_time_s: T,
    ) -> Result<Self, ParameterError> {
        not_negative("velocity_integral_1_s", velocity_integral_1_s)?;
        Ok(Self {
            position_gain_1_s: not_negative("position_gain_1_s", position_gain_1_s)?,
            velocity_gain_nm_s_rad: not_negative("velocity_gain_nm_s_rad", velocity_gain_nm_s_rad)?,
            integral_gain_nm_s_rad: velocity_gain_nm_s_rad
                * velocity_integral_1_s
                * positive("sample_time_s", sample_time_s)?,
            torque_limit_nm: positive("torque_limit_nm", torque_limit_nm)?,
        })
    }

    /// A torque within the limit, N m.
    #[inline]
    pub fn limited(&self, torque_nm: T) -> T {
        torque_nm.within(self.torque_limit_nm)
    }

    /// Torque for a reference, given position (from where the experiment began) and velocity.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut State<T>,
        reference: Reference<T>,
        position_rad: T,
        velocity_rad_s: T,
    ) -> T {
        let wanted = match reference {
            Reference::Torque(torque_nm) => return self.limited(torque_nm),
            Reference::Velocity(velocity) => velocity,
            Reference::Position {
                position_rad: target,
                velocity_rad_s: feed_forward,
            } => feed_forward + self.position_gain_1_s * (target - position_rad),
        };
        let error = wanted - velocity_rad_s;
        let proportional = self.velocity_gain_nm_s_rad * error;
        let integral = state.integral_nm + self.integral_gain_nm_s_rad * error;
        // The integral may hold no more than what is left of the limit: it does not wind up.
        let room = (self.torque_limit_nm - proportional.abs()).most(T::ZERO);
        if integral.is_finite() {
            state.integral_nm = integral.within(room);
        }
        self.limited(proportional + state.integral_nm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INERTIA_KG_M2: f64 = 1e-4;

    fn cascade(torque_limit_nm: f64) -> Cascade<f64> {
        let slow = FIFTH * BANDWIDTH_RAD_S;
        let gain = INERTIA_KG_M2 * BANDWIDTH_RAD_S;
        Cascade::new(slow, gain, slow, torque_limit_nm, 1e-4).unwrap()
    }

    #[test]
    fn removes_a_constant_load() {
        let t = 1e-4;
        let loop_ = cascade(1.0);
        let mut state = State::default();
        let (mut q, mut v) = (0.0, 0.0);
        for _ in 0..20_000 {
            let reference = Reference::Position {
                position_rad: 1.0,
                velocity_rad_s: 0.0,
            };
            let u = loop_.step(&mut state, reference, q, v) - 0.2;
            v += t / INERTIA_KG_M2 * u;
            q += t * v;
        }
        // 2 s are 125 time constants of the slowest loop, 1/63 s.
        assert!((q - 1.0).abs() < 1e-9, "{q}");
    }

    #[test]
    fn does_not_wind_up() {
        let loop_ = cascade(0.1);
        let mut state = State::default();
        for _ in 0..100_000 {
            assert_eq!(
                loop_.step(&mut state, Reference::Velocity(100.0), 0.0, 0.0),
                0.1
            );
        }
        assert!(loop_.step(&mut state, Reference::Velocity(0.0), 0.0, 1.0) < 0.0);
    }

    #[test]
    fn limits_torque_and_survives_nan() {
        let loop_ = cascade(0.1);
        let mut state = State::default();
        assert_eq!(
            loop_.step(&mut state, Reference::Torque(5.0), 0.0, 0.0),
            0.1
        );
        loop_.step(&mut state, Reference::Velocity(f64::NAN), 0.0, 0.0);
        assert!(
            loop_
                .step(&mut state, Reference::Velocity(0.0), 0.0, 0.0)
                .is_finite()
        );
    }
}
