//! Stretches of constant speed in a log, and the mean torque of each with its spread.
//!
//! A stretch grows window by window while the slope of position stays what it was within what the encoder can tell. Its
//! beginning is cut where that makes the mean surest (the MSER rule: White, Simulation 69(6), 1997), so that a transient
//! of drive, loop or bristles does not count. The standard error allows for the correlation of neighbouring samples by
//! batch means (Law, Simulation Modeling and Analysis, chapter 9).

use super::{SteadyMap, SteadyPoint};
use crate::axis_file::AxisFile;
use crate::error::InputError;
use crate::identify::record::grid;
use crate::log::{EffortKind, Log};

/// How stretches are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Length of a window, s. A stretch is four of them or more.
    pub window_s: f64,
    /// Change of speed that still counts as none, as a share of it.
    pub speed_share: f64,
    /// Least travel of a stretch in encoder counts: fewer leave the speed uncertain by a tenth.
    pub least_counts: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            window_s: 0.025,
            speed_share: 0.03,
            least_counts: 10.0,
        }
    }
}

/// Fewest windows of a stretch: one at either end is cut off.
const WINDOWS: usize = 6;
/// Parts of a stretch whose means are compared: each is longer than what a speed loop remembers.
const BATCHES: usize = 16;
/// Change of torque over a stretch, as a share of it, from which on the axis is sticking or settling.
const DRIFT_SHARE: f64 = 0.05;

pub(super) fn find(
    log: &Log,
    axis: &AxisFile,
    settings: &Settings,
) -> Result<SteadyMap, InputError> {
    let torque = log.effort_nm(axis)?;
    let position = log.position_rad(axis)?;
    let step_s = log.median_step_s();
    let grid = grid(&position);
    let window = ((settings.window_s / step_s).round() as usize).max(4);
    let mut map = SteadyMap {
        source: log.file.clone(),
        points: Vec::new(),
        left_out: Vec::new(),
    };
    let (mut slow, mut turning, mut drifting) = (0, 0, 0);
    for range in log.stretches() {
        let start = range.start;
        for (from, to) in straight(&position[range], window, step_s, grid, settings.speed_share) {
            let (from, to) = (start + from, start + to);
            let travel = (position[to - 1] - position[from]).abs();
            if travel < settings.least_counts * grid {
                slow += 1;
                continue;
            }
            let range = settled(&torque[from..to]);
            let (from, to) = (from + range, to);
            let speeds = halves(&position[from..to], step_s);
            let tell = settings.speed_share * speeds[0].abs().max(speeds[1].abs())
                + 4.0 * grid / ((to - from) as f64 * step_s);
            if (speeds[1] - speeds[0]).abs() > tell || speeds[0] * speeds[1] <= 0.0 {
                turning += 1;
                continue;
            }
            if drifts(&torque[from..to], DRIFT_SHARE) {
                drifting += 1;
                continue;
            }
            map.points
                .push(point(&position[from..to], &torque[from..to], step_s));
        }
    }
    if slow > 0 {
        map.left_out.push(format!(
            "{slow} stretches moved fewer than {} encoder counts: at rest, or too slow for this encoder in their time",
            settings.least_counts
        ));
    }
    if turning > 0 {
        map.left_out
            .push(format!("{turning} stretches whose speed was not constant"));
    }
    if drifting > 0 {
        map.left_out.push(format!(
            "{drifting} stretches whose torque still changed: sticking, or settling"
        ));
    }
    let commanded = log.best_effort(axis)?.kind;
    if matches!(commanded, EffortKind::TorqueReference | EffortKind::Voltage) {
        map.left_out.push(
            "torque is the commanded one: an error of the drive's gain goes into every torque"
                .to_string(),
        );
    }
    Ok(map)
}

/// Ranges over which position is a straight line, without the window at either end.
fn straight(
    position: &[f64],
    window: usize,
    step_s: f64,
    grid: f64,
    share: f64,
) -> Vec<(usize, usize)> {
    let slopes: Vec<f64> = position
        .chunks_exact(window)
        .map(|chunk| slope(chunk, step_s))
        .collect();
    let window_s = window as f64 * step_s;
    let mut ranges = Vec::new();
    let mut from = 0;
    while from < slopes.len() {
        let mut to = from + 1;
        let mut sum = slopes[from];
        while to < slopes.len() {
            let mean = sum / (to - from) as f64;
            if (slopes[to] - mean).abs() > share * mean.abs() + 2.0 * grid / window_s {
                break;
            }
            sum += slopes[to];
            to += 1;
        }
        if to - from >= WINDOWS {
            ranges.push(((from + 1) * window, (to - 1) * window));
            from = to;
        } else {
            from += 1;
        }
    }
    ranges
}

/// Slope of the straight line through positions.
fn slope(position: &[f64], step_s: f64) -> f64 {
    let n = position.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let (mut above, mut below) = (0.0, 0.0);
    for (i, q) in position.iter().enumerate() {
        let t = i as f64 - middle;
        above += t * (q - position[0]);
        below += t * t;
    }
    above / (below * step_s)
}

fn halves(position: &[f64], step_s: f64) -> [f64; 2] {
    let (first, second) = position.split_at(position.len() / 2);
    [slope(first, step_s), slope(second, step_s)]
}

/// How many samples at the beginning, at most half, are better left out of the mean.
fn settled(torque: &[f64]) -> usize {
    let last = torque.len() / 2;
    let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
    let origin = torque[torque.len() - 1];
    let (mut best, mut cut) = (f64::INFINITY, 0);
    for (i, u) in torque.iter().enumerate().rev() {
        let u = u - origin;
        sum += u;
        squares += u * u;
        count += 1.0;
        if i <= last {
            let measure = (squares - sum * sum / count) / (count * count);
            if measure <= best {
                (best, cut) = (measure, i);
            }
        }
    }
    cut
}

fn point(position: &[f64], torque: &[f64], step_s: f64) -> SteadyPoint {
    let n = torque.len() as f64;
    let mean = torque.iter().sum::<f64>() / n;
    let variance = torque.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / (n - 1.0);
    SteadyPoint {
        velocity_rad_s: slope(position, step_s),
        torque_nm: mean,
        spread_nm: variance.sqrt(),
        standard_error_nm: Some(standard_error(torque)),
    }
}

/// Standard error of the mean of correlated values, by the spread of the means of [`BATCHES`] parts. A loop that takes
/// back what it gave makes it smaller than that of independent values.
fn standard_error(values: &[f64]) -> f64 {
    let means = batches(values);
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt()
}

fn batches(values: &[f64]) -> Vec<f64> {
    let length = (values.len() / BATCHES).max(1);
    values
        .chunks_exact(length)
        .take(BATCHES)
        .map(|part| part.iter().sum::<f64>() / part.len() as f64)
        .collect()
}

/// The torque goes on changing over the stretch: by more than a share of itself, and more than its spread allows.
fn drifts(torque: &[f64], share: f64) -> bool {
    let means = batches(torque);
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let middle = 0.5 * (n - 1.0);
    let below: f64 = (0..means.len()).map(|i| (i as f64 - middle).powi(2)).sum();
    let slope = means
        .iter()
        .enumerate()
        .map(|(i, m)| (i as f64 - middle) * (m - mean))
        .sum::<f64>()
        / below;
    let left = means
        .iter()
        .enumerate()
        .map(|(i, m)| (m - mean - slope * (i as f64 - middle)).powi(2))
        .sum::<f64>();
    let error = (left / (n - 2.0) / below).sqrt();
    (slope * n).abs() > share * mean.abs() && slope.abs() > 3.0 * error
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First-order noise with correlation `rho`, from a fixed generator.
    fn noise(n: usize, rho: f64) -> Vec<f64> {
        let mut state = 1_u64;
        let mut level = 0.0;
        (0..n)
            .map(|_| {
                let mut sum = 0.0;
                for _ in 0..12 {
                    state = state
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1_442_695_040_888_963_407);
                    sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
                }
                level = rho * level + (sum - 6.0);
                level
            })
            .collect()
    }

    #[test]
    fn standard_error_allows_for_correlation() {
        // Variance of the mean of n: (1/(1 - rho))^2/n for unit steps; 16 batches give it to a share of 1/sqrt(30).
        for rho in [0.9, 0.0, -0.5] {
            let error = standard_error(&noise(20_000, rho));
            let expected = 1.0 / ((1.0 - rho) * 20_000_f64.sqrt());
            assert!(
                (0.6..1.5).contains(&(error / expected)),
                "{rho}: {error} against {expected}"
            );
        }
    }

    #[test]
    fn a_ramp_of_torque_drifts_and_noise_does_not() {
        let flat: Vec<f64> = noise(5000, 0.9).iter().map(|e| 1.0 + 0.02 * e).collect();
        assert!(!drifts(&flat, DRIFT_SHARE));
        let ramp: Vec<f64> = flat
            .iter()
            .enumerate()
            .map(|(i, u)| u + 0.2 * i as f64 / 5000.0)
            .collect();
        assert!(drifts(&ramp, DRIFT_SHARE));
    }

    #[test]
    fn a_transient_is_cut() {
        let torque: Vec<f64> = noise(2000, 0.0)
            .iter()
            .enumerate()
            .map(|(i, e)| 1.0 + 0.01 * e + (-(i as f64) / 50.0).exp())
            .collect();
        // After n samples the transient is e^(-n/50): below the noise's 0.01 from 230 on.
        let cut = settled(&torque);
        assert!((150..500).contains(&cut), "{cut}");
    }

    #[test]
    fn a_zigzag_is_its_lines() {
        let q = |i: i32| f64::from(if i < 1000 { i } else { 2000 - i }) * 0.1;
        let counts: Vec<f64> = (0..2000).map(|i| q(i).floor() * 1e-3).collect();
        let ranges = straight(&counts, 50, 1e-3, 1e-3, 0.03);
        assert_eq!(ranges, [(50, 950), (1050, 1950)]);
    }
}
