//! A mass off the centre of what turns with the motor: gravity acts on it once a turn, whichever way it turns.
//!
//! tau + A sin(n q + p), A = m g r. On a linear axis n is the turns of its screw in a metre.
//!
//! Source: any text on mechanics, the torque of a pendulum.

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Unbalance {
    amplitude_nm: f64,
    wave_rad: f64,
    phase_rad: f64,
}

impl Effect for Unbalance {
    fn mechanics(&mut self, now: &Instant) -> f64 {
        let angle = self.wave_rad * now.motion.position_rad + self.phase_rad;
        self.amplitude_nm * angle.sin()
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "mechanics.unbalance",
    model: "tau + A sin(n q + p)",
    parameters: &[
        Parameter::new(["amplitude_nm", "amplitude_n"], Kind::Size, |scale| {
            [0.0, scale.coulomb_nm]
        }),
        Parameter::TURN,
        Parameter::PHASE,
    ],
    build: |values, unit| {
        Box::new(Unbalance {
            amplitude_nm: values[0],
            wave_rad: unit.wave_rad(values[1]),
            phase_rad: values[2],
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::at;
    use super::*;
    use crate::unit::Unit;
    use std::f64::consts::{FRAC_PI_2, TAU};

    #[test]
    fn comes_once_a_turn_at_any_velocity() {
        let mut effect = (ENTRY.build)(&[0.01, 1.0, 0.0], Unit::Rotary);
        let mut torque = |q, v| effect.mechanics(&at(q, v));
        assert!((torque(FRAC_PI_2, 0.0) - 0.01).abs() < 1e-15);
        assert!((torque(FRAC_PI_2 + TAU, 100.0) - 0.01).abs() < 1e-15);
        assert!((torque(-FRAC_PI_2, -100.0) + 0.01).abs() < 1e-15);
    }

    #[test]
    fn an_axis_hangs_down() {
        use super::super::testing;
        // Released near the top it swings to near the other side of the top, pi away from the bottom at q = pi.
        let effect = (ENTRY.build)(&[0.01, 1.0, 0.0], Unit::Rotary);
        let mut axis = testing::axis(testing::free(), vec![effect]).starting_at(0.1, 0.0);
        let mut highest = 0.0_f64;
        for _ in 0..20_000 {
            axis.advance(0.0);
            highest = highest.max(axis.truth().motion.position_rad);
        }
        // Energy is kept by the step to (w h)^2, w = 10 rad/s.
        assert!((highest - (TAU - 0.1)).abs() < 1e-4, "{highest}");
    }
}
