//! Which effects a set of experiments cannot tell from the one that is there, known beforehand: what the true effect changes
//! along the records, less what the axis's own parameters take away, is laid against what every other effect can change.

use super::{OWN, Seen};
use crate::believed::Believed;
use crate::diagnose::Background;
use crate::error::InputError;
use crate::inverse::{Model, fit_at, scale};
use bristle_plant::effect::ALL;

/// Part of the floor below which nobody is asked to see the difference: the smallest gap that is asked for is the floor itself.
const BELOW_FLOOR: f64 = 0.5;

/// Ids of the effects that leave less than half the floor of what `id` changes, which `truth` has.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn alike(
    id: &str,
    truth: &Believed,
    seen: &Seen,
) -> Result<Vec<&'static str>, InputError> {
    let Seen {
        believed,
        records,
        nodes,
        weights,
        ..
    } = seen;
    let model = Model::base(believed, records, OWN)?;
    let with = Model::base(truth, records, OWN)?;
    let mut fit = fit_at(&model, records, weights, model.start())?;
    let rest = with.left_over(records, &with.start())?;
    for (change, rest) in fit.left_over.iter_mut().zip(&rest) {
        *change -= rest;
    }
    let scale = scale(believed, records);
    let background = Background::new(&model, records, nodes, &scale, weights, &fit);
    let change = background.beyond(&background.rest());
    let counted = weights.iter().filter(|w| **w > 0.0).count() as f64;
    let apart = |gain: f64| ((change.norm_squared() - gain).max(0.0) / counted).sqrt();
    let others = ALL.iter().filter(|entry| entry.id != id);
    let alike = others.filter(|entry| {
        let starts = background.starts(entry);
        starts.iter().any(|start| apart(start.gain) < BELOW_FLOOR)
    });
    Ok(alike.map(|entry| entry.id).collect())
}
