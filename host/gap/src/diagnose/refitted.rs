//! The simulator alone, fitted to the records: what every effect is laid against.

use super::drift::put_drift;
use super::fitted_noise::{noise_of, own_left_over};
use super::own::Own;
use super::regime::{Node, nodes};
use super::rotor_noise::put_rotor_noise;
use super::round::{MOST_ROUNDS, WORTH_A_ROUND};
use super::single::strays;
use crate::believed::Believed;
use crate::error::InputError;
use crate::inverse::{self, Fit, Model, Owner, Record, fit, scale};
use bristle_plant::effect::Scale;
use std::sync::Arc;

/// Standard deviation of a parameter of the axis file, as a share of it.
pub const DOUBT: f64 = 0.15;

/// The simulator alone, and what it was fitted to.
pub(super) struct Refitted {
    pub(super) records: Arc<[Record]>,
    /// Size of axis and records.
    pub(super) scale: Scale,
    pub(super) nodes: Vec<Node>,
    /// The simulator as the axis file has it.
    pub(super) model: Model,
    /// What it leaves over there, N m.
    pub(super) as_given: Vec<f64>,
    /// What the method leaves over of its own records there.
    pub(super) own_as_given: Own,
    /// The weight of each node in the fit.
    pub(super) weights: Vec<f64>,
    pub(super) fitted: Fit,
}

impl Refitted {
    /// Fits it.
    ///
    /// # Errors
    /// The friction model refuses the parameters of the axis file.
    pub(super) fn new(mut records: Vec<Record>, believed: &Believed) -> Result<Self, InputError> {
        let scale = scale(believed, &records);
        let nodes = nodes(&records, scale.z_ss_rad);
        let model = Model::base(believed, &records, DOUBT)?;
        let start = model.start();
        let mut as_given = model.left_over(&records, &start)?;
        put_rotor_noise(&mut records, &model, &nodes, &as_given, &scale);
        let refitted = |records: &[Record], as_given: &[f64]| {
            let own = own_left_over(&model, &start, records, &scale);
            let (weights, fitted) = refit(&model, records, &nodes, as_given, &own)?;
            Ok::<_, InputError>((own, weights, fitted))
        };
        let drifts = put_drift(&mut records, &model, &start, &nodes)?;
        if drifts {
            as_given = model.left_over(&records, &start)?;
        }
        let (mut own_as_given, mut weights, mut fitted) = refitted(&records, &as_given)?;
        // Drift that parameters hide which are off shows once they are refitted.
        if !drifts && put_drift(&mut records, &model, &fitted.at, &nodes)? {
            as_given = model.left_over(&records, &start)?;
            (own_as_given, weights, fitted) = refitted(&records, &as_given)?;
        }
        Ok(Self {
            records: records.into(),
            scale,
            nodes,
            model,
            as_given,
            own_as_given,
            weights,
            fitted,
        })
    }

    /// The axis that records are prepared for where the level of friction turned out to be far from what was believed: how coarse an encoder is
    /// beside friction, and how long means of its positions are, follows from that level.
    pub(super) fn prepared_for(&self, believed: &Believed) -> Option<Believed> {
        let mut pairs = self.model.free.iter().zip(&self.fitted.at);
        let (free, &level) =
            pairs.find(|(free, _)| free.owner == Owner::Own(inverse::Own::Coulomb))?;
        strays(free, level).then(|| {
            let mut found = believed.clone();
            found.coulomb_nm = free.value(level);
            found
        })
    }
}

/// The simulator alone, and the weights of its nodes.
///
/// # Errors
/// The friction model refuses the parameters of the axis file.
fn refit(
    model: &Model,
    records: &[Record],
    nodes: &[Node],
    as_given: &[f64],
    own: &Own,
) -> Result<(Vec<f64>, Fit), InputError> {
    let noise_of = |left_over: &[f64]| noise_of(model, records, nodes, left_over, own);
    let mut weights = noise_of(as_given).weights(nodes);
    let mut fitted = fit(model, records, &weights, model.start())?;
    let mut before = f64::NEG_INFINITY;
    for _ in 0..MOST_ROUNDS {
        let noise = noise_of(&fitted.left_over);
        weights = noise.weights(nodes);
        fitted = fit(model, records, &weights, fitted.at)?;
        let density = noise.log_density(nodes, &fitted.left_over);
        if density - before < WORTH_A_ROUND {
            break;
        }
        before = density;
    }
    Ok((weights, fitted))
}
