//! The joint fit: all parameters of a friction model from any mix of logs, with an interval and a judgement for each.
//!
//! What is minimised is the effort that the model leaves over along the measured motion (see [`crate::inverse`]): it is
//! blind to whether a loop was closed, and an error of one moment is not carried into the next. Output error over windows
//! and in free running checks the result.

mod axis;
mod choice;
mod covariance;
mod file;
mod fit;
mod interval;
mod output_error;
mod start;
mod twin;

pub use axis::axis_file;
pub use choice::{Compared, MODELS, compare};
pub use covariance::Covariance;
pub use file::{Provenance, to_toml};
pub use fit::{Data, Joint, Search, Weighting, entries};
pub use interval::{BREAKAWAY_SCALE, Estimate, IDENTIFIED, estimates};
pub use output_error::{WINDOW_S, free_run, windowed};
pub use start::{prepare, records};
pub use twin::Bias;

use crate::axis_file::{AxisFile, FrictionModel};
use crate::error::InputError;
use crate::inverse::{Own, Owner, Record};
use crate::log::Log;
use crate::signal::rms;
use bristle_plant::effect::Entry;
use rayon::prelude::*;
use std::ops::Range;
use std::path::Path;

/// A log and the samples of it that no one should fit.
pub struct Usable {
    /// The log.
    pub log: Log,
    /// Ranges of its samples.
    pub excluded: Vec<Range<usize>>,
}

impl From<Log> for Usable {
    /// All of it.
    fn from(log: Log) -> Self {
        Self {
            log,
            excluded: Vec::new(),
        }
    }
}

/// What is asked for.
pub struct Options {
    /// The friction model; none has them compared and the simplest good one chosen.
    pub model: Option<FrictionModel>,
    /// Effects that are free beside it.
    pub with: Vec<&'static Entry>,
    /// How nodes are weighted and effort is read.
    pub weighting: Weighting,
}

/// Errors of a fit on one log.
#[derive(Clone, Debug, PartialEq)]
pub struct Errors {
    /// Name of the log.
    pub log: String,
    /// Effort left over along the measured motion, N m rms.
    pub effort_nm: f64,
    /// The same as a share of the effort.
    pub relative: f64,
    /// Position error over windows whose start is fitted, rad rms.
    pub windowed_rad: Option<f64>,
    /// Position error running freely from the start under the recorded effort, rad rms.
    pub free_rad: f64,
}

/// What was identified.
pub struct Identified {
    /// Data with the final weights.
    pub data: Data,
    /// The fit.
    pub joint: Joint,
    /// Estimates of what was free but the timing.
    pub estimates: Vec<Estimate>,
    /// How much later than recorded the effort acts, s.
    pub timing: Option<Estimate>,
    /// Correlation of the estimates.
    pub correlation: Vec<Vec<f64>>,
    /// The models compared, where there was a choice.
    pub compared: Vec<Compared>,
    /// Errors on the logs of the fit.
    pub errors: Vec<Errors>,
    /// The axis file that the fit makes.
    pub file: AxisFile,
}

/// Identifies. `progress` is called with the share done.
///
/// # Errors
/// Logs and axis file do not fit each other, or no model can be fitted.
pub fn identify(
    logs: &[Usable],
    axis: &AxisFile,
    path: &Path,
    options: &Options,
    progress: &dyn Fn(f64),
) -> Result<Identified, InputError> {
    let (file, records) = prepare(logs, axis, path)?;
    progress(0.1);
    let mut data = Data::new(records, &file, path, options.weighting)?;
    let kinds: &[FrictionModel] = match &options.model {
        Some(kind) => std::slice::from_ref(kind),
        None => &MODELS,
    };
    let mut fits = Vec::new();
    for (done, &kind) in kinds.iter().enumerate() {
        fits.push(Joint::new(
            &data,
            &file,
            path,
            kind,
            &options.with,
            Search::Near,
        )?);
        progress(0.1 + 0.4 * (done + 1) as f64 / kinds.len() as f64);
    }
    // The first weights are those of a fit without bristles, which hardly counts what bristles do: the best model is searched
    // for once more with weights of its own.
    let mut best = best_of(&fits).clone();
    data.weigh(&best);
    best.again(&data)?;
    let searched = Joint::new(&data, &file, path, best.kind, &options.with, Search::Wide)?;
    if searched.fit.cost < best.fit.cost {
        best = searched;
    }
    for joint in &mut fits {
        if joint.kind == best.kind {
            *joint = best.clone();
        } else {
            joint.again_beside(&data, &best)?;
        }
    }
    progress(0.6);
    data.weigh(best_of(&fits));
    for joint in &mut fits {
        joint.again(&data)?;
    }
    progress(0.7);
    let (compared, chosen) = if fits.len() > 1 {
        compare(&data, &fits)
    } else {
        (Vec::new(), 0)
    };
    let mut joint = fits.swap_remove(chosen);
    if !compared.is_empty() {
        data.weigh(&joint);
        joint.again(&data)?;
    }
    let covariance = Covariance::new(&data, &joint).ok_or_else(|| {
        InputError::new(
            &logs[0].log.file,
            "these logs leave a parameter without any hold",
            "record an experiment that moves the axis",
        )
    })?;
    progress(0.8);
    let bias = match options.weighting {
        Weighting::Noise => Bias::new(&data, &joint, &covariance)?,
        Weighting::Equal => Bias::none(joint.model.free.len()),
    };
    let mut all = estimates(&data, &joint, &covariance, &bias);
    progress(0.95);
    for ((x, bias), free) in joint
        .fit
        .at
        .iter_mut()
        .zip(&bias.mean)
        .zip(&joint.model.free)
    {
        *x = free.coordinate(free.value(*x - bias));
    }
    joint.fit.left_over = joint.model.left_over(&data.records, &joint.fit.at)?;
    let kept: Vec<usize> = (0..all.len())
        .filter(|&i| all[i].owner != Owner::Own(Own::Skew))
        .collect();
    let correlation = kept
        .iter()
        .map(|&i| kept.iter().map(|&j| covariance.correlation(i, j)).collect())
        .collect();
    let timing = all
        .iter()
        .position(|estimate| estimate.owner == Owner::Own(Own::Skew))
        .map(|place| all.remove(place))
        .filter(|_| options.weighting == Weighting::Noise);
    let errors = errors(&joint, &data.records)?;
    progress(1.0);
    Ok(Identified {
        file: axis_file(&joint, axis),
        estimates: all,
        timing,
        correlation,
        compared,
        errors,
        data,
        joint,
    })
}

/// The fit with the least cost.
fn best_of(fits: &[Joint]) -> &Joint {
    fits.iter()
        .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))
        .unwrap_or(&fits[0])
}

/// Errors of a fit on records, its own or withheld ones.
///
/// # Errors
/// The friction model refuses the parameters.
pub fn errors(joint: &Joint, records: &[Record]) -> Result<Vec<Errors>, InputError> {
    let simulated = axis::simulated(joint);
    records
        .par_iter()
        .map(|record| {
            let one = std::slice::from_ref(record);
            let rest = joint.model.left_over(one, &joint.fit.at)?;
            let mut effort = Vec::new();
            for stretch in &record.stretches {
                let u = &stretch.effort_nm;
                let mut means: Vec<f64> =
                    (1..u.len() - 1).map(|k| 0.5 * (u[k - 1] + u[k])).collect();
                record.kernel.apply(&mut means, &mut effort);
            }
            let effort_nm = rms(rest.iter().copied());
            let (free, measured) = free_run(&simulated, record)?;
            Ok(Errors {
                log: record.name.clone(),
                effort_nm,
                relative: effort_nm / rms(effort).max(f64::MIN_POSITIVE),
                windowed_rad: windowed(&simulated, record)?,
                free_rad: rms(free.iter().zip(&measured).map(|(s, m)| s - m)),
            })
        })
        .collect()
}
