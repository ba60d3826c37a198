//! The noise of records beside a fitted model, and what the method leaves over of that model's own records.

use super::axis_at::axis_at;
use super::hypothesis::{Hypothesis, Judge};
use super::likelihood::Noise;
use super::own::Own;
use super::regime::{Node, nodes};
use super::rotor_noise::as_quiet_as;
use crate::error::InputError;
use crate::inverse::{Model, Record, fit_alone, sees_bristles, twins};
use bristle_plant::effect::Scale;

/// Where friction is whatever holds, or what holds it bends by less than is seen, it is known to this part of itself while the axis hardly
/// moves. Records of a model's own do not say so: they follow the path that the method took for the true one.
const HELD: f64 = 0.5;

/// The noise of records that a fitted model leaves this over of.
pub(super) fn noise_of(
    model: &Model,
    records: &[Record],
    nodes: &[Node],
    left_over: &[f64],
    own: &Own,
) -> Noise {
    let believed = &model.believed;
    let holds_nm = if sees_bristles(believed, records) {
        0.0
    } else {
        HELD * believed.coulomb_nm
    };
    Noise::beside(
        records,
        nodes,
        left_over,
        believed.whole_inertia_kg_m2(),
        holds_nm,
        own,
    )
}

/// A model's own records along these without noise, and the nodes of them; see [`twins`].
///
/// # Errors
/// It cannot be simulated.
pub(super) fn twins_of(
    model: &Model,
    at: &[f64],
    records: &[Record],
    scale: &Scale,
) -> Result<(Vec<Record>, Vec<Node>), InputError> {
    of_axis(model, at, records, scale, 0.0, 0)
}

/// A hypothesis's own records with the noise of the measured ones, which is no more than what it leaves over of them; each with a seed of its own from the first on.
///
/// # Errors
/// It cannot be simulated.
pub(super) fn noisy_twins(
    by: &Hypothesis,
    measured: &Judge<'_>,
    scale: &Scale,
    first_seed: u64,
) -> Result<(Vec<Record>, Vec<Node>), InputError> {
    let records = as_quiet_as(measured.records, measured.nodes, &by.fit.left_over);
    of_axis(&by.model, &by.fit.at, &records, scale, 1.0, first_seed)
}

fn of_axis(
    model: &Model,
    at: &[f64],
    records: &[Record],
    scale: &Scale,
    noise_times: f64,
    first_seed: u64,
) -> Result<(Vec<Record>, Vec<Node>), InputError> {
    let twins = twins(&axis_at(&model.at(at)), records, noise_times, first_seed)?;
    let nodes = nodes(&twins, scale.z_ss_rad);
    Ok((twins, nodes))
}

/// What the method leaves over of a model's own records without noise; nothing where it cannot be simulated.
pub(super) fn own_left_over(model: &Model, at: &[f64], records: &[Record], scale: &Scale) -> Own {
    twins_of(model, at, records, scale)
        .and_then(|(twins, nodes)| {
            let left_over = model.left_over(&twins, at)?;
            Ok(Own::new(&nodes, &left_over, records.len()))
        })
        .unwrap_or_default()
}

/// Records of a model's own.
pub(super) struct OwnRecords {
    pub(super) records: Vec<Record>,
    pub(super) nodes: Vec<Node>,
    /// What it leaves over of them, N m at each node.
    pub(super) left_over: Vec<f64>,
}

/// What a hypothesis leaves over of its own records once it is fitted to them; nothing where it cannot be simulated.
pub(super) fn left_once_fitted(by: &Hypothesis, measured: &Judge<'_>, scale: &Scale) -> Own {
    own_records(by, measured, scale)
        .map(|own| Own::new(&own.nodes, &own.left_over, measured.records.len()))
        .unwrap_or_default()
}

/// Its own records, with the noise of those that were measured, and what it leaves over of them once it is fitted to them as it was to those.
///
/// # Errors
/// It cannot be simulated.
pub(super) fn own_records(
    by: &Hypothesis,
    measured: &Judge<'_>,
    scale: &Scale,
) -> Result<OwnRecords, InputError> {
    let mut about = by.model.clone();
    for (free, &at) in about.free.iter_mut().zip(&by.fit.at) {
        free.center = at;
    }
    let (records, nodes) = noisy_twins(by, measured, scale, 0)?;
    let weights = measured.noise.weights(&nodes);
    let fit = fit_alone(&about, &records, &weights, by.fit.at.clone())?;
    Ok(OwnRecords {
        left_over: fit.left_over,
        records,
        nodes,
    })
}
