//! Details of an effect: harmonics of a wave, the knee of a limit, how a stop hardens, fitted once wave, limit or stop stands.

use super::accuse::ACCUSES;
use super::look_again::other_form;
use super::screen::Tried;
use crate::error::InputError;
use crate::inverse::{Fit, Free, Model, Owner, Record, fit};
use bristle_plant::effect::{Kind, Scale};
use rayon::prelude::*;

/// Part of the fall of the sum of squares by the best effect that another must bring before its details are asked for.
const WORTH_DETAILS: f64 = 0.3;
/// Part of its range at which a detail of one sign starts; at zero its slope says nothing.
const STARTS_AT: f64 = 0.25;

/// Fits the details of all that have some and do nearly as well beside a simulator `alone` as the best; they stay where they gain as
/// much as accuses.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn try_details(
    found: &mut [Tried],
    alone: &Fit,
    records: &[Record],
    scale: &Scale,
    weights: &[f64],
) -> Result<(), InputError> {
    let best = found
        .iter()
        .map(|one| one.fit.cost)
        .fold(alone.cost, f64::min);
    let worth_it = alone.cost - (WORTH_DETAILS * (alone.cost - best)).max(ACCUSES);
    found.par_iter_mut().try_for_each(|one| {
        if one.fit.cost > worth_it {
            return Ok(());
        }
        let Some(model) = with_details(&one.model, scale) else {
            return Ok(());
        };
        // A form that does worse without them may do better with them.
        let other = other_form(&model, scale);
        let enough = one.fit.cost - ACCUSES;
        let mut start = one.fit.at.clone();
        start.extend(&model.start()[start.len()..]);
        for model in std::iter::once(model).chain(other) {
            let fit = fit(&model, records, weights, start.clone())?;
            if fit.cost < enough.min(one.fit.cost) {
                (one.model, one.fit) = (model, fit);
            }
        }
        Ok(())
    })
}

/// The model with the details of its last effect free; none where that has none, or no wave, limit or stop.
fn with_details(model: &Model, scale: &Scale) -> Option<Model> {
    let place = model.effects.len().checked_sub(1)?;
    let parameters = model.effects[place].entry.parameters;
    let is_free = |i: usize| {
        let own = Owner::Effect(place, i);
        model.free.iter().any(|free| free.owner == own)
    };
    let of = |kind: Kind| (0..parameters.len()).filter(move |&i| parameters[i].kind == kind);
    let mut stands = [Kind::Phase, Kind::Limit, Kind::Stop]
        .into_iter()
        .flat_map(of);
    if !stands.any(is_free) {
        return None;
    }
    let mut with = model.clone();
    for i in of(Kind::Detail).filter(|&i| !is_free(i)) {
        let [low, high] = (parameters[i].range)(scale);
        let start = if low < 0.0 { 0.0 } else { STARTS_AT * high };
        let (owner, name) = (Owner::Effect(place, i), parameters[i].name(scale.unit));
        // Small ones are usual.
        let mut free = Free::linear(owner, name, start, 0.5 * high, [low, high]);
        free.center = 0.0;
        with.free.push(free);
    }
    (with.free.len() > model.free.len()).then_some(with)
}
