//! The search: the simulator refitted, every effect against it, then effects beside the best one.

use super::accuse::{ACCUSES, gain_below_open, leaves_room};
use super::apply::axis_at;
use super::candidate::{Background, Start};
use super::hypothesis::{Hypothesis, Judge, NOISE_ONLY, foremost, of_noise};
use super::likelihood::{Noise, Own};
use super::null::{Null, nulls};
use super::play;
use super::regime::{Node, nodes};
use super::signature;
use crate::believed::Believed;
use crate::error::InputError;
use crate::inverse::{
    self, Fit, Model, Owner, Record, fit, fit_at, fit_near, fit_on, has_bristles, scale,
};
use bristle_plant::effect::{ALL, Entry, Scale};
use rayon::prelude::*;

/// Effects that are fitted after screening.
const FITTED: usize = 12;
/// The simulator alone is fitted so often at most: with the noise that each fit leaves the next one goes farther, and one
/// that began at wrong parameters has to come all the way.
const MOST_ROUNDS: usize = 8;
/// Nats that a further one must have gained: less than any effect must.
const WORTH_A_ROUND: f64 = 6.0;
/// Starts that a fit is tried from.
const STARTS: usize = 2;
/// A second start is worth a fit if it promises this part of what the first one does.
const CLOSE: f64 = 0.6;
/// Of those so many are fitted with the noise that the best one leaves.
const KEPT: usize = 9;
/// The best of them are fitted once more with a Jacobian of their own.
const POLISHED: usize = 3;
/// Of so many it is asked what they gain where they are not.
const NULLS: usize = 3;
/// Effects that are tried beside the best one.
pub(super) const BESIDE: usize = 4;
/// Most effects at once.
pub const MOST_EFFECTS: usize = 2;
/// Fall of the sum of squares below which a start is not worth a fit: three nats for each of two parameters.
const WORTH_A_FIT: f64 = 12.0;
/// Standard deviations of its prior beyond which a parameter has strayed.
const STRAYS: f64 = 2.0;
/// Where friction is whatever holds, it is known to this part of itself while the axis hardly moves.
const HELD: f64 = 0.5;
/// Standard deviation of a parameter of the axis file, as a share of it.
pub const DOUBT: f64 = 0.15;

/// All that was tried.
pub struct Search {
    /// The prepared logs.
    pub records: Vec<Record>,
    /// Their nodes.
    pub nodes: Vec<Node>,
    /// Size of axis and records.
    pub scale: Scale,
    /// Noise by record and regime.
    pub noise: Noise,
    /// Weight of each node.
    pub weights: Vec<f64>,
    /// What the simulator as it stands leaves over, N m.
    pub as_given: Vec<f64>,
    /// What the method leaves over of the simulator as it stands on records of its own.
    pub own_as_given: Own,
    /// The same of the refitted simulator.
    pub own: Own,
    /// The simulator with its own parameters refitted.
    pub base: Hypothesis,
    /// With one effect, best first.
    pub single: Vec<Hypothesis>,
    /// With several, best first.
    pub several: Vec<Hypothesis>,
    /// What the best effects gain on records of the refitted simulator without them.
    pub nulls: Vec<Null>,
    /// The effect that positions showed by themselves: whatever else is named, it is.
    pub shown: Option<&'static str>,
    /// Every effect and the fall of squares that screening expects of it.
    pub screened: Vec<(&'static Entry, f64)>,
}

impl Search {
    /// The hypothesis of an effect alone.
    pub(super) fn alone(&self, id: &str) -> Option<&Hypothesis> {
        self.single.iter().find(|h| h.added[0].id == id)
    }

    /// Squares of what a hypothesis leaves over of data that took no part, as a fit weighs them.
    pub(super) fn weighted_squares(&self, hypothesis: &Hypothesis) -> f64 {
        let rest = hypothesis.held_out.iter().zip(&self.weights);
        rest.map(|(r, w)| (r * w).powi(2)).sum()
    }

    /// What an effect gains where it is not, if that was asked.
    pub(super) fn null(&self, id: &str) -> Option<&Null> {
        self.nulls.iter().find(|null| null.id == id)
    }
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
    let as_given = model.left_over(&records, &model.start())?;
    let noise_of =
        |left_over: &[f64], own: &Own| noise_of(&model, &records, &nodes, left_over, own);
    let own_as_given = own_left_over(&model, &model.start(), &records, &scale);
    let mut noise = noise_of(&as_given, &own_as_given);
    let mut weights = noise.weights(&nodes);
    let mut fitted = fit(&model, &records, &weights, model.start())?;
    let mut before = f64::NEG_INFINITY;
    for _ in 0..MOST_ROUNDS {
        noise = noise_of(&fitted.left_over, &own_as_given);
        weights = noise.weights(&nodes);
        fitted = fit(&model, &records, &weights, fitted.at)?;
        let density = noise.log_density(&nodes, &fitted.left_over);
        if density - before < WORTH_A_ROUND {
            break;
        }
        before = density;
    }
    let own = own_left_over(&model, &fitted.at, &records, &scale);
    noise = noise_of(&fitted.left_over, &own);
    progress(0.1);

    let catalogue: Vec<&'static Entry> = catalogue
        .iter()
        .copied()
        .filter(|entry| model.effects.iter().all(|added| added.entry.id != entry.id))
        .collect();
    let fitted_ones: Vec<&'static Entry> = catalogue
        .iter()
        .copied()
        .filter(|entry| !NOISE_ONLY.contains(&entry.id))
        .collect();
    let background = Background::new(&model, &records, &nodes, &scale, &weights, &fitted);
    let screened = screen(&background, &fitted_ones, &|share| {
        progress(0.1 + 0.4 * share)
    });
    let mut found = fit_best(&background, &screened, FITTED, true)?;
    progress(0.6);
    if strayed(&model, &fitted.at) {
        let believed = fit_at(&model, &records, &weights, model.start())?;
        let background = Background::new(&model, &records, &nodes, &scale, &weights, &believed);
        let screened = screen(&background, &fitted_ones, &|share| {
            progress(0.6 + 0.1 * share)
        });
        for other in fit_best(&background, &screened, FITTED, true)? {
            match found.iter_mut().find(|one| one.0.id == other.0.id) {
                Some(one) if other.2.cost < one.2.cost => *one = other,
                Some(_) => {}
                None => found.push(other),
            }
        }
    }
    let density = |fit: &Fit| noise.log_density(&nodes, &fit.left_over);
    found.sort_by(|a, b| density(&b.2).total_cmp(&density(&a.2)));
    found.truncate(KEPT);
    let mut tried: Vec<(Vec<&'static Entry>, Model, Fit)> = found
        .into_iter()
        .map(|(entry, model, fit)| {
            let fit = fit_at(&model, &records, &weights, fit.at)?;
            Ok((vec![entry], model, fit))
        })
        .collect::<Result<_, InputError>>()?;
    progress(0.7);

    // Noise once more, now from the best that was found: what it explains is no noise.
    let old = weights.clone();
    if let Some((_, with, best)) = tried.iter().min_by(|a, b| a.2.cost.total_cmp(&b.2.cost)) {
        let own = own
            .clone()
            .or_less(&own_left_over(with, &best.at, &records, &scale));
        noise = noise_of(&best.left_over, &own);
        weights = noise.weights(&nodes);
    }
    let again = |model: &Model, fit: &Fit| {
        let mut known = fit.jacobian.clone();
        for (row, (new, old)) in weights.iter().zip(&old).enumerate() {
            known
                .row_mut(row)
                .scale_mut(if *old > 0.0 { new / old } else { 0.0 });
        }
        fit_near(model, &records, &weights, fit.at.clone(), &known)
            .and_then(|fit| fit_at(model, &records, &weights, fit.at))
    };
    let mut fitted = again(&model, &fitted)?;
    tried = tried
        .into_par_iter()
        .map(|(added, model, fit)| {
            let fit = again(&model, &fit)?;
            Ok((added, model, fit))
        })
        .collect::<Result<Vec<_>, InputError>>()?;
    tried.sort_by(|a, b| a.2.cost.total_cmp(&b.2.cost));
    // From where the best one has taken the simulator's own parameters the simulator alone may do better, too.
    if let Some((_, _, best)) = tried.first() {
        let own = best.at[..model.free.len()].to_vec();
        let other = fit(&model, &records, &weights, own)?;
        if other.cost < fitted.cost {
            fitted = other;
        }
    }
    // And with an effect it does no worse than without.
    let no_worse = |with: &Model, kept: Fit, without: &Fit| -> Result<Fit, InputError> {
        if kept.cost <= without.cost {
            return Ok(kept);
        }
        let mut start = without.at.clone();
        start.extend(&kept.at[start.len()..]);
        let other = fit(with, &records, &weights, start)?;
        Ok(if other.cost < kept.cost { other } else { kept })
    };
    tried = tried
        .into_par_iter()
        .map(|(added, with, kept)| {
            let kept = no_worse(&with, kept, &fitted)?;
            Ok((added, with, kept))
        })
        .collect::<Result<Vec<_>, InputError>>()?;
    tried.sort_by(|a, b| a.2.cost.total_cmp(&b.2.cost));
    let further = tried.split_off(POLISHED.min(tried.len()));
    tried = tried
        .into_par_iter()
        .map(|(added, model, fit)| {
            let fit = fit_on(&model, &records, &weights, fit)?;
            Ok((added, model, fit))
        })
        .collect::<Result<Vec<_>, InputError>>()?;
    tried.extend(further);
    let noise = noise.explaining(&nodes, &fitted.left_over);
    let judge = Judge {
        records: &records,
        nodes: &nodes,
        weights: &weights,
        noise: &noise,
    };
    let score = |added, model, fit| judge.hypothesis(added, model, fit);
    let base = score(Vec::new(), model, fitted)?;
    let mut single = tried
        .into_iter()
        .map(|(added, model, fit)| score(added, model, fit))
        .collect::<Result<Vec<Hypothesis>, InputError>>()?;
    single.extend(signature::hypotheses(
        &base, &records, &nodes, &noise, &catalogue, &scale,
    ));
    single.sort_by(|a, b| b.score.total_cmp(&a.score));
    progress(0.8);

    let mut several: Vec<Hypothesis> = Vec::new();
    let mut best = foremost(&single, &base).cloned();
    for _ in 1..MOST_EFFECTS {
        let room = |h: &Hypothesis| leaves_room(&noise, &nodes, &h.held_out);
        let Some(from) = best.take().filter(room) else {
            break;
        };
        // Noise leaves the model as it is.
        let ground = if of_noise(&from) { &base } else { &from };
        let (model, fit) = (&ground.model, &ground.fit);
        let background = Background::new(model, &records, &nodes, &scale, &weights, fit);
        let others: Vec<&'static Entry> = fitted_ones
            .iter()
            .copied()
            .filter(|entry| from.added.iter().all(|added| added.id != entry.id))
            .collect();
        let screened = screen(&background, &others, &|share| progress(0.8 + 0.15 * share));
        let mut found: Vec<Hypothesis> = fit_best(&background, &screened, BESIDE, false)?
            .into_iter()
            .map(|(entry, model, fit)| {
                let mut added = from.added.clone();
                added.push(entry);
                let fit = fit_at(&model, &records, &weights, fit.at)?;
                let fit = no_worse(&model, fit, &ground.fit)?;
                let both = score(added, model, fit)?;
                Ok(if of_noise(&from) {
                    both.beside_noise(&from, &base)
                } else {
                    both
                })
            })
            .collect::<Result<_, InputError>>()?;
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        best = found
            .first()
            .filter(|next| next.score > from.score)
            .cloned();
        several.extend(found);
    }
    several.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut search = Search {
        screened: screened
            .into_iter()
            .map(|(entry, starts)| (entry, gain(&starts)))
            .collect(),
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
    let gains = |h: &&Hypothesis| h.score - search.base.score > ACCUSES && !of_noise(h);
    let mut accusable: Vec<&'static Entry> = search
        .single
        .iter()
        .take(NULLS)
        .filter(gains)
        .map(|h| h.added[0])
        .collect();
    for (hypothesis, _) in gain_below_open(&search).into_iter().take(NULLS) {
        let entry = hypothesis.added[0];
        if accusable.iter().all(|known| known.id != entry.id) {
            accusable.push(entry);
        }
    }
    // A simulator that diverges has no null.
    search.nulls = nulls(&search, &accusable).unwrap_or_default();
    progress(1.0);
    Ok(search)
}

/// The noise of records that a fitted model leaves this over of.
pub(super) fn noise_of(
    model: &Model,
    records: &[Record],
    nodes: &[Node],
    left_over: &[f64],
    own: &Own,
) -> Noise {
    let believed = &model.believed;
    let holds_nm = if has_bristles(believed.model) {
        0.0
    } else {
        HELD * believed.coulomb_nm
    };
    Noise::beside(
        records,
        nodes,
        left_over,
        believed.whole_inertia_kg_m2(),
        holds_nm,
        own,
    )
}

/// What the method leaves over of a model's own records; nothing where it cannot be simulated.
fn own_left_over(model: &Model, at: &[f64], records: &[Record], scale: &Scale) -> Own {
    let axis = axis_at(&model.at(at));
    inverse::twins(&axis, records, 0.0, 0)
        .and_then(|twins| {
            let left_over = model.left_over(&twins, at)?;
            Ok(Own::new(&twins, &nodes(&twins, scale.z_ss_rad), &left_over))
        })
        .unwrap_or_default()
}

/// Whether a parameter of the simulator lies where it was hardly believed to be. Then it may stand for an effect, which
/// has to be looked for from what was believed.
fn strayed(model: &Model, at: &[f64]) -> bool {
    model.free.iter().zip(at).any(|(free, x)| {
        matches!(free.owner, Owner::Own(own) if own != inverse::Own::Skew)
            && (x - free.center).abs() > STRAYS * free.spread
    })
}

/// Everything that may be accused.
pub fn catalogue() -> Vec<&'static Entry> {
    ALL.iter().collect()
}

fn gain(starts: &[Start]) -> f64 {
    starts.first().map_or(0.0, |start| start.gain)
}

/// The starts of each effect, most promising effect first.
pub(super) fn screen(
    background: &Background<'_>,
    catalogue: &[&'static Entry],
    progress: &dyn Fn(f64),
) -> Vec<(&'static Entry, Vec<Start>)> {
    let mut screened: Vec<(&'static Entry, Vec<Start>)> = Vec::new();
    for (done, entry) in catalogue.iter().enumerate() {
        screened.push((entry, background.starts(entry)));
        progress(done as f64 / catalogue.len() as f64);
    }
    screened.sort_by(|a, b| gain(&b.1).total_cmp(&gain(&a.1)));
    screened
}

pub(super) fn fit_best(
    background: &Background<'_>,
    screened: &[(&'static Entry, Vec<Start>)],
    most: usize,
    unpromising: bool,
) -> Result<Vec<(&'static Entry, Model, Fit)>, InputError> {
    let promising = screened
        .iter()
        .take(most)
        .filter(|(_, starts)| gain(starts) > WORTH_A_FIT);
    // What is never zero may be far off wherever it is tried, until everything else has moved with it.
    let never_zero = screened
        .iter()
        .enumerate()
        .filter(|(place, (entry, starts))| {
            let promises = *place < most && gain(starts) > WORTH_A_FIT;
            unpromising && !promises && !starts.is_empty() && background.never_zero(entry)
        })
        .map(|(_, one)| one);
    let all: Vec<&(&'static Entry, Vec<Start>)> = promising.chain(never_zero).collect();
    let fits: Result<Vec<_>, InputError> = all
        .into_par_iter()
        .map(|(entry, starts)| {
            let close = |start: &&Start| start.gain > CLOSE * gain(starts);
            let first = starts.iter().take(1);
            let starts: Vec<Start> = first
                .chain(starts.iter().take(STARTS).skip(1).filter(close))
                .cloned()
                .collect();
            Ok(background
                .try_effect(entry, &starts)?
                .map(|(model, fit)| (*entry, model, fit)))
        })
        .collect();
    let mut found = fits?.into_iter().flatten().collect();
    play::try_about_coupling(background, screened, &mut found)?;
    Ok(found)
}
