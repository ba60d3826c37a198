//! The search: the simulator refitted, every effect against it, then effects beside the best one.

use super::accuse::{ACCUSES, gain_below_open};
use super::beside::Pairs;
use super::fitted_noise::{noise_of, own_left_over};
use super::hypothesis::{Hypothesis, Judge, NOISE_ONLY, of_noise, sort};
use super::likelihood::Own;
use super::null::nulls;
use super::regime::nodes;
use super::screen::gain;
use super::signature;
use super::single::Ground;
use super::tried::Search;
use crate::believed::Believed;
use crate::error::InputError;
use crate::inverse::{Fit, Model, Record, fit, scale};
use bristle_plant::Unit;
use bristle_plant::effect::{ALL, Entry};

/// The simulator alone is fitted so often at most: with the noise that each fit leaves the next one goes farther, and one
/// that began at wrong parameters has to come all the way.
const MOST_ROUNDS: usize = 8;
/// Nats that a further one must have gained: less than any effect must.
const WORTH_A_ROUND: f64 = 6.0;
/// Of so many it is asked what they gain where they are not.
const NULLS: usize = 3;
/// Standard deviation of a parameter of the axis file, as a share of it.
pub const DOUBT: f64 = 0.15;

/// It comes once a turn, which a linear axis does not know: any wave over its stroke is a cogging.
const ONCE_A_TURN: &str = "mechanics.unbalance";

/// Everything that may be accused.
pub fn catalogue() -> Vec<&'static Entry> {
    ALL.iter().collect()
}

/// Searches. `catalogue` is what may be accused; `progress` is called with the share done.
///
/// # Errors
/// The friction model refuses the parameters of the axis file.
pub fn search(
    records: Vec<Record>,
    believed: &Believed,
    catalogue: &[&'static Entry],
    progress: &dyn Fn(f64),
) -> Result<Search, InputError> {
    let scale = scale(believed, &records);
    let nodes = nodes(&records, scale.z_ss_rad);
    let model = Model::base(believed, &records, DOUBT)?;
    let ground = Ground {
        records: &records,
        nodes: &nodes,
        scale: &scale,
        model: &model,
    };
    let noise_of =
        |left_over: &[f64], own: &Own| noise_of(&model, &records, &nodes, left_over, own);
    let own_of = |model: &Model, at: &[f64]| own_left_over(model, at, &records, &scale);
    let as_given = model.left_over(&records, &model.start())?;
    let own_as_given = own_of(&model, &model.start());
    let (old, fitted) = refit(&ground, &as_given, &own_as_given)?;
    let own = own_of(&model, &fitted.at);
    let mut noise = noise_of(&fitted.left_over, &own);
    progress(0.1);

    let catalogue: Vec<&'static Entry> = catalogue
        .iter()
        .copied()
        .filter(|entry| model.effects.iter().all(|added| added.entry.id != entry.id))
        .filter(|entry| scale.unit == Unit::Rotary || entry.id != ONCE_A_TURN)
        .collect();
    let fitted_ones: Vec<&'static Entry> = catalogue
        .iter()
        .copied()
        .filter(|entry| !NOISE_ONLY.contains(&entry.id))
        .collect();
    let (screened, tried) = ground.try_each(&fitted_ones, &noise, &old, &fitted, &|share| {
        progress(0.1 + 0.6 * share)
    })?;
    progress(0.7);

    // Noise once more, now from the best that was found: what it explains is no noise.
    let mut weights = old.clone();
    let best = tried
        .iter()
        .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
    if let Some(best) = best {
        let of_best = own_of(&best.model, &best.fit.at);
        noise = noise_of(&best.fit.left_over, &own.clone().or_less(&of_best));
        weights = noise.weights(&nodes);
    }
    let (fitted, tried) = ground.refine(fitted, tried, &old, &weights)?;
    let noise = noise.explaining(&nodes, &fitted.left_over);
    let judge = Judge {
        records: &records,
        nodes: &nodes,
        weights: &weights,
        noise: &noise,
    };
    let base = judge.hypothesis(Vec::new(), model.clone(), fitted);
    let mut single = tried
        .into_iter()
        .map(|one| judge.hypothesis(vec![one.entry], one.model, one.fit))
        .collect::<Vec<Hypothesis>>();
    single.extend(signature::hypotheses(
        &base, &records, &nodes, &noise, &catalogue, &scale,
    ));
    sort(&mut single);
    progress(0.8);

    let pairs = Pairs {
        judge: &judge,
        scale: &scale,
        base: &base,
        single: &single,
    };
    let several = pairs.search(&fitted_ones, &|share| progress(0.8 + 0.15 * share))?;
    let screened = screened
        .into_iter()
        .map(|(entry, starts)| (entry, gain(&starts)));
    let mut search = Search {
        screened: screened.collect(),
        records,
        nodes,
        scale,
        noise,
        weights,
        as_given,
        own_as_given,
        own,
        base,
        single,
        several,
        nulls: Vec::new(),
        shown: None,
    };
    // A simulator that diverges has no null.
    search.nulls = nulls(&search, &accusable(&search)).unwrap_or_default();
    progress(1.0);
    Ok(search)
}

/// The simulator alone, and the weights of its nodes.
///
/// # Errors
/// The friction model refuses the parameters of the axis file.
fn refit(ground: &Ground<'_>, as_given: &[f64], own: &Own) -> Result<(Vec<f64>, Fit), InputError> {
    let &Ground {
        records,
        nodes,
        model,
        ..
    } = ground;
    let noise_of = |left_over: &[f64]| noise_of(model, records, nodes, left_over, own);
    let mut weights = noise_of(as_given).weights(nodes);
    let mut fitted = fit(model, records, &weights, model.start())?;
    let mut before = f64::NEG_INFINITY;
    for _ in 0..MOST_ROUNDS {
        let noise = noise_of(&fitted.left_over);
        weights = noise.weights(nodes);
        fitted = fit(model, records, &weights, fitted.at)?;
        let density = noise.log_density(nodes, &fitted.left_over);
        if density - before < WORTH_A_ROUND {
            break;
        }
        before = density;
    }
    Ok((weights, fitted))
}

/// What gains enough that its null is asked for.
fn accusable(search: &Search) -> Vec<&'static Entry> {
    let base = &search.base;
    let gains =
        |h: &&Hypothesis| h.score - base.score > ACCUSES && !of_noise(h) && h.is_credible(base);
    let mut accusable: Vec<&'static Entry> = search
        .single
        .iter()
        .take(NULLS)
        .filter(gains)
        .map(|h| h.added[0])
        .collect();
    for (hypothesis, _) in gain_below_open(search).into_iter().take(NULLS) {
        let entry = hypothesis.added[0];
        if accusable.iter().all(|known| known.id != entry.id) {
            accusable.push(entry);
        }
    }
    accusable
}
