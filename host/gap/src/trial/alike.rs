//! Which effects a set of experiments cannot tell from the one that is there, known beforehand: what the true effect changes
//! along the records, less what the axis's own parameters take away, is laid against what every other effect can change.

use super::{OWN, Seen};
use crate::believed::Believed;
use crate::diagnose::Background;
use crate::error::InputError;
use crate::inverse::{DELAYS, Model, fit_at, scale};
use bristle_plant::effect::ALL;

/// Part of the floor below which nobody is asked to see the difference: the smallest gap that is asked for is the floor itself.
const BELOW_FLOOR: f64 = 0.5;

/// Ids of the effects that leave less than half the floor of what `id` changes: it is what an axis `with` it has more than the one
/// `without`.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn alike(
    id: &str,
    without: &Believed,
    with: &Believed,
    seen: &Seen,
) -> Result<Vec<&'static str>, InputError> {
    let Seen {
        records,
        nodes,
        weights,
        ..
    } = seen;
    let model = Model::base(without, records, OWN)?;
    let with = Model::base(with, records, OWN)?;
    let mut fit = fit_at(&model, records, weights, model.start())?;
    let rest = with.left_over(records, &with.start())?;
    for (change, rest) in fit.left_over.iter_mut().zip(&rest) {
        *change -= rest;
    }
    let scale = scale(without, records);
    let background = Background::new(&model, records, nodes, &scale, weights, &fit);
    let change = background.beyond(&background.rest());
    let counted = weights.iter().filter(|w| **w > 0.0).count() as f64;
    let apart = |gain: f64| ((change.norm_squared() - gain).max(0.0) / counted).sqrt();
    // What the axis's own parameters take away to first order, though no refit does, tells nothing of other effects.
    let tells = apart(0.0) > BELOW_FLOOR;
    let others = ALL.iter().filter(|entry| entry.id != id);
    let alike = others.filter(|entry| {
        let starts = || background.starts(entry);
        [id, entry.id].iter().all(|id| DELAYS.contains(id))
            || tells && starts().iter().any(|start| apart(start.gain) < BELOW_FLOOR)
    });
    Ok(alike.map(|entry| entry.id).collect())
}
