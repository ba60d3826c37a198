//! What the method itself does to an estimate: an axis with the fitted parameters is simulated along the same motion,
//! with the same encoder and noise, and identified in the same way. How far the answer then lies from what was put in is
//! the bias of coarse positions, smoothing and inverse dynamics together, and it is taken off.
//!
//! Source: indirect inference, Gourieroux, Monfort, Renault 1993, J. Appl. Econometrics 8.

use super::Usable;
use super::file::simulated;
use super::fit::{Data, Joint};
use super::interval::Covariance;
use crate::axis_file::AxisFile;
use crate::believed::Noise as AxisNoise;
use crate::diagnose::nodes;
use crate::error::InputError;
use crate::inverse::{self, Own, Owner, Record};
use crate::log::{Effort, EffortKind, Log, Position};
use crate::signal::interpolate;
use bristle_plant::drive::DriveConfig;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Twins of a round, each with noise of its own.
const TWINS: usize = 2;
/// Rounds of taking the bias off: each leaves the bias's slope times what the one before left.
const ROUNDS: usize = 4;
/// A coordinate whose standard deviation is larger is not corrected: its twin would wander as it does.
const KNOWN: f64 = 0.35;
/// Most that a coordinate is moved, in its prior's or its logarithm's units.
const MOST: f64 = 0.7;
/// Standard deviation of what is left of a bias, as a share of it.
const DOUBT: f64 = 0.3;
/// Bandwidth of what leads a twin along the measured motion, rad/s.
const LEADS: f64 = 125.0;

/// Bias of each coordinate and how well it is known.
#[derive(Clone, Debug)]
pub struct Bias {
    /// Of the estimate against the truth.
    pub mean: Vec<f64>,
    /// Standard deviation.
    pub spread: Vec<f64>,
    /// Standard deviation of an estimate from one record, as twins with different noise show it.
    pub noise: Vec<f64>,
}

impl Bias {
    /// None known.
    pub fn none(parameters: usize) -> Self {
        Self {
            mean: vec![0.0; parameters],
            spread: vec![0.0; parameters],
            noise: vec![0.0; parameters],
        }
    }

    /// Of a fit on these logs.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub fn new(
        data: &Data,
        joint: &Joint,
        covariance: &Covariance,
        logs: &[Usable],
        axis: &AxisFile,
    ) -> Result<Self, InputError> {
        let free = &joint.model.free;
        let corrected: Vec<bool> = (0..free.len())
            .map(|i| {
                // A twin's clock is its own, and effects are judged as they stand.
                let own = matches!(free[i].owner, Owner::Own(own) if own != Own::Skew);
                own && (!free[i].logarithmic || covariance.spread(i) < KNOWN)
            })
            .collect();
        let asked = &joint.fit.at;
        let mut at = asked.clone();
        let mut bias = Self::none(free.len());
        let mut squares = vec![0.0; free.len()];
        for round in 0..ROUNDS {
            let found = (0..TWINS)
                .into_par_iter()
                .map(|twin| {
                    let seed = (round * TWINS + twin) as u64;
                    answer(data, joint, &at, logs, axis, seed)
                })
                .collect::<Result<Vec<_>, InputError>>()?;
            for i in (0..free.len()).filter(|&i| corrected[i]) {
                let mean = found.iter().map(|f| f[i]).sum::<f64>() / TWINS as f64;
                squares[i] += found.iter().map(|f| (f[i] - mean).powi(2)).sum::<f64>();
                let most = if free[i].logarithmic {
                    MOST
                } else {
                    free[i].spread
                };
                let moved = (at[i] + asked[i] - mean).clamp(asked[i] - most, asked[i] + most);
                at[i] = free[i].coordinate(free[i].value(moved));
                bias.mean[i] = asked[i] - at[i];
            }
        }
        for (i, square) in squares.iter().enumerate() {
            bias.noise[i] = (square / ((TWINS - 1) * ROUNDS) as f64).sqrt();
            let of_mean = bias.noise[i] / (TWINS as f64).sqrt();
            bias.spread[i] = of_mean.hypot(DOUBT * bias.mean[i]);
        }
        Ok(bias)
    }
}

/// What identification answers for an axis whose parameters are those at `at`.
fn answer(
    data: &Data,
    joint: &Joint,
    at: &[f64],
    logs: &[Usable],
    axis: &AxisFile,
    seed: u64,
) -> Result<Vec<f64>, InputError> {
    let mut truth = joint.clone();
    truth.fit.at = at.to_vec();
    let records = data
        .records
        .iter()
        .zip(logs)
        .enumerate()
        .map(|(place, (record, usable))| {
            let log = record_twin(&truth, record, &usable.log, seed * 1000 + place as u64)?;
            Record::new(&log, axis, &joint.believed(), &[])
        })
        .collect::<Result<Vec<_>, InputError>>()?;
    let nodes = nodes(&records, data.z_ss_rad);
    let weights = data.noise.weights(&nodes);
    Ok(inverse::fit_alone(&joint.model, &records, &weights, at.to_vec())?.at)
}

/// The record that an axis with the fitted parameters would have left, led along the measured motion.
fn record_twin(truth: &Joint, record: &Record, log: &Log, seed: u64) -> Result<Log, InputError> {
    let mut believed = simulated(truth);
    if !record.commanded {
        believed.drive = DriveConfig::default();
    }
    let step_s = record.step_s / record.averaged as f64;
    let unit = believed.unit;
    let empty = || InputError::new(&log.file, "has no stretch to simulate", "record for longer");
    let stretch = record
        .stretches
        .iter()
        .max_by_key(|stretch| stretch.effort_nm.len())
        .ok_or_else(empty)?;
    let samples = stretch.effort_nm.len() * record.averaged;
    let time_s: Vec<f64> = (0..samples).map(|k| k as f64 * step_s).collect();
    let coarse: Vec<f64> = (0..stretch.effort_nm.len())
        .map(|k| k as f64 * record.step_s)
        .collect();
    let position = interpolate(&coarse, &stretch.smooth_rad, &time_s);
    let velocity = interpolate(&coarse, &stretch.velocity_rad_s, &time_s);
    let inertia = believed.whole_inertia_kg_m2();
    let mut twin = believed
        .axis(believed.model, step_s, AxisNoise::default(), seed)?
        .starting_at(position[0], velocity[0]);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let noise_nm = record.effort_noise_nm * (record.averaged as f64).sqrt();
    let (mut efforts, mut positions) = (Vec::new(), Vec::new());
    for k in 0..samples {
        let motion = twin.truth().motion;
        let lead = LEADS * LEADS * (position[k] - motion.position_rad)
            + 2.0 * LEADS * (velocity[k] - motion.velocity_rad_s);
        let effort = stretch.effort_nm[k / record.averaged] + inertia * lead;
        positions.push(twin.reading().counts as f64 * believed.rad_per_count());
        twin.advance(effort);
        let noise: f64 = StandardNormal.sample(&mut random);
        efforts.push(effort + noise_nm * noise);
    }
    if positions.iter().chain(&efforts).any(|x| !x.is_finite()) {
        return Err(believed.diverged(time_s[samples - 1]));
    }
    Ok(Log::new(
        log.file.clone(),
        unit,
        time_s,
        vec![Effort {
            kind: if record.commanded {
                EffortKind::TorqueReference
            } else {
                EffortKind::TorqueMeasured
            },
            values: efforts,
        }],
        Position::of(unit, positions),
    ))
}
