//! Whether a set of experiments cannot tell an effect from the one that is there, known beforehand: the other one is fitted to the
//! records with the axis's own parameters, from the truth and with the true floor as noise. What it leaves over beyond the truth, fitted
//! alike since when the effort acts is no part of the truth, is what tells them apart.

use super::Seen;
use crate::believed::Believed;
use crate::diagnose::{Background, DOUBT, Start};
use crate::error::InputError;
use crate::inverse::{DELAYS, Model, fit, fit_alone, fit_at, scale};
use bristle_plant::effect::Entry;

/// Part of the floor below which nobody is asked to see the difference: the smallest gap that is asked for is the floor itself.
const BELOW_FLOOR: f64 = 0.5;
/// Starts that the other one is fitted from.
const STARTS: usize = 3;

/// Whether `other` leaves less than half the floor of what `id` changes: it is what an axis `with` it has more than the one
/// `without`.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn alike(
    id: &str,
    other: &'static Entry,
    without: &Believed,
    with: &Believed,
    seen: &Seen,
) -> Result<bool, InputError> {
    if [id, other.id].iter().all(|id| DELAYS.contains(id)) {
        return Ok(true);
    }
    let Seen {
        records,
        nodes,
        weights,
        ..
    } = seen;
    let model = Model::base(without, records, DOUBT)?;
    let rest = left_over(with, seen)?;
    let scale = scale(without, records);
    let as_believed = fit_at(&model, records, weights, model.start())?;
    let refitted = fit(&model, records, weights, model.start())?;
    for from in [as_believed, refitted] {
        let background = Background::new(&model, records, nodes, &scale, weights, &from);
        let mut starts = background.starts(other);
        starts.truncate(STARTS);
        let Some((model, near)) = background.try_effect(other, &starts)? else {
            continue;
        };
        let fitted = fit(&model, records, weights, near.at)?;
        if apart(&fitted.left_over, &rest, weights) < BELOW_FLOOR {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Whether each of some effects of these values, which are there together, shows: an axis with one other alone, whatever its parameters, leaves at least
/// half the floor beyond what all leave. A limit of which another one lets nothing through shows nowhere.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn all_show(
    effects: &[(&'static Entry, Vec<f64>)],
    with: &Believed,
    seen: &Seen,
) -> Result<bool, InputError> {
    let Seen {
        believed,
        records,
        nodes,
        weights,
        ..
    } = seen;
    let rest = left_over(with, seen)?;
    let model = Model::base(believed, records, DOUBT)?;
    let scale = scale(believed, records);
    let from = fit_at(&model, records, weights, model.start())?;
    let background = Background::new(&model, records, nodes, &scale, weights, &from);
    for (other, values) in effects {
        let start = Start::at(values.clone());
        let Some((model, near)) = background.try_effect(other, &[start])? else {
            continue;
        };
        let alone = fit(&model, records, weights, near.at)?.left_over;
        if apart(&alone, &rest, weights) < BELOW_FLOOR {
            return Ok(false);
        }
    }
    Ok(true)
}

/// What an axis leaves over with its own parameters fitted, N m.
fn left_over(axis: &Believed, seen: &Seen) -> Result<Vec<f64>, InputError> {
    let model = Model::base(axis, &seen.records, DOUBT)?;
    let fitted = fit_alone(&model, &seen.records, &seen.weights, model.start())?;
    Ok(fitted.left_over)
}

/// Root-mean-square of how far two rests are apart where they count.
fn apart(one: &[f64], other: &[f64], weights: &[f64]) -> f64 {
    let counted = weights.iter().filter(|w| **w > 0.0).count() as f64;
    let beyond = one.iter().zip(other).zip(weights);
    let squares: f64 = beyond.map(|((a, b), w)| ((a - b) * w).powi(2)).sum();
    (squares / counted).sqrt()
}
