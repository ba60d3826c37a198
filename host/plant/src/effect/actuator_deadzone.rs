//! A drive that gives no torque for a small command.
//!
//! 0 for |u| < d, beyond it u - (1 - j) d sgn(u): continuous for a jump share j of 0, the whole command for 1.
//!
//! Source: Tao, Kokotovic, "Adaptive Control of Systems with Actuator and Sensor Nonlinearities", Wiley, 1996, ch. 2.

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Deadzone {
    width_nm: f64,
    jump_share: f64,
}

impl Effect for Deadzone {
    fn actuator(&mut self, now: &Instant) -> f64 {
        let u = now.torque_nm;
        if u.abs() < self.width_nm {
            0.0
        } else {
            u - ((1.0 - self.jump_share) * self.width_nm).copysign(u)
        }
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "actuator.deadzone",
    model: "0 for |u| < d, else u - (1 - j) d sgn(u)",
    parameters: &[
        Parameter::new(["width_nm", "width_n"], Kind::Size, |scale| {
            [0.0, 0.6 * scale.coulomb_nm]
        }),
        Parameter::same("jump_share", Kind::Shape, |_| [0.0, 1.0]),
    ],
    build: |values, _| {
        Box::new(Deadzone {
            width_nm: values[0].abs(),
            jump_share: values[1],
        })
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    fn out(jump_share: f64, torque_nm: f64) -> f64 {
        let mut effect = (ENTRY.build)(&[0.01, jump_share], Unit::Rotary);
        effect.actuator(&Instant {
            torque_nm,
            ..Instant::default()
        })
    }

    #[test]
    fn small_commands_are_lost() {
        assert_eq!([out(0.0, 0.0099), out(1.0, -0.0099)], [0.0, 0.0]);
        assert!((out(0.0, 0.05) - 0.04).abs() < 1e-17);
        assert!((out(0.0, -0.05) + 0.04).abs() < 1e-17);
        assert!((out(1.0, -0.05) + 0.05).abs() < 1e-17);
    }
}
