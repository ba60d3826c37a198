//! What the method itself does to an estimate: an axis with the fitted parameters is simulated along the same motion,
//! with the same encoder and noise, and identified in the same way. How far the answer then lies from what was put in is
//! the bias of coarse positions, smoothing and inverse dynamics together, and it is taken off.
//!
//! Source: indirect inference, Gourieroux, Monfort, Renault 1993, J. Appl. Econometrics 8.

use super::axis::simulated;
use super::covariance::{Covariance, is_curved};
use super::fit::{Data, Joint};
use crate::diagnose::nodes;
use crate::error::InputError;
use crate::inverse::{self, Own, Owner};
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
/// The same where the cost is no parabola: a twin answers from the valley that it was put into. As well known as the others
/// these were covered on 72 to 90 % of 60 virtual axes (`bristle trials identify --cases 60 --seed 6000` at 7acf3ac).
const DOUBT_CURVED: f64 = 1.0;
/// The same for stiffness and damping, which all of presliding shows: with as much doubt as the other curved ones, 96 % of
/// stiffnesses and of dampings were covered (`--cases 100` at seeds 6600 and 6400); with as little as the rest 88 % of dampings.
const DOUBT_PRESLIDING: f64 = 0.6;

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
    pub fn new(data: &Data, joint: &Joint, covariance: &Covariance) -> Result<Self, InputError> {
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
                    answer(data, joint, &at, seed)
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
            let doubt = match free[i].owner {
                Owner::Own(Own::Stiffness | Own::Damping) => DOUBT_PRESLIDING,
                owner if is_curved(owner) => DOUBT_CURVED,
                _ => DOUBT,
            };
            bias.spread[i] = of_mean.hypot(doubt * bias.mean[i]);
        }
        Ok(bias)
    }
}

/// What identification answers for an axis whose parameters are those at `at`.
fn answer(data: &Data, joint: &Joint, at: &[f64], seed: u64) -> Result<Vec<f64>, InputError> {
    let mut truth = joint.clone();
    truth.fit.at = at.to_vec();
    let axis = simulated(&truth);
    let records = inverse::twins(&axis, &data.records, 1.0, 1000 * seed)?;
    let nodes = nodes(&records, data.z_ss_rad);
    let weights = data.noise.weights(&nodes);
    // It starts from its truth: what its noise moves is little, and the slopes there serve all the way.
    let model = &joint.model;
    let there = inverse::fit_at(model, &records, &weights, at.to_vec())?;
    Ok(inverse::fit_near(model, &records, &weights, there.at, &there.jacobian)?.at)
}
