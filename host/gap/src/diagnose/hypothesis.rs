//! The simulator, perhaps with effects: fitted, and judged by what it leaves over on data that took no part.

use super::held_out::{held_out, precision};
use super::likelihood::Noise;
use super::regime::Node;
use crate::inverse::{Fit, Free, Model, Owner, Record};
use bristle_plant::effect::{Entry, Kind, Scale};
use nalgebra::{Cholesky, DVector};

/// Effects that make noise only: their torque cannot be predicted, so positions are asked instead.
const NOISE_ONLY: [&str; 2] = ["sensor.quantization", "sensor.jitter"];

/// A dead zone, and its parameters: half its width, and the share of that by which it jumps at its end.
const DEAD_ZONE: (&str, usize, usize) = ("actuator.deadzone", 0, 1);
/// Share from which it loses nothing beyond its end.
const WHOLE: f64 = 0.9;
/// Standard deviations of the effort's noise that hardly any sample is beyond.
const NOISE_ENDS: f64 = 4.0;

/// Nats of belief in the simulator's own parameters that an effect may cost. Of opened cases right answers cost 2 at most, an effect
/// that was not there 109.
const STRAINS: f64 = 30.0;

/// Times beyond what is usual from which a shape is one that no axis is known by. Of five opened pairs with a coupling that stood for a lag three had it
/// damped by 2.2 to 3 times as much as is usual.
const UNUSUAL: f64 = 1.5;

/// The simulator, perhaps with effects, fitted and scored.
#[derive(Clone)]
pub struct Hypothesis {
    /// Effects that were added to what is believed.
    pub added: Vec<&'static Entry>,
    /// The model.
    pub model: Model,
    /// Its fit.
    pub fit: Fit,
    /// What it leaves over on data that took no part, N m.
    pub held_out: Vec<f64>,
    /// Logarithm of the density of that, and of where the simulator's own parameters have gone.
    pub score: f64,
    /// The second part of that.
    pub log_belief: f64,
    /// Logarithm of the Occam factor.
    pub log_occam: f64,
}

impl Hypothesis {
    /// Ids of what was added.
    pub fn ids(&self) -> Vec<&'static str> {
        self.added.iter().map(|entry| entry.id).collect()
    }

    /// Logarithm of the evidence: held-out data stand for those that were fitted. Source: Kass, Raftery 1995, J. Am. Stat.
    /// Assoc. 90, section 4.1 (Laplace's method).
    pub fn log_evidence(&self) -> f64 {
        self.score + self.log_occam
    }

    /// Whether it may be accused, see [`is_credible`].
    pub(super) fn is_credible(&self, base: &Self) -> bool {
        is_credible(&self.model, &self.fit, base.log_belief)
    }

    /// Whether a parameter of an effect came out at the end of what is physical.
    pub(super) fn ends_at_limit(&self) -> bool {
        self.model.ends_at_limit(&self.fit.at)
    }

    /// Whether a detail of an effect came out at the end of what it may be, or a shape far from what is usual.
    pub(super) fn has_an_unusual_shape(&self, scale: &Scale) -> bool {
        let mut fitted = self.model.free.iter().zip(&self.fit.at);
        fitted.any(|(free, &x)| {
            let Owner::Effect(effect, place) = free.owner else {
                return false;
            };
            let parameter = &self.model.effects[effect].entry.parameters[place];
            let (value, [low, high]) = (free.value(x), (parameter.range)(scale));
            match parameter.kind {
                Kind::Detail => value != 0.0 && free.range.contains(&value),
                Kind::Shape => low > 0.0 && !(low / UNUSUAL..=high * UNUSUAL).contains(&value),
                _ => false,
            }
        })
    }

    /// Whether it takes the noise off an effort of zero instead of a torque: a dead zone as narrow as that noise, beyond which all of the effort
    /// arrives.
    pub(super) fn takes_noise_off(&self, records: &[Record]) -> bool {
        let (id, width, jump) = DEAD_ZONE;
        // One of the axis file is no candidate.
        if self.added.iter().all(|entry| entry.id != id) {
            return false;
        }
        let noises_nm = records.iter().map(Record::sample_noise_nm);
        let noise_nm = noises_nm.fold(f64::INFINITY, f64::min);
        let point = self.model.at(&self.fit.at);
        point.effects().iter().any(|added| {
            added.entry.id == id
                && added.values[jump] > WHOLE
                && added.values[width].abs() < NOISE_ENDS * noise_nm
        })
    }

    /// Scores what it leaves over at all nodes that count.
    pub(super) fn scored(&mut self, noise: &Noise, nodes: &[Node]) {
        self.score = noise.log_density(nodes, &self.held_out) + self.log_belief;
    }

    /// The score where a rest below what is open counts, too.
    pub(super) fn score_of_all(&self, noise: &Noise, nodes: &[Node]) -> f64 {
        noise.log_density_of_all(nodes, &self.held_out) + self.log_belief
    }

    /// This beside noise that takes as much off it as off the base.
    pub(super) fn beside_noise(mut self, noise: &Self, base: &Self) -> Self {
        let square = |rest: &[f64]| rest.iter().map(|r| r * r).sum::<f64>();
        let part = (square(&noise.held_out) / square(&base.held_out)).sqrt();
        for r in &mut self.held_out {
            *r *= part;
        }
        self.score += noise.score - base.score;
        self.model
            .effects
            .extend(noise.model.effects.last().cloned());
        self
    }
}

/// What is changed of a rest, as a fit weighs it.
pub(super) fn change(before: &[f64], after: &[f64], weights: &[f64]) -> DVector<f64> {
    let change = before.iter().zip(after).zip(weights);
    DVector::from_iterator(weights.len(), change.map(|((b, a), w)| (b - a) * w))
}

/// Cosine between two changes; zero where there is none.
pub(super) fn cosine(one: &DVector<f64>, other: &DVector<f64>) -> f64 {
    one.dot(other) / (one.norm() * other.norm()).max(f64::MIN_POSITIVE)
}

/// Effects whose torque can be predicted.
pub(super) fn fitted_ones(catalogue: &[&'static Entry]) -> impl Iterator<Item = &'static Entry> {
    catalogue
        .iter()
        .copied()
        .filter(|entry| is_predicted(entry))
}

/// Whether an effect's torque can be predicted.
pub(crate) fn is_predicted(entry: &Entry) -> bool {
    !NOISE_ONLY.contains(&entry.id)
}

/// Whether an effect makes steps of the position, at a moment or a place; they act in few nodes.
pub(super) fn makes_steps(entry: &Entry) -> bool {
    entry.parameters.iter().any(|p| p.kind.is_of_step())
}

/// Whether no noise was added: a fit says all of it.
pub(super) fn is_without_noise(hypothesis: &Hypothesis) -> bool {
    hypothesis.added.iter().all(|entry| is_predicted(entry))
}

/// Whether nothing but noise was added.
pub(super) fn of_noise(hypothesis: &Hypothesis) -> bool {
    hypothesis.added.iter().all(|entry| !is_predicted(entry))
}

/// What hypotheses are judged by.
pub(super) struct Judge<'a> {
    /// The prepared logs.
    pub(super) records: &'a [Record],
    /// Their nodes.
    pub(super) nodes: &'a [Node],
    /// Weight of each node.
    pub(super) weights: &'a [f64],
    /// Noise by record and regime.
    pub(super) noise: &'a Noise,
}

impl Judge<'_> {
    /// A fitted model as a hypothesis.
    pub(super) fn hypothesis(
        &self,
        added: Vec<&'static Entry>,
        model: Model,
        fit: Fit,
    ) -> Hypothesis {
        let parameters = added.iter().flat_map(|entry| entry.parameters);
        let steps = parameters.filter(|p| p.kind.is_of_step()).count();
        // One of as many moments or places as there are nodes.
        let chosen = steps as f64 * (self.nodes.len() as f64).ln();
        let mut hypothesis = Hypothesis {
            held_out: held_out(&model, &fit, self.weights, self.nodes),
            log_belief: log_belief(&model, &fit.at),
            log_occam: log_occam(&model, &fit) - chosen,
            score: 0.0,
            added,
            model,
            fit,
        };
        hypothesis.scored(self.noise, self.nodes);
        hypothesis
    }
}

/// Whether a model with an effect may be accused: not where the only size of the effect is fitted as small as it can be, which is all that keeps it from not being
/// there; nor where the simulator's own parameters go farther from what is believed than without it, which belief is `of_base`, as when a limit cuts all effort
/// and they shrink with it.
pub(super) fn is_credible(model: &Model, fit: &Fit, of_base: f64) -> bool {
    let is_least = |free: &Free, x: f64| {
        let Owner::Effect(effect, parameter) = free.owner else {
            return false;
        };
        let [least, _] = free.range;
        let parameters = model.effects[effect].entry.parameters;
        let is_only_size =
            (0..parameters.len()).all(|i| (parameters[i].kind == Kind::Size) == (i == parameter));
        is_only_size && least > 0.0 && free.value(x) <= least
    };
    let mut fitted = model.free.iter().zip(&fit.at);
    log_belief(model, &fit.at) > of_base - STRAINS && !fitted.any(|(free, &x)| is_least(free, x))
}

/// Logarithm of how far the simulator's own parameters are believed, but for a constant.
pub(super) fn log_belief(model: &Model, at: &[f64]) -> f64 {
    log_prior(model, at, |free| matches!(free.owner, Owner::Own(_)))
}

/// Logarithm of the Occam factor: how far an effect's parameters are believed, and the part of all priors that data leave.
fn log_occam(model: &Model, fit: &Fit) -> f64 {
    let before: f64 = model.free.iter().map(|free| free.spread.ln()).sum();
    let left = Cholesky::new(precision(model, fit))
        .map_or(0.0, |root| -0.5 * root.ln_determinant() - before);
    left + log_prior(model, &fit.at, |free| !matches!(free.owner, Owner::Own(_)))
}

/// Logarithm of the prior of some of the parameters, but for a constant.
fn log_prior(model: &Model, at: &[f64], of: impl Fn(&Free) -> bool) -> f64 {
    let free = model.free.iter().zip(at).filter(|(free, _)| of(free));
    free.map(|(free, x)| -0.5 * ((x - free.center) / free.spread).powi(2))
        .sum()
}

/// Puts each of these effects alone in its place among all, best first.
pub(super) fn replace_alone(single: &mut Vec<Hypothesis>, better: Vec<Hypothesis>) {
    for alone in better {
        single.retain(|h| h.ids() != alone.ids());
        single.push(alone);
    }
    sort(single);
}

/// Hypotheses by their evidence, best first.
pub(super) fn sort(hypotheses: &mut [Hypothesis]) {
    hypotheses.sort_by(|a, b| b.log_evidence().total_cmp(&a.log_evidence()));
}
