//! Which hypothesis is worth the effects that it adds.

use super::bristles::is_bristles;
use super::hypothesis::{Hypothesis, change, cosine, is_predicted, makes_steps, of_noise};
use super::likelihood::Noise;
use super::play::springs;
use super::regime::{Node, Regime};
use super::tried::{Null, Search};
use crate::signal::rms_beside;
use bristle_plant::effect::Entry;

/// Nats that an effect must gain before it is accused: the price of choosing among some thirty, each from many starts. Of
/// opened cases those that were there gained 36 or more, one that was not 12.
pub(super) const ACCUSES: f64 = 20.0;
/// Nats of evidence, beyond its null, that it must gain as well: of opened cases those that were there gained 28 or more, a play that was not, with
/// four parameters to follow errors of the method, -3.
pub(super) const LEAST_EVIDENCE: f64 = 10.0;
/// Times of what is open that an effect must take away, were it independent of what is left: less is what a model's own
/// error leaves to it.
pub(super) const MATTERS: f64 = 0.4;
/// Nats of evidence that an effect must gain beyond its null, and part of the weighted squares that it must take away, to be accused whatever share
/// that is of times that are counted over all regimes: what acts in few of them, as friction that remembers a rest, hardly shows there. Of 40
/// trials without an effect one was at 13, the others at 8 at most, where it was no friction that grows with load, or alike. That takes more: errors
/// of the motion took 0.14 at most where they gained anything above what is open. A lag that was not there took 0.075 by 63 nats.
pub(super) const BY_EVIDENCE: (f64, [f64; 2]) = (25.0, [0.1, 0.2]);
/// Share of the gap, nats of evidence beyond its null, and part of the weighted squares, that an effect must explain, gain and take away to be accused
/// however small the gap is; of the last the second where it changes what errors of the motion change. Of 90 opened trials without an effect
/// those that seemed to explain as much took 0.09 at most of what errors change, by 73 nats, and 0.02 of other squares, by 24.
pub(super) const EXPLAINS_ALL: (f64, f64, [f64; 2]) = (0.9, 18.0, [0.03, 0.3]);
/// Part of the weighted squares that steps of the position must take away for both: they choose the moments of the largest rests. Right ones took
/// 0.77 and more, those of a clean axis 0.18 by 98 nats.
pub(super) const STEPS_TAKE: f64 = 0.5;
/// Part of them that steps must take away whatever they explain. Of opened trials at one times the floor right ones took 0.39 and more, those of two
/// clean axes 0.17 at most.
pub(super) const STEPS_EXPLAIN: f64 = 0.25;
/// Share of the gap that an effect must explain: one that is not there explains as much, by the model's own error.
pub(super) const SHARE: f64 = 0.25;
/// Share of a gap of few moments, in the ratio of root-mean-squares, that an effect must explain where the geometric mean hardly
/// shows the gap: opened cases with such an effect were at 0.77 and more, those without one at 0.68 at most.
pub(super) const OF_MOMENTS: f64 = 0.75;
/// Nats that a second effect must gain beside the first, beyond what it gains where it is not; part of the weighted squares that it must take away, and times of
/// what both take away that two may take away alone: beyond it they are one effect in two forms. Either much is gained above what
/// is open, or most of the squares go, below it too. True ones of opened cases were at 73, 0.30 and 1.23, or at 13, 0.45
/// and 1.35, but for some; of 330 other cases four pass.
const SECOND: [(f64, f64, f64); 2] = [(60.0, 0.26, 1.3), (LEAST_SECOND, 0.4, 1.4)];
/// The fewest of these nats.
pub(super) const LEAST_SECOND: f64 = 10.0;
/// The first two of these where a single effect leaves much in sliding; or where it leaves much, and both leave nothing: then the
/// second one need not explain anything alone, or if it does, need not take squares, by the weights of which what the first one
/// leaves is noise.
const SECOND_WHERE_MUCH_IS_LEFT: (f64, f64) = (60.0, 0.2);
/// All three where a single effect leaves anything and both leave nothing: two that act alike, as two limits or two delays, are then no
/// one effect in two forms. Of 93 trials with one effect, of which one had a pair that gained 30 and more and left nothing, that took 0.08. The first
/// alone where both leave nothing of much that one leaves in few moments, of which squares tell little.
const SECOND_WHERE_NOTHING_IS_LEFT: (f64, f64, f64) = (30.0, 0.3, 2.0);
/// All three, and the share that they explain of what the single effect leaves, where that is anything. Of those 93 the most was 0.21 where the
/// first two hold, and 0.22 where the effect was left out.
const SECOND_OF_WHAT_IS_LEFT: ((f64, f64, f64), f64) = ((100.0, 0.15, 1.3), 0.4);
/// All three, and the least ratio of root-mean-squares in motion that the single effect leaves, where both leave nothing of few moments either. Of
/// 300 opened trials with one effect none comes to it.
const SECOND_WHERE_NO_MOMENTS_ARE_LEFT: ((f64, f64, f64), f64) = ((100.0, 0.1, 1.05), 1.5);
/// Ratios of root-mean-squares in motion beyond which few moments have much of a rest, and below which they have nothing. Of 40 trials
/// without an effect the refitted simulator left 1.3 at most.
const MOMENTS: [f64; 2] = [2.0, 1.25];
/// Times of what is open below which a second effect is looked for only among what does well alone: a search of all costs as much
/// as the first one.
const ROOM: f64 = 0.5;
/// Nats of evidence, and part of the best one's gain, within which two hypotheses tie. Beyond five evidence is called very
/// strong: Kass, Raftery 1995, J. Am. Stat. Assoc. 90, section 3.2.
pub(super) const TIES: (f64, f64) = (5.0, 0.002);
/// Nats of evidence within which they tie where what is left below what is open does not tell them apart by as much as `TIES` either:
/// there one more parameter alone costs seven, the data leaving a thousandth of its prior.
pub(super) const TIES_BUT_FOR_PRIORS: f64 = 8.0;
/// Nats by which two effects must do better alone than two others to be named in their place.
const TIES_ALONE: f64 = 10.0;
/// Share of the gap below which the best one explains little of much. Of a real axis, of which it leaves much, too, one effect explains 0.42.
pub(super) const LITTLE: f64 = 0.33;
/// Times of what is open that are left where too little is explained: then the effect is not in the catalogue. Opened cases
/// with nothing but wrong parameters were left with 1.2 at most.
pub(super) const UNKNOWN: f64 = 1.4;
/// The same of the ratio of root-mean-squares in sliding: those were left with 1.2 at most, those with an effect that no list has
/// with 2.2 and more. Slower an axis creeps on bristles whose load the encoder does not tell.
pub(super) const UNKNOWN_SLIDING: f64 = 1.6;
/// Times of what is open, of all and of sliding alone, below which nothing is left.
pub(super) const NOTHING: [f64; 2] = [1.15, 1.25];
/// The same of the geometric mean over records in sliding: one that is coarse does not hide the others. Those were left with 1.4 at
/// most, and with 1.6 and more.
pub(super) const UNKNOWN_SLIDING_USUALLY: f64 = 1.55;
/// A rest as large in every record and regime of motion, to this factor, is noise of the recorder that is correlated for longer than
/// its differences show, up to so many times of what is open. Of opened cases with an effect that no list has one was at 1.15 and
/// seven times, the others at 1.5 and more.
pub(super) const EVENLY: (f64, f64) = (1.1, 3.0);
/// Share of such a rest that tones explain from which it is no noise. Of noise that is correlated for long a line or two may stand out; an opened trial
/// with a tone that no list had was at 0.83.
pub(super) const TONES: f64 = 0.7;
/// Part of the weighted squares left by an effect that is named whatever its form leaves in sliding.
pub(super) const TAKES_ALL_BUT: f64 = 0.05;
/// Times of what is open, of all, and ratio of root-mean-squares in motion beside it, beyond which what is named leaves what nothing does that is there, or the
/// simulator where nothing is accused. Of 70 opened cases and trials that a single effect explains rightly none was beyond the first, nor
/// of 40 without an effect; of 40 whose effect was left out 23 were. A real axis leaves some times of what is open all over, by many small
/// effects, but nothing in the moments that are largest.
pub(super) const LEAVES: [f64; 2] = [1.25, 1.05];
/// The same of the geometric mean over records in sliding. Of 57 opened trials that a single effect explains rightly none was beyond 1.25; a dwell that
/// was named for a Stribeck fall was at 1.54.
pub(super) const LEAVES_SLIDING: f64 = 1.45;
/// The first of `LEAVES` where a single effect explains less than the second, a share of the gap. Of 200 opened cases and trials those that were there
/// and left more than 1.15 explained 0.58 and more; of those whose effect was left out four left 1.21 and more and explained 0.44 at most.
pub(super) const LEAVES_OF_LITTLE: (f64, f64) = (1.18, 0.55);
/// The same of few moments: ratio of root-mean-squares, and part of the weighted squares.
pub(super) const LEAVES_MOMENTS: (f64, f64) = (1.4, 0.3);
/// Nats of belief in the simulator's own parameters below which one effect stands for another, that takes them back to where they are believed. Of 135
/// opened cases and trials that were named rightly two were at -28 and -36, the others at -10 and more; three of which another effect was named were at -27
/// to -39.
pub(super) const STRAINED: f64 = -25.0;
/// Ratio of root-mean-squares in motion beyond which what is left, whatever is accused, is an effect that no list has. Of 100 trials
/// without an effect two left 2.4 and 2.7, creeping on bristles whose load the encoder does not tell, the others 2.0 at most.
pub(super) const UNKNOWN_MOMENTS: f64 = 2.9;
/// Nats by which a rest has to speak in one regime of one record, and times of what is open, beyond which it is an effect that no list has where one effect
/// is accused, or none; of fewer moments more times. Of 40 opened trials with one effect that were named rightly one was at 2.1, the others at 1.7 and
/// less, of 51 without an effect one was at 1.9; friction that is a third more than believed left 63 nats at 3.5. Of those of which another was named, or
/// only parameters, two were at 4.9 and 7.0, one left 47 nats at 6.4.
pub(super) const IN_A_REGIME: [(f64, f64); 2] = [(80.0, 2.5), (40.0, 5.0)];
/// Shares of the gap below which two effects stand for something else where they leave so much, of all or of few moments: of a pair that explains more
/// each may be there, and fitted badly beside the other. Opened pairs that were there explained 0.49 and more of all.
pub(super) const STANDS_FOR: [f64; 2] = [0.45, 0.75];
/// Nats that a smooth black box must gain on what an effect leaves, where that is anything, for the effect to stand for one that no list has. Of
/// opened cases and trials that were named rightly one was at 92, the others at 48 at most; of trials whose effect was left out nine were at 62 to
/// 406.
pub(super) const FOREIGN: f64 = 60.0;
/// Share of the squares that an effect leaves while the axis slides, and of the gap, as root-mean-squares, beyond which what is left depends on
/// where the axis is and how it moves. Of 50 trials that were named rightly the first was 0.04 at most but for two, at 0.25; of ten whose effect was left
/// out and another one named in its place four were at 0.36 and 0.07 or more, one at 0.21. Without noise one that is there leaves 0.32 and 0.015.
pub(super) const DEPENDS: [f64; 2] = [0.3, 0.04];
/// Share of the gap from which an effect explains all that can be told, whatever the rest below what is open depends on: two that were there and left as
/// much to it explained all of it, a third one 0.99, of opened cases whose effect was left out one explained 0.98.
pub(super) const ALL_BUT_TELLS: f64 = 0.985;
/// A null is one draw of what varies by as much as it is: of clean axes two gained 1.3 and 1.8 times their null.
pub(super) const NULLS_VARY: f64 = 2.0;
/// Part by which an effect may make the ratio of root-mean-squares in motion larger: it has taken the simulator to where few moments are wrong that were
/// not. Of 60 opened cases and trials right ones were at 1.11 at most, wrong ones at 1.24 to 29.
pub(super) const WORSENS: f64 = 1.2;
/// Nats that an effect must gain beyond its null, and part of the weighted squares that it must take away, to be accused of
/// what lies below what is open. Opened cases without an effect were at 49 nats at most where they took away the tenth; of clean trials one
/// that took away 0.15 was at 209.
const BELOW_OPEN: (f64, f64) = (70.0, 0.1);
/// The same of a second effect. Of 105 trials with one effect or none that were asked none was beyond both, where of 35 right pairs 31 were at 182
/// and more and took 0.22.
pub(super) const BELOW_OPEN_BESIDE: (f64, f64) = (150.0, 0.2);
/// Nats within which two tie there, where errors of the method are as large as the effect.
const TIES_BELOW_OPEN: f64 = 8.0;
/// Part of these nats with which bristles of fewer parameters are named: those of more take some of the method's errors, too. Where the plainer ones
/// were there they gained 0.92 of the others and more, where the others were there 0.68 at most, of 18 opened cases.
const PLAIN_BRISTLES: f64 = 0.8;
/// Cosine between what an effect changes below what is open and what a load behind a spring would change: beyond it both follow
/// the same errors of the motion. Opened cases whose effect was there were at 0.10 at most, others at 0.44 and more.
const LIKE_A_SPRING: f64 = 0.25;

/// Nats that bristles must gain where friction is static. Of fourteen static axes with nothing missing they gained 88 at most, where they
/// were missing 590 and more, or 514 beside another effect.
const BRISTLES_GAIN: f64 = 200.0;
/// Friction that grows with acceleration, too. Below what is open it was there in one opened case of four that it explained best.
const GROWS_WITH_LOAD: &str = "friction.load";

/// The best single effect, or the best pair if it is worth its second effect, or the best one with that single effect if it is.
pub(super) fn choose(search: &Search) -> Option<&Hypothesis> {
    let holds = |h: &&Hypothesis| {
        search.shown.is_none_or(|id| h.ids().contains(&id)) && h.is_credible(&search.base)
    };
    let single = match search.shown {
        Some(_) => search.single.iter().find(holds),
        None => foremost(&search.single, &search.base),
    }?;
    let Some(pair) = best_pair(search, holds) else {
        return Some(single);
    };
    let as_well = |h: &&Hypothesis| {
        single.score.max(pair.score) - h.score < LEAST_SECOND
            && search.score_of_all(pair) - search.score_of_all(h) < LEAST_SECOND
    };
    let alone = pair.ids().into_iter().filter_map(|id| search.alone(id));
    // Also what lies below what is open, which the best one may not explain, but the other one alone.
    if let Some(alone) = alone.filter(holds).find(as_well) {
        return Some(alone);
    }
    let beside = best_beside(search, single).filter(holds);
    let bristles = bristles_beside(search, single).filter(holds);
    let mut pairs = std::iter::once(pair).chain(beside).chain(bristles);
    pairs
        .find(|pair| is_worth_its_second(search, single, pair))
        .or(Some(single))
}

/// The best pair that a single effect is part of.
pub(super) fn best_beside<'a>(search: &'a Search, single: &Hypothesis) -> Option<&'a Hypothesis> {
    beside(search, single).next()
}

/// The pairs that a single effect is part of, best first.
fn beside<'a>(search: &'a Search, single: &Hypothesis) -> impl Iterator<Item = &'a Hypothesis> {
    let id = single.added[0].id;
    let pairs = search.several.iter();
    pairs.filter(move |pair| pair.ids().contains(&id))
}

/// The best pair of a single effect and bristles where friction is static, by what lies below what is open, which such friction hides; the one of fewer
/// parameters where it does nearly as well.
pub(super) fn bristles_beside<'a>(
    search: &'a Search,
    single: &Hypothesis,
) -> Option<&'a Hypothesis> {
    let brings = |pair: &&Hypothesis| {
        let second = |entry: &Entry| entry.id != single.added[0].id;
        let mut added = pair.added.iter();
        added.any(|entry| second(entry) && is_bristles(&search.base.model, entry))
    };
    let nats = |pair: &Hypothesis| search.score_of_all(pair) - search.score_of_all(single);
    let pairs = || beside(search, single).filter(brings);
    let most = pairs().map(nats).fold(0.0, f64::max);
    pairs()
        .filter(|pair| nats(pair) > PLAIN_BRISTLES * most)
        .min_by_key(|pair| pair.model.free.len())
}

/// Whether a pair explains enough beyond the best single effect.
fn is_worth_its_second(search: &Search, single: &Hypothesis, pair: &Hypothesis) -> bool {
    // Noise that multiplies what the fit is made of, as of the times at which positions were read, pulls the simulator's own parameters to
    // where they are not believed, and leaves what looks like another effect.
    if of_noise(single) && pair.log_belief < STRAINED {
        return false;
    }
    let before = search.weighted_squares(&search.base);
    let taken = |h: &Hypothesis| before - search.weighted_squares(h);
    let shown = |entry: &&Entry| !is_predicted(entry) || search.shown == Some(entry.id);
    // What explains nothing by itself stands for the other one's error.
    let explains = |h: &&Hypothesis| taken(h) > 0.0 || h.score - search.base.score > SECOND[0].0;
    let alone = |id: &str| {
        let alone = search.alone(id).filter(explains);
        alone.map(|h| taken(h).max(0.0))
    };
    let parts: Option<f64> = pair.ids().into_iter().map(alone).sum();
    let overlap = if pair.added.iter().any(shown) {
        1.0
    } else {
        parts.map_or(f64::INFINITY, |parts| parts / taken(pair))
    };
    let is_second = |entry: &&&Entry| !single.ids().contains(&entry.id);
    let second = || pair.added.iter().filter(is_second);
    let nulls: f64 = second()
        .filter_map(|entry| search.null(entry.id))
        .map(Null::may_gain)
        .sum();
    let nats = pair.score - single.score - nulls;
    let takes = (taken(pair) - taken(single)) / (before - taken(single));
    let leaves = |h: &Hypothesis, times| leaves(&search.noise, &search.nodes, &h.held_out, times);
    let slides_off = leaves(single, [f64::INFINITY, UNKNOWN_SLIDING]);
    let [of_single, of_pair] = [single, pair].map(|h| {
        search
            .noise
            .rms_times_open(&search.nodes, &h.held_out, &Regime::MOVING)
    });
    let (where_none, least_moments) = SECOND_WHERE_NO_MOMENTS_ARE_LEFT;
    let of_moments = of_single > MOMENTS[0]
        && (of_pair < MOMENTS[1] || explained(of_single, of_pair) > OF_MOMENTS);
    let leaves_nothing = !leaves(pair, NOTHING);
    let nothing_left = of_moments || leaves(single, [UNKNOWN, UNKNOWN_SLIDING]) && leaves_nothing;
    let anything_left = leaves(single, NOTHING) || of_single > least_moments;
    let times = |h: &Hypothesis| search.noise.times_open(&search.nodes, &h.held_out);
    let (of_rest, least_share) = SECOND_OF_WHAT_IS_LEFT;
    let takes_rest = anything_left && explained(times(single), times(pair)) > least_share;
    let asked = |(least_nats, least, most): (f64, f64, f64)| {
        nats > least_nats && takes > least && overlap < most
    };
    let no_moments = of_single > least_moments && of_pair < MOMENTS[1] && leaves_nothing;
    let (least_nats, least) = SECOND_WHERE_MUCH_IS_LEFT;
    let apart = overlap < SECOND[0].2;
    SECOND.into_iter().any(asked)
        || nats > least_nats
            && (apart && slides_off && takes > least
                || of_moments && parts.is_none()
                || nothing_left && (apart || parts.is_none() && takes > least))
        || (of_moments || anything_left && leaves_nothing) && asked(SECOND_WHERE_NOTHING_IS_LEFT)
        || of_moments && leaves_nothing && apart && nats > SECOND_WHERE_NOTHING_IS_LEFT.0
        || takes_rest && asked(of_rest)
        || no_moments && asked(where_none)
        || search.leaves_another
            && leaves_nothing
            && nats > SECOND[0].0
            && (apart || parts.is_none())
        || second().next().is_some_and(|entry| {
            let takes = parts.map(|_| takes);
            gains_below_open(search, single, pair, entry, takes)
        })
}

/// Whether the second effect of a pair gains below what is open what an effect that is there does, or bristles beside friction that
/// is static; where its null tells what it gains where it is not. `takes` is none where it explains nothing alone.
fn gains_below_open(
    search: &Search,
    single: &Hypothesis,
    pair: &Hypothesis,
    second: &Entry,
    takes: Option<f64>,
) -> bool {
    let Some(null) = search.null(second.id) else {
        return false;
    };
    let nats = search.score_of_all(pair) - search.score_of_all(single) - null.may_gain_of_all();
    let (least_nats, least) = BELOW_OPEN_BESIDE;
    // What grows with load follows errors of the motion; steps are at the moments of the largest.
    let follows = grows_with_load(second) || makes_steps(second);
    nats > least_nats && takes.is_some_and(|takes| takes > least) && !follows
        || nats > BRISTLES_GAIN && is_bristles(&search.base.model, second)
}

/// Whether a rest is more times what is open than these, of all or of sliding alone.
pub(super) fn leaves(
    noise: &Noise,
    nodes: &[Node],
    rest: &[f64],
    [all, sliding]: [f64; 2],
) -> bool {
    noise.times_open(nodes, rest) > all
        || noise.rms_times_open(nodes, rest, &[Regime::Sliding]) > sliding
}

/// The best pair; or one that ties with it and whose effects do clearly better alone; or one that ties with it but for priors and does as much
/// better below what is open as accuses.
pub(super) fn best_pair(
    search: &Search,
    holds: impl Fn(&&Hypothesis) -> bool,
) -> Option<&Hypothesis> {
    let pairs = || search.several.iter().filter(&holds);
    let first = pairs().next()?;
    let near = |nats: f64| {
        let least = first.log_evidence() - nats;
        pairs().filter(move |pair| pair.log_evidence() >= least)
    };
    let alone = |pair: &Hypothesis| {
        let each = pair.ids().into_iter().map(|id| search.alone(id));
        each.map(|h| h.map_or(f64::NEG_INFINITY, Hypothesis::log_evidence))
            .sum::<f64>()
    };
    let enough = alone(first) + TIES_ALONE;
    let of_all = |h: &Hypothesis| search.score_of_all(h) + h.log_occam;
    let most = near(TIES.0).map(of_all).fold(f64::NEG_INFINITY, f64::max);
    // Not where what lies below what is open speaks for another.
    let better_alone = near(TIES.0)
        .filter(|pair| alone(pair) > enough && of_all(pair) > most - ACCUSES)
        .max_by(|one, other| alone(one).total_cmp(&alone(other)));
    let better_below = || {
        near(TIES_BUT_FOR_PRIORS)
            .filter(|pair| of_all(pair) > of_all(first) + ACCUSES)
            .max_by(|one, other| of_all(one).total_cmp(&of_all(other)))
    };
    better_alone.or_else(better_below).or(Some(first))
}

/// What a second effect is looked for beside: noise that positions show by themselves, whatever else is there; or the best.
pub(super) fn foremost<'a>(single: &'a [Hypothesis], base: &Hypothesis) -> Option<&'a Hypothesis> {
    let shows = |h: &&Hypothesis| of_noise(h) && h.score - base.score > ACCUSES;
    let credible = |h: &&Hypothesis| h.is_credible(base);
    single
        .iter()
        .find(shows)
        .or_else(|| single.iter().find(credible))
}

/// Whether beside an effect enough is left of the gap for a second one to be believed.
pub(super) fn leaves_room(noise: &Noise, nodes: &[Node], single: &[f64]) -> bool {
    rms_beside(noise.times_open(nodes, single), 1.0) > ROOM
        || noise.rms_times_open(nodes, single, &[Regime::Sliding]) > UNKNOWN_SLIDING
}

/// The same in few moments.
pub(super) fn leaves_moments(noise: &Noise, nodes: &[Node], single: &[f64]) -> bool {
    noise.rms_times_open(nodes, single, &Regime::MOVING) > MOMENTS[0]
}

/// Whether a rest is anything, of all, in sliding or in few moments.
pub(super) fn leaves_anything(noise: &Noise, nodes: &[Node], rest: &[f64]) -> bool {
    leaves(noise, nodes, rest, NOTHING) || leaves_moments(noise, nodes, rest)
}

/// Share of the gap that was taken away, both in times of what is open.
pub(super) fn explained(before: f64, after: f64) -> f64 {
    if before <= 1.0 {
        1.0
    } else {
        (1.0 - after.ln() / before.ln()).clamp(0.0, 1.0)
    }
}

/// What effects gain where a rest below what is open counts, too, in nats, best first: where little is left above it, and of those
/// whose null would tell. Where friction is static, half of it is open while the axis hardly moves: what effects that bring bristles
/// take there, squares weighted by that hardly show, nor that it is no spring.
pub(super) fn gain_below_open(search: &Search) -> Vec<(&Hypothesis, f64)> {
    if search
        .noise
        .times_open(&search.nodes, &search.base.held_out)
        > UNKNOWN
    {
        return Vec::new();
    }
    let most = (1.0 - BELOW_OPEN.1) * search.weighted_squares(&search.base);
    let tells = |h: &&Hypothesis| {
        !of_noise(h)
            && !makes_steps(h.added[0])
            && h.is_credible(&search.base)
            && (brings_bristles(search, h)
                || !h.ends_at_limit() && !follows_acceleration(search, h))
    };
    let mut found: Vec<(&Hypothesis, f64)> = search
        .single
        .iter()
        .filter(tells)
        .map(|h| (h, search.gain_of_all(h)))
        .filter(|(h, nats)| {
            if brings_bristles(search, h) {
                *nats > BRISTLES_GAIN
            } else {
                *nats > BELOW_OPEN.0 && search.weighted_squares(h) < most
            }
        })
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    found
}

/// Whether what a hypothesis changes may be errors of the motion, which a null does not have: a load behind a spring, what changes the
/// same as such a load, and friction that grows with load.
pub(super) fn follows_acceleration(search: &Search, hypothesis: &Hypothesis) -> bool {
    let changes = |h: &Hypothesis| change(&search.base.held_out, &h.held_out, &search.weights);
    let changed = changes(hypothesis);
    let like =
        |h: &Hypothesis| springs(h.added[0]) && cosine(&changed, &changes(h)) >= LIKE_A_SPRING;
    hypothesis.added.iter().any(|entry| grows_with_load(entry)) || search.single.iter().any(like)
}

/// A load behind a spring, and friction that grows with load.
pub(super) fn grows_with_load(entry: &Entry) -> bool {
    springs(entry) || entry.id == GROWS_WITH_LOAD
}

/// Whether a hypothesis brings bristles to friction that is static.
pub(super) fn brings_bristles(search: &Search, hypothesis: &Hypothesis) -> bool {
    let mut added = hypothesis.added.iter();
    added.all(|entry| is_bristles(&search.base.model, entry))
}

/// The effects that explain best what lies below what is open, where any does so beyond what it gains where it is not.
pub(super) fn below_open(search: &Search) -> Vec<&Hypothesis> {
    let beyond_null = |(h, nats): (_, f64)| {
        let h: &Hypothesis = h;
        let nats = nats - search.null(h.added[0].id)?.may_gain_of_all();
        (nats > BELOW_OPEN.0).then_some((h, nats))
    };
    let mut found: Vec<(&Hypothesis, f64)> = gain_below_open(search)
        .into_iter()
        .filter_map(beyond_null)
        .collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    let Some(&(best, most)) = found.first() else {
        return Vec::new();
    };
    let plainer = |(h, nats): &&(&Hypothesis, f64)| {
        [best, *h].iter().all(|h| brings_bristles(search, h))
            && h.model.free.len() < best.model.free.len()
            && *nats > PLAIN_BRISTLES * most
    };
    if let Some(&(plain, _)) = found.iter().find(plainer) {
        return vec![plain];
    }
    found.retain(|(_, nats)| *nats >= most - TIES_BELOW_OPEN);
    found.into_iter().map(|(h, _)| h).collect()
}
