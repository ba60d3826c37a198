//! Second step: the axis in stick, a spring, a damper and a mass, from a small torque that never breaks it away.
//! Gives sigma0, sigma1 + sigma2 and J.
//!
//! Source: thesis (Aktas, ITU 2002) eqs. 2.28 and 2.29 and its appendix 2.

mod arx;
mod choice;
mod continuous;

pub use choice::Candidate;
pub use continuous::{Arx, Continuous};

use super::linear::delta;
use super::record::{grid, span};
use super::{Estimate, LEVEL, Parameter};
use crate::axis_file::AxisFile;
use crate::error::InputError;
use crate::log::Log;
use arx::{Model, Record, iterate, least_squares};
use statrs::distribution::{ContinuousCDF, Normal};
use std::ops::Range;

/// What the step found.
#[derive(Clone, Debug, PartialEq)]
pub struct Presliding {
    /// The equation by least squares, as the thesis has it: noise of the encoder goes into its damping.
    pub least_squares: Option<Arx>,
    /// By refined instrumental variables; the estimates come from it.
    pub instrumental: Arx,
    /// The same without the hold.
    pub continuous: Continuous,
    /// Every order and delay that was tried, best first.
    pub candidates: Vec<Candidate>,
    /// sigma0, sigma1 + sigma2 and J.
    pub estimates: Vec<Estimate>,
    /// Rms of what the simulated model leaves of position, rad.
    pub residual_rms_rad: f64,
    /// Encoder counts between lowest and highest position.
    pub span_counts: f64,
    /// What the data cannot support, a line each.
    pub notes: Vec<String>,
}

/// Least span of motion: of two or three counts one sees steps, not a spring.
const LEAST_COUNTS: f64 = 4.0;
/// Span of motion in counts at which rounding weighs on the intervals as much as noise does.
const COARSE_COUNTS: f64 = 20.0;
/// Least number of changes of torque: an order of three and a delay take eight numbers, some of each for noise.
const LEAST_CHANGES: usize = 30;
/// A model that explains less than this of the motion's variance is not one of it.
const LEAST_EXPLAINED: f64 = 0.7;

/// Identifies the axis in stick.
///
/// # Errors
/// A log that cannot show it, with the reason: too coarse an encoder, too little change of torque, an axis that broke
/// away, or motion that is not that of a spring, a damper and a mass.
pub fn identify(log: &Log, axis: &AxisFile) -> Result<Presliding, InputError> {
    let refuse = |message: String, remedy: &str| Err(InputError::new(&log.file, message, remedy));
    let torque = log.effort_nm(axis)?;
    let position = log.position_rad(axis)?;
    let step_s = log.median_step_s();
    let range = log
        .stretches()
        .into_iter()
        .max_by_key(Range::len)
        .unwrap_or(0..log.len());
    let torque = &torque[range.clone()];
    let count = grid(&position);
    let origin = position[range.start];
    let position: Vec<f64> = position[range.clone()].iter().map(|q| q - origin).collect();
    let record = Record {
        torque,
        position: &position,
    };
    let span_counts = if count > 0.0 {
        span(&position) / count
    } else {
        0.0
    };
    if span_counts < LEAST_COUNTS {
        return refuse(
            format!(
                "the motion spans {span_counts:.0} encoder counts, fewer than {LEAST_COUNTS}: too coarse to show presliding"
            ),
            "raise the torque towards half of break-away, or use a finer encoder",
        );
    }
    let changes = changes(torque);
    if changes < LEAST_CHANGES || range.len() < 20 * LEAST_CHANGES {
        return refuse(
            format!(
                "the torque changes {changes} times in {} samples: not enough excitation",
                range.len()
            ),
            "run the binary experiment (prbs) for some seconds",
        );
    }
    let (candidates, start) = choice::choose(record);
    let Some(model) = start.and_then(|start| iterate(record, start)) else {
        return refuse(
            moved(&position, count),
            "lower the torque until the axis holds still: a tenth to a half of break-away",
        );
    };
    let residual_rms_rad = model.output_error(record);
    let motion = deviation(&position);
    let wander = span(&tenths(&model.residuals(record)));
    if wander > motion {
        return refuse(
            format!(
                "the axis broke away: it wandered by {:.1} counts beside its spring",
                wander / count
            ),
            "lower the torque: a tenth to a half of break-away",
        );
    }
    if residual_rms_rad * residual_rms_rad > (1.0 - LEAST_EXPLAINED) * motion * motion {
        return refuse(
            format!(
                "a spring, a damper and a mass leave {:.2} of {:.2} counts rms of the motion",
                residual_rms_rad / count,
                motion / count
            ),
            "look for vibration from outside, or for break-away",
        );
    }
    let instrumental = sampled(&model, step_s);
    let Some(continuous) = instrumental.continuous() else {
        return refuse(
            format!(
                "the sampled model has no continuous one: its poles are those of A = {:?}",
                instrumental.a
            ),
            "sample faster, so that the axis in stick is seen to move between samples",
        );
    };
    let mut notes = Vec::new();
    match candidates.first().map(|first| first.order) {
        Some(1) => notes.push(
            "one pole explains the motion as well as two: it hardly shows the inertia".to_string(),
        ),
        Some(3) => {
            notes.push("a third pole is seen: a lag of the drive, or a compliance; it goes into J and damping".to_string());
        }
        _ => {}
    }
    Ok(Presliding {
        least_squares: least_squares(record, 2, model.delay).map(|model| sampled(&model, step_s)),
        instrumental,
        continuous,
        estimates: estimates(&model, step_s, span_counts),
        candidates,
        residual_rms_rad,
        span_counts,
        notes,
    })
}

fn sampled(model: &Model, sample_time_s: f64) -> Arx {
    Arx {
        a: [model.a(0), model.a(1)],
        b: [model.b(0), model.b(1)],
        delay: model.delay,
        sample_time_s,
    }
}

fn estimates(model: &Model, step_s: f64, span_counts: f64) -> Vec<Estimate> {
    let physical = delta(&model.solution, |p| {
        let arx = Arx {
            a: [p[0], p[1]],
            b: [p[2], p[3]],
            delay: 0,
            sample_time_s: step_s,
        };
        let c = arx.continuous()?;
        Some([
            c.stiffness_nm_rad(),
            c.damping_nm_s_rad(),
            c.inertia_kg_m2(),
        ])
    });
    let whole = [f64::NEG_INFINITY, f64::INFINITY];
    let names = [
        Parameter::Stiffness,
        Parameter::PreslidingDamping,
        Parameter::Inertia,
    ];
    let quantile = Normal::standard().inverse_cdf(0.5 + 0.5 * LEVEL);
    // Rounding to whole counts is no noise but a staircase; over L counts its slope is off by up to 1/L^2. It goes with
    // the motion, which the covariance does not know: on virtual axes of 5 to 10 counts the deviations were too small by
    // half, of 26 counts right.
    let staircase = 1.0 / (span_counts * span_counts);
    let quantile = quantile * 1.0_f64.hypot(COARSE_COUNTS / span_counts);
    let c = sampled(model, step_s).continuous();
    names
        .into_iter()
        .enumerate()
        .map(|(i, parameter)| {
            let advice = || match parameter {
                Parameter::Inertia => {
                    "motion in stick is too slow to show the inertia: take it from an acceleration, or use a shorter bit"
                }
                _ => "record longer, with more torque below break-away, or use a finer encoder",
            };
            let (value, interval) = match &physical {
                Some(all) => {
                    let (value, deviation) = all[i];
                    let half = quantile * deviation + staircase * value.abs();
                    (value, [value - half, value + half])
                }
                None => {
                    let values = c.map(|c| [c.stiffness_nm_rad(), c.damping_nm_s_rad(), c.inertia_kg_m2()]);
                    (values.map_or(f64::NAN, |values| values[i]), whole)
                }
            };
            Estimate::judged(parameter, value, interval, value, || advice().to_string())
        })
        .collect()
}

/// How often the torque crosses its mean.
fn changes(torque: &[f64]) -> usize {
    let mean = torque.iter().sum::<f64>() / torque.len().max(1) as f64;
    torque
        .windows(2)
        .filter(|pair| (pair[0] > mean) != (pair[1] > mean))
        .count()
}

fn deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    crate::signal::rms(values.iter().map(|x| x - mean))
}

/// Means over tenths.
fn tenths(values: &[f64]) -> Vec<f64> {
    let length = (values.len() / 10).max(1);
    values
        .chunks_exact(length)
        .map(|part| part.iter().sum::<f64>() / length as f64)
        .collect()
}

/// What can be said of motion that no linear model follows.
fn moved(position: &[f64], count: f64) -> String {
    format!(
        "no spring, damper and mass follows the motion, whose mean over a tenth of the record wanders by {:.1} counts: \
         the axis broke away",
        span(&tenths(position)) / count
    )
}
