//! The hypothesis that explains most: whether it is accused, what it stands for, and what ties with it.

use super::accuse::{
    ACCUSES, ALL_BUT_TELLS, BY_EVIDENCE, DEPENDS, EXPLAINS_ALL, FOREIGN, LEAST_EVIDENCE,
    LEAVES_MOMENTS, LEAVES_OF_LITTLE, MATTERS, NOTHING, OF_MOMENTS, SHARE, STANDS_FOR,
    STEPS_EXPLAIN, STEPS_TAKE, STRAINED, TAKES_ALL_BUT, TIES, TIES_BUT_FOR_PRIORS, UNKNOWN_MOMENTS,
    UNKNOWN_SLIDING, WORSENS, below_open, brings_bristles, choose, explained, follows_acceleration,
    leaves,
};
use super::ceiling;
use super::coupling::COUPLING;
use super::details::passes_waves;
use super::hypothesis::{Hypothesis, is_without_noise, makes_steps, of_noise};
use super::left::Left;
use super::moved::Moved;
use super::own::Own;
use super::own_form::in_own_form;
use super::play::{PLAY, springs};
use super::regime::Regime;
use super::rivals::is_told_from;
use super::tried::Search;
use crate::inverse::Owner;
use crate::signal::{rms_beside, weighted_squares};
use bristle_plant::effect::{Entry, Kind};
use std::cell::OnceCell;

/// Times of what is open that a change of the simulator's own parameters must take away, as `MATTERS` is of an effect.
const MOVE_MATTERS: f64 = 0.5;

/// Times of what is open that two must differ by for what lies below it to tell them apart: the half of a floor beyond which a trial asks
/// for the right one of two effects.
const SAME: f64 = 0.5;
/// Part of the best one's gain, what lies below what is open counted, too, by which another is behind where that tells them apart however little they
/// differ by. Of opened ties those that these experiments could not tell apart were at 0.22 at most but for one, the others at 0.39 and more.
const BEHIND_OF_ALL: f64 = 0.3;

/// Nats of evidence, and parts of what the best one gains, without and with what lies below what is open, that another may be behind where the
/// method's own error may make as much, and no noise: where they differ by less than the last two, in times of what is open, the latter
/// where the other one leaves less, what lies below what is open counted. Of 62 opened trials three that named another effect than
/// was there had the right one so near, 0.04 to 0.34 apart; one was 0.32 from another that left more.
const CANNOT_TELL: (f64, [f64; 2], [f64; 2]) = (30.0, [0.05, 0.1], [0.25, 0.4]);

/// The best hypothesis beside the simulator alone.
pub(super) struct Chosen<'a> {
    search: &'a Search,
    /// It, or the simulator where there is none.
    pub(super) best: &'a Hypothesis,
    /// Nats that its held-out score gains; none where there is none.
    gain: Option<f64>,
    /// Times of what is open that are left without and with it.
    times: [f64; 2],
    /// The same of root-mean-squares in motion.
    rms_times: [f64; 2],
    /// Weighted squares that are left.
    squares: [f64; 2],
    /// Share of the gap that it explains.
    pub(super) explained: f64,
    left_alone: OnceCell<Left>,
    /// What it leaves over of its own records.
    own: OnceCell<Own>,
}

impl<'a> Chosen<'a> {
    pub(super) fn new(search: &'a Search) -> Self {
        let base = &search.base;
        let chosen = choose(search);
        let best = chosen.unwrap_or(base);
        let (noise, nodes) = (&search.noise, &search.nodes);
        let times = [base, best].map(|h| noise.times_open(nodes, &h.held_out));
        Self {
            best,
            gain: chosen.map(|h| h.score - base.score),
            times,
            rms_times: [base, best]
                .map(|h| noise.rms_times_open(nodes, &h.held_out, &Regime::MOVING)),
            squares: [base, best].map(|h| search.weighted_squares(h)),
            explained: explained(times[0], times[1]),
            left_alone: OnceCell::new(),
            own: OnceCell::new(),
            search,
        }
    }

    /// Whether it is accused: it gains beyond its null, and is shown, matters or is evident.
    pub(super) fn is_accused(&self) -> bool {
        let &Self { search, best, .. } = self;
        let Some(gain) = self.gain else {
            return false;
        };
        let null = match best.ids()[..] {
            [id] => search.null(id),
            _ => None,
        };
        let (nats, may_take) = null.map_or((0.0, 0.0), |null| {
            (null.may_gain(), rms_beside(null.times[0], null.times[1]))
        });
        // What a null takes below what is open it takes above it where less is open than the method leaves.
        let of_all = search.gain_of_all(best);
        let beyond_null = null.is_none_or(|null| of_all > null.may_gain_of_all());
        let matters =
            |[before, after]: [f64; 2]| rms_beside(before, after) > MATTERS.hypot(may_take);
        let evidence = best.log_evidence() - search.base.log_evidence() - nats;
        let [before, after] = self.rms_times;
        let takes = 1.0 - self.squares[1] / self.squares[0];
        let follows = follows_acceleration(search, best);
        let of_moments = matters(self.rms_times)
            && explained(before, after) > OF_MOMENTS
            && (before > LEAVES_MOMENTS.0 || evidence > BY_EVIDENCE.0)
            && (!follows || takes > BY_EVIDENCE.1[0]);
        let explains = (matters(self.times) || of_moments) && self.explained > SHARE
            || of_moments && evidence > TIES.0;
        // What positions show by themselves needs no share of what is left once that is mended.
        let shown = |entry: &Entry| search.shown == Some(entry.id);
        let mut added = best.added.iter();
        let steps = added.any(|entry| makes_steps(entry) && !shown(entry));
        let takes_enough = |least: f64| takes > if steps { STEPS_TAKE } else { least };
        let (nats_of_evidence, least) = BY_EVIDENCE;
        let springs = best.added.iter().all(|entry| springs(entry));
        let evident =
            evidence > nats_of_evidence && takes_enough(least[usize::from(follows && !springs)]);
        let (share, nats_of_all, least) = EXPLAINS_ALL;
        let explains_all = self.explained > share
            && evidence > nats_of_all
            && takes_enough(least[usize::from(follows)]);
        let worsens = after > WORSENS * before;
        gain - nats > ACCUSES
            && (self.is_by_itself()
                || !worsens
                    && !self.is_no_play()
                    && beyond_null
                    && evidence > LEAST_EVIDENCE
                    && !(steps && takes < STEPS_EXPLAIN)
                    && (self.spares()
                        || explains
                        || evident
                        || explains_all
                        || evidence > nats_of_evidence && self.takes_what_is_of_no_list()))
    }

    /// Whether it is a play that does no better than the coupling without one, which may be too stiff to be accused: what is left of that is the
    /// motion between samples, and no play's either.
    fn is_no_play(&self) -> bool {
        let &Self { search, best, .. } = self;
        best.ids() == [PLAY]
            && search
                .alone(COUPLING)
                .is_some_and(|h| h.score >= best.score)
    }

    /// What the simulator alone leaves: asked for the accusation and the verdict, and found by a simulation and a fit.
    pub(super) fn left_alone(&self) -> &Left {
        let base = &self.search.base;
        let of_base = || Left::new(self.search, base, &base.held_out, &OnceCell::new());
        self.left_alone.get_or_init(of_base)
    }

    /// What it leaves, or another form of it, N m at each node.
    fn left_of(&self, rest_nm: &[f64]) -> Left {
        Left::new(self.search, self.best, rest_nm, &self.own)
    }

    /// What it leaves.
    pub(super) fn left(&self) -> Left {
        self.left_of(&self.best.held_out)
    }

    /// Whether the simulator alone leaves what would be of no list, and it nothing: few moments, or one regime of one record, that a geometric mean
    /// hardly shows.
    fn takes_what_is_of_no_list(&self) -> bool {
        let (noise, nodes) = (&self.search.noise, &self.search.nodes);
        let base = &self.search.base.held_out;
        let slides = || noise.rms_times_open(nodes, base, &[Regime::Sliding]) > UNKNOWN_SLIDING;
        !leaves(noise, nodes, &self.best.held_out, NOTHING)
            && (slides() || self.left_alone().is_of_no_list())
            && !self.left().fills_a_regime
    }

    /// What a refit explains alike is the effect's where the refit has to take parameters to where they are not believed.
    fn spares(&self) -> bool {
        self.best.log_belief - self.search.base.log_belief > ACCUSES
            && self.given_contributes(self.times[1])
    }

    /// Whether what the refit took away by what it moved of the simulator's own parameters matters, however little it is where sliding tells any
    /// of them.
    pub(super) fn refit_matters(&self, moved: &[Moved]) -> bool {
        let search = self.search;
        let by_sliding = moved.iter().any(|moved| moved.by_sliding);
        let as_given = search.noise.log_density(&search.nodes, &search.as_given);
        !moved.is_empty()
            && search.base.score - as_given > ACCUSES
            && (by_sliding || self.given_contributes(self.times[0]))
    }

    /// Whether the simulator as it stands leaves over that much more than `times` of what is open. What the method would leave over
    /// of parameters that are right moves none of them.
    fn given_contributes(&self, times: f64) -> bool {
        let search = self.search;
        let of_given = search.noise.clone().at_least(&search.own_as_given);
        let given = of_given.times_open(&search.nodes, &search.as_given);
        rms_beside(given, times) > MOVE_MATTERS
    }

    /// Whether positions show it by themselves, whatever else is there.
    pub(super) fn is_shown(&self) -> bool {
        self.gain.is_some() && self.search.shown.is_some_and(|id| self.best.ids() == [id])
    }

    /// Whether it is seen in the positions.
    pub(super) fn is_by_itself(&self) -> bool {
        self.is_shown() || of_noise(self.best)
    }

    /// Whether another form of it would leave no more than effects that are there do.
    pub(super) fn is_in_another_form(&self) -> bool {
        in_own_form(self.search, self.best).is_some_and(|rest_nm| {
            let left = self.left_of(&rest_nm);
            let squares = weighted_squares(&rest_nm, &self.search.weights);
            let takes_all = squares < TAKES_ALL_BUT * self.squares[0];
            let is_unexplained = left.is_unexplained()
                || left.is_unexplained_in_sliding()
                || left.moments > LEAVES_MOMENTS.0;
            (takes_all || !is_unexplained) && !left.fills_a_regime
        })
    }

    /// Whether it leaves what no effect leaves that is there, or what depends smoothly on where an axis is and how it moves.
    pub(super) fn leaves_another(&self, left: &Left) -> bool {
        let takes_all = self.squares[1] < TAKES_ALL_BUT * self.squares[0];
        let alone = self.best.added.len() == 1;
        let (of_little, share) = LEAVES_OF_LITTLE;
        let is_unexplained =
            left.is_unexplained() || alone && self.explained < share && left.is_beyond(of_little);
        let named_below = |share: f64| alone || self.explained < share;
        let of_all = (is_unexplained || left.is_unexplained_in_sliding())
            && (alone || !self.has_free_order());
        let of_moments =
            left.moments > LEAVES_MOMENTS.0 && self.squares[1] > LEAVES_MOMENTS.1 * self.squares[0];
        let leaves = [of_all, of_moments]
            .into_iter()
            .zip(STANDS_FOR)
            .any(|(leaves, share)| leaves && named_below(share));
        let is_foreign =
            || left.is_anything() && ceiling::gains(self.search, &self.best.held_out) > FOREIGN;
        let depends = || {
            named_below(STANDS_FOR[1])
                && self.explained < ALL_BUT_TELLS
                && ceiling::depends_in_sliding(self.search, self.best, DEPENDS)
        };
        let stands = !takes_all && (left.moments > UNKNOWN_MOMENTS || leaves || is_foreign());
        let fills = alone && left.fills_a_regime;
        // What noise of the sensor leaves is noise.
        is_without_noise(self.best) && (stands || fills || depends())
    }

    /// Whether one effect leaves the simulator's own parameters where they are hardly believed, in whatever form.
    pub(super) fn strains(&self) -> bool {
        self.best.added.len() == 1 && is_without_noise(self.best) && self.best.log_belief < STRAINED
    }

    /// Whether one of several effects has a form that no axis is known by, or a wave of torque that was found in hardly more than one pass: together
    /// they follow what neither is.
    pub(super) fn is_unusual(&self) -> bool {
        let (scale, model) = (&self.search.scale, &self.best.model);
        let mut added = self.search.base.model.effects.len()..model.effects.len();
        let mut is_curve =
            || self.has_free_order() && added.any(|place| !passes_waves(model, place, scale));
        self.best.added.len() > 1
            && is_without_noise(self.best)
            && (self.best.has_an_unusual_shape(scale) || is_curve())
    }

    /// Whether it has a wave whose order was fitted: beside another effect it may stop beside its own, or stand for what is no wave.
    fn has_free_order(&self) -> bool {
        let model = &self.best.model;
        model.free.iter().any(|free| {
            matches!(free.owner, Owner::Effect(effect, parameter)
                if model.effects[effect].entry.parameters[parameter].kind == Kind::Order)
        })
    }

    /// What explains best what lies below what is open: bristles whatever is accused, else only where nothing is.
    pub(super) fn small(&self, accused: bool) -> Vec<&'a Hypothesis> {
        let bristles = |h: &Hypothesis| brings_bristles(self.search, h);
        if accused && !bristles(self.best) {
            return Vec::new();
        }
        let small = below_open(self.search);
        // Which bristles is told by what the axis does while it hardly moves.
        if accused && small.first().is_some_and(|h| !bristles(h)) {
            return Vec::new();
        }
        small
    }

    /// Whether another one, not at an end of what it may be, is so near that the method's own error may decide between them.
    fn cannot_tell(&self, other: &Hypothesis) -> bool {
        let &Self { search, best, .. } = self;
        let (nats, [of_gain, of_all], apart) = CANNOT_TELL;
        let nats = nats.min(of_gain * self.gain.unwrap_or_default());
        let [of_best, of_other, of_none] =
            [best, other, &search.base].map(|h| search.score_of_all(h));
        let apart = apart[usize::from(of_other > of_best)];
        let (rest, other_rest) = (&best.fit.left_over, &other.fit.left_over);
        !other.ends_at_limit()
            && other.log_evidence() >= best.log_evidence() - nats
            && of_best - of_other < of_all * (of_best - of_none)
            && search.noise.apart(&search.nodes, other_rest, rest) < apart
    }

    /// Places of those that tie with it, itself among them.
    pub(super) fn tied(&self, ranked: &[Hypothesis]) -> Vec<usize> {
        let &Self { search, best, .. } = self;
        let limit = best.log_evidence() - TIES.0.max(TIES.1 * self.gain.unwrap_or_default());
        let ties = |h: &Hypothesis| {
            let squares = search.weighted_squares(h) - self.squares[1];
            h.log_evidence() >= limit
                || self.cannot_tell(h)
                || h.log_evidence() >= best.log_evidence() - TIES_BUT_FOR_PRIORS
                    && squares < 2.0 * TIES.0
        };
        // What positions show by themselves ties with nothing.
        let by_itself = self.is_by_itself();
        let tied =
            |h: &Hypothesis| h.ids() == best.ids() || !by_itself && h.added.len() == 1 && ties(h);
        // All of them explain what is above what is open: what lies below it may tell them apart, unless it is next to nothing.
        let (noise, nodes) = (&search.noise, &search.nodes);
        let of_all = |h: &Hypothesis| search.score_of_all(h) + h.log_occam;
        let ranked = ranked.iter().enumerate();
        let tied: Vec<(usize, &Hypothesis)> = ranked.filter(|(_, h)| tied(h)).collect();
        let most = tied.iter().map(|&(_, h)| h);
        let most = most.max_by(|one, other| of_all(one).total_cmp(&of_all(other)));
        let keeps = |h: &Hypothesis| {
            most.is_none_or(|most| {
                let behind = of_all(most) - of_all(h);
                let far = BEHIND_OF_ALL * (of_all(most) - of_all(&search.base));
                behind <= ACCUSES
                    || behind < far
                        && noise.apart(nodes, &h.fit.left_over, &most.fit.left_over) < SAME
            })
        };
        let kept: Vec<(usize, &Hypothesis)> = tied.into_iter().filter(|(_, h)| keeps(h)).collect();
        let Some((&(place, first), others)) = kept.split_first() else {
            return Vec::new();
        };
        let is_told = |h: &Hypothesis| {
            noise.apart(nodes, &h.fit.left_over, &first.fit.left_over) > 0.0
                && is_told_from(search, first, h)
        };
        let rivals = others.iter().filter(|(_, h)| !is_told(h));
        std::iter::once(place)
            .chain(rivals.map(|&(place, _)| place))
            .collect()
    }
}
