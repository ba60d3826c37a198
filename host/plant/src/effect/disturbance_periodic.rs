//! A torque that comes with time and not with angle: a fan, a pump, a floor that shakes.
//!
//! tau + A sin(2 pi f t + p), t since the start of the record; the exact mean over a step.
//!
//! Source: any text on vibration; the mean of a sine over h is sin(x)/x of its middle, x = pi f h.

use super::{Effect, Entry, Instant, Kind, Parameter};
use std::f64::consts::{PI, TAU};

struct Periodic {
    amplitude_nm: f64,
    frequency_hz: f64,
    phase_rad: f64,
}

impl Effect for Periodic {
    fn mechanics(&mut self, now: &Instant) -> f64 {
        let half = PI * self.frequency_hz * now.step_s;
        let share = if half == 0.0 { 1.0 } else { half.sin() / half };
        let angle = TAU * self.frequency_hz * now.time_s + half + self.phase_rad;
        self.amplitude_nm * share * angle.sin()
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "disturbance.periodic",
    model: "tau + A sin(2 pi f t + p)",
    parameters: &[
        Parameter::new(["amplitude_nm", "amplitude_n"], Kind::Size, |scale| {
            [0.0, scale.coulomb_nm]
        }),
        Parameter::same("frequency_hz", Kind::Frequency, |scale| {
            [0.1, 0.4 / scale.sample_time_s]
        })
        .or(1.0),
        Parameter::PHASE,
    ],
    build: |values, _| {
        Box::new(Periodic {
            amplitude_nm: values[0],
            frequency_hz: values[1],
            phase_rad: values[2],
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::at;
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn repeats_in_time_wherever_the_axis_is() {
        let mut effect = (ENTRY.build)(&[0.01, 5.0, 0.0], Unit::Rotary);
        let mut torque = |time_s, q| {
            effect.mechanics(&Instant {
                time_s,
                step_s: 1e-6,
                ..at(q, 10.0)
            })
        };
        // A step of 1 us shifts the phase by half a step, 1.6e-5 rad.
        assert!((torque(0.05, 0.0) - 0.01).abs() < 1e-8);
        assert!((torque(0.05, 2.7) - torque(0.05, 0.0)).abs() < 1e-18);
        assert!((torque(0.15, 0.0) + 0.01).abs() < 1e-8);
        assert!((torque(0.033, 1.0) - torque(0.233, 1.0)).abs() < 1e-15);
    }

    #[test]
    fn a_long_step_has_the_mean_of_short_ones() {
        let mut effect = (ENTRY.build)(&[0.01, 80.0, 0.4], Unit::Rotary);
        let mut torque = |time_s, step_s| {
            effect.mechanics(&Instant {
                time_s,
                step_s,
                ..Instant::default()
            })
        };
        let long = torque(0.1, 2e-3);
        let mean = (0..200)
            .map(|k| torque(0.1 + f64::from(k) * 1e-5, 1e-5))
            .sum::<f64>()
            / 200.0;
        assert!((long - mean).abs() < 1e-14);
    }
}
