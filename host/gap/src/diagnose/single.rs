//! Effects one at a time: each fitted jointly with the simulator's own parameters, first roughly and many, then well and few.

use super::accuse::{ACCUSES, NOTHING, grows_with_load, leaves, leaves_anything};
use super::candidate::{Background, Screened};
use super::details::try_details;
use super::likelihood::Noise;
use super::regime::Node;
use super::screen::{Tried, WORTH_A_FIT, fit_best, screen};
use crate::error::InputError;
use crate::inverse::{
    Fit, Free, Model, Own, Owner, PROMISES, Record, fit, fit_at, fit_near, fit_near_until, fit_on,
};
use bristle_plant::effect::{Entry, Scale};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Effects that are fitted after screening.
const FITTED: usize = 12;
/// Of those so many are fitted with the noise that the best one leaves.
const KEPT: usize = 9;
/// And of the others so many that do best above what is open: what cuts few moments may leave more of all the others.
const KEPT_ABOVE: usize = 1;
/// The best of them are fitted once more with a Jacobian of their own.
const POLISHED: usize = 3;
/// Where the best one leaves nothing, those go no further that leave this part of the nats that it gains ungained.
const BEHIND: f64 = 0.8;
/// But for those that do better than the best one by so many nats above what is open.
const WORTH_KEEPING: f64 = 3.0;
/// Part of the fall of the sum of squares by the best one that another must bring to be fitted from what was believed.
const WORTH_A_RESTART: f64 = 0.3;
/// Standard deviations of its prior beyond which a parameter has strayed.
const STRAYS: f64 = 2.0;

/// What effects are tried on.
pub(super) struct Ground<'a> {
    /// The prepared logs.
    pub(super) records: &'a [Record],
    /// Their nodes.
    pub(super) nodes: &'a [Node],
    /// Size of axis and records.
    pub(super) scale: &'a Scale,
    /// The simulator as the axis file has it.
    pub(super) model: &'a Model,
}

impl Ground<'_> {
    /// The simulator as fitted with these weights, and what it leaves over: what effects are laid against.
    pub(super) fn background<'a>(&'a self, weights: &'a [f64], fit: &'a Fit) -> Background<'a> {
        Background::new(
            self.model,
            self.records,
            self.nodes,
            self.scale,
            weights,
            fit,
        )
    }

    /// What each effect promises, and the best of those that were fitted beside the simulator's `fitted` parameters.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn try_each(
        &self,
        entries: &[&'static Entry],
        noise: &Noise,
        weights: &[f64],
        fitted: &Fit,
        progress: &dyn Fn(f64),
    ) -> Result<(Vec<Screened>, Vec<Tried>), InputError> {
        let background = self.background(weights, fitted);
        // What is never zero may be far off wherever it is tried, until everything else has moved with it.
        let plays = leaves_anything(noise, self.nodes, &fitted.left_over);
        let screened = screen(&background, entries, &|share| progress(0.65 * share));
        let mut found = fit_best(&background, &screened, FITTED, plays, |_, entry| {
            background.never_zero(entry)
        })?;
        progress(0.8);
        // Where what strayed comes back with an effect that leaves nothing, it stood for that.
        let best = found
            .iter()
            .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        let came_back = best.is_some_and(|best| {
            !leaves_anything(noise, self.nodes, &best.fit.left_over)
                && !strayed(&best.model, &best.fit.at)
        });
        if !came_back && let Some(believed) = self.believed(noise, weights, fitted)? {
            let background = self.background(weights, &believed);
            let screened = screen(&background, entries, &|share| progress(0.8 + 0.2 * share));
            let others = fit_best(&background, &screened, FITTED, plays, |_, entry| {
                background.never_zero(entry)
            })?;
            for other in others {
                match found.iter_mut().find(|one| one.entry.id == other.entry.id) {
                    Some(one) if other.fit.cost < one.fit.cost => *one = other,
                    Some(_) => {}
                    None => found.push(other),
                }
            }
        }
        try_details(&mut found, fitted, self.records, self.scale, weights)?;
        // What lies below what is open counts, too: the noise that it is judged by is yet to be found.
        let density = |fit: &Fit| noise.log_density_of_all(self.nodes, &fit.left_over);
        found.sort_by(|a, b| density(&b.fit).total_cmp(&density(&a.fit)));
        let mut further = found.split_off(KEPT.min(found.len()));
        let above = |fit: &Fit| noise.log_density(self.nodes, &fit.left_over);
        further.sort_by(|a, b| above(&b.fit).total_cmp(&above(&a.fit)));
        further.truncate(KEPT_ABOVE);
        found.extend(further);
        Ok((screened, found))
    }

    /// The simulator as it was believed, where a parameter of the fit has strayed and where it leaves something that the parameter may stand
    /// for.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    fn believed(
        &self,
        noise: &Noise,
        weights: &[f64],
        fitted: &Fit,
    ) -> Result<Option<Fit>, InputError> {
        if !strayed(self.model, &fitted.at) {
            return Ok(None);
        }
        let believed = fit_at(self.model, self.records, weights, self.model.start())?;
        let something = leaves(noise, self.nodes, &believed.left_over, NOTHING);
        Ok(something.then_some(believed))
    }

    /// A fit with an effect, or where a parameter of the simulator's own has strayed there and where it leaves something, the one from what
    /// was believed if that does better.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    fn restarted(
        &self,
        with: &Model,
        kept: Fit,
        noise: &Noise,
        weights: &[f64],
    ) -> Result<Fit, InputError> {
        if !strayed(with, &kept.at) || !leaves_anything(noise, self.nodes, &kept.left_over) {
            return Ok(kept);
        }
        let start = beside(&kept, self.model.start());
        let other = fit(with, self.records, weights, start)?;
        Ok(if other.cost < kept.cost { other } else { kept })
    }

    /// The Jacobian of a fit by `old` weights as it is with `new` ones. Where the fit has none it is made.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn jacobian(
        &self,
        model: &Model,
        fit: &Fit,
        old: &[f64],
        new: &[f64],
    ) -> Result<DMatrix<f64>, InputError> {
        let mut jacobian = if fit.jacobian.is_empty() {
            fit_at(model, self.records, old, fit.at.clone())?.jacobian
        } else {
            fit.jacobian.clone()
        };
        for (row, (new, old)) in new.iter().zip(old).enumerate() {
            let times = if *old > 0.0 { new / old } else { 0.0 };
            jacobian.row_mut(row).scale_mut(times);
        }
        Ok(jacobian)
    }

    /// The simulator alone and with each effect, fitted anew once noise and weights have changed; best first. Where the best one leaves
    /// nothing, without those that are far behind, below what is open and above.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn refine(
        &self,
        fitted: Fit,
        mut tried: Vec<Tried>,
        noise: &Noise,
        old: &[f64],
        weights: &[f64],
    ) -> Result<(Fit, Vec<Tried>), InputError> {
        let again = |model: &Model, fit: Fit| {
            let known = self.jacobian(model, &fit, old, weights)?;
            fit_near(model, self.records, weights, fit.at, &known)
                .and_then(|fit| fit_at(model, self.records, weights, fit.at))
        };
        let mut fitted = again(self.model, fitted)?;
        let density = |fit: &Fit| noise.log_density_of_all(self.nodes, &fit.left_over);
        let above = |fit: &Fit| noise.log_density(self.nodes, &fit.left_over);
        // Beside a simulator that leaves nothing, what grows with load is only accused for what it gains above what is open.
        let nothing = !leaves(noise, self.nodes, &fitted.left_over, NOTHING);
        let gains = above(&fitted) + 0.5 * ACCUSES;
        let idle = |model: &Model, fit: &Fit| {
            let grows = model.effects.last();
            nothing && grows.is_some_and(|added| grows_with_load(added.entry)) && above(fit) < gains
        };
        let again = |model: &Model, fit: Fit| {
            if idle(model, &fit) {
                return fit_at(model, self.records, weights, fit.at);
            }
            again(model, fit)
        };
        tried.sort_by(|a, b| density(&b.fit).total_cmp(&density(&a.fit)));
        let mut further = tried.split_off(POLISHED.min(tried.len()));
        tried = each(tried, again)?;
        if let Some(Tried { fit: best, .. }) = tried.first()
            && !leaves(noise, self.nodes, &best.left_over, NOTHING)
        {
            let enough = density(best) - BEHIND * (density(best) - density(&fitted));
            let enough_above = above(best) + WORTH_KEEPING;
            further.retain(|one| density(&one.fit) >= enough || above(&one.fit) > enough_above);
        }
        tried.extend(each(further, again)?);
        by_cost(&mut tried);
        // From where the best one has taken the simulator's own parameters the simulator alone may do better, too.
        if let Some(best) = tried.first() {
            let own = best.fit.at[..self.model.free.len()].to_vec();
            let other = fit(self.model, self.records, weights, own)?;
            if other.cost < fitted.cost {
                fitted = other;
            }
        }
        let worth = |part: f64, tried: &[Tried]| {
            let best = tried.first().map_or(fitted.cost, |best| best.fit.cost);
            fitted.cost - part * (fitted.cost - best)
        };
        let explained = tried
            .first()
            .is_some_and(|best| !leaves(noise, self.nodes, &best.fit.left_over, NOTHING));
        if !explained {
            tried = each(tried, |with, kept| {
                no_worse(with, kept, &fitted, self.records, weights)
            })?;
        }
        further = tried.split_off(POLISHED.min(tried.len()));
        if explained {
            let worth_a_fit = worth(1.0 - BEHIND, &tried);
            // What hardly does anything beside the best one is ranked as it is.
            let (mut as_they_are, polished): (Vec<Tried>, Vec<Tried>) = tried
                .into_iter()
                .partition(|one| one.fit.cost > worth_a_fit || idle(&one.model, &one.fit));
            as_they_are.append(&mut further);
            (tried, further) = (polished, as_they_are);
        }
        tried = each(tried, |model, fit| {
            fit_on(model, self.records, weights, fit)
        })?;
        let worth_it = worth(WORTH_A_RESTART, &tried);
        tried = each(tried, |model, fit| {
            if fit.cost > worth_it {
                return Ok(fit);
            }
            self.restarted(model, fit, noise, weights)
        })?;
        tried.extend(further);
        // With noise that the best one leaves they may show where they did not before.
        try_details(&mut tried, &fitted, self.records, self.scale, weights)?;
        Ok((fitted, tried))
    }
}

/// All fitted anew by a function of model and fit, best first.
fn each(
    tried: Vec<Tried>,
    fit: impl Fn(&Model, Fit) -> Result<Fit, InputError> + Sync,
) -> Result<Vec<Tried>, InputError> {
    let mut tried = tried
        .into_par_iter()
        .map(|one| {
            let fit = fit(&one.model, one.fit)?;
            Ok(Tried { fit, ..one })
        })
        .collect::<Result<Vec<_>, InputError>>()?;
    by_cost(&mut tried);
    Ok(tried)
}

fn by_cost(tried: &mut [Tried]) {
    tried.sort_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
}

/// The fit with an effect that does no worse than the one without: where `kept` does, it is fitted from there, to the end where that promises
/// anything.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn no_worse(
    with: &Model,
    kept: Fit,
    without: &Fit,
    records: &[Record],
    weights: &[f64],
) -> Result<Fit, InputError> {
    if kept.cost <= without.cost {
        return Ok(kept);
    }
    let start = beside(&kept, without.at.clone());
    let known = &without.jacobian;
    let rough = fit_near_until(PROMISES, with, records, weights, start, known)?;
    if rough.cost < without.cost - WORTH_A_FIT {
        fit(with, records, weights, rough.at)
    } else if rough.cost < kept.cost {
        fit_at(with, records, weights, rough.at)
    } else {
        Ok(kept)
    }
}

/// Parameters of the simulator's own with those of the effects of a fit.
pub(super) fn beside(fit: &Fit, own: Vec<f64>) -> Vec<f64> {
    let mut at = own;
    at.extend(&fit.at[at.len()..]);
    at
}

/// Whether a parameter of the simulator lies where it was hardly believed to be. Then it may stand for an effect, which
/// has to be looked for from what was believed.
fn strayed(model: &Model, at: &[f64]) -> bool {
    model.free.iter().zip(at).any(|(free, &x)| {
        matches!(free.owner, Owner::Own(own) if own != Own::Skew) && strays(free, x)
    })
}

/// Whether a parameter lies there.
pub(super) fn strays(free: &Free, x: f64) -> bool {
    (x - free.center).abs() > STRAYS * free.spread
}
