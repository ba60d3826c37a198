//! A round of the search: everything fitted with the weights of some noise, and the hypotheses that it comes to.

use super::accuse::{ACCUSES, NOTHING, leaves};
use super::beside::Pairs;
use super::bristles::fit_bristles;
use super::fitted_noise::{noise_of, own_left_over};
use super::hypothesis::{
    Hypothesis, Judge, fitted_ones, is_without_noise, log_belief, replace_alone, sort,
};
use super::likelihood::Noise;
use super::own::Own;
use super::screen::Tried;
use super::signature;
use super::single::Ground;
use crate::error::InputError;
use crate::inverse::{Fit, Model, fit_at, fit_near};
use bristle_plant::effect::Entry;
use rayon::prelude::*;

/// A model is fitted so often at most: with the noise that each fit leaves the next one goes farther, and one that began at wrong
/// parameters has to come all the way.
pub(super) const MOST_ROUNDS: usize = 8;
/// Nats that a further one must have gained: less than any effect must.
pub(super) const WORTH_A_ROUND: f64 = 6.0;
/// Pairs are searched for so often at most.
const MOST_SEARCHES: usize = 2;
/// So many of the best effects are fitted with their own noise.
const SETTLED: usize = 3;

/// What was fitted with some weights.
pub(super) struct Round {
    /// What the method leaves over of a model's own records.
    pub(super) own: Own,
    /// The noise that weights are from.
    pub(super) noise: Noise,
    /// The weight of each node.
    pub(super) weights: Vec<f64>,
    /// The simulator alone.
    pub(super) fitted: Fit,
    /// Each effect, best first.
    pub(super) tried: Vec<Tried>,
}

/// What a round comes to.
pub(super) struct Compared {
    /// The noise that densities are compared with.
    pub(super) noise: Noise,
    /// The simulator alone.
    pub(super) base: Hypothesis,
    /// With one effect, best first.
    pub(super) single: Vec<Hypothesis>,
    /// With two, best first.
    pub(super) several: Vec<Hypothesis>,
    /// Nats that speak for noise of the sensor that no effect of the list makes.
    pub(super) unlisted_nats: f64,
}

impl Round {
    /// Compares hypotheses.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn compare(
        &self,
        ground: &Ground<'_>,
        catalogue: &[&'static Entry],
        progress: &dyn Fn(f64),
    ) -> Result<Compared, InputError> {
        let &Ground {
            records,
            nodes,
            scale,
            model,
        } = ground;
        let noise = self.noise.clone().explaining(nodes, &self.fitted.left_over);
        let judge = Judge {
            records,
            nodes,
            weights: &self.weights,
            noise: &noise,
        };
        let base = judge.hypothesis(Vec::new(), model.clone(), self.fitted.clone());
        let mut single: Vec<Hypothesis> = self
            .tried
            .iter()
            .map(|one| judge.hypothesis(vec![one.entry], one.model.clone(), one.fit.clone()))
            .collect();
        let listed = |h: &Hypothesis| catalogue.iter().any(|entry| entry.id == h.added[0].id);
        let (listed, unlisted): (Vec<_>, Vec<_>) =
            signature::hypotheses(&base, records, nodes, &noise, scale)
                .into_iter()
                .partition(listed);
        let unlisted = unlisted.iter().map(|h| h.score - base.score);
        let unlisted_nats = unlisted.fold(0.0, f64::max);
        single.extend(listed);
        fit_bristles(ground, &self.own, &noise, &mut single)?;
        single.retain(|one| !one.takes_noise_off(records));
        sort(&mut single);
        let fitted: Vec<&'static Entry> = fitted_ones(catalogue).collect();
        let mut several = Vec::new();
        // An effect that comes out better once it was fitted beside another asks for more pairs.
        for _ in 0..MOST_SEARCHES {
            let pairs = Pairs {
                judge: &judge,
                scale,
                base: &base,
                single: &single,
            };
            let mut found = pairs.search(&fitted, progress)?;
            fit_bristles(ground, &self.own, &noise, &mut found)?;
            found.retain(|both| !both.takes_noise_off(records));
            several.append(&mut found);
            self.settle(ground, &noise, &mut several)?;
            let (Some(both), Some(first)) = (several.first(), single.first()) else {
                break;
            };
            if both.score - first.score <= ACCUSES {
                break;
            }
            pairs.refit_from_best(&mut several)?;
            let mut better = pairs.each_alone(&several[0])?;
            self.settle(ground, &noise, &mut better)?;
            better.retain(|one| !one.takes_noise_off(records));
            let before = first.log_evidence();
            replace_alone(&mut single, better);
            if single[0].log_evidence() - before < ACCUSES {
                break;
            }
        }
        Ok(Compared {
            noise,
            base,
            single,
            several,
            unlisted_nats,
        })
    }

    /// Fits the best ones with the noise that they leave themselves, where they leave something: by the weights of another effect
    /// what they explain was noise.
    fn settle(
        &self,
        ground: &Ground<'_>,
        compared: &Noise,
        best: &mut [Hypothesis],
    ) -> Result<(), InputError> {
        let &Ground { records, nodes, .. } = ground;
        let settling = Settling {
            ground,
            own: &self.own,
            compared,
            most: MOST_ROUNDS - 1,
            least_gain: 0.0,
        };
        let something = |one: &Hypothesis| leaves(compared, nodes, &one.held_out, NOTHING);
        let most = best.len().min(SETTLED);
        best[..most].par_iter_mut().try_for_each(|one| {
            if !something(one) || !is_without_noise(one) {
                return Ok(());
            }
            let found = Weighed {
                model: one.model.clone(),
                fit: one.fit.clone(),
                weights: self.weights.clone(),
            };
            let weights = settling.noise(&found).weights(nodes);
            let Weighed {
                model,
                fit,
                weights,
            } = settling.settled(found, weights)?;
            let judge = Judge {
                records,
                nodes,
                weights: &weights,
                noise: compared,
            };
            let settled = judge.hypothesis(one.added.clone(), model, fit);
            if settled.log_evidence() > one.log_evidence() {
                *one = settled;
            }
            Ok(())
        })?;
        sort(best);
        Ok(())
    }
}

/// The noise that the best effect leaves, weights by it, and what the method leaves over of that effect's own records or of the
/// simulator's alone, which is `own`, whichever is less. Where it leaves something, but nothing once it is fitted with its own noise,
/// again and again, that noise is the right one; so is that of another of the best where only that one leaves nothing so. Else what is
/// left is a regime that a fit would hold as noise.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn noise_of_best(
    ground: &Ground<'_>,
    tried: &[Tried],
    old: &[f64],
    own: &Own,
) -> Result<Option<(Own, Noise, Vec<f64>)>, InputError> {
    let &Ground {
        records,
        nodes,
        scale,
        ..
    } = ground;
    let mut order: Vec<&Tried> = tried.iter().collect();
    order.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
    order.truncate(SETTLED);
    let Some(best) = order.first() else {
        return Ok(None);
    };
    let of_best = own_left_over(&best.model, &best.fit.at, records, scale);
    let own = own.clone().or_less(&of_best);
    let first = noise_of(&best.model, records, nodes, &best.fit.left_over, &own);
    let at_first = first.weights(nodes);
    let something = |noise: &Noise, fit: &Fit| leaves(noise, nodes, &fit.left_over, NOTHING);
    if !something(&first, &best.fit) {
        return Ok(Some((own, first, at_first)));
    }
    let settling = Settling {
        ground,
        own: &own,
        compared: &first,
        most: MOST_ROUNDS - 1,
        least_gain: WORTH_A_ROUND,
    };
    let settled = |one: &&Tried| -> Result<(f64, Fit, Noise), InputError> {
        let as_tried = Weighed {
            model: one.model.clone(),
            fit: one.fit.clone(),
            weights: old.to_vec(),
        };
        let settled = settling.settled(as_tried, at_first.clone())?;
        let noise = settling.noise(&settled);
        let Weighed { model, fit, .. } = settled;
        let score = first.log_density(nodes, &fit.left_over) + log_belief(&model, &fit.at);
        Ok((score, fit, noise))
    };
    let explains = |(_, fit, noise): &(f64, Fit, Noise)| !something(noise, fit);
    let of_best = settled(best)?;
    let explains = if explains(&of_best) {
        Some(of_best)
    } else {
        let others = order[1..].par_iter().map(settled);
        let others = others.collect::<Result<Vec<_>, _>>()?;
        let all = others.into_iter().chain([of_best]);
        all.max_by(|a, b| a.0.total_cmp(&b.0)).filter(explains)
    };
    Ok(Some(match explains {
        Some((.., noise)) => {
            let weights = noise.weights(nodes);
            (own, noise, weights)
        }
        None => (own, first, at_first),
    }))
}

/// A fit and the weights that it was made with.
pub(super) struct Weighed {
    pub(super) model: Model,
    pub(super) fit: Fit,
    pub(super) weights: Vec<f64>,
}

/// Fitting with the noise that each fit leaves itself: iteratively reweighted least squares, Green 1984, J. R. Stat. Soc. B 46.
pub(super) struct Settling<'a> {
    pub(super) ground: &'a Ground<'a>,
    /// What the method leaves over of a model's own records.
    pub(super) own: &'a Own,
    /// Noise that densities are compared with.
    pub(super) compared: &'a Noise,
    /// Most fits.
    pub(super) most: usize,
    /// Nats that a fit must gain beyond to be taken.
    pub(super) least_gain: f64,
}

impl Settling<'_> {
    /// The noise that a fit leaves itself.
    pub(super) fn noise(&self, one: &Weighed) -> Noise {
        self.noise_that_leaves(&one.model, &one.fit.left_over)
    }

    /// Weights by the noise that a model leaves this of.
    pub(super) fn weights(&self, model: &Model, left_over: &[f64]) -> Vec<f64> {
        let noise = self.noise_that_leaves(model, left_over);
        noise.weights(self.ground.nodes)
    }

    fn noise_that_leaves(&self, model: &Model, left_over: &[f64]) -> Noise {
        let &Ground { records, nodes, .. } = self.ground;
        noise_of(model, records, nodes, left_over, self.own)
    }

    /// Fitted with `weights`, then with its own, until it gains no more.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn settled(
        &self,
        mut one: Weighed,
        mut weights: Vec<f64>,
    ) -> Result<Weighed, InputError> {
        let &Ground { records, nodes, .. } = self.ground;
        let density = |fit: &Fit| self.compared.log_density(nodes, &fit.left_over);
        for _ in 0..self.most {
            let known = self
                .ground
                .jacobian(&one.model, &one.fit, &one.weights, &weights)?;
            let fit = fit_near(&one.model, records, &weights, one.fit.at.clone(), &known)?;
            let gained = density(&fit) - density(&one.fit);
            if gained <= self.least_gain {
                break;
            }
            one.fit = fit_at(&one.model, records, &weights, fit.at)?;
            one.weights = weights;
            if gained < WORTH_A_ROUND {
                break;
            }
            weights = self.noise(&one).weights(nodes);
        }
        Ok(one)
    }
}
