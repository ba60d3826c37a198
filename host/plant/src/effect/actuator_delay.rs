//! Dead time between a torque command and its torque beyond that of the drive that is believed.
//!
//! u(t - T); the exact mean over a step of a command held over its steps.
//!
//! Source: Ellis, "Control System Design Guide", 4th ed., ch. 4 (delays of digital drives).

use super::history::History;
use super::{Effect, Entry, Instant, Kind, Parameter};

struct Delay(Option<History>);

impl Effect for Delay {
    fn actuator(&mut self, now: &Instant) -> f64 {
        match &mut self.0 {
            Some(history) => history.mean(now.time_s, now.torque_nm),
            None => now.torque_nm,
        }
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "actuator.delay",
    model: "u(t - T)",
    parameters: &[Parameter::same("delay_s", Kind::Size, |_| [1e-4, 1e-2])],
    build: |values, _| Box::new(Delay((values[0] > 0.0).then(|| History::new(values[0])))),
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;
    use std::f64::consts::TAU;

    #[test]
    fn its_phase_is_linear_in_frequency_and_its_gain_one() {
        for hz in [5.0, 20.0] {
            let mut effect = (ENTRY.build)(&[3.3e-3], Unit::Rotary);
            for k in 0..2000 {
                let time_s = f64::from(k) * 1e-4;
                let out = effect.actuator(&Instant {
                    time_s,
                    step_s: 1e-4,
                    torque_nm: (TAU * hz * time_s).sin(),
                    ..Instant::default()
                });
                let expected = (TAU * hz * (time_s - 3.3e-3)).sin();
                // Linear between steps: (w h)^2/8, 2e-5 at 20 Hz.
                assert!(k < 40 || (out - expected).abs() < 2.5e-5, "{hz} {k}");
            }
        }
    }
}
