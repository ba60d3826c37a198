//! Forms of the effects. The listed ones go by the catalogue's ids and have other shapes than its own: harmonics, smooth
//! edges, other exponents. The foreign ones are in no catalogue; some resemble a listed one.
//!
//! Every form has one size above 0 and up to 1: at 0 it is not there, at 1 it is as strong as practice knows. The
//! numbers of its shape are drawn once a case.

mod actuator;
mod foreign;
mod friction;
mod mechanics;
mod sensor;

use crate::axis::{Axis, Wanted};
use crate::draw::Draw;
use crate::friction::{Friction, Level};
use std::f64::consts::TAU;

/// What a form sees of a substep.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Now {
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) q: f64,
    pub(crate) v: f64,
    /// Torque of the drive as measured.
    pub(crate) u: f64,
    pub(crate) friction: f64,
    /// How long it has been at rest.
    pub(crate) rest_s: f64,
}

/// A second inertia.
pub(crate) struct Coupling {
    pub(crate) load_share: f64,
    /// Torque for a twist and its rate.
    pub(crate) torque: Box<dyn Fn(f64, f64) -> f64 + Send>,
}

/// What a form may change of the axis before a run.
pub(crate) struct Body {
    pub(crate) friction: Friction,
    pub(crate) coupling: Option<Coupling>,
}

/// Where a form takes hold; it passes on what it does not change.
pub(crate) trait Form: Send {
    /// Starts a log.
    fn reset(&mut self, _: &Axis) {}
    /// Changes the axis itself.
    fn configure(&self, _: &mut Body) {}
    /// Torque that reaches the rotor.
    fn actuator(&mut self, _: &Now, u: f64) -> f64 {
        u
    }
    /// Torque added on the rotor.
    fn torque(&self, _: &Now) -> f64 {
        0.0
    }
    /// Level of friction.
    fn level(&self, _: &Now, _: &mut Level) {}
    /// Velocity that friction follows.
    fn friction_velocity(&self, v: f64) -> f64 {
        v
    }
    /// Factor on the inertia, and its slope over position.
    fn inertia(&self, _: &Now) -> (f64, f64) {
        (1.0, 0.0)
    }
    /// Sensed less true position.
    fn offset(&mut self, _: &Now) -> f64 {
        0.0
    }
    /// What the sensor makes of a position when it is sampled.
    fn sample(&mut self, _: &Now, reading: f64) -> f64 {
        reading
    }
    /// Moves its state on by a substep.
    fn advance(&mut self, _: &Now) {}
}

/// Numbers of a shape, each from 0 to 1.
pub(crate) type Shape = [f64; 6];

/// A form with what it is called in the catalogue's names for a rotary axis.
pub(crate) struct Built {
    pub(crate) form: Box<dyn Form>,
    pub(crate) parameters: Vec<(&'static str, f64)>,
}

fn built(form: impl Form + 'static, parameters: &[(&'static str, f64)]) -> Built {
    Built {
        form: Box::new(form),
        parameters: parameters.to_vec(),
    }
}

/// A form in the lists.
pub(crate) struct Entry {
    /// Id; of a listed form the catalogue's.
    pub(crate) id: &'static str,
    /// Where it takes hold: the catalogue's blocks.
    pub(crate) block: &'static str,
    /// The listed effect that a foreign one resembles.
    pub(crate) resembles: Option<&'static str>,
    /// Axis that can have it.
    pub(crate) wanted: Wanted,
    /// Experiments of which the case has at least one.
    pub(crate) shown_by: &'static [&'static str],
    /// Smallest size that practice knows.
    pub(crate) smallest: f64,
    /// Makes it at a size.
    pub(crate) build: fn(f64, &Shape, &Axis) -> Built,
}

/// Ids of the listed forms.
pub const LISTED: [&str; 31] = ids(
    friction::ENTRIES,
    mechanics::ENTRIES,
    actuator::ENTRIES,
    sensor::ENTRIES,
);
/// Ids of the foreign forms.
pub const FOREIGN: [&str; 8] = ids(foreign::ENTRIES, &[], &[], &[]);

const fn ids<const N: usize>(
    a: &[Entry],
    b: &[Entry],
    c: &[Entry],
    d: &[Entry],
) -> [&'static str; N] {
    let lists = [a, b, c, d];
    let mut ids = [""; N];
    let (mut list, mut i, mut k) = (0, 0, 0);
    while list < 4 {
        if i < lists[list].len() {
            ids[k] = lists[list][i].id;
            k += 1;
            i += 1;
        } else {
            list += 1;
            i = 0;
        }
    }
    assert!(k == N, "the length says how many there are");
    ids
}

/// The form of an id.
pub(crate) fn entry(id: &str) -> Option<&'static Entry> {
    [
        friction::ENTRIES,
        mechanics::ENTRIES,
        actuator::ENTRIES,
        sensor::ENTRIES,
        foreign::ENTRIES,
    ]
    .into_iter()
    .flatten()
    .find(|entry| entry.id == id)
}

/// Smallest size of most forms: far below any noise.
const SMALL: f64 = 1e-4;
/// Any experiment will do.
const ANY: &[&str] = &[];
const NO_WISH: Wanted = Wanted {
    is_static: false,
    bristles: false,
    flat: false,
    linear: None,
};
const ROTARY: Wanted = Wanted {
    linear: Some(false),
    ..NO_WISH
};

/// A wave with two harmonics, of amplitude near 1 and mean 0.
#[derive(Clone, Copy)]
struct Wave {
    order: f64,
    phase: f64,
    second: f64,
    third: f64,
}

impl Wave {
    fn new(order: f64, shape: &Shape) -> Self {
        Self {
            order,
            phase: TAU * shape[0],
            second: 0.1 + 0.2 * shape[1],
            third: -0.15 * shape[2],
        }
    }

    fn at(&self, q: f64) -> f64 {
        let x = self.order * q + self.phase;
        libm::sin(x) + self.second * libm::sin(2.0 * x + 1.0) + self.third * libm::sin(3.0 * x)
    }
}

/// Waves a rad, of a whole number of waves a turn, or of a screw on a linear axis; and the same a turn or a metre.
fn order(axis: &Axis, choice: f64, list: &[f64]) -> (f64, f64) {
    if axis.linear {
        // Screws of 5 to 20 mm.
        let per_m = 1.0 / (0.005 * libm::pow(4.0, choice));
        (TAU * per_m, per_m)
    } else {
        let n = list[((choice * list.len() as f64) as usize).min(list.len() - 1)];
        (n, n)
    }
}

/// max(x, 0) with an edge of width `edge`.
fn ramp(x: f64, edge: f64) -> f64 {
    let y = x / edge;
    if y > 30.0 {
        x
    } else if y < -30.0 {
        0.0
    } else {
        edge * libm::log1p(libm::exp(y))
    }
}

/// The last stretch of a signal, to be read with a delay.
struct History {
    values: Vec<f64>,
    next: usize,
}

impl History {
    fn new() -> Self {
        Self {
            values: Vec::new(),
            next: 0,
        }
    }

    /// Takes a value a substep, gives the one of `delay_s` ago.
    fn delayed(&mut self, value: f64, delay_s: f64, h: f64) -> f64 {
        let back = delay_s / h;
        let length = back.ceil() as usize + 2;
        if self.values.len() < length {
            // The past before the start is as the start; a change of delay within a run only wanders by a part.
            self.values = vec![value; 2 * length];
            self.next = 0;
        }
        let size = self.values.len();
        self.values[self.next] = value;
        let at = |i: usize| self.values[(self.next + size - i) % size];
        let whole = back.floor();
        let part = back - whole;
        let result = (1.0 - part) * at(whole as usize) + part * at(whole as usize + 1);
        self.next = (self.next + 1) % size;
        result
    }
}

/// Random numbers of a form, the same in every run.
fn randomness(shape: &Shape) -> Draw {
    Draw::new(shape[5].to_bits(), 77)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_to_a_part_of_a_step() {
        let mut history = History::new();
        let mut last = 0.0;
        for k in 0..100 {
            last = history.delayed(f64::from(k), 2.5, 1.0);
        }
        assert_eq!(last, 96.5);
    }

    #[test]
    fn every_id_has_a_form_and_a_known_likeness() {
        for id in LISTED.iter().chain(&FOREIGN) {
            let entry = entry(id).unwrap();
            assert!(
                entry.resembles.is_none_or(|like| LISTED.contains(&like)),
                "{id}"
            );
        }
    }
}
