//! The search: the simulator refitted, every effect against it, then effects beside the best one.

use super::accuse::{
    ACCUSES, BELOW_OPEN_BESIDE, LEAST_SECOND, UNKNOWN, UNKNOWN_SLIDING, best_beside, best_pair,
    bristles_beside, foremost, gain_below_open, leaves,
};
use super::beside::Pairs;
use super::fitted_noise::{noise_of, own_left_over};
use super::hypothesis::{Hypothesis, fitted_ones, is_predicted, of_noise, replace_alone, sort};
use super::look_again::{look_again, pair_again, pairs_again};
use super::null::nulls;
use super::own::Own;
use super::play::{with_coupling, without_coupling};
use super::refitted::Refitted;
use super::round::{Compared, Round, noise_of_best};
use super::screen::gain;
use super::single::Ground;
use super::tried::Search;
use super::verdict::{Kind, Verdict, verdict};
use crate::error::InputError;
use crate::inverse::Model;
use bristle_plant::Unit;
use bristle_plant::effect::{ALL, Entry};

/// Below what is open it is asked of so many what they gain where they are not.
const NULLS: usize = 3;

/// It comes once a turn, which a linear axis does not know: any wave over its stroke is a cogging.
const ONCE_A_TURN: &str = "mechanics.unbalance";

/// Everything that may be accused.
pub fn catalogue() -> Vec<&'static Entry> {
    ALL.iter().collect()
}

/// Searches beside the refitted simulator, and what is concluded. `catalogue` is what may be accused; `progress` is called with the share done.
///
/// # Errors
/// The friction model refuses the parameters of the axis file.
pub fn search(
    refitted: Refitted,
    catalogue: &[&'static Entry],
    progress: &dyn Fn(f64),
) -> Result<(Search, Verdict), InputError> {
    let Refitted {
        records,
        scale,
        nodes,
        model,
        as_given,
        own_as_given,
        weights: old,
        fitted,
    } = refitted;
    let ground = Ground {
        records: &records,
        nodes: &nodes,
        scale: &scale,
        model: &model,
    };
    let noise_of =
        |left_over: &[f64], own: &Own| noise_of(&model, &records, &nodes, left_over, own);
    let own_of = |model: &Model, at: &[f64]| own_left_over(model, at, &records, &scale);
    let own = own_of(&model, &fitted.at);
    let noise = noise_of(&fitted.left_over, &own);
    progress(0.1);

    let mut catalogue: Vec<&'static Entry> = catalogue
        .iter()
        .copied()
        .filter(|entry| model.effects.iter().all(|added| added.entry.id != entry.id))
        .filter(|entry| scale.unit == Unit::Rotary || entry.id != ONCE_A_TURN)
        .collect();
    let fitted_ones: Vec<&'static Entry> = fitted_ones(&catalogue).collect();
    let asked = with_coupling(&fitted_ones, &model);
    let (screened, mut tried) = ground.try_each(&asked, &noise, &old, &fitted, &|share| {
        progress(0.1 + 0.55 * share)
    })?;
    without_coupling(&mut catalogue, &mut tried, &fitted);
    progress(0.65);

    // Noise once more, now from the best that was found: what it explains is no noise.
    let (own, noise, weights) =
        noise_of_best(&ground, &tried, &old, &own)?.unwrap_or_else(|| (own, noise, old.clone()));
    let (fitted, tried) = ground.refine(fitted, tried, &noise, &old, &weights)?;
    let first = Round {
        own,
        noise,
        weights,
        fitted,
        tried,
    };
    let screened: Vec<(&'static Entry, f64)> = screened
        .into_iter()
        .filter(|(entry, _)| catalogue.iter().any(|known| known.id == entry.id))
        .map(|(entry, starts)| (entry, gain(&starts)))
        .collect();
    let judged = |round: &Round, from: f64, to: f64| {
        let Compared {
            noise,
            base,
            single,
            several,
            unlisted_nats,
        } = round.compare(&ground, &catalogue, &|share| {
            progress(from + (to - from) * share)
        })?;
        let mut search = Search {
            screened: screened.clone(),
            records: records.clone(),
            nodes: nodes.clone(),
            scale,
            noise,
            weights: round.weights.clone(),
            as_given: as_given.clone(),
            own_as_given: own_as_given.clone(),
            own: round.own.clone(),
            base,
            single,
            several,
            nulls: Vec::new(),
            shown: None,
            unlisted_nats,
            leaves_another: false,
        };
        // A simulator that diverges has no null.
        search.nulls = nulls(&search, &accusable(&search)).unwrap_or_default();
        Ok(search)
    };
    let mut search = judged(&first, 0.75, 0.85)?;
    progress(0.9);
    let mut concluded = verdict(&search);
    let looks_again = concluded.kind == Kind::Unknown && !concluded.is_settled();
    if looks_again
        && let Some(second) = look_again(&ground, first, &own_as_given, &catalogue)?
        && let Some(explaining) = explaining(judged(&second, 0.9, 0.95)?)
    {
        (search, concluded) = explaining;
    }
    if looks_again && concluded.kind == Kind::Unknown {
        let pair = pair_again(&ground, &search)?.into_iter().collect();
        if let Some(explaining) = explaining_with(&search, pair, false)? {
            (search, concluded) = explaining;
        }
    }
    if looks_again && concluded.kind == Kind::Unknown {
        let pairs = pairs_again(&search, &catalogue)?;
        if let Some(explaining) = explaining_with(&search, pairs, true)? {
            (search, concluded) = explaining;
        }
    }
    progress(1.0);
    Ok((search, concluded))
}

/// A second look and its verdict, where it ends at an effect, or at two that leave nothing: a pair that leaves something stands for what it is not.
fn explaining(search: Search) -> Option<(Search, Verdict)> {
    let verdict = verdict(&search);
    let all = |&at: &usize| {
        let rest = &verdict.ranked[at].0.held_out;
        let times = [UNKNOWN, UNKNOWN_SLIDING];
        !leaves(&search.noise, &search.nodes, rest, times)
    };
    let explains = match verdict.kind {
        Kind::Unknown => false,
        Kind::Effects => verdict.named.iter().all(all),
        _ => true,
    };
    explains.then_some((search, verdict))
}

/// A search with these pairs, too, best first, where there are any, and with each effect of the best one alone from where it came out there; and
/// its verdict, where it explains.
///
/// # Errors
/// The friction model refuses the parameters.
fn explaining_with(
    search: &Search,
    pairs: Vec<Hypothesis>,
    leaves_another: bool,
) -> Result<Option<(Search, Verdict)>, InputError> {
    let Some(best) = pairs.first() else {
        return Ok(None);
    };
    let alone = Pairs::of(search, &search.judge()).each_alone(best)?;
    let mut search = search.clone();
    search.leaves_another = leaves_another;
    replace_alone(&mut search.single, alone);
    search.several.extend(pairs);
    sort(&mut search.several);
    search.nulls = nulls(&search, &accusable(&search)).unwrap_or_default();
    Ok(explaining(search))
}

/// What gains enough that its null is asked for.
fn accusable(search: &Search) -> Vec<&'static Entry> {
    let base = &search.base;
    let gains =
        |h: &&Hypothesis| h.score - base.score > ACCUSES && !of_noise(h) && h.is_credible(base);
    let foremost = foremost(&search.single, base);
    let pair = best_pair(search, |pair| pair.is_credible(base));
    // One of the best pair may be named alone.
    let of_pair = pair.into_iter().flat_map(Hypothesis::ids);
    let of_pair = of_pair.filter_map(|id| search.alone(id));
    let alone = foremost.into_iter().chain(of_pair).filter(gains);
    let alone = alone.map(|one| one.added[0]);
    let below = gain_below_open(search)
        .into_iter()
        .take(NULLS)
        .map(|(hypothesis, _)| hypothesis.added[0]);
    let beside = foremost.and_then(|one| best_beside(search, one));
    let bristles = foremost.and_then(|one| bristles_beside(search, one));
    let second = search
        .several
        .first()
        .into_iter()
        .chain(pair)
        .chain(beside)
        .chain(bristles)
        .filter(|pair| pair.is_credible(base) && !of_noise(pair))
        .filter(|pair| {
            foremost.is_some_and(|one| {
                pair.score - one.score > LEAST_SECOND
                    || search.score_of_all(pair) - search.score_of_all(one) > BELOW_OPEN_BESIDE.0
            })
        })
        .flat_map(|pair| pair.added.iter().copied())
        .filter(|entry| is_predicted(entry));
    let mut accusable: Vec<&'static Entry> = Vec::new();
    for entry in alone.chain(below).chain(second) {
        if accusable.iter().all(|known| known.id != entry.id) {
            accusable.push(entry);
        }
    }
    accusable
}
