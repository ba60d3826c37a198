//! Plays from usual ones: laid against the records a play shows as a dip over its size at shapes that are near enough, to which no slope leads from elsewhere.

use super::candidate::Background;
use super::other_couplings::Beside;
use super::play::{BRINGS, OF_PLAY, PLAY, corrected, descended, may_be_corrected};
use super::screen::Tried;
use super::starts::levels;
use crate::error::InputError;
use crate::inverse::{Corrects, PROMISES, cost_at, fit_alone, fit_roughly};
use bristle_plant::effect::Entry;
use rayon::prelude::*;

/// Sizes, up to so many times the largest usual one, and resonances of so many levels, parts of the inertia behind, and damping ratios.
const SIZES: (usize, f64) = (17, 3.0);
const RESONANCES: usize = 5;
const SHARES: [f64; 3] = [0.15, 0.35, 0.6];
const DAMPING: [f64; 2] = [0.05, 0.3];
/// Sizes once more about the best one, in times of it: dips are as narrow as that.
const CLOSE: [f64; 4] = [0.75, 0.87, 1.15, 1.32];
/// What corrects the load, where it does that; else nothing.
const WAYS: [Corrects; 2] = [OF_PLAY, Corrects::ByMotor];
/// So many dips of each are fitted.
const FITTED: usize = 3;

/// A play of some size in the shape that does best.
struct Shaped {
    gap: f64,
    cost: f64,
    play: Beside,
}

/// A play fitted from usual ones, its load corrected where it may be, at the simulator's own parameters as they came out with `other`, an effect that is read
/// alike: about the coupling that fits best without one a play may be as good as rigid, and no slope leads from there. None where it does no better than a
/// `coupling` that is corrected as much.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn usual_play(
    background: &Background<'_>,
    entry: &'static Entry,
    other: &Tried,
    coupling: Option<&Tried>,
) -> Result<Option<Tried>, InputError> {
    let (records, weights) = (background.records, background.weights);
    let dips = WAYS.map(|corrects| dips(background, entry, other, corrects));
    let dips: Vec<Vec<Beside>> = dips.into_iter().collect::<Result<_, InputError>>()?;
    let fitted = dips.into_par_iter().flatten().map(|Beside { model, at }| {
        let rough = fit_roughly(&model, records, weights, at)?;
        let near = descended(background, &model, rough.at)?;
        let fit = fit_alone(&model, records, weights, near)?;
        Ok(Tried { entry, model, fit })
    });
    let fitted = fitted.collect::<Result<Vec<Tried>, InputError>>()?;
    let nearest = fitted
        .into_iter()
        .filter(|play| !play.model.ends_at_limit(&play.fit.at))
        .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
    let Some(play) = nearest else {
        return Ok(None);
    };
    let without_play = match (coupling, play.model.corrects) {
        (Some(open), Some(corrects)) => corrected(background, open, corrects, PROMISES)?
            .map_or(open.fit.cost, |(_, fit)| fit.cost),
        (Some(open), None) => open.fit.cost,
        (None, _) => f64::INFINITY,
    };
    Ok((play.fit.cost < without_play - BRINGS.0).then_some(play))
}

/// Where the cost is least over the size of a play whose load is corrected so, best first.
///
/// # Errors
/// The friction model refuses the parameters.
fn dips(
    background: &Background<'_>,
    entry: &'static Entry,
    other: &Tried,
    corrects: Corrects,
) -> Result<Vec<Beside>, InputError> {
    let point = other.model.at(&other.fit.at);
    let values = point.effects().last().map(|added| &added.values[..]);
    let Some(&[first, ..]) = values else {
        return Ok(Vec::new());
    };
    let usual = |parameter: usize| (entry.parameters[parameter].range)(background.scale);
    let (sizes, resonances_hz, on_motor) = (usual(0), usual(2), usual(4));
    let shaped = |gap: f64| {
        let shapes = levels(resonances_hz, RESONANCES).flat_map(|resonance_hz| {
            SHARES.into_iter().flat_map(move |share| {
                DAMPING.into_iter().flat_map(move |damping_ratio| {
                    on_motor.map(|side| vec![gap, share, resonance_hz, damping_ratio, side])
                })
            })
        });
        let tried = shapes.map(|values| {
            let mut play = Beside::new(background, entry, values, other);
            let applies = may_be_corrected(background, &play.model, corrects);
            play.model.corrects = Some(corrects).filter(|_| applies);
            let (records, weights) = (background.records, background.weights);
            let cost = cost_at(&play.model, records, weights, play.at.clone())?;
            Ok(Shaped { gap, cost, play })
        });
        let tried = tried.collect::<Result<Vec<Shaped>, InputError>>()?;
        Ok(tried.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost)))
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
    if let Some(least) = scan.iter().min_by(|a, b| a.cost.total_cmp(&b.cost)) {
        let close = CLOSE.map(|times| times * least.gap);
        scan.extend(scanned(close.to_vec())?);
    }
    scan.sort_by(|a, b| a.gap.total_cmp(&b.gap));
    let costs: Vec<f64> = scan.iter().map(|one| one.cost).collect();
    let is_least = |place: usize| {
        let near = &costs[place.saturating_sub(1)..costs.len().min(place + 2)];
        near.iter().all(|cost| *cost >= costs[place])
    };
    let mut place = 0..;
    scan.retain(|_| place.next().is_some_and(is_least));
    scan.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    scan.truncate(FITTED);
    Ok(scan.into_iter().map(|one| one.play).collect())
}
