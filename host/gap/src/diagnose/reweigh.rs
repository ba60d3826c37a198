//! A fit with the noise that it leaves itself.
//!
//! Hypotheses are ranked by a density whose spread is their own in every record and regime. With the weights that another fit
//! left, a regime in which that one failed counts for nothing, and what explains it is not fitted there.
//!
//! Iteratively reweighted least squares: Green 1984, J. R. Stat. Soc. B 46.

use super::fitted_noise::noise_of;
use super::likelihood::{Noise, Own};
use super::look_again::of_simulator;
use super::regime::Node;
use crate::error::InputError;
use crate::inverse::{Fit, Model, Record, fit_at, fit_near};

/// Most rounds of new weights.
const ROUNDS: usize = 3;
/// Nats that a round must gain for another one to be worth it.
const WORTH_A_ROUND: f64 = 2.0;
/// Weights that differ by less than this factor fit the same.
const ALIKE: f64 = 1.1;

/// What fits are weighed anew with.
pub(super) struct Reweighs<'a> {
    /// The prepared logs.
    pub(super) records: &'a [Record],
    /// Their nodes.
    pub(super) nodes: &'a [Node],
    /// Noise that densities are compared with.
    pub(super) noise: &'a Noise,
    /// What the method leaves over of a model's own records.
    pub(super) own: &'a Own,
}

impl Reweighs<'_> {
    /// The fit of a model and its weights, where neither changes the other any more, or the density grows no more.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn settled(
        &self,
        model: &Model,
        mut fit: Fit,
        mut weights: Vec<f64>,
    ) -> Result<(Fit, Vec<f64>), InputError> {
        let Self {
            records,
            nodes,
            noise,
            own,
        } = self;
        let mut density = noise.log_density(nodes, &fit.left_over);
        for _ in 0..ROUNDS {
            let new = noise_of(model, records, nodes, &fit.left_over, own).weights(nodes);
            let alike = |(new, old): (&f64, &f64)| *new <= ALIKE * old && *old <= ALIKE * new;
            if new.iter().zip(&weights).all(alike) {
                break;
            }
            let known = rescaled(&fit, &weights, &new);
            let known = known
                .columns(0, known.ncols().min(of_simulator(model)))
                .into_owned();
            let next = fit_near(model, records, &new, fit.at.clone(), &known)?;
            let gained = noise.log_density(nodes, &next.left_over) - density;
            if gained <= 0.0 {
                break;
            }
            fit = fit_at(model, records, &new, next.at)?;
            weights = new;
            density += gained;
            if gained < WORTH_A_ROUND {
                break;
            }
        }
        Ok((fit, weights))
    }
}

/// The Jacobian of a fit as it is with other weights.
pub(super) fn rescaled(fit: &Fit, old: &[f64], new: &[f64]) -> nalgebra::DMatrix<f64> {
    let mut jacobian = fit.jacobian.clone();
    for (row, (new, old)) in new.iter().zip(old).enumerate() {
        let times = if *old > 0.0 { new / old } else { 0.0 };
        jacobian.row_mut(row).scale_mut(times);
    }
    jacobian
}
