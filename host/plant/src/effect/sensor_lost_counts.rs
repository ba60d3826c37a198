//! Counts that are lost: at a bad spot of the disc or scale each time it passes, and once at an instant.
//!
//! q - a n(q) - e for t >= t_e, n how often the place has been passed upward less downward: once a turn, on a linear axis
//! at one place of the scale. Passing back gives the counts back.
//!
//! Source: makers' notes on contaminated incremental encoders.

use super::{Effect, Entry, Instant, Kind, Parameter};
use crate::unit::Unit;
use std::f64::consts::{PI, TAU};

struct LostCounts {
    lost_rad: f64,
    place_rad: f64,
    unit: Unit,
    event_rad: f64,
    event_s: f64,
    start: Option<f64>,
}

impl Effect for LostCounts {
    fn sensor(&mut self, now: &Instant) -> f64 {
        let q = now.motion.position_rad;
        let passed = match self.unit {
            Unit::Rotary => ((q - self.place_rad) / TAU).floor(),
            Unit::Linear => f64::from(u8::from(q >= self.place_rad)),
        };
        let times = passed - *self.start.get_or_insert(passed);
        let event = if now.time_s >= self.event_s {
            self.event_rad
        } else {
            0.0
        };
        q - self.lost_rad * times - event
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "sensor.lost_counts",
    model: "q - a passes(q) - e (t >= t_e)",
    parameters: &[
        Parameter::new(["lost_rad", "lost_m"], Kind::Size, |scale| {
            [scale.rad_per_count, 100.0 * scale.rad_per_count]
        }),
        Parameter::new(["place_rad", "place_m"], Kind::Place, |scale| {
            scale.either([-PI, PI], [scale.lowest_rad, scale.highest_rad])
        }),
        Parameter::new(["event_rad", "event_m"], Kind::Size, |scale| {
            let most = 100.0 * scale.rad_per_count;
            [-most, most]
        }),
        Parameter::same("event_s", Kind::Event, |scale| [0.0, scale.duration_s]),
    ],
    build: |values, unit| {
        Box::new(LostCounts {
            lost_rad: values[0],
            place_rad: values[1],
            unit,
            event_rad: values[2],
            event_s: values[3],
            start: None,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::at;
    use super::*;

    #[test]
    fn steps_once_a_turn_and_back() {
        let mut effect = (ENTRY.build)(&[0.01, 1.0, 0.0, 0.0], Unit::Rotary);
        let mut lost = |q| q - effect.sensor(&at(q, 0.0));
        assert_eq!(lost(0.0), 0.0);
        for (q, times) in [(0.99, 0.0), (1.01, 1.0), (7.2, 1.0), (7.4, 2.0), (0.0, 0.0)] {
            assert!((lost(q) - 0.01 * times).abs() < 1e-14, "{q}");
        }
    }

    #[test]
    fn an_event_stays() {
        let mut effect = (ENTRY.build)(&[0.0, 0.0, 0.02, 3.0], Unit::Linear);
        let mut seen = |time_s| {
            effect.sensor(&Instant {
                time_s,
                ..Instant::default()
            })
        };
        assert_eq!([seen(2.99), seen(3.0), seen(9.0)], [0.0, -0.02, -0.02]);
    }
}
