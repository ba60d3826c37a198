//! Details of an effect: harmonics of a wave, the knee of a limit, how a stop hardens, fitted once wave, limit or stop stands.

use super::accuse::ACCUSES;
use super::candidate::TORQUE_WAVES;
use super::look_again::other_form;
use super::screen::Tried;
use crate::error::InputError;
use crate::inverse::{Fit, Free, Model, Owner, Record, fit};
use bristle_plant::effect::{Kind, Parameter, Scale};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Part of the fall of the sum of squares by the best effect that another must bring before its details are asked for.
const WORTH_DETAILS: f64 = 0.3;
/// Waves of torque that must be passed: harmonics of fewer are any function of the place, as a spring is.
const WAVES: f64 = 2.0;
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
    if !stands.any(is_free) || !passes_waves(model, place, scale) {
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

/// Whether an axis passes enough of the wave of an effect, if that adds torque over the angle.
pub(super) fn passes_waves(model: &Model, place: usize, scale: &Scale) -> bool {
    let added = &model.effects[place];
    // Friction is told from what adds torque by its sign.
    if !TORQUE_WAVES.contains(&added.entry.id) {
        return true;
    }
    let is_order = |parameter: &Parameter| parameter.kind == Kind::Order;
    added
        .entry
        .parameters
        .iter()
        .position(is_order)
        .is_none_or(|order| {
            let travel_rad = scale.highest_rad - scale.lowest_rad;
            scale.unit.wave_rad(added.values[order]) * travel_rad > WAVES * TAU
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis_file::AxisFile;
    use crate::believed::Believed;
    use crate::inverse::Added;
    use crate::scale::without_record;
    use bristle_plant::Unit;
    use bristle_plant::effect::ALL;
    use std::path::Path;

    /// Whether cogging of so many waves a metre has harmonics on an axis of half a metre.
    fn has_harmonics(order_per_m: f64) -> bool {
        let mut file = AxisFile::new(Unit::Linear, 20.0);
        file.friction.coulomb = Some(10.0);
        let believed = Believed::new(&file, Path::new("axis.toml")).unwrap();
        let mut model = Model::base(&believed, &[], 0.1).unwrap();
        let entry = ALL
            .iter()
            .find(|entry| entry.id == "actuator.cogging")
            .unwrap();
        let mut values = vec![0.0; entry.parameters.len()];
        values[1] = order_per_m;
        model.effects.push(Added { entry, values });
        let phase = Owner::Effect(0, 2);
        let free = Free::linear(phase, "phase_rad", 0.0, 3.0, [-20.0, 20.0]);
        model.free.push(free);
        with_details(&model, &without_record(&believed)).is_some()
    }

    #[test]
    fn harmonics_are_those_of_a_wave_that_is_passed() {
        assert!(!has_harmonics(3.9));
        assert!(has_harmonics(4.1));
    }
}
