//! Whether a set of experiments cannot tell an effect from the one that is there, known beforehand: the other one is fitted to the
//! records with the axis's own parameters, from the truth and with the true floor as noise. What it leaves over beyond the truth, fitted
//! alike since when the effort acts is no part of the truth, is what tells them apart.

use super::Seen;
use crate::believed::Believed;
use crate::diagnose::{Background, DOUBT};
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
    let with = Model::base(with, records, DOUBT)?;
    let rest = fit_alone(&with, records, weights, with.start())?.left_over;
    let counted = weights.iter().filter(|w| **w > 0.0).count() as f64;
    let apart = |left_over: &[f64]| {
        let beyond = left_over.iter().zip(&rest).zip(weights);
        let squares: f64 = beyond.map(|((a, b), w)| ((a - b) * w).powi(2)).sum();
        (squares / counted).sqrt()
    };
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
        if apart(&fitted.left_over) < BELOW_FLOOR {
            return Ok(true);
        }
    }
    Ok(false)
}
