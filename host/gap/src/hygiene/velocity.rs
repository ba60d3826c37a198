//! Whether a velocity column is the derivative of the position: both as the way made in windows of time.

use super::{Code, Hygiene, Severity};
use crate::axis_file::AxisFile;
use crate::log::Log;
use crate::signal::correlation;

/// Windows in a log.
const WINDOWS: usize = 200;
/// Ways that are this many counts rms can be compared to a few per cent.
const FEWEST_COUNTS: f64 = 20.0;
/// A slope within this of one is a filter or a rounded gain.
const SLOPE_TOLERANCE: f64 = 0.1;

pub(super) fn inspect(log: &Log, axis: &AxisFile, position: &[f64], count: f64, out: &mut Hygiene) {
    let Some(velocity) = &log.velocity else {
        return;
    };
    let window = (log.len() / WINDOWS).max(5);
    let gaps = log.gaps();
    let (mut ways, mut said) = (Vec::new(), Vec::new());
    let mut start = 0;
    while start + window < log.len() {
        let end = start + window;
        if !gaps.iter().any(|gap| (start..end).contains(&gap.before)) {
            ways.push(position[end] - position[start]);
            said.push(
                (start..end)
                    .map(|k| {
                        0.5 * (velocity[k] + velocity[k + 1]) * (log.time_s[k + 1] - log.time_s[k])
                    })
                    .sum::<f64>(),
            );
        }
        start = end;
    }
    let way = crate::signal::rms(ways.iter().copied());
    if ways.len() < 20 || way < FEWEST_COUNTS * count || way == 0.0 {
        return;
    }
    let r = correlation(&ways, &said);
    let slope = r.signum() * crate::signal::rms(said.iter().copied()) / way;
    let unit = axis.unit.position();
    let text = if !r.is_finite() || r.abs() < 0.9 {
        format!(
            "the velocity column is not the derivative of the position (correlation {r:.2} over {} windows); take it out",
            ways.len()
        )
    } else if (slope - 1.0).abs() > SLOPE_TOLERANCE {
        format!(
            "the velocity column is {slope:.4} times the derivative of the position: another unit than {unit}/s, or \
             another sign; correct or take out the column"
        )
    } else {
        return;
    };
    out.find(Code::VelocityMismatch, Severity::Warning, text);
}
