//! From everything that was tried to a verdict: none, parameters, an effect, several, ambiguous or unknown.
//!
//! Scores are held-out log densities over as many nodes as are independent; with what the data leave of the priors they are
//! evidence, by which effects are ranked, so that one that could have explained much else does not tie with a plain one. How much is left over is counted in times of
//! what is open, as the geometric mean over records and regimes: an rms in N m would be decided by whichever regime the
//! method knows least of. What an effect explains is a share of the logarithm of that. A rest of few moments hardly moves that
//! mean; it shows in the ratio of root-mean-squares, which counts beside it.

use super::accuse::{
    ACCUSES, BY_EVIDENCE, EVENLY, FOREIGN, MATTERS, NULLS_VARY, OF_MOMENTS, SHARE, STANDS_FOR,
    TAKES_ALL_BUT, TIES, TIES_BUT_FOR_PRIORS, UNKNOWN, UNKNOWN_SLIDING, UNKNOWN_SLIDING_USUALLY,
    below_open, brings_bristles, choose, contribution, explained, follows_acceleration,
};
use super::ceiling;
use super::fitted_noise::own_with_noise;
use super::held_out::spreads;
use super::hypothesis::{Hypothesis, of_noise, sort};
use super::likelihood::Noise;
use super::regime::Regime;
use super::tried::Search;
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
}

/// Times of what is open that a change of the simulator's own parameters must take away, as `MATTERS` is of an effect.
const MOVE_MATTERS: f64 = 0.5;
/// Evidence is divided by this: nodes are less independent than their correlation says, and models are not exact.
const TEMPERATURE: f64 = 8.0;
/// How often answers were right on development cases, as a logistic function: `unknown` of the logarithm of the times that
/// are left; an effect of the share that it explains. See docs/diagnosis-method.md.
const UNKNOWN_IS: (f64, f64) = (-0.5, 1.5);
const EFFECT_IS: (f64, f64) = (-2.0, 6.0);
/// An effect by evidence where it takes little of times over all regimes.
const EFFECT_IS_AT_LEAST: f64 = 0.6;
/// The same of the answers that have no such measure.
const EFFECTS_ARE: f64 = 0.6;
const SMALL_IS: f64 = 0.7;
const NONE_IS: f64 = 0.8;
const PARAMETERS_ARE: f64 = 0.3;
const NOISE_IS: f64 = 0.85;
/// Of what a verdict leaves open this part is for an effect that no list has.
const UNKNOWN_ELSE: f64 = 0.2;
/// A parameter moved if it moved by so many of its standard deviations and by this part of itself.
const MOVED: (f64, f64) = (4.0, 0.02);

/// Concludes.
pub fn verdict(search: &Search) -> Verdict {
    let base = &search.base;
    let mut ranked: Vec<Hypothesis> = search
        .single
        .iter()
        .chain(&search.several)
        .filter(|h| h.is_credible(base))
        .cloned()
        .collect();
    sort(&mut ranked);
    let chosen = choose(search);
    let gain = chosen.map_or(0.0, |h| h.score - base.score);
    let (floor, before) = search.noise.rms(&search.nodes, &base.held_out);
    let best = chosen.unwrap_or(base);
    let times = |left_over: &[f64]| search.noise.times_open(&search.nodes, left_over);
    let [base_times, left_times] = [&base.held_out, &best.held_out].map(|rest| times(rest));
    let rms_times = |left_over: &[f64], regimes: &[Regime]| {
        let noise = &search.noise;
        noise.rms_times_open(&search.nodes, left_over, regimes)
    };
    let [base_rms, left_rms] = [&base.held_out, &best.held_out]
        .map(|rest| rms_times(rest, &[Regime::Low, Regime::Sliding]));
    let [base_squares, left_squares] = [base, best].map(|h| search.weighted_squares(h));
    // What the method would leave over of parameters that are right moves none of them.
    let of_given = search.noise.clone().at_least(&search.own_as_given);
    let given_times = of_given.times_open(&search.nodes, &search.as_given);
    let explained_rms = explained(base_rms, left_rms);
    let explained = explained(base_times, left_times);
    let moved = moved(search);

    let parameters_help = search.noise.log_density(&search.nodes, &search.as_given);
    let refit_gain = base.score - parameters_help;
    let moved_matters = refit_gain > ACCUSES
        && !moved.is_empty()
        && contribution(given_times, base_times) > MOVE_MATTERS;

    // What a refit explains alike is the effect's where the refit has to take parameters to where they are not believed.
    let spares = |h: &Hypothesis| {
        h.log_belief - base.log_belief > ACCUSES
            && contribution(given_times, left_times) > MOVE_MATTERS
    };
    let shown = chosen.is_some_and(|h| search.shown.is_some_and(|id| h.ids() == [id]));
    // Beyond what it gains where it is not.
    let null = |h: &Hypothesis| match h.ids()[..] {
        [id] => search.null(id),
        _ => None,
    };
    let accused = chosen.is_some_and(|h| {
        let (nats, takes) = null(h).map_or((0.0, 0.0), |null| {
            (
                NULLS_VARY * null.nats.max(0.0),
                contribution(null.times[0], null.times[1]),
            )
        });
        let matters = |before, after| contribution(before, after) > MATTERS.hypot(takes);
        let of_moments = matters(base_rms, left_rms) && explained_rms > OF_MOMENTS;
        let explains = (matters(base_times, left_times) || of_moments) && explained > SHARE;
        let evident = h.log_evidence() - base.log_evidence() - nats > BY_EVIDENCE.0
            && left_squares < (1.0 - BY_EVIDENCE.1) * base_squares
            && !follows_acceleration(search, h);
        gain - nats > ACCUSES && (of_noise(h) || shown || spares(h) || explains || evident)
    });
    // What is not accused explains nothing.
    let unexplained = if accused { best } else { base };
    let rest = &unexplained.held_out;
    let times_by = |noise: &Noise| {
        let sliding = &[Regime::Sliding];
        [
            noise.times_open(&search.nodes, rest),
            noise.rms_times_open(&search.nodes, rest, sliding),
            noise.times_open_in(&search.nodes, rest, sliding),
        ]
    };
    let is_much = |times: [f64; 3]| {
        let most = [UNKNOWN, UNKNOWN_SLIDING, UNKNOWN_SLIDING_USUALLY];
        times.iter().zip(most).any(|(times, most)| *times > most)
    };
    let left = times_by(&search.noise);
    let noise_alone = left[0] < EVENLY.1 && search.noise.is_even(&search.nodes, rest, EVENLY.0);
    // What a model leaves over of its own records is no gap, though another one leaves less.
    let much = is_much(left) && !noise_alone && {
        let (model, at) = (&unexplained.model, &unexplained.fit.at);
        let own = own_with_noise(1.0, model, at, &search.records, &search.scale);
        is_much(times_by(&search.noise.clone().at_least(&own)))
    };
    let takes_all = left_squares < TAKES_ALL_BUT * base_squares;
    let stands_for = accused
        && !of_noise(best)
        && !takes_all
        && left[1] > STANDS_FOR.0
        && explained < STANDS_FOR.1;
    // What depends smoothly on where an axis is and how it moves, and is left by an effect, is another effect's.
    let foreign =
        accused && !of_noise(best) && !takes_all && much && ceiling::gains(search, rest) > FOREIGN;
    let left_unknown =
        (stands_for || foreign || search.is_unlisted() || much && explained <= SHARE) && !shown;
    let bristles = |h: &Hypothesis| brings_bristles(search, h);
    let mut small = if accused && !bristles(best) || much {
        Vec::new()
    } else {
        below_open(search)
    };
    // Which bristles is told by what the axis does while it hardly moves.
    if accused && small.first().is_some_and(|h| !bristles(h)) {
        small.clear();
    }
    let best = small.first().copied().unwrap_or(best);
    let after = search.noise.rms(&search.nodes, &best.held_out).1;

    let (kind, named) = if left_unknown {
        (Kind::Unknown, Vec::new())
    } else if !small.is_empty() {
        let named = |(_, h): &(usize, &Hypothesis)| small.iter().any(|s| s.ids() == h.ids());
        let named = ranked.iter().enumerate().filter(named);
        (one_of(small.len()), named.map(|(place, _)| place).collect())
    } else if !accused {
        let kind = if moved_matters {
            Kind::Parameters
        } else {
            Kind::None
        };
        (kind, Vec::new())
    } else if best.added.len() > 1 {
        let place = ranked.iter().position(|h| h.ids() == best.ids());
        (Kind::Effects, place.into_iter().collect())
    } else {
        let limit = best.log_evidence() - TIES.0.max(TIES.1 * gain);
        let ties = |h: &Hypothesis| {
            let squares = search.weighted_squares(h) - left_squares;
            h.log_evidence() >= limit
                || h.log_evidence() >= best.log_evidence() - TIES_BUT_FOR_PRIORS
                    && squares < 2.0 * TIES.0
        };
        // What positions show by themselves ties with nothing.
        let by_itself = shown || of_noise(best);
        let tied =
            |h: &Hypothesis| h.ids() == best.ids() || !by_itself && h.added.len() == 1 && ties(h);
        // All of them explain what is above what is open: what lies below it may tell them apart.
        let of_all = |h: &Hypothesis| h.score_of_all(&search.noise, &search.nodes) + h.log_occam;
        let most = ranked.iter().filter(|h| tied(h)).map(of_all);
        let least = most.fold(f64::NEG_INFINITY, f64::max) - ACCUSES;
        let tied: Vec<usize> = ranked
            .iter()
            .enumerate()
            .filter(|(_, h)| tied(h) && of_all(h) >= least)
            .map(|(i, _)| i)
            .collect();
        (one_of(tied.len()), tied)
    };
    let probability = match kind {
        Kind::Unknown if search.is_unlisted() => NOISE_IS,
        Kind::Unknown => {
            logistic(UNKNOWN_IS.0 + UNKNOWN_IS.1 * left.into_iter().fold(1.0, f64::max).ln())
        }
        Kind::None => NONE_IS,
        Kind::Parameters => PARAMETERS_ARE,
        Kind::Effects => EFFECTS_ARE,
        _ if !small.is_empty() => SMALL_IS,
        _ if shown || of_noise(best) => NOISE_IS,
        _ => logistic(EFFECT_IS.0 + EFFECT_IS.1 * explained).max(EFFECT_IS_AT_LEAST),
    };

    // What the verdict does not take is shared by all other answers as their scores say.
    let plain = base.log_evidence();
    let top = ranked
        .first()
        .map_or(plain, |h| h.log_evidence().max(plain));
    let weight = |evidence: f64| ((evidence - top) / TEMPERATURE).exp();
    let ids: Vec<&str> = named.iter().flat_map(|&i| ranked[i].ids()).collect();
    let says = |h: &Hypothesis| h.ids().iter().any(|id| ids.contains(id));
    let weights: Vec<f64> = ranked
        .iter()
        .map(|h| weight(h.log_evidence() - ACCUSES * h.added.len() as f64))
        .collect();
    let plain = weight(plain);
    let [mut named_sum, mut others_sum] = [0.0; 2];
    for (h, w) in ranked.iter().zip(&weights) {
        *(if says(h) {
            &mut named_sum
        } else {
            &mut others_sum
        }) += w;
    }
    let without_effect = [Kind::None, Kind::Parameters].contains(&kind);
    let open = 1.0 - probability;
    let shared = match kind {
        Kind::Unknown => open,
        _ => (1.0 - UNKNOWN_ELSE) * open,
    };
    if !without_effect {
        others_sum += plain;
    }
    let mut per_other = shared / others_sum.max(f64::MIN_POSITIVE);
    let per_named = probability / named_sum.max(f64::MIN_POSITIVE);
    if !named.is_empty() {
        // No other answer is more probable than what is named.
        let least = named
            .iter()
            .map(|&i| per_named * weights[i] / ranked[i].added.len() as f64);
        let least = least.fold(f64::INFINITY, f64::min);
        let other = ranked.iter().zip(&weights).filter(|(h, _)| !says(h));
        let most = other.fold(plain, |most, (_, w)| most.max(*w));
        per_other = per_other.min(least / most.max(f64::MIN_POSITIVE));
    }
    let plain = if without_effect {
        probability
    } else {
        plain * per_other
    };
    let unknown = match kind {
        Kind::Unknown => probability,
        _ => open - per_other * others_sum,
    };
    let (none, parameters) = if moved_matters {
        (0.0, plain)
    } else {
        (plain, 0.0)
    };
    let weights = ranked.iter().zip(weights).map(|(h, w)| {
        if says(h) {
            w * per_named
        } else {
            w * per_other
        }
    });
    let weights: Vec<f64> = weights.collect();
    let ranked: Vec<(Hypothesis, f64)> = ranked.into_iter().zip(weights).collect();
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
    }
}

/// One of so many effects.
fn one_of(effects: usize) -> Kind {
    if effects > 1 {
        Kind::Ambiguous
    } else {
        Kind::Effect
    }
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
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
