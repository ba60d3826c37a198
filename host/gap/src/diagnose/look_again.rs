//! A second look where an effect explains much and leaves much: a fit goes downhill only, and with what is sudden, as a dead
//! zone or a play, it stops short.

use super::single::Tried;
use crate::error::InputError;
use crate::inverse::{Fit, Free, Model, Owner, Record, fit_alone, fit_at, fit_near};
use bristle_plant::effect::{Kind, Scale};
use rayon::prelude::*;

/// What parameters of the effect a fit starts again from, in times of where it ended; beside zero, what is more or less than 1 in
/// times of what is usual.
const TIMES: [f64; 4] = [0.5, 0.7, 1.35, 1.8];
/// Part of the cost that a look must take away for another one from there.
const WORTH_ANOTHER: f64 = 0.1;
/// Most looks.
const LOOKS: usize = 3;

/// The effect with the parameters that fit best of those near by and of its other forms.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn look_again(
    records: &[Record],
    scale: &Scale,
    mut tried: Tried,
) -> Result<Tried, InputError> {
    for _ in 0..LOOKS {
        let weights = &tried.weights;
        let own = of_simulator(&tried.model);
        let known = tried.fit.jacobian.columns(0, own).into_owned();
        let near = near(&tried.model, &tried.fit)
            .into_par_iter()
            .filter_map(|at| {
                let fit = fit_near(&tried.model, records, weights, at, &known).ok()?;
                Some((tried.model.clone(), fit))
            });
        // Nothing that is known of one form holds for the other.
        let other_form = other_form(&tried.model, scale).and_then(|model| {
            let fit = fit_alone(&model, records, weights, tried.fit.at.clone()).ok()?;
            Some((model, fit))
        });
        let best = near
            .chain(other_form.into_par_iter())
            .min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        let Some((model, fit)) = best.filter(|(_, fit)| fit.cost < tried.fit.cost) else {
            break;
        };
        let taken = 1.0 - fit.cost / tried.fit.cost;
        tried.fit = fit_at(&model, records, weights, fit.at)?;
        tried.model = model;
        if taken < WORTH_ANOTHER {
            break;
        }
    }
    Ok(tried)
}

/// Parameters that are not of the effect that was added last.
pub(super) fn of_simulator(model: &Model) -> usize {
    let of_last = |free: &Free| {
        matches!(free.owner, Owner::Effect(effect, _) | Owner::OnRecord(effect, ..)
            if effect + 1 == model.effects.len())
    };
    let own = model.free.iter().position(of_last);
    own.unwrap_or(model.free.len())
}

/// Points off a fit, by one parameter of the effect each, or by both of two.
fn near(model: &Model, fit: &Fit) -> Vec<Vec<f64>> {
    let of_effect = |(_, free): &(usize, &Free)| {
        matches!(free.owner, Owner::Effect(effect, parameter)
            if effect + 1 == model.effects.len()
                && model.effects[effect].entry.parameters[parameter].kind != Kind::Phase)
    };
    let off = |(i, free): (usize, &Free)| {
        let value = free.value(fit.at[i]);
        TIMES.map(|times| {
            let mut at = fit.at.clone();
            at[i] = free.coordinate(if value == 0.0 {
                (times - 1.0) * free.spread
            } else {
                times * value
            });
            at
        })
    };
    let places: Vec<(usize, &Free)> = model.free.iter().enumerate().filter(of_effect).collect();
    let mut points: Vec<Vec<f64>> = places.iter().copied().flat_map(off).collect();
    // Two that make up for each other, as the width of a dead zone and its jump, go together.
    if let [first, second] = places[..] {
        let together = off(first)
            .into_iter()
            .zip(off(second))
            .map(|(mut at, other)| {
                at[second.0] = other[second.0];
                at
            });
        points.extend(together);
    }
    points
}

/// The model with its last effect in its other form, where it has one: no fit goes from one to the other.
fn other_form(model: &Model, scale: &Scale) -> Option<Model> {
    let mut other = model.clone();
    let added = other.effects.last_mut()?;
    let parameters = added.entry.parameters;
    let form = parameters.iter().position(|p| p.kind == Kind::Form)?;
    let [one, two] = (parameters[form].range)(scale);
    added.values[form] = one + two - added.values[form];
    Some(other)
}
