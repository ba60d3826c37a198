//! Positions: whether they move, on which grid, and whether effort and inertia could have moved them so.

use super::jump::{Jump, Measured, measured, slope_before};
use super::limits::Limits;
use super::{Code, Hygiene, Severity, many, spot};
use crate::axis_file::AxisFile;
use crate::error::InputError;
use crate::log::{Log, PositionKind};
use crate::sensor::grid_rad;
use crate::signal::extent;
use crate::stretch::{Stretch, rad_per_count};
use bristle_plant::Unit;
use std::ops::Range;

/// Shortest standstill that may be a stuck encoder.
const SHORTEST_STANDSTILL: usize = 10;
/// A record of which more than this part is stuck is none.
const STUCK_PART: f64 = 0.6;
/// Factors by which encoders are misread: quadrature, decimal and binary gears, turns for radians left out.
const FACTORS: [f64; 7] = [2.0, 3.0, 4.0, 5.0, 8.0, 10.0, 16.0];
/// Samples on either side that a step has to stand out of.
const AROUND: usize = 10;
/// By this factor.
const STANDS_OUT: f64 = 4.0;
/// There and back of a step differ by this part at most: the axis goes on as before.
const UNEVEN: f64 = 0.3;
/// Fewest different positions before their grid means something.
const FEWEST_PLACES: usize = 30;

/// What the grid of the positions says of the axis file's count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grid {
    /// Positions in radians or metres lie on it: neither it nor their unit is off.
    Agrees,
    /// It is off.
    Differs,
    /// Counts, or positions on no grid.
    Unseen,
}

pub(super) fn inspect(
    log: &Log,
    axis: &AxisFile,
    stretches: &[Stretch],
    out: &mut Hygiene,
) -> Result<Grid, InputError> {
    let position = log.position_rad(axis)?;
    let effort = log.effort_nm(axis)?;
    // Where the axis file does not say, the smallest step seen.
    let count = rad_per_count(axis)
        .unwrap_or(0.0)
        .max(smallest_step(&position));
    let (low, high) = extent(&position);
    if high - low <= 1.5 * count || high <= low {
        let text = format!(
            "the position stays within {:.3e} {}, a count: nothing can be fitted; move the axis, take a finer encoder, or \
             check that this one is connected",
            high - low,
            axis.unit.position()
        );
        out.find(Code::NeverMoved, Severity::Fatal, text);
        return Ok(Grid::Unseen);
    }
    let grid = inspect_grid(log, axis, out);
    // A step of a coarser encoder than the file says is none of the axis.
    let step_rad = count.max(grid_rad(&position, count).unwrap_or(0.0));
    let limits = Limits::new(axis, &position, &effort, step_rad);
    let mut found = Found::default();
    for stretch in stretches {
        found.in_stretch(
            &limits,
            &position[stretch.range.clone()],
            &effort[stretch.range.clone()],
            stretch,
        );
    }
    found.report(axis, log, out);
    super::velocity::inspect(log, axis, &position, count, out);
    Ok(grid)
}

/// Finds positions that lie on a grid that is not the one of the axis file.
fn inspect_grid(log: &Log, axis: &AxisFile, out: &mut Hygiene) -> Grid {
    let counts = log.position.kind == PositionKind::Counts;
    let count = if counts {
        1.0
    } else {
        match rad_per_count(axis) {
            Some(count) => count,
            None => return Grid::Unseen,
        }
    };
    let values = &log.position.values;
    let first = values[0];
    let largest = values.iter().fold(0.0_f64, |m, q| m.max(q.abs()));
    // Rounding of what was printed or computed; a grid finer than that cannot be seen.
    let on = |q: f64, step: f64| {
        let n = (q - first) / step;
        (n - n.round()).abs() <= 0.02
    };
    let fits = |step: f64| {
        // Some single positions may be wrong.
        let most = values.len() / 200;
        largest * 1e-12 < 0.02 * step
            && values.iter().filter(|q| !on(**q, step)).nth(most).is_none()
    };
    // A jump puts half a record off the grid, but always by the same part of a count: a finer grid shows all of its parts.
    let all_parts = |factor: f64| {
        let mut seen = [0_usize; 16];
        for q in values {
            let part = ((q - first) / count * factor).round().rem_euclid(factor);
            seen[part as usize % 16] += 1;
        }
        let fewest = 0.3 * values.len() as f64 / factor;
        seen[..factor as usize]
            .iter()
            .all(|seen| *seen as f64 >= fewest)
    };
    let places = |step: f64| {
        let mut places: Vec<i64> = values
            .iter()
            .map(|q| ((q - first) / step).round() as i64)
            .collect();
        places.sort_unstable();
        places.dedup();
        places.len()
    };
    let key = match axis.unit {
        Unit::Rotary => "counts_per_rev",
        Unit::Linear => "counts_per_m",
    };
    let given = axis.axis.counts_per_turn.unwrap_or(1.0);
    if fits(count) {
        let coarser = FACTORS
            .iter()
            .rev()
            .find(|&&factor| fits(factor * count) && places(factor * count) >= FEWEST_PLACES);
        if let Some(factor) = coarser {
            let text = if counts {
                format!(
                    "every position is a multiple of {factor} counts: {key} is {factor} times too high for what this log \
                     counts, or the counter drops its lowest digits"
                )
            } else {
                format!(
                    "positions lie on a grid {factor} times the count of the axis file: {key} = {given} should be {}",
                    given / factor
                )
            };
            out.find(Code::WrongScale, Severity::Warning, text);
            return Grid::Differs;
        }
        if !counts && places(count) >= FEWEST_PLACES {
            return Grid::Agrees;
        }
    } else if !counts {
        let finer = FACTORS
            .iter()
            .find(|&&factor| !decimal(count / factor) && all_parts(factor) && fits(count / factor));
        if let Some(factor) = finer {
            let text = format!(
                "positions lie on a grid of 1/{factor} of the count of the axis file: {key} = {given} should be {}",
                given * factor
            );
            out.find(Code::WrongScale, Severity::Warning, text);
            return Grid::Differs;
        }
    }
    Grid::Unseen
}

/// A power of ten: the rounding of a printed column, not an encoder's count.
fn decimal(step: f64) -> bool {
    let power = step.log10();
    (power - power.round()).abs() < 1e-6
}

#[derive(Default)]
struct Found {
    stuck: Vec<Range<usize>>,
    outliers: Vec<Range<usize>>,
    jumps: Vec<Range<usize>>,
    steps: Vec<Jump>,
    largest_rad: f64,
}

impl Found {
    fn in_stretch(&mut self, limits: &Limits, q: &[f64], u: &[f64], stretch: &Stretch) {
        let offset = stretch.range.start;
        let usual = usual_second_difference(q);
        let shifted = |range: Range<usize>| range.start + offset..range.end + offset;
        let still = standstills(q);
        let mut elsewhere = Vec::new();
        for group in impossible(limits, q, u, stretch.step_s, usual) {
            let (first, last) = (group.start, group.end - 1);
            let (Some(&before), Some(&after)) = (q.get(first.wrapping_sub(1)), q.get(last + 1))
            else {
                continue;
            };
            let speed = slope_before(q, first);
            let net = after - before - speed * (last + 2 - first) as f64;
            let peak = (first..=last)
                .map(|k| (q[k] - before - speed * (k + 1 - first) as f64).abs())
                .fold(0.0, f64::max);
            let frozen = still.iter().find(|range| {
                // The jump is what was missed: the axis went on at its speed.
                let missed = slope_before(q, range.start) * range.len() as f64;
                range.end >= first
                    && range.start < last
                    && missed * net > 0.0
                    && missed.abs() >= 0.3 * net.abs()
            });
            if net.abs() <= 0.3 * peak && group.len() <= 5 {
                self.largest_rad = self.largest_rad.max(peak);
                self.outliers.push(shifted(group));
            } else if let Some(frozen) = frozen {
                self.stuck.push(shifted(frozen.start..last + 1));
            } else {
                let step = match measured(
                    q,
                    &group,
                    limits.within(effort_about(u, &group), stretch.step_s),
                ) {
                    Measured::Hit => continue,
                    Measured::Nothing => None,
                    Measured::Step(jump) => Some(Jump {
                        sample: jump.sample + offset,
                        ..jump
                    }),
                };
                elsewhere.push((shifted(group), peak.max(net.abs()), step));
            }
        }
        for jump in at_a_spot(limits, q, u, stretch.step_s) {
            let own = shifted(jump.sample - 1..jump.sample + 1);
            elsewhere.retain(|(group, ..)| group.end < own.start || own.end < group.start);
            let sample = jump.sample + offset;
            elsewhere.push((own, jump.size_rad.abs(), Some(Jump { sample, ..jump })));
        }
        for range in &still {
            let near = |other: &Range<usize>| {
                other.start < range.end + offset + 12 && range.start + offset < other.end + 12
            };
            if stands_against_effort(limits, &u[range.clone()], stretch.step_s)
                || (!self.outliers.iter().any(near)
                    && stops_dead(limits, q, range, stretch.step_s, usual))
            {
                self.stuck.push(shifted(range.clone()));
            }
        }
        // The start and the end of a standstill are part of it.
        for (group, size, step) in elsewhere {
            let touches =
                |range: &Range<usize>| group.start <= range.end + 2 && range.start <= group.end + 2;
            if !self.stuck.iter().any(touches) {
                self.largest_rad = self.largest_rad.max(size);
                self.jumps.push(group);
                self.steps.extend(step);
            }
        }
    }

    fn report(mut self, axis: &AxisFile, log: &Log, out: &mut Hygiene) {
        let unit = axis.unit.position();
        if !self.stuck.is_empty() {
            let (stretches, samples) = out.exclude(Code::StuckEncoder, self.stuck);
            let fatal = samples as f64 > STUCK_PART * log.len() as f64;
            let (severity, remedy) = if fatal {
                (Severity::Fatal, "mend it and record again")
            } else {
                (Severity::Excluded, "left out")
            };
            let text = format!(
                "the position stands still in {}, {:.4} s in all, where effort or speed must have moved it: a stuck \
                 encoder, or an axis that is blocked; {remedy}",
                many(stretches, "stretch", "stretches"),
                samples as f64 * log.median_step_s()
            );
            out.find(Code::StuckEncoder, severity, text);
        }
        if !self.outliers.is_empty() {
            let (count, _) = out.exclude(Code::PositionOutlier, self.outliers);
            let text = format!(
                "{} off the motion around, by up to {:.3e} {unit}; left out",
                many(count, "position stands", "positions stand"),
                self.largest_rad
            );
            out.find(Code::PositionOutlier, Severity::Excluded, text);
        }
        if !self.jumps.is_empty() {
            let (count, _) = out.exclude(Code::PositionJump, self.jumps);
            self.steps.sort_by_key(|jump| jump.sample);
            out.jumps = self.steps;
            let text = format!(
                "{}, by up to {:.3e} {unit}, faster than the effort can move the axis or alike and at one place: lost \
                 counts or a counter that wraps; left out",
                many(count, "position jump", "position jumps"),
                self.largest_rad
            );
            out.find(Code::PositionJump, Severity::Excluded, text);
        }
    }
}

/// Steps that are alike and at one place, of those farther than effort and friction at twice its level move the axis.
fn at_a_spot(limits: &Limits, q: &[f64], u: &[f64], step_s: f64) -> Vec<Jump> {
    let beyond = |(sample, size_rad): (usize, f64)| {
        let effort_nm = effort_about(u, &(sample - 1..sample + 1));
        (size_rad.abs() > limits.by(1.0, effort_nm, step_s)).then(|| Jump {
            sample,
            size_rad,
            allowed_rad: limits.within(effort_nm, step_s),
        })
    };
    let steps: Vec<Jump> = spot::steps(q, u, step_s * step_s / limits.inertia)
        .into_iter()
        .filter_map(beyond)
        .collect();
    spot::at_one_place(q, &steps, limits.rotary, limits.count)
}

fn smallest_step(q: &[f64]) -> f64 {
    let smallest = q
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { 0.0 }
}

/// Runs of one and the same position.
fn standstills(q: &[f64]) -> Vec<Range<usize>> {
    let mut out = Vec::new();
    let mut start = 0;
    for k in 1..=q.len() {
        if k == q.len() || q[k] != q[start] {
            if k - start >= SHORTEST_STANDSTILL {
                out.push(start..k);
            }
            start = k;
        }
    }
    out
}

/// What the effort beyond any break-away would have moved the axis by, with friction taken off.
fn stands_against_effort(limits: &Limits, u: &[f64], step_s: f64) -> bool {
    let (mut v, mut x, mut furthest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for &u in u {
        let beyond = u.abs() - limits.breaks_away_nm;
        if beyond > 0.0 {
            v += u.signum() * beyond / limits.inertia * step_s;
        } else {
            // Friction holds or stops it: a clean start for the next push.
            v = 0.0;
            x = 0.0;
        }
        x += v * step_s;
        furthest = furthest.max(x.abs());
    }
    furthest > limits.missed_rad
}

/// The axis comes to rest, or leaves it, faster than it can brake: its speed changes over w samples by more than the
/// effort allows.
fn stops_dead(limits: &Limits, q: &[f64], still: &Range<usize>, step_s: f64, usual: f64) -> bool {
    let turns = |k: usize| {
        (1..=still.len().min(10)).any(|w| {
            let (Some(before), Some(after)) = (k.checked_sub(w).map(|k| q[k]), q.get(k + w)) else {
                return false;
            };
            // A single step far above those around is a jump, not a motion that stops.
            let steps = || {
                q[k.saturating_sub(10)..(k + 11).min(q.len())]
                    .windows(2)
                    .map(|q| (q[1] - q[0]).abs())
            };
            let largest = steps().fold(0.0, f64::max);
            if largest > 0.4 * steps().sum::<f64>() && largest > 4.0 * limits.count {
                return false;
            }
            let w = w as f64;
            let beyond_counts = (usual - 2.0 * limits.count).max(0.0);
            (after - 2.0 * q[k] + before).abs()
                > limits
                    .within(limits.largest_nm, w * step_s)
                    .max(10.0 * beyond_counts * w * w)
        })
    };
    turns(still.start) || turns(still.end - 1)
}

fn second_differences(q: &[f64]) -> Vec<f64> {
    q.windows(3).map(|q| q[2] - 2.0 * q[1] + q[0]).collect()
}

/// The second difference that one in two hundred exceeds.
fn usual_second_difference(q: &[f64]) -> f64 {
    let mut second: Vec<f64> = second_differences(q).into_iter().map(f64::abs).collect();
    if second.is_empty() {
        return 0.0;
    }
    let rank = (second.len() - 1) * 199 / 200;
    *second.select_nth_unstable_by(rank, f64::total_cmp).1
}

/// Largest effort about some samples.
fn effort_about(u: &[f64], samples: &Range<usize>) -> f64 {
    let near = samples.start.saturating_sub(3)..(samples.end + 2).min(u.len());
    u[near].iter().fold(0.0, |most: f64, u| most.max(u.abs()))
}

/// Groups of samples about which the position changes its speed faster than the effort allows, and far faster than it
/// does elsewhere on this record; or steps to where it goes on as before, faster than the effort of that moment allows.
fn impossible(limits: &Limits, q: &[f64], u: &[f64], step_s: f64, usual: f64) -> Vec<Range<usize>> {
    let turns = second_differences(q);
    let limit = limits.within(limits.largest_nm, step_s).max(10.0 * usual);
    let steps = |i: usize| {
        let near = turns[i.saturating_sub(AROUND)..(i + AROUND).min(turns.len())].iter();
        let (there, back) = (turns[i], turns[i + 1]);
        let size = there.abs().min(back.abs());
        let others = near.filter(|turn| ![there, back].contains(turn));
        let loudest = others.fold(0.0, |most: f64, turn| most.max(turn.abs()));
        there * back < 0.0
            && (there + back).abs() < UNEVEN * size
            && size > limits.within(effort_about(u, &(i + 1..i + 3)), step_s)
            && size > STANDS_OUT * loudest
    };
    let mut out: Vec<Range<usize>> = Vec::new();
    let mut add = |k: usize| match out.last_mut() {
        Some(last) if k <= last.end + 2 => last.end = last.end.max(k + 1),
        _ => out.push(k..k + 1),
    };
    for (i, value) in turns.iter().enumerate() {
        // The second difference i is about sample i + 1.
        let k = i + 1;
        if value.abs() > limit {
            add(k);
        }
        if i + 1 < turns.len() && steps(i) {
            add(k);
            add(k + 1);
        }
    }
    out
}
