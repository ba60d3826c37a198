//! A position that is old when it is read: a serial encoder, a filter, a late stamp.
//!
//! q(t - T), by a cubic through the four nearest samples. Without a torque sensor it cannot be told from `actuator.delay`.
//!
//! Source: Ellis, "Control System Design Guide", 4th ed., ch. 14 (feedback delay).

use super::history::History;
use super::{Effect, Entry, Instant, Kind, Parameter};

struct Delay(Option<History>);

impl Effect for Delay {
    fn sensor(&mut self, now: &Instant) -> f64 {
        let q = now.motion.position_rad;
        match &mut self.0 {
            Some(history) => history.smooth(now.time_s, q),
            None => q,
        }
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "sensor.delay",
    model: "q(t - T)",
    parameters: &[Parameter::same("delay_s", Kind::Size, |_| [1e-4, 1e-2])],
    build: |values, _| Box::new(Delay((values[0] > 0.0).then(|| History::new(values[0])))),
};

#[cfg(test)]
mod tests {
    use super::super::testing::at;
    use super::*;
    use crate::unit::Unit;
    use std::f64::consts::TAU;

    #[test]
    fn reads_the_position_of_before_at_any_rate() {
        for step_s in [1e-4, 1e-3, 2e-3] {
            let mut effect = (ENTRY.build)(&[1.3e-3], Unit::Rotary);
            for k in 0..(0.5 / step_s) as i32 {
                let time_s = f64::from(k) * step_s;
                let position = |t: f64| (TAU * 2.0 * t).sin();
                let seen = effect.sensor(&Instant {
                    time_s,
                    step_s,
                    ..at(position(time_s), 0.0)
                });
                // (w h)^4/16 of 1 rad, w h = 0.025, where the delay falls into the last interval.
                let error = (seen - position(time_s - 1.3e-3)).abs();
                assert!(
                    time_s < 1.3e-3 + 4.0 * step_s || error < 3e-8,
                    "{step_s} {time_s}: {error:e}"
                );
            }
        }
    }
}
