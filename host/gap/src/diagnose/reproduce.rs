//! How well the simulator reproduces the records: torque one step ahead, position over windows that start anew, position
//! in free run.
//!
//! One step ahead is what the fit sees, here on data that took no part in it. Windows and free run integrate the measured
//! effort on the virtual axis, with the parameters of all data. A window starts from the measured motion, bristles under
//! the load that the balance of torques gives; what its initial position and velocity may be wrong by, a straight line, is
//! taken off the error. A free run starts once, at rest or moving as the record does.

use super::axis_at::entries;
use super::hypothesis::Hypothesis;
use super::regime::Regime;
use super::tried::Search;
use super::{Closed, Outcome, closed_over};
use crate::believed::Noise;
use crate::error::InputError;
use crate::inverse::{Later, Point, Record, Stretch};
use bristle_plant::Unit;
use bristle_plant::drive::DriveConfig;
use rayon::prelude::*;
use serde::Serialize;
use std::ops::Range;

/// Lengths of windows, s.
const WINDOWS_S: [f64; 3] = [0.2, 0.6, 2.0];
/// Windows of a length cover no more than this of a record, s: evenly spread, more would only cost time.
const COVERED_S: f64 = 8.0;
/// An error grown by less than this is the same within rounding of positions.
const WORSE: f64 = 1.02;

/// What a hypothesis makes of one part of the data in one view.
#[derive(Clone, Debug, Serialize)]
pub struct Reproduced {
    /// Ids of the effects, joined by `+`.
    pub effect: String,
    /// `effort one step ahead`, `position over ... s`, `position in free run`.
    pub view: String,
    /// Name of a log, or `all`.
    pub log: String,
    /// What the axis does, or `all`.
    pub regime: &'static str,
    /// Of the three figures.
    pub unit: &'static str,
    /// Rms error of the refitted simulator.
    pub before: f64,
    /// With the effect.
    pub after: f64,
    /// Noise, as far as it is known in this view: of windows and free run, the encoder's alone.
    pub floor: f64,
    /// Share of the error that the effect takes away; one step ahead with its 90 % interval.
    pub closed_fraction: Closed,
    /// The effect makes it worse.
    pub worse: bool,
}

/// All views for the named effects; for the most probable one where none is named.
///
/// # Errors
/// The friction model refuses a parameter.
pub fn reproduced(outcome: &Outcome) -> Result<Vec<Reproduced>, InputError> {
    let search = &outcome.search;
    let ranked = &outcome.verdict.ranked;
    let places: Vec<usize> = if outcome.verdict.named.is_empty() {
        (0..ranked.len().min(1)).collect()
    } else {
        outcome.verdict.named.clone()
    };
    let (before, with) = rayon::join(
        || simulated(search, &search.base),
        || {
            let named = places.par_iter().map(|&place| &ranked[place].0);
            let with = named.map(|hypothesis| simulated(search, hypothesis));
            with.collect::<Result<Vec<_>, InputError>>()
        },
    );
    let (before, with) = (before?, with?);
    let mut all = Vec::new();
    for (place, after) in places.iter().zip(&with) {
        let hypothesis = &ranked[*place].0;
        one_step(search, hypothesis, &mut all);
        for (before, after) in before.iter().zip(after) {
            all.push(compared(search, hypothesis, before, after));
        }
    }
    Ok(all)
}

/// A row of the table of torque one step ahead, for each log and each regime.
fn one_step(search: &Search, hypothesis: &Hypothesis, out: &mut Vec<Reproduced>) {
    let mut row = |log: String, regime: &'static str, keep: &dyn Fn(&super::Node) -> bool| {
        let Some(part) = closed_over(search, &hypothesis.held_out, keep) else {
            return;
        };
        let [before, after, floor] = part.rms_nm;
        out.push(Reproduced {
            effect: hypothesis.ids().join("+"),
            view: "effort one step ahead".to_string(),
            log,
            regime,
            unit: search.scale.unit.effort(),
            before,
            after,
            floor,
            closed_fraction: part.closed,
            worse: after > WORSE * before,
        });
    };
    row("all".to_string(), "all", &|node| {
        node.regime != Regime::Rest
    });
    for (place, record) in search.records.iter().enumerate() {
        row(record.name.clone(), "all", &|node| {
            node.record == place && node.regime != Regime::Rest
        });
    }
    for regime in Regime::ALL {
        row("all".to_string(), regime.name(), &|node| {
            node.regime == regime
        });
    }
}

/// Squares of a view's position error on a record.
struct Error {
    view: String,
    record: usize,
    square: f64,
    samples: usize,
}

fn compared(search: &Search, hypothesis: &Hypothesis, before: &Error, after: &Error) -> Reproduced {
    let record = &search.records[before.record];
    let rms = |error: &Error| (error.square / error.samples.max(1) as f64).sqrt();
    let (before_rad, after_rad) = (rms(before), rms(after));
    let floor = record.position_noise_rad.min(after_rad).min(before_rad);
    let value = if before_rad > floor {
        (before_rad - after_rad) / (before_rad - floor)
    } else {
        0.0
    };
    Reproduced {
        effect: hypothesis.ids().join("+"),
        view: before.view.clone(),
        log: record.name.clone(),
        regime: "all",
        unit: search.scale.unit.position(),
        before: before_rad,
        after: after_rad,
        floor,
        closed_fraction: Closed {
            value,
            low: value,
            high: value,
        },
        worse: after_rad > WORSE * before_rad,
    }
}

/// Errors of all windows and of the free run, by record.
fn simulated(search: &Search, hypothesis: &Hypothesis) -> Result<Vec<Error>, InputError> {
    let point = hypothesis.model.at(&hypothesis.fit.at);
    let of_record = |(place, record): (usize, &Record)| {
        let mut errors = Vec::new();
        for length_s in WINDOWS_S {
            let ranges = windows(record, length_s);
            let parts = ranges
                .into_par_iter()
                .map(|(stretch, range)| {
                    let error = position_error(&point, record, place, stretch, &range)?;
                    Ok(without_line(error))
                })
                .collect::<Result<Vec<_>, InputError>>()?;
            if !parts.is_empty() {
                let view = format!("position over {length_s} s");
                errors.push(summed(view, place, parts));
            }
        }
        let parts = record
            .stretches
            .par_iter()
            .map(|stretch| {
                let whole = 0..stretch.effort_nm.len() - 1;
                position_error(&point, record, place, stretch, &whole)
            })
            .collect::<Result<Vec<_>, InputError>>()?;
        errors.push(summed("position in free run".to_string(), place, parts));
        Ok(errors)
    };
    let records = search.records.par_iter().enumerate();
    let errors: Vec<Vec<Error>> = records.map(of_record).collect::<Result<_, InputError>>()?;
    Ok(errors.into_iter().flatten().collect())
}

fn summed(view: String, record: usize, parts: Vec<Vec<f64>>) -> Error {
    let all = || parts.iter().flatten();
    Error {
        view,
        record,
        square: all().map(|x| x * x).sum(),
        samples: all().count(),
    }
}

/// Windows of a length, in which nothing is excluded.
fn windows(record: &Record, length_s: f64) -> Vec<(&Stretch, Range<usize>)> {
    let samples = ((length_s / record.step_s).round() as usize).max(8);
    let all: Vec<(&Stretch, Range<usize>)> = record
        .stretches
        .iter()
        .flat_map(|stretch| {
            (0..stretch.effort_nm.len().saturating_sub(1) / samples)
                .map(move |i| (stretch, i * samples..(i + 1) * samples))
        })
        .filter(|(stretch, range)| !stretch.excluded[range.clone()].contains(&true))
        .collect();
    let most = ((COVERED_S / length_s) as usize).max(1);
    let every = all.len().div_ceil(most).max(1);
    all.into_iter().step_by(every).collect()
}

/// The virtual axis under the measured effort of a range of samples: its position less the measured one, sample by
/// sample, the first excepted.
pub(super) fn position_error(
    point: &Point,
    record: &Record,
    place: usize,
    stretch: &Stretch,
    range: &Range<usize>,
) -> Result<Vec<f64>, InputError> {
    let mut believed = point.believed().clone();
    believed.effects = entries(point, place, believed.unit);
    // What the encoder cannot see is no error of the model; an effect that makes it coarser stays.
    believed.counts_per_turn = believed.counts_per_turn.max(match believed.unit {
        Unit::Rotary => f64::from(1 << 24),
        Unit::Linear => 1e9,
    });
    let step_s = record.step_s;
    let later = Later::new(point.skew_s() / step_s + record.delay_samples(believed.drive));
    believed.drive = DriveConfig {
        delay_samples: 0,
        ..record.drive(believed.drive)
    };
    let first = range.start;
    let velocity = &stretch.velocity_rad_s;
    let next = (first + 1).min(velocity.len() - 1);
    let acceleration = (velocity[next] - velocity[first]) / step_s;
    let effort = later.at(&stretch.effort_nm, first);
    let load_nm = effort
        - believed.whole_inertia_kg_m2() * acceleration
        - believed.viscous_nm_s_rad * velocity[first];
    let since_start = (stretch.start_s / step_s).round() as u64 + first as u64;
    let mut axis = believed
        .axis(believed.model, step_s, Noise::default(), 1)?
        .starting_at(stretch.smooth_rad[first], velocity[first])
        .resumed(since_start, load_nm, believed.stiffness_nm_rad);
    let rad_per_count = believed.rad_per_count();
    let mut errors = Vec::with_capacity(range.len());
    for k in range.clone() {
        let reading = axis.advance(later.at(&stretch.effort_nm, k));
        let position_rad = reading.counts as f64 * rad_per_count;
        if !position_rad.is_finite() {
            return Err(believed.diverged(stretch.start_s + k as f64 * step_s));
        }
        errors.push(position_rad - stretch.position_rad[k + 1]);
    }
    Ok(errors)
}

/// What is left of a signal beside the straight line through it.
fn without_line(mut values: Vec<f64>) -> Vec<f64> {
    let count = values.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = values.iter().sum::<f64>() / count;
    let (mut product, mut square) = (0.0, 0.0);
    for (k, x) in values.iter().enumerate() {
        let t = k as f64 - middle;
        product += t * x;
        square += t * t;
    }
    let slope = if square > 0.0 { product / square } else { 0.0 };
    for (k, x) in values.iter_mut().enumerate() {
        *x -= mean + slope * (k as f64 - middle);
    }
    values
}
