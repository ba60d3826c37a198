//! Counts that are lost: at a bad spot of the disc or scale each time it passes, and once at an instant.
//!
//! q - a n(q) - e for t >= t_e, n how often the place has been passed upward less downward: once a turn, on a linear axis
//! at one place of the scale. Passing back gives the counts back; where `given_back` is 0, it does not, and n is how often the
//! place has been passed upward, each time from as far below as it loses.
//!
//! Source: makers' notes on contaminated incremental encoders.

use super::{Effect, Entry, Instant, Kind, Parameter};
use crate::unit::Unit;
use std::f64::consts::{PI, TAU};

struct LostCounts {
    lost_rad: f64,
    place_rad: f64,
    unit: Unit,
    given_back: bool,
    event_rad: f64,
    event_s: f64,
    /// Places below the axis at its start, and after what it has passed last.
    start: Option<f64>,
    passed: f64,
    /// Passed upward.
    upward: f64,
}

impl LostCounts {
    /// How many of its places lie below.
    fn below(&self, position_rad: f64) -> f64 {
        match self.unit {
            Unit::Rotary => ((position_rad - self.place_rad) / TAU).floor(),
            Unit::Linear => f64::from(u8::from(position_rad >= self.place_rad)),
        }
    }

    /// How often the place has been passed.
    fn times(&mut self, position_rad: f64) -> f64 {
        let below = self.below(position_rad);
        let start = *self.start.get_or_insert_with(|| {
            self.passed = below;
            below
        });
        if self.given_back {
            return below - start;
        }
        if below > self.passed {
            self.upward += below - self.passed;
            self.passed = below;
        }
        self.passed = self
            .passed
            .min(self.below(position_rad + self.lost_rad.abs()));
        self.upward
    }
}

impl Effect for LostCounts {
    fn sensor(&mut self, now: &Instant) -> f64 {
        let q = now.motion.position_rad;
        let times = self.times(q);
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
        Parameter::same("given_back", Kind::Form, |_| [0.0, 1.0]).or(1.0),
    ],
    build: |values, unit| {
        Box::new(LostCounts {
            lost_rad: values[0],
            place_rad: values[1],
            unit,
            event_rad: values[2],
            event_s: values[3],
            given_back: values[4] > 0.5,
            start: None,
            passed: 0.0,
            upward: 0.0,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::at;
    use super::*;

    #[test]
    fn steps_once_a_turn_and_back() {
        let mut effect = (ENTRY.build)(&[0.01, 1.0, 0.0, 0.0, 1.0], Unit::Rotary);
        let mut lost = |q| q - effect.sensor(&at(q, 0.0));
        assert_eq!(lost(0.0), 0.0);
        for (q, times) in [(0.99, 0.0), (1.01, 1.0), (7.2, 1.0), (7.4, 2.0), (0.0, 0.0)] {
            assert!((lost(q) - 0.01 * times).abs() < 1e-14, "{q}");
        }
    }

    #[test]
    fn once_a_turn_upward_and_none_back() {
        let mut effect = (ENTRY.build)(&[0.01, 1.0, 0.0, 0.0, 0.0], Unit::Rotary);
        let mut lost = |q| q - effect.sensor(&at(q, 0.0));
        assert_eq!(lost(0.0), 0.0);
        // Back by less than what is lost is no new pass.
        let passes = [
            (1.01, 1.0),
            (0.995, 1.0),
            (1.01, 1.0),
            (0.9, 1.0),
            (1.01, 2.0),
            (7.4, 3.0),
            (0.0, 3.0),
        ];
        for (q, times) in passes {
            assert!((lost(q) - 0.01 * times).abs() < 1e-14, "{q}");
        }
    }

    #[test]
    fn an_event_stays() {
        let mut effect = (ENTRY.build)(&[0.0, 0.0, 0.02, 3.0, 1.0], Unit::Linear);
        let mut seen = |time_s| {
            effect.sensor(&Instant {
                time_s,
                ..Instant::default()
            })
        };
        assert_eq!([seen(2.99), seen(3.0), seen(9.0)], [0.0, -0.02, -0.02]);
    }
}
