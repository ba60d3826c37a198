//! Effects beside the best one: forward from it, then backward, whether another than it does better beside the second.

use super::accuse::{
    ACCUSES, BELOW_OPEN_BESIDE, NOTHING, UNKNOWN_SLIDING, foremost, grows_with_load, leaves,
    leaves_anything, leaves_moments, leaves_room,
};
use super::bristles::is_bristles;
use super::candidate::{self, Background, Screened, Start};
use super::fitted_noise::left_once_fitted;
use super::hypothesis::{
    Hypothesis, Judge, change, cosine, is_predicted, is_without_noise, of_noise, sort,
};
use super::likelihood::Noise;
use super::play::springs;
use super::regime::Regime;
use super::screen::{Tried, by_promise, fit_best, screen};
use super::single::{beside, no_worse};
use super::tried::Search;
use crate::error::InputError;
use crate::inverse::{Free, Owner, fit, fit_at};
use bristle_plant::effect::{Entry, Scale};
use nalgebra::DVector;
use rayon::prelude::*;

/// Effects that are tried beside another.
pub(super) const BESIDE: usize = 4;
/// Most effects at once.
pub const MOST_EFFECTS: usize = 2;
/// So many of those next to the best pair are fitted from where that has taken the simulator's own parameters.
const REFITTED: usize = 3;
/// Part of the best one's gain that another must have alone to be tried in its place: with less it hardly stands for the same.
const RIVALS: f64 = 0.2;

/// The same of one that the first is tried without, beside whatever else does well alone: of two effects a third one may
/// do better alone than either, and what the second has moved of the simulator's own parameters the first does not know.
const NEXT: f64 = 0.5;
/// So many of them at most.
const MOST_NEXT: usize = 2;
/// Cosine between what two effects change beyond which they are one in two forms.
const ONE_IN_TWO_FORMS: f64 = 0.9;
/// The same below which two change something else.
const APART: f64 = 0.3;
/// Ratio of root-mean-squares in motion to what the model leaves of its own records beyond which few moments have room for a second effect.
const OF_OWN: f64 = 1.5;

/// What pairs are made of.
pub(super) struct Pairs<'a> {
    pub(super) judge: &'a Judge<'a>,
    /// Size of axis and records.
    pub(super) scale: &'a Scale,
    /// The simulator alone.
    pub(super) base: &'a Hypothesis,
    /// With one effect, best first.
    pub(super) single: &'a [Hypothesis],
}

impl<'a> Pairs<'a> {
    /// Of what a search has come to, with its [judge](Search::judge).
    pub(super) fn of(search: &'a Search, judge: &'a Judge<'a>) -> Self {
        Self {
            judge,
            scale: &search.scale,
            base: &search.base,
            single: &search.single,
        }
    }
}

impl Pairs<'_> {
    /// The hypotheses of two effects, best first.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn search(
        &self,
        entries: &[&'static Entry],
        progress: &dyn Fn(f64),
    ) -> Result<Vec<Hypothesis>, InputError> {
        let Some(first) = foremost(self.single, self.base) else {
            return Ok(Vec::new());
        };
        if of_noise(first) {
            return Ok(self.beside_noise(first));
        }
        let background = self.background(first);
        let room = self.has_room(first);
        let screened = if room {
            self.screened(&background, first, entries, progress)
        } else {
            let mut rivals = self.rivals(&background, ACCUSES, first);
            rivals.extend(self.bristles(&background, entries, &rivals, first));
            by_promise(&mut rivals);
            rivals
        };
        let mut several = self.beside(first, &background, &screened)?;
        let enough = NEXT * (first.score - self.base.score);
        let better = several.first().filter(|both| both.score > first.score);
        let beside_first = better.and_then(|both| self.alone(both.added.last()?));
        let Judge { noise, nodes, .. } = self.judge;
        let left = several
            .iter()
            .all(|both| leaves(noise, nodes, &both.held_out, NOTHING));
        for second in self.seconds(first, beside_first, enough) {
            let background = self.background(second);
            // What the second one needs beside it may do nothing beside the first.
            let screened = if room && left {
                self.screened(&background, second, entries, &|_| ())
            } else {
                let enough = RIVALS * (first.score - self.base.score);
                self.rivals(&background, enough, second)
            };
            several.extend(self.beside(second, &background, &screened)?);
        }
        sort(&mut several);
        Ok(several)
    }

    /// The best effect with every other one, where it left no room for [all](Self::search), best first.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn without_room(
        &self,
        entries: &[&'static Entry],
    ) -> Result<Vec<Hypothesis>, InputError> {
        let Some(first) = foremost(self.single, self.base)
            .filter(|first| !of_noise(first) && !self.has_room(first))
        else {
            return Ok(Vec::new());
        };
        let background = self.background(first);
        let screened = self.screened(&background, first, entries, &|_| ());
        self.beside(first, &background, &screened)
    }

    /// What pairs are looked for beside, in the place of `first`: what does best beside it, and those that gain `enough` alone and change something else.
    fn seconds<'a>(
        &'a self,
        first: &Hypothesis,
        beside_first: Option<&'a Hypothesis>,
        enough: f64,
    ) -> Vec<&'a Hypothesis> {
        let mut seconds: Vec<&Hypothesis> = beside_first.into_iter().collect();
        let mut apart = vec![self.changes(first)];
        for next in self.single {
            if apart.len() > MOST_NEXT {
                break;
            }
            if !self.explains(next, enough) {
                continue;
            }
            let changed = self.changes(next);
            let alike = |other| cosine(other, &changed) > ONE_IN_TWO_FORMS;
            if apart.iter().any(alike) {
                continue;
            }
            apart.push(changed);
            if seconds.iter().all(|second| second.ids() != next.ids()) {
                seconds.push(next);
            }
        }
        seconds
    }

    /// Whether all effects are asked for beside `first`: it leaves room. What it leaves in few moments alone, or evenly, counts where it is more than
    /// its own records leave; in few moments, where an effect is there: what no effect takes, and is nothing otherwise, no two of them take.
    fn has_room(&self, first: &Hypothesis) -> bool {
        let Judge { noise, nodes, .. } = self.judge;
        let rest = &first.held_out;
        let (room, moments) = (
            leaves_room(noise, nodes, rest),
            leaves_moments(noise, nodes, rest),
        );
        if room && (moments || leaves(noise, nodes, rest, [f64::INFINITY, UNKNOWN_SLIDING])) {
            return true;
        }
        let is_there = || {
            first.score - self.base.score > ACCUSES
                || leaves(noise, nodes, &self.base.held_out, NOTHING)
        };
        (room || moments && is_there()) && {
            let own = left_once_fitted(first, self.judge, self.scale);
            let noise = Noise::clone(noise).at_least(&own);
            if room {
                leaves_room(&noise, nodes, rest)
            } else {
                noise.rms_times_open(nodes, rest, &Regime::MOVING) > OF_OWN
            }
        }
    }

    /// Fits those next to the best one from where that has taken the simulator's own parameters: what they are near may be far from
    /// where the first effect alone has them.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn refit_from_best(&self, sorted: &mut [Hypothesis]) -> Result<(), InputError> {
        let (records, weights) = (self.judge.records, self.judge.weights);
        let [best, others @ ..] = sorted else {
            return Ok(());
        };
        let own = &best.fit.at[..self.base.model.free.len()];
        let most = others.len().min(REFITTED);
        others[..most]
            .par_iter_mut()
            .filter(|one| is_without_noise(one))
            .try_for_each(|one| {
                let from = beside(&one.fit, own.to_vec());
                let fit = fit(&one.model, records, weights, from)?;
                let other = self
                    .judge
                    .hypothesis(one.added.clone(), one.model.clone(), fit);
                if other.log_evidence() > one.log_evidence() {
                    *one = other;
                }
                Ok(())
            })?;
        sort(sorted);
        Ok(())
    }

    /// Backward: each effect of a pair without the other, from where it came out beside it, where that does better than its own fit, which may
    /// have taken for noise what it explains.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn each_alone(&self, pair: &Hypothesis) -> Result<Vec<Hypothesis>, InputError> {
        let (records, weights) = (self.judge.records, self.judge.weights);
        let background = self.background(self.base);
        let mut better = Vec::new();
        for &entry in pair.added.iter().filter(|entry| is_predicted(entry)) {
            let Some(values) = values_in(pair, entry) else {
                continue;
            };
            let mut model = background.with(entry, &Start::at(values));
            model.scales_effort |= pair.model.scales_effort;
            model.corrects = pair.model.corrects.filter(|_| springs(entry));
            let own = self.base.model.free.len();
            let mut from = pair.fit.at[..own].to_vec();
            from.extend_from_slice(&model.start()[own..]);
            let fit = fit(&model, records, weights, from)?;
            let alone = self.judge.hypothesis(vec![entry], model, fit);
            let before = self.alone(entry).map(Hypothesis::log_evidence);
            if before.is_none_or(|before| alone.log_evidence() > before) {
                better.push(alone);
            }
        }
        Ok(better)
    }

    /// What every effect promises beside `first`.
    fn screened(
        &self,
        background: &Background<'_>,
        first: &Hypothesis,
        entries: &[&'static Entry],
        progress: &dyn Fn(f64),
    ) -> Vec<Screened> {
        let others: Vec<&'static Entry> = entries
            .iter()
            .copied()
            .filter(|entry| goes_beside(entry, first))
            .collect();
        let mut screened = screen(background, &others, progress);
        for (entry, starts) in &mut screened {
            starts.extend(self.came_out(background, entry));
            candidate::sort(starts);
        }
        by_promise(&mut screened);
        screened
    }

    /// Bristles beside `first` that are no rivals: what they change where friction is static is below what is open, and alone they may be
    /// hidden by what another effect leaves.
    fn bristles(
        &self,
        background: &Background<'_>,
        entries: &[&'static Entry],
        rivals: &[Screened],
        first: &Hypothesis,
    ) -> Vec<Screened> {
        let known = |entry: &Entry| {
            first.ids().contains(&entry.id) || rivals.iter().any(|(rival, _)| rival.id == entry.id)
        };
        let asked: Vec<&'static Entry> = entries
            .iter()
            .copied()
            .filter(|entry| is_bristles(&self.base.model, entry) && !known(entry))
            .collect();
        screen(background, &asked, &|_| ())
    }

    /// What gains `enough` alone and may be one more beside `from`, from where it came out; not what grows with load where all lies below what is open: no
    /// second effect is believed that does.
    fn rivals(&self, background: &Background<'_>, enough: f64, from: &Hypothesis) -> Vec<Screened> {
        let Judge { noise, nodes, .. } = self.judge;
        let anything = leaves(noise, nodes, &self.base.held_out, NOTHING);
        let mut rivals: Vec<Screened> = self
            .single
            .iter()
            .filter(|h| self.gains(h, enough) && !of_noise(h))
            .map(|h| h.added[0])
            .filter(|entry| anything || !grows_with_load(entry))
            .filter(|entry| goes_beside(entry, from))
            .filter_map(|entry| Some((entry, vec![self.came_out(background, entry)?])))
            .collect();
        by_promise(&mut rivals);
        rivals
    }

    fn alone(&self, entry: &Entry) -> Option<&Hypothesis> {
        self.single.iter().find(|h| h.added[0].id == entry.id)
    }

    /// Whether it is an effect that gains so much alone above what is open.
    fn explains(&self, alone: &Hypothesis, enough: f64) -> bool {
        alone.score - self.base.score > enough && !of_noise(alone)
    }

    /// An effect that does well alone.
    fn well_alone(&self, entry: &Entry) -> Option<&Hypothesis> {
        self.alone(entry).filter(|alone| self.gains(alone, ACCUSES))
    }

    /// What a hypothesis changes of the rest of the simulator alone.
    fn changes(&self, hypothesis: &Hypothesis) -> DVector<f64> {
        change(
            &self.base.held_out,
            &hypothesis.held_out,
            self.judge.weights,
        )
    }

    /// Each effect beside noise, which leaves the simulator as it is: as it came out alone.
    fn beside_noise(&self, noise: &Hypothesis) -> Vec<Hypothesis> {
        let alone = self.single.iter().filter(|one| !of_noise(one)).cloned();
        let both = |mut one: Hypothesis| {
            one.added.insert(0, noise.added[0]);
            one.beside_noise(noise, self.base)
        };
        let mut several: Vec<Hypothesis> = alone.map(both).collect();
        sort(&mut several);
        several
    }

    fn background<'a>(&'a self, from: &'a Hypothesis) -> Background<'a> {
        Background::new(
            &from.model,
            self.judge.records,
            self.judge.nodes,
            self.scale,
            self.judge.weights,
            &from.fit,
        )
    }

    /// An effect that does well alone, from where it came out; not a wave with a phase of its own on each record.
    fn came_out(&self, background: &Background<'_>, entry: &'static Entry) -> Option<Start> {
        let alone = self.well_alone(entry)?;
        Some(background.as_it_came_out(entry, values_in(alone, entry)?))
    }

    /// Whether an effect gains so much alone, or below what is open what is asked of a second effect there.
    fn gains(&self, alone: &Hypothesis, enough: f64) -> bool {
        let of_all = |h: &Hypothesis| h.score_of_all(self.judge.noise, self.judge.nodes);
        alone.score - self.base.score > enough
            || of_all(alone) - of_all(self.base) > BELOW_OPEN_BESIDE.0
    }

    /// The best of these effects beside a hypothesis, best first: those that promise anything, and whatever they promise those that do well alone and
    /// change something else, from which the hypothesis may have taken the simulator far away.
    fn beside(
        &self,
        from: &Hypothesis,
        background: &Background<'_>,
        screened: &[Screened],
    ) -> Result<Vec<Hypothesis>, InputError> {
        let &Judge {
            records,
            nodes,
            weights,
            noise,
        } = self.judge;
        let changed = self.changes(from);
        // What grows with load follows errors of the motion, whatever else is there.
        let apart = |entry: &Entry| {
            !grows_with_load(entry)
                && self
                    .well_alone(entry)
                    .is_some_and(|alone| cosine(&changed, &self.changes(alone)) < APART)
        };
        // What acts in few moments promises little of all squares.
        let moments = leaves_moments(noise, nodes, &from.held_out);
        let whatever = |place, entry: &Entry| {
            place < BESIDE && apart(entry) || moments && entry.acts_in_moments()
        };
        let plays = leaves_anything(noise, nodes, &from.held_out);
        let mut found: Vec<Hypothesis> = fit_best(background, screened, BESIDE, plays, whatever)?
            .into_iter()
            .map(|Tried { entry, model, fit }| {
                let mut added = from.added.clone();
                added.push(entry);
                let fit = fit_at(&model, records, weights, fit.at)?;
                let fit = no_worse(&model, fit, &from.fit, records, weights)?;
                Ok(self.judge.hypothesis(added, model, fit))
            })
            .collect::<Result<_, InputError>>()?;
        sort(&mut found);
        Ok(found)
    }
}

/// Whether an effect may be one more beside a hypothesis: an axis has one load behind a spring.
fn goes_beside(entry: &Entry, hypothesis: &Hypothesis) -> bool {
    let mut added = hypothesis.added.iter();
    added.all(|added| added.id != entry.id && !(springs(added) && springs(entry)))
}

/// The values that an effect came out with in a hypothesis; none for a wave with a phase of its own on each record.
fn values_in(hypothesis: &Hypothesis, entry: &Entry) -> Option<Vec<f64>> {
    let on_one = |free: &Free| matches!(free.owner, Owner::OnRecord(..));
    if hypothesis.model.free.iter().any(on_one) {
        return None;
    }
    let point = hypothesis.model.at(&hypothesis.fit.at);
    let effects = point.effects();
    let effect = effects.iter().rfind(|added| added.entry.id == entry.id)?;
    Some(effect.values.clone())
}
