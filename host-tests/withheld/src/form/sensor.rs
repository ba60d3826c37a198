//! Listed effects of the position sensor.

use super::{
    ANY, Built, Entry, Form, History, NO_WISH, Now, ROTARY, SMALL, Shape, built, randomness,
};
use crate::axis::{Axis, Wanted};
use crate::draw::Draw;
use std::f64::consts::TAU;

const fn entry(
    id: &'static str,
    wanted: Wanted,
    shown_by: &'static [&'static str],
    build: fn(f64, &Shape, &Axis) -> Built,
) -> Entry {
    Entry {
        id,
        block: "sensor",
        resembles: None,
        wanted,
        shown_by,
        smallest: SMALL,
        build,
    }
}

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "sensor.eccentricity",
        ROTARY,
        &["ladder", "moves", "sine"],
        eccentricity,
    ),
    entry("sensor.quantization", NO_WISH, ANY, quantization),
    entry("sensor.delay", NO_WISH, &["multisine", "moves"], delay),
    entry(
        "sensor.lost_counts",
        NO_WISH,
        &["sine", "moves", "ladder"],
        lost_counts,
    ),
    entry(
        "sensor.jitter",
        NO_WISH,
        &["moves", "ladder", "sine"],
        jitter,
    ),
];

/// A disc off its centre, with a part of twice a turn.
struct Eccentricity {
    amplitude: f64,
    phase: f64,
    second: f64,
}

impl Form for Eccentricity {
    fn offset(&mut self, now: &Now) -> f64 {
        let wave = |q: f64| libm::sin(q + self.phase) + self.second * libm::sin(2.0 * q + 1.0);
        // Every record starts at zero.
        self.amplitude * (wave(now.q) - wave(0.0))
    }
}

fn eccentricity(size: f64, shape: &Shape, _: &Axis) -> Built {
    let amplitude = 0.05 * size;
    built(
        Eccentricity {
            amplitude,
            phase: TAU * shape[0],
            second: 0.15 * shape[1],
        },
        &[("amplitude_rad", amplitude)],
    )
}

/// A counter that drops its low digits.
struct Quantization {
    grid: f64,
}

impl Form for Quantization {
    fn sample(&mut self, _: &Now, reading: f64) -> f64 {
        (reading / self.grid).floor() * self.grid
    }
}

fn quantization(size: f64, _: &Shape, axis: &Axis) -> Built {
    // A whole number of counts, so that a count remains what a log can hold.
    let grid = axis.count
        * (size * if axis.linear { 1e-4 } else { 0.03 } / axis.count)
            .round()
            .max(2.0);
    built(Quantization { grid }, &[("step_rad", grid)])
}

/// A position that is late, by a little more where it is fast.
struct Delay {
    time_s: f64,
    history: History,
}

impl Form for Delay {
    fn reset(&mut self, _: &Axis) {
        self.history = History::new();
    }
    fn offset(&mut self, now: &Now) -> f64 {
        let wander = 1.0 + 0.03 * libm::sin(1.7 * now.t);
        self.history.delayed(now.q, self.time_s * wander, now.h) - now.q
    }
}

fn delay(size: f64, _: &Shape, _: &Axis) -> Built {
    let time_s = 0.012 * size;
    built(
        Delay {
            time_s,
            history: History::new(),
        },
        &[("delay_s", time_s)],
    )
}

/// Counts that go missing when a place is passed in one direction, two times of three.
struct LostCounts {
    lost: f64,
    every: f64,
    place: f64,
    shape: Shape,
    draw: Draw,
    turn: Option<f64>,
    sum: f64,
}

impl Form for LostCounts {
    fn reset(&mut self, _: &Axis) {
        self.draw = randomness(&self.shape);
        self.turn = None;
        self.sum = 0.0;
    }
    fn sample(&mut self, now: &Now, reading: f64) -> f64 {
        let turn = ((now.q - self.place) / self.every).floor();
        if self.turn.is_some_and(|last| turn > last) && self.draw.chance(0.67) {
            self.sum += self.lost;
        }
        self.turn = Some(turn);
        reading - self.sum
    }
}

fn lost_counts(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let counts = (size * if axis.linear { 2e-4 } else { 0.05 } / axis.count)
        .round()
        .max(1.0);
    let every = if axis.linear { axis.travel * 0.5 } else { TAU };
    let form = LostCounts {
        lost: counts * axis.count,
        every,
        place: every * (0.1 + 0.3 * shape[0]),
        shape: *shape,
        draw: randomness(shape),
        turn: None,
        sum: 0.0,
    };
    built(form, &[("lost_rad", counts * axis.count)])
}

/// Samples taken late by a random time, most of them by little.
struct Jitter {
    time_s: f64,
    shape: Shape,
    draw: Draw,
}

impl Form for Jitter {
    fn reset(&mut self, _: &Axis) {
        self.draw = randomness(&self.shape);
    }
    fn sample(&mut self, now: &Now, reading: f64) -> f64 {
        let x = self.draw.normal();
        // Longer tails than a normal distribution has.
        reading + now.v * self.time_s * x * (0.7 + 0.3 * x.abs())
    }
}

fn jitter(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let time_s = size * 1e-3f64.min(0.5 / axis.rate_hz);
    built(
        Jitter {
            time_s,
            shape: *shape,
            draw: randomness(shape),
        },
        &[("jitter_s", time_s)],
    )
}
