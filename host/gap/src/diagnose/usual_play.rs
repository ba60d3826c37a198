//! Plays from usual ones: laid against the records a play shows as a dip over its size at shapes that are near enough, to which no slope leads from elsewhere.

use super::accuse::ACCUSES;
use super::candidate::Background;
use super::hypothesis::log_belief;
use super::other_couplings::Beside;
use super::play::{OF_PLAY, PLAY, corrected, descended, may_be_corrected};
use super::round::{Settling, WORTH_A_ROUND};
use super::screen::Tried;
use super::starts::levels;
use crate::error::InputError;
use crate::inverse::{Corrects, Fit, Model, PROMISES, fit_alone, fit_at, fit_roughly};
use bristle_plant::effect::Entry;
use rayon::prelude::*;
use std::cmp::Ordering;

/// Sizes, up to so many times the largest usual one, and resonances of so many levels, parts of the inertia behind, and damping ratios.
const SIZES: (usize, f64) = (17, 3.0);
const RESONANCES: usize = 5;
const SHARES: [f64; 3] = [0.15, 0.35, 0.6];
const DAMPING: [f64; 2] = [0.05, 0.3];
/// Sizes once more about the best one, in times of it: dips are as narrow as that.
const CLOSE: [f64; 4] = [0.75, 0.87, 1.15, 1.32];
/// What corrects the load, where it does that; else nothing.
const WAYS: [Corrects; 2] = [OF_PLAY, Corrects::ByMotor];
/// Which of a play's parameters says on which side its friction is.
const ON_MOTOR: usize = 4;
/// So many dips of each are fitted, and so many of these again and again.
const FITTED: usize = 2;
const SETTLED: usize = 2;
const MOST_ROUNDS: usize = 4;

/// A play of some size in the shape that does best.
struct Shaped {
    gap: f64,
    left_over: Vec<f64>,
    density: f64,
    play: Beside,
}

/// A play fitted from usual ones, its load corrected where it may be, at the simulator's own parameters as they came out with `other`, an effect that is read
/// alike: about the coupling that fits best without one a play may be as good as rigid, and no slope leads from there. By densities: weights that hold what no
/// effect explains as noise tell little of what a play leaves. None where it does no better than a `coupling` that is corrected as much.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn usual_play(
    background: &Background<'_>,
    entry: &'static Entry,
    other: &Tried,
    coupling: Option<&Tried>,
    judge: &Settling<'_>,
) -> Result<Option<Tried>, InputError> {
    let (records, nodes) = (background.records, background.nodes);
    let density = |left_over: &[f64]| judge.compared.log_density(nodes, left_over);
    let on_motor = (entry.parameters[ON_MOTOR].range)(background.scale);
    let ways = WAYS
        .into_iter()
        .flat_map(|corrects| on_motor.map(|side| (corrects, side)));
    let dips = ways.map(|way| dips(background, entry, other, way, &density));
    let dips: Vec<Vec<Shaped>> = dips.collect::<Result<_, InputError>>()?;
    let fitted = dips.into_par_iter().flatten().map(|shaped| {
        let Beside { model, at } = shaped.play;
        let weights = judge.weights(&model, &shaped.left_over);
        let fit = fit_roughly(&model, records, &weights, at)?;
        refitted(background, Tried { entry, model, fit }, judge)
    });
    let fitted = fitted.collect::<Result<Vec<Tried>, InputError>>()?;
    let score = |model: &Model, fit: &Fit| density(&fit.left_over) + log_belief(model, &fit.at);
    let of = |play: &Tried| score(&play.model, &play.fit);
    let best = settled(background, fitted, judge, of)?
        .into_iter()
        .map(|play| (of(&play), play))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let Some((of_play, play)) = best else {
        return Ok(None);
    };
    let followed = match (coupling, play.model.corrects) {
        (Some(open), Some(corrects)) => corrected(background, open, corrects, PROMISES)?,
        _ => None,
    };
    let followed = followed.map(|(model, fit)| score(&model, &fit));
    let open = coupling.map(|open| score(&open.model, &open.fit));
    let without_play = open
        .into_iter()
        .chain(followed)
        .fold(f64::NEG_INFINITY, f64::max);
    Ok((of_play > without_play + ACCUSES).then_some(play))
}

/// The best of these plays by a score, those among them that were followed open loop behind a led motor, too, fitted until that gains nothing; without those
/// that end at what is physical.
///
/// # Errors
/// The friction model refuses the parameters.
fn settled(
    background: &Background<'_>,
    mut plays: Vec<Tried>,
    judge: &Settling<'_>,
    score: impl Fn(&Tried) -> f64 + Sync,
) -> Result<Vec<Tried>, InputError> {
    let is_inside = |play: &Tried| !play.model.ends_at_limit(&play.fit.at);
    plays.retain(is_inside);
    plays.sort_by(|a, b| score(b).total_cmp(&score(a)));
    plays.truncate(SETTLED);
    let open = plays.iter().filter(|play| play.model.corrects.is_none());
    let led = open.map(|play| {
        let (entry, mut model) = (play.entry, play.model.clone());
        model.corrects = Some(Corrects::ByMotor);
        let (records, weights) = (background.records, background.weights);
        let fit = fit_at(&model, records, weights, play.fit.at.clone())?;
        Ok(Tried { entry, model, fit })
    });
    let led = led.collect::<Result<Vec<Tried>, InputError>>()?;
    plays.extend(led);
    let settled = plays.into_par_iter().map(|mut play| {
        for _ in 0..MOST_ROUNDS {
            let before = score(&play);
            play = refitted(background, play, judge)?;
            if score(&play) - before < WORTH_A_ROUND {
                break;
            }
        }
        Ok(play)
    });
    let mut settled = settled.collect::<Result<Vec<Tried>, InputError>>()?;
    settled.retain(is_inside);
    Ok(settled)
}

/// A play fitted once more, by the weights that it comes to itself, from the highest density near by.
///
/// # Errors
/// The friction model refuses the parameters.
fn refitted(
    background: &Background<'_>,
    play: Tried,
    judge: &Settling<'_>,
) -> Result<Tried, InputError> {
    let (records, nodes) = (background.records, background.nodes);
    let Tried { entry, model, fit } = play;
    let density = |rest: &[f64]| judge.compared.log_density(nodes, rest);
    let near = descended(background, &model, fit.at, |rest| -density(rest))?;
    let weights = judge.weights(&model, &model.left_over(records, &near)?);
    let fit = fit_alone(&model, records, &weights, near)?;
    Ok(Tried { entry, model, fit })
}

/// Where the density is highest over the size of a play whose load is corrected so and that has its friction on this side, best first.
///
/// # Errors
/// The friction model refuses the parameters.
fn dips(
    background: &Background<'_>,
    entry: &'static Entry,
    other: &Tried,
    (corrects, on_motor): (Corrects, f64),
    density: &(impl Fn(&[f64]) -> f64 + Sync),
) -> Result<Vec<Shaped>, InputError> {
    let point = other.model.at(&other.fit.at);
    let values = point.effects().last().map(|added| &added.values[..]);
    let Some(&[first, ..]) = values else {
        return Ok(Vec::new());
    };
    let usual = |parameter: usize| (entry.parameters[parameter].range)(background.scale);
    let (sizes, resonances_hz) = (usual(0), usual(2));
    let shaped = |gap: f64| {
        let shapes = levels(resonances_hz, RESONANCES).flat_map(|resonance_hz| {
            SHARES.into_iter().flat_map(move |share| {
                DAMPING.map(|damping_ratio| vec![gap, share, resonance_hz, damping_ratio, on_motor])
            })
        });
        let tried = shapes.map(|values| {
            let mut play = Beside::new(background, entry, values, other);
            let applies = may_be_corrected(background, &play.model, corrects);
            play.model.corrects = Some(corrects).filter(|_| applies);
            let left_over = play.model.left_over(background.records, &play.at)?;
            let density = density(&left_over);
            Ok(Shaped {
                gap,
                left_over,
                density,
                play,
            })
        });
        let tried = tried.collect::<Result<Vec<Shaped>, InputError>>()?;
        Ok(tried.into_iter().max_by(by_density))
    };
    let scanned = |sizes: Vec<f64>| -> Result<Vec<Shaped>, InputError> {
        let best = sizes
            .into_par_iter()
            .map(shaped)
            .filter_map(Result::transpose);
        best.collect()
    };
    let found = Some(first).filter(|_| other.entry.id == PLAY);
    let (count, beyond) = SIZES;
    let sizes = levels([sizes[0], beyond * sizes[1]], count);
    let mut scan = scanned(sizes.chain(found).collect())?;
    if let Some(best) = scan.iter().max_by(|a, b| by_density(a, b)) {
        let close = CLOSE.map(|times| times * best.gap);
        scan.extend(scanned(close.to_vec())?);
    }
    scan.sort_by(|a, b| a.gap.total_cmp(&b.gap));
    // Those below the smallest are the same.
    scan.dedup_by(|a, b| a.density == b.density);
    let densities: Vec<f64> = scan.iter().map(|one| one.density).collect();
    let is_highest = |place: usize| {
        let near = &densities[place.saturating_sub(1)..densities.len().min(place + 2)];
        near.iter().all(|density| *density <= densities[place])
    };
    let mut place = 0..;
    scan.retain(|_| place.next().is_some_and(is_highest));
    scan.sort_by(|a, b| by_density(b, a));
    scan.truncate(FITTED);
    Ok(scan)
}

fn by_density(one: &Shaped, other: &Shaped) -> Ordering {
    one.density.total_cmp(&other.density)
}
