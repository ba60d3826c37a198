//! A wave with its harmonics: fitted once the wave itself stands.

use super::accuse::ACCUSES;
use super::screen::Tried;
use crate::error::InputError;
use crate::inverse::{Fit, Free, Model, Owner, Record, fit};
use bristle_plant::effect::{Kind, Scale};
use rayon::prelude::*;

/// Part of the fall of the sum of squares by the best effect that a wave must bring before its harmonics are asked for.
const WORTH_HARMONICS: f64 = 0.3;

/// Fits the harmonics of all that have some and do nearly as well beside a simulator `alone` as the best; they stay where they gain as
/// much as accuses.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn try_harmonics(
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
    let worth_it = alone.cost - (WORTH_HARMONICS * (alone.cost - best)).max(ACCUSES);
    found.par_iter_mut().try_for_each(|one| {
        if one.fit.cost > worth_it {
            return Ok(());
        }
        let Some(model) = with_harmonics(&one.model, scale) else {
            return Ok(());
        };
        let start = model.free[one.fit.at.len()..].iter();
        let start = one.fit.at.iter().copied().chain(start.map(|_| 0.0));
        let fit = fit(&model, records, weights, start.collect())?;
        if fit.cost < one.fit.cost - ACCUSES {
            (one.model, one.fit) = (model, fit);
        }
        Ok(())
    })
}

/// The model with the harmonics of its last effect free; none where that has none, or no wave.
fn with_harmonics(model: &Model, scale: &Scale) -> Option<Model> {
    let place = model.effects.len().checked_sub(1)?;
    let parameters = model.effects[place].entry.parameters;
    let of_wave = |free: &Free| matches!(free.owner, Owner::Effect(owner, i) if owner == place && parameters[i].kind == Kind::Phase);
    if !model.free.iter().any(of_wave) {
        return None;
    }
    let mut with = model.clone();
    for (i, parameter) in parameters.iter().enumerate() {
        let is_free = model
            .free
            .iter()
            .any(|free| free.owner == Owner::Effect(place, i));
        if parameter.kind != Kind::Harmonic || is_free {
            continue;
        }
        let range = (parameter.range)(scale);
        let (owner, name) = (Owner::Effect(place, i), parameter.name(scale.unit));
        // Small ones are usual.
        let spread = 0.5 * range[1];
        with.free
            .push(Free::linear(owner, name, 0.0, spread, range));
    }
    (with.free.len() > model.free.len()).then_some(with)
}
