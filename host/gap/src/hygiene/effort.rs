//! Effort columns that are zero, and stretches where the effort stands at its limit.

use super::{Code, Hygiene, Severity, many};
use crate::axis_file::AxisFile;
use crate::error::InputError;
use crate::log::{EffortKind, Log};
use crate::signal::extent;
use std::ops::Range;

/// A plateau shorter than this is no plateau.
const SHORTEST_PLATEAU: usize = 5;
/// Samples on either side over which an approach to a plateau is judged.
const APPROACH: usize = 10;
/// Effort counts as equal within this part of its range: below the rounding of any printed column.
const EQUAL_PART: f64 = 1e-7;
/// Share of the drive's limit above which the drive is at it: a measured effort has some noise.
const AT_LIMIT: f64 = 0.99;

pub(super) fn inspect(log: &Log, axis: &AxisFile, out: &mut Hygiene) -> Result<(), InputError> {
    let best = log.best_effort(axis)?.kind;
    for effort in &log.efforts {
        if effort.values.iter().all(|value| *value == 0.0) {
            let (severity, remedy) = if effort.kind == best {
                (Severity::Fatal, "take the column out, or wire it")
            } else {
                (Severity::Warning, "another column is used")
            };
            let text = format!("{} is zero throughout; {remedy}", words(effort.kind));
            out.find(Code::ZeroEffort, severity, text);
        }
    }
    let values = log.effort_nm(axis)?;
    let plateaus = saturated(log, axis, &values, best);
    if plateaus.is_empty() {
        return Ok(());
    }
    let level = plateaus
        .iter()
        .map(|range| values[range.start].abs())
        .fold(0.0, f64::max);
    let step_s = log.median_step_s();
    // What the drive holds back leaves it over its lag.
    let after = 5 + (3.0 * axis.drive.lag_s.unwrap_or(0.0) / step_s).ceil() as usize;
    let wider = plateaus
        .iter()
        .map(|range| range.start.saturating_sub(2)..(range.end + after).min(log.len()))
        .collect();
    let (stretches, samples) = out.exclude(Code::Saturated, wider);
    let text = format!(
        "the effort stands at its limit of {level:.6} {} in {}, {:.4} s with margins, which are left out",
        axis.unit.effort(),
        many(stretches, "stretch", "stretches"),
        samples as f64 * step_s
    );
    out.find(Code::Saturated, Severity::Excluded, text);
    Ok(())
}

fn words(kind: EffortKind) -> &'static str {
    match kind {
        EffortKind::TorqueMeasured => "the measured effort",
        EffortKind::TorqueReference => "the commanded effort",
        EffortKind::Current => "the current",
        EffortKind::Voltage => "the voltage",
    }
}

/// Plateaus that are a limit and not a wish.
fn saturated(log: &Log, axis: &AxisFile, values: &[f64], best: EffortKind) -> Vec<Range<usize>> {
    let (low, high) = extent(values);
    let largest = high.abs().max(low.abs());
    let measured = matches!(best, EffortKind::TorqueMeasured | EffortKind::Current);
    if let Some(limit) = axis.drive.torque_limit {
        // A measured effort well beyond the limit says that the limit is not the drive's.
        if !measured || largest <= 1.05 * limit {
            return runs(values.len(), |k| values[k].abs() >= AT_LIMIT * limit);
        }
    }
    if high <= low {
        return Vec::new();
    }
    let equal = grid(values).max(EQUAL_PART * (high - low));
    let mut plateaus: Vec<Range<usize>> = Vec::new();
    for extreme in [low, high] {
        plateaus.extend(runs(values.len(), |k| (values[k] - extreme).abs() <= equal));
    }
    let reference = log
        .effort(EffortKind::TorqueReference)
        .filter(|_| measured)
        .map(|effort| effort.values.as_slice());
    if let Some(reference) = reference {
        // What was asked for is known: only where it lies beyond the plateau is there a limit.
        plateaus.retain(|range| {
            let beyond = range
                .clone()
                .filter(|&k| reference[k] * values[k].signum() > 1.02 * values[k].abs())
                .count();
            5 * beyond >= 4 * range.len()
        });
        return plateaus;
    }
    let position = &log.position.values;
    let closed_loop = log.position_ref.is_some();
    let moves = |range: &Range<usize>| {
        let first = position[range.start];
        range.clone().filter(|&k| position[k] != first).count() * 2 > range.len()
    };
    if closed_loop && plateaus.iter().any(moves) {
        // A controller that sees the axis move cannot ask for the same effort to the last digit.
        return plateaus;
    }
    let cornered = plateaus
        .iter()
        .filter(|range| corner(values, range, equal))
        .count();
    // Commanded steps, and their approach through a lag, have no corner; a ramp that is clipped has.
    if measured && cornered >= 2 && 2 * cornered >= plateaus.len() {
        return plateaus;
    }
    Vec::new()
}

/// The effort runs into the plateau at full slope, in more than one step.
fn corner(values: &[f64], plateau: &Range<usize>, equal: f64) -> bool {
    let Some(from) = plateau.start.checked_sub(APPROACH + 1) else {
        return false;
    };
    let steps: Vec<f64> = values[from..plateau.start]
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .collect();
    let sum: f64 = steps.iter().sum();
    let largest = steps
        .iter()
        .copied()
        .chain([(values[plateau.start] - values[plateau.start - 1]).abs()])
        .fold(0.0, f64::max);
    let last = steps[steps.len() - 2..].iter().sum::<f64>() / 2.0;
    // A smooth peak on a coarse grid moves by some four grid steps over the length of its plateau.
    sum >= 20.0 * equal && largest <= 0.5 * sum && last >= 0.3 * sum / steps.len() as f64
}

/// Runs of samples of which all fulfil a condition, long enough to be a plateau.
fn runs(samples: usize, holds: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut out = Vec::new();
    let mut start = None;
    for k in 0..=samples {
        match (k < samples && holds(k), start) {
            (true, None) => start = Some(k),
            (false, Some(from)) => {
                if k - from >= SHORTEST_PLATEAU {
                    out.push(from..k);
                }
                start = None;
            }
            _ => {}
        }
    }
    out
}

/// Grid on which a column lies, by rounding or conversion; zero where it lies on none.
fn grid(values: &[f64]) -> f64 {
    let steps = || values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let smallest = steps()
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    let whole = |step: f64| (step / smallest - (step / smallest).round()).abs() < 0.02;
    if steps().filter(|step| !whole(*step)).count() * 20 > values.len() || !smallest.is_finite() {
        return 0.0;
    }
    smallest
}
