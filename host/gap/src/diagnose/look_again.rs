//! A second look where nothing explains what is left: a fit goes downhill only, and with what is sudden, as a dead zone or a
//! play, it stops short; and where it failed in one regime altogether, the weights hold that regime as noise.

use super::accuse::ACCUSES;
use super::beside::Pairs;
use super::coupling::COUPLING;
use super::fitted_noise::{noise_of, own_left_over};
use super::hypothesis::{
    Hypothesis, Judge, fitted_ones, is_credible, is_without_noise, log_belief,
};
use super::likelihood::Noise;
use super::other_couplings::other_loads;
use super::own::Own;
use super::play::{PLAY, corrected_coupling, springs};
use super::round::{Round, Settling, WORTH_A_ROUND, Weighed};
use super::screen::{Tried, fit_best, screen};
use super::single::Ground;
use super::tried::Search;
use super::usual_play::usual_play;
use crate::error::InputError;
use crate::inverse::{Fit, Free, Model, Owner, fit_alone, fit_at, fit_near};
use bristle_plant::effect::{Entry, Kind, Scale};
use rayon::prelude::*;
use std::ops::Range;

/// So many of the best effects are looked at again.
const LOOKED_AT: usize = 4;
/// What parameters of the effect a fit starts again from, in times of where it ended; beside zero, what is more or less than 1 in
/// times of what is usual.
const TIMES: [f64; 4] = [0.5, 0.7, 1.35, 1.8];
/// Most looks, and most rounds of new weights.
const LOOKS: usize = 3;

/// The round anew with the noise that the best effect leaves once each of the best was looked at again: where it explains more than
/// the best did by as much as accuses. `as_given` is what the method leaves over of the simulator as it stands, `catalogue` what may be accused.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn look_again(
    ground: &Ground<'_>,
    first: Round,
    as_given: &Own,
    catalogue: &[&'static Entry],
) -> Result<Option<Round>, InputError> {
    let &Ground {
        records,
        nodes,
        scale,
        model,
    } = ground;
    let score = |model: &Model, fit: &Fit| {
        first.noise.log_density(nodes, &fit.left_over) + log_belief(model, &fit.at)
    };
    let of_first = |&at: &usize| score(&first.tried[at].model, &first.tried[at].fit);
    let belief = log_belief(model, &first.fitted.at);
    let credible = |&at: &usize| is_credible(&first.tried[at].model, &first.tried[at].fit, belief);
    let mut order: Vec<usize> = (0..first.tried.len()).filter(credible).collect();
    order.sort_by(|a, b| of_first(b).total_cmp(&of_first(a)));
    order.truncate(LOOKED_AT);
    let again = Again {
        ground,
        own: &first.own,
        noise: &first.noise,
        weights: &first.weights,
    };
    let looked_at: Vec<&'static Entry> = order.iter().map(|&at| first.tried[at].entry).collect();
    let anew = again.anew(&looked_at, &first.fitted)?;
    let background = ground.background(&first.weights, &first.fitted);
    let mut found: Vec<(usize, Tried)> = Vec::new();
    for &at in &order {
        let tried = &first.tried[at];
        let better = anew
            .iter()
            .find(|one| one.entry.id == tried.entry.id && one.fit.cost < tried.fit.cost);
        let Tried { model, fit, .. } = better.unwrap_or(tried);
        let (model, fit) = again.at(model, fit)?;
        let entry = tried.entry;
        let mut one = Tried { entry, model, fit };
        other_loads(&background, &mut one)?;
        // A coupling that does not do best open loop either follows whatever swings as fast.
        if Some(&at) == order.first() {
            one = corrected_coupling(&background, one)?;
        }
        found.push((at, one));
    }
    // What did not come out before stands behind the others.
    let tried = &first.tried;
    let place = |id: &str| {
        let place = tried.iter().position(|one| one.entry.id == id);
        place.unwrap_or(tried.len())
    };
    let play = catalogue.iter().find(|entry| entry.id == PLAY);
    let springs = tried.iter().filter(|one| springs(one.entry));
    let nearest = springs.min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
    let other = nearest.or(order.first().map(|&best| &tried[best]));
    if let (Some(&play), Some(other)) = (play, other) {
        let coupling = tried.get(place(COUPLING));
        let one = usual_play(&background, play, other, coupling, &again.settling())?;
        found.extend(one.map(|one| (place(PLAY), one)));
    }
    let few = again.in_few_moments(&first.fitted, catalogue)?;
    found.extend(few.into_iter().map(|one| (place(one.entry.id), one)));
    let scored = found
        .into_iter()
        .map(|(at, one)| (score(&one.model, &one.fit), at, one));
    // Of equals the first.
    let best = scored.reduce(|best, other| if best.0 < other.0 { other } else { best });
    let Some((
        score,
        at,
        Tried {
            entry,
            model: with,
            fit,
        },
    )) = best
    else {
        return Ok(None);
    };
    let before = order.first().map_or_else(
        || first.noise.log_density(nodes, &first.fitted.left_over) + belief,
        of_first,
    );
    if score - before < ACCUSES {
        return Ok(None);
    }
    let [alone, of_best] = [(model, &first.fitted.at), (&with, &fit.at)]
        .map(|(model, at)| own_left_over(model, at, records, scale));
    let own = Own::middle(&alone, &of_best, as_given);
    let noise = noise_of(&with, records, nodes, &fit.left_over, &own);
    let weights = noise.weights(nodes);
    let mut tried = first.tried;
    let fit = fit_at(&with, records, &first.weights, fit.at)?;
    let model = with;
    tried.splice(at..tried.len().min(at + 1), [Tried { entry, model, fit }]);
    let (fitted, tried) = ground.refine(first.fitted, tried, &noise, &first.weights, &weights)?;
    Ok(Some(Round {
        own,
        noise,
        weights,
        fitted,
        tried,
    }))
}

/// The best pair looked at again, where one of it acts in moments and it does better, by as much as accuses, than it did.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn pair_again(
    ground: &Ground<'_>,
    search: &Search,
) -> Result<Option<Hypothesis>, InputError> {
    let (records, nodes) = (ground.records, ground.nodes);
    let is_fitted = |pair: &&Hypothesis| is_without_noise(pair) && pair.is_credible(&search.base);
    let Some(pair) = search
        .several
        .iter()
        .find(is_fitted)
        .filter(|pair| pair.added.iter().any(|entry| entry.acts_in_moments()))
    else {
        return Ok(None);
    };
    let again = Again {
        ground,
        own: &search.own,
        noise: &search.noise,
        weights: &search.weights,
    };
    let fit = fit_at(&pair.model, records, &search.weights, pair.fit.at.clone())?;
    let (model, fit) = again.at(&pair.model, &fit)?;
    let judge = Judge {
        records,
        nodes,
        weights: &search.weights,
        noise: &search.noise,
    };
    let found = judge.hypothesis(pair.added.clone(), model, fit);
    Ok((found.score > pair.score + ACCUSES).then_some(found))
}

/// The best effect with every other one, where few were asked for because it left no room for a second one: it leaves something all the same.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn pairs_again(
    search: &Search,
    catalogue: &[&'static Entry],
) -> Result<Vec<Hypothesis>, InputError> {
    let fitted: Vec<&'static Entry> = fitted_ones(catalogue).collect();
    Pairs::of(search, &search.judge()).without_room(&fitted)
}

struct Again<'a> {
    ground: &'a Ground<'a>,
    own: &'a Own,
    noise: &'a Noise,
    weights: &'a [f64],
}

impl Again<'_> {
    fn settling(&self) -> Settling<'_> {
        Settling {
            ground: self.ground,
            own: self.own,
            compared: self.noise,
            most: LOOKS,
            least_gain: 0.0,
        }
    }

    fn density(&self, fit: &Fit) -> f64 {
        let nodes = self.ground.nodes;
        self.noise.log_density(nodes, &fit.left_over)
    }

    /// Effects from the starts that promise most with these weights: by those of the first search a wave of another order did.
    fn anew(&self, entries: &[&'static Entry], fitted: &Fit) -> Result<Vec<Tried>, InputError> {
        let background = self.ground.background(self.weights, fitted);
        let screened = screen(&background, entries, &|_| ());
        fit_best(&background, &screened, entries.len(), true, |_, _| false)
    }

    /// The best of all effects by weights that the moments which hold a regime as noise have no part in.
    fn in_few_moments(
        &self,
        fitted: &Fit,
        catalogue: &[&'static Entry],
    ) -> Result<Vec<Tried>, InputError> {
        let &Ground {
            records,
            nodes,
            model,
            ..
        } = self.ground;
        let Some(weights) = self.noise.weights_of_most(nodes, &fitted.left_over) else {
            return Ok(Vec::new());
        };
        let fitted = fit_at(model, records, &weights, fitted.at.clone())?;
        let background = self.ground.background(&weights, &fitted);
        let entries: Vec<&'static Entry> = fitted_ones(catalogue).collect();
        let screened = screen(&background, &entries, &|_| ());
        fit_best(&background, &screened, LOOKED_AT, false, |_, _| false)
    }

    /// A fit looked at again.
    fn at(&self, model: &Model, fit: &Fit) -> Result<(Model, Fit), InputError> {
        let mut best = Weighed {
            model: model.clone(),
            fit: fit.clone(),
            weights: self.weights.to_vec(),
        };
        let settling = self.settling();
        for _ in 0..LOOKS {
            let before = self.density(&best.fit);
            let weights = settling.noise(&best).weights(self.ground.nodes);
            best = settling.settled(best, weights)?;
            best = self.elsewhere(best)?;
            if self.density(&best.fit) - before < WORTH_A_ROUND {
                break;
            }
        }
        Ok((best.model, best.fit))
    }

    /// With the parameters that fit best of those near by and of its other forms.
    fn elsewhere(&self, one: Weighed) -> Result<Weighed, InputError> {
        let &Ground { records, scale, .. } = self.ground;
        let Weighed {
            model,
            fit,
            weights,
        } = &one;
        let of_simulator = self.ground.model.free.len();
        let known = self.ground.jacobian(model, fit, weights, weights)?;
        let known = known.columns(0, of_simulator).into_owned();
        let tried = self.ground.model.effects.len()..model.effects.len();
        let near = near(model, fit, tried).into_par_iter().filter_map(|at| {
            let fit = fit_near(model, records, weights, at, &known).ok()?;
            Some((model.clone(), fit))
        });
        // Nothing that is known of one form holds for the other.
        let other_form = other_form(model, scale).and_then(|other| {
            let fit = fit_alone(&other, records, weights, fit.at.clone()).ok()?;
            Some((other, fit))
        });
        let best = near
            .chain(other_form.into_par_iter())
            .min_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        match best.filter(|(_, other)| other.cost < fit.cost) {
            Some((model, fit)) => {
                let fit = fit_at(&model, records, weights, fit.at)?;
                Ok(Weighed { model, fit, ..one })
            }
            None => Ok(one),
        }
    }
}

/// Points off a fit, by one parameter each of the effects that are tried, or by both of one of two; of several effects by those that act in moments.
fn near(model: &Model, fit: &Fit, tried: Range<usize>) -> Vec<Vec<f64>> {
    let alone = tried.len() == 1;
    let of_effect = |place: usize| -> Vec<(usize, &Free)> {
        let parameters = model.effects[place].entry.parameters;
        let moves = |(_, free): &(usize, &Free)| {
            matches!(free.owner, Owner::Effect(owner, parameter)
                if owner == place && parameters[parameter].kind != Kind::Phase)
        };
        model.free.iter().enumerate().filter(moves).collect()
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
    let mut points = Vec::new();
    let stops_short = |place: &usize| alone || model.effects[*place].entry.acts_in_moments();
    for places in tried.filter(stops_short).map(of_effect) {
        points.extend(places.iter().copied().flat_map(off));
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
    }
    points
}

/// The model with its last effect in its other form, where it has one: no fit goes from one to the other.
pub(super) fn other_form(model: &Model, scale: &Scale) -> Option<Model> {
    let mut other = model.clone();
    let added = other.effects.last_mut()?;
    let parameters = added.entry.parameters;
    let form = parameters.iter().position(|p| p.kind == Kind::Form)?;
    let [one, two] = (parameters[form].range)(scale);
    added.values[form] = one + two - added.values[form];
    Some(other)
}
