//! From everything that was tried to a verdict: none, parameters, an effect, several, ambiguous or unknown.
//!
//! Scores are held-out log densities over as many nodes as are independent. What an effect explains is a share of the
//! explainable gap: (before^2 - after^2)/(before^2 - floor^2).

use super::closed::closed_over;
use super::held_out::spreads;
use super::likelihood::Noise;
use super::regime::{Node, Regime};
use super::search::{Hypothesis, Search};
use crate::inverse::{Own, Owner};
use serde::Serialize;

/// What is concluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// One effect.
    Effect,
    /// All of several effects.
    Effects,
    /// The simulator's own parameters were wrong.
    Parameters,
    /// Nothing is missing.
    None,
    /// Something is, and nothing in the catalogue explains it.
    Unknown,
    /// Any one of several effects.
    Ambiguous,
    /// The data cannot decide.
    Insufficient,
}

/// How much of the gap is closed, with a 90 % interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Closed {
    /// (before - after)/(before - floor).
    pub value: f64,
    /// 5 % quantile.
    pub low: f64,
    /// 95 % quantile.
    pub high: f64,
}

/// The conclusion and what it rests on.
#[derive(Clone)]
pub struct Verdict {
    /// What is concluded.
    pub kind: Kind,
    /// Places in `ranked` of the effects it names.
    pub named: Vec<usize>,
    /// How probable it is.
    pub probability: f64,
    /// Every hypothesis that was fitted, best first, with its probability.
    pub ranked: Vec<(Hypothesis, f64)>,
    /// Probability that nothing is missing.
    pub none: f64,
    /// Probability that only parameters were wrong.
    pub parameters: f64,
    /// Probability that the effect is not in the catalogue.
    pub unknown: f64,
    /// The simulator's parameters that moved, as (name, believed, refitted, standard deviation).
    pub moved: Vec<(String, f64, f64, f64)>,
    /// Rms of the refitted simulator and of the best hypothesis on held-out data, and the floor, N m.
    pub rms_nm: [f64; 3],
    /// Rms in sliding after the best hypothesis over its floor: above one, something is left.
    pub lack_of_fit: f64,
}

/// Nats that an effect must gain before it is accused: the price of choosing among some thirty.
const ACCUSES: f64 = 12.0;
/// Part of the floor that an effect must take away: less is what smoothing leaves at reversals. Nor may it be less than
/// what a coarse encoder leaves open in presliding.
const MATTERS: f64 = 0.25;
/// Weight of all effects that do not matter, as a part of that of none.
const TOO_SMALL: f64 = 0.2;
/// A second effect must explain this much more of the explainable gap: less is what a model's own error leaves to it.
const SECOND: f64 = 0.12;
/// Of several effects each must explain this much of the gap alone.
const ALONE: f64 = 0.15;
/// Nats, and part of the best one's gain, within which two hypotheses tie.
const TIES: (f64, f64) = (8.0, 0.002);
/// Scores are divided by this: nodes are less independent than their correlation says, and models are not exact.
const TEMPERATURE: f64 = 8.0;
/// Left in sliding over the floor, and share of the gap explained, beyond which the effect is not in the catalogue.
const UNKNOWN: (f64, f64) = (1.5, 0.8);
/// A parameter moved if it moved by so many of its standard deviations and by this part of itself.
const MOVED: (f64, f64) = (4.0, 0.02);

/// Concludes.
pub fn verdict(search: &Search) -> Verdict {
    let base = &search.base;
    let mut ranked: Vec<Hypothesis> = search
        .single
        .iter()
        .chain(&search.several)
        .cloned()
        .collect();
    ranked.sort_by(|a, b| b.score.total_cmp(&a.score));
    let chosen = choose(search);
    let gain = chosen.map_or(0.0, |h| h.score - base.score);
    let (floor, before) = search.noise.rms(&search.nodes, &base.held_out);
    let after = chosen.map_or(before, |h| search.noise.rms(&search.nodes, &h.held_out).1);
    let best = chosen.unwrap_or(base);
    let lack_of_fit = lack_of_fit(&search.noise, &search.nodes, &best.fit.left_over);
    let explained = explained(before, after, floor);
    let moved = moved(search);

    let parameters_help = search.noise.log_density(&search.nodes, &search.as_given);
    let refit_gain = base.score - parameters_help;
    let given = search.noise.rms(&search.nodes, &search.as_given).1;
    let refitted = search.noise.rms(&search.nodes, &base.fit.left_over).1;
    let matters = (MATTERS * floor).max(search.noise.open_beyond_floor_nm(&search.nodes));
    let moved_matters =
        refit_gain > ACCUSES && !moved.is_empty() && contribution(given, refitted) > matters;

    let accused = chosen.is_some() && gain > ACCUSES && contribution(before, after) > matters;
    let left_unknown = lack_of_fit > UNKNOWN.0 && explained < UNKNOWN.1;

    // Weights of all answers: what is left unexplained counts against every hypothesis alike.
    let top = ranked
        .first()
        .map_or(base.score, |h| h.score.max(base.score));
    let weight = |score: f64| ((score - top) / TEMPERATURE).exp();
    let mut weights: Vec<f64> = ranked
        .iter()
        .map(|h| weight(h.score - ACCUSES * h.added.len() as f64))
        .collect();
    let plain = weight(base.score);
    if !accused {
        // Too small to matter is as good as not there, however clear it is.
        let sum: f64 = weights.iter().sum();
        let keep = (TOO_SMALL * plain / sum.max(f64::MIN_POSITIVE)).min(1.0);
        for w in &mut weights {
            *w *= keep;
        }
    }
    // Both must speak for it: much left over, and little explained.
    let logistic = |x: f64| 1.0 / (1.0 + (-x).exp());
    let unknown = if gain > ACCUSES || lack_of_fit > UNKNOWN.0 {
        let left = logistic(6.0 * (lack_of_fit - UNKNOWN.0));
        left.min(logistic(15.0 * (UNKNOWN.1 - explained)))
    } else {
        0.01
    };
    let sum: f64 = (weights.iter().sum::<f64>() + plain) / (1.0 - unknown);
    for w in &mut weights {
        *w /= sum;
    }
    let (none, parameters) = if moved_matters {
        (0.0, plain / sum)
    } else {
        (plain / sum, 0.0)
    };
    let ranked: Vec<(Hypothesis, f64)> = ranked.into_iter().zip(weights).collect();

    let place = |ids: &[&str]| ranked.iter().position(|(h, _)| h.ids() == ids);
    let (kind, named, probability) = if left_unknown {
        (Kind::Unknown, Vec::new(), unknown)
    } else if !accused {
        if moved_matters {
            (Kind::Parameters, Vec::new(), parameters)
        } else {
            (Kind::None, Vec::new(), none)
        }
    } else {
        let chosen = best;
        if chosen.added.len() > 1 {
            let named: Vec<usize> = place(&chosen.ids()).into_iter().collect();
            let probability = named.iter().map(|&i| ranked[i].1).sum();
            (Kind::Effects, named, probability)
        } else {
            let limit = chosen.score - TIES.0.max(TIES.1 * gain);
            let tied: Vec<usize> = ranked
                .iter()
                .enumerate()
                .filter(|(_, (h, _))| {
                    let of_structure = inseparable(chosen.added[0].id, h.added[0].id)
                        && h.score - base.score > 0.5 * gain;
                    h.added.len() == 1 && (h.score >= limit || of_structure)
                })
                .map(|(i, _)| i)
                .collect();
            // With a second effect that is not needed it is still this one.
            let ids: Vec<&str> = tied.iter().map(|&i| ranked[i].0.added[0].id).collect();
            let probability = ranked
                .iter()
                .filter(|(h, _)| h.ids().iter().any(|id| ids.contains(id)))
                .map(|(_, p)| p)
                .sum();
            let kind = if tied.len() > 1 {
                Kind::Ambiguous
            } else {
                Kind::Effect
            };
            (kind, tied, probability)
        }
    };
    Verdict {
        kind,
        named,
        probability,
        ranked,
        none,
        parameters,
        unknown,
        moved,
        rms_nm: [before, after, floor],
        lack_of_fit,
    }
}

/// The best single effect, or the best pair if it is worth its second effect.
fn choose(search: &Search) -> Option<&Hypothesis> {
    let single = search.single.first()?;
    let Some(pair) = search.several.first() else {
        return Some(single);
    };
    let rms = |h: &Hypothesis| search.noise.rms(&search.nodes, &h.held_out).1;
    let (floor, _) = search.noise.rms(&search.nodes, &single.held_out);
    let before = rms(&search.base);
    let share = |h: &Hypothesis| explained(before, rms(h), floor);
    // Each must explain something by itself: what only helps another one stands for that one's error.
    let alone = |id: &str| {
        search
            .single
            .iter()
            .any(|h| h.added[0].id == id && share(h) > ALONE)
    };
    let worth = pair.score - single.score > ACCUSES
        && contribution(rms(single), rms(pair)) > MATTERS * floor
        && share(pair) - share(single) > SECOND
        && pair.ids().into_iter().all(alone);
    Some(if worth { pair } else { single })
}

/// Whether beside an effect enough is left of the gap for a second one to be believed.
pub(super) fn leaves_room(noise: &Noise, nodes: &[Node], base: &[f64], single: &[f64]) -> bool {
    let (floor, before) = noise.rms(nodes, base);
    let left = contribution(noise.rms(nodes, single).1, floor);
    left > MATTERS * floor && left > SECOND.sqrt() * contribution(before, floor)
}

/// Two effects that no data of effort and motor position tell apart: what differs between them is the controller's or the
/// simulator's own error.
fn inseparable(a: &str, b: &str) -> bool {
    const DELAYS: [&str; 2] = ["actuator.delay", "sensor.delay"];
    DELAYS.contains(&a) && DELAYS.contains(&b)
}

/// Rms of what was taken away, were it independent of what is left.
fn contribution(before: f64, after: f64) -> f64 {
    (before * before - after * after).max(0.0).sqrt()
}

/// Share of the explainable square that was taken away.
fn explained(before: f64, after: f64, floor: f64) -> f64 {
    let explainable = before * before - floor * floor;
    if explainable <= 0.0 {
        1.0
    } else {
        ((before * before - after * after) / explainable).clamp(0.0, 1.0)
    }
}

/// Rms in sliding over the floor there.
fn lack_of_fit(noise: &Noise, nodes: &[Node], left_over: &[f64]) -> f64 {
    let (mut square, mut floor) = (0.0, 0.0);
    for (node, r) in nodes.iter().zip(left_over) {
        if !node.excluded && node.regime == Regime::Sliding {
            square += r * r;
            floor += noise.group(node).floor_nm.powi(2);
        }
    }
    if floor > 0.0 {
        (square / floor).sqrt()
    } else {
        1.0
    }
}

fn moved(search: &Search) -> Vec<(String, f64, f64, f64)> {
    let model = &search.base.model;
    let at = &search.base.fit.at;
    let spreads = spreads(model, &search.base.fit);
    model
        .free
        .iter()
        .zip(at)
        .zip(&spreads)
        .filter(|((free, _), _)| free.owner != Owner::Own(Own::Skew))
        .filter_map(|((free, &x), &spread)| {
            let (before, after) = (free.start, free.value(x));
            let far = (x - free.coordinate(before)).abs();
            let relative = (after - before).abs() / before.abs().max(1e-300);
            let deviation = if free.logarithmic {
                spread * after
            } else {
                spread
            };
            (far > MOVED.0 * spread && relative > MOVED.1)
                .then(|| (free.name.clone(), before, after, deviation))
        })
        .collect()
}

/// How much of the gap a hypothesis closes on held-out data; the interval by the jackknife over folds.
pub fn closed(search: &Search, hypothesis: &Hypothesis) -> Closed {
    closed_over(search, hypothesis, &|node| node.regime != Regime::Rest)
        .map_or_else(Closed::default, |part| part.closed)
}
