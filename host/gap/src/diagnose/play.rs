//! A play is looked for about the coupling that fits best without one. From a guess far off its flanks meet at moments at
//! which they did not, and no step of a fit leads from the one to the other.

use super::candidate::{Background, Screened, Start};
use super::coupling::COUPLING;
use super::other_couplings::spring_of_play;
use super::screen::Tried;
use crate::error::InputError;
use crate::inverse::{Corrects, Fit, Model, PROMISES, STANDS_STILL, fit_near_until};
use bristle_plant::effect::{ALL, Coupling, Entry};
use rayon::prelude::*;
use std::f64::consts::TAU;

pub(super) const PLAY: &str = "mechanics.backlash";
/// Plays that are tried, in times of the smallest usual one: from hardly one at all.
const GAPS: [f64; 6] = [0.4, 1.0, 2.5, 5.0, 8.0, 14.0];
/// So many of them are fitted.
const FITTED: usize = 3;
/// Resonances, in times of the coupling's: a play makes it seem softer than it is.
const STIFFER: [f64; 4] = [1.0, 1.2, 1.5, 2.0];
/// Damping ratios, in times of the coupling's: a play makes it seem damped.
const DAMPED: [f64; 2] = [1.0, 0.4];
/// Steps of a parameter, as parts of itself.
const STEPS: [f64; 8] = [0.5, 0.5, 0.3, 0.3, 0.2, 0.2, 0.1, 0.05];
/// Fall of the sum of squares that the play must bring beside the coupling, and the part of the fall by the coupling: less
/// is what a coupling without a play leaves over by the method's own error.
pub(super) const BRINGS: (f64, f64) = (16.0, 0.1);

/// What corrects a load behind a play. Of two opened ones a damping ratio of 0.2 left 2.2 and 1.2 times as many squares, 1.5, by which
/// it follows noise, 1.7 and 7 times as many.
pub(super) const OF_PLAY: Corrects = Corrects::ByBalance(0.6);
/// The same of a coupling: more follows whatever swings about as fast.
const OF_COUPLING: Corrects = Corrects::ByBalance(0.1);

/// Another effect that takes away so many times as much as the coupling, and leaves that part of what the coupling leaves, is no play: with
/// one the coupling fits better than what has neither.
const NO_PLAY: (f64, f64) = (2.0, 0.5);

/// Whether an effect puts a load behind a spring.
pub(super) fn springs(entry: &Entry) -> bool {
    [COUPLING, PLAY].contains(&entry.id)
}

/// What is fitted to tell what a play is: these effects and, where only the play is among them, the coupling, if the `model` has none.
pub(super) fn with_coupling(entries: &[&'static Entry], model: &Model) -> Vec<&'static Entry> {
    let of_model = model.effects.iter().map(|added| added.entry);
    let known: Vec<&Entry> = entries.iter().copied().chain(of_model).collect();
    let has = |id: &str| known.iter().any(|entry| entry.id == id);
    let lacks = has(PLAY) && !has(COUPLING);
    let coupling = ALL.iter().find(|entry| lacks && entry.id == COUPLING);
    entries.iter().copied().chain(coupling).collect()
}

/// Takes the coupling out of what was `tried` where the `catalogue` lacks it. A play that does no better only stands for it, whatever else is there:
/// it is not tried further. `alone` is the simulator without any of them.
pub(super) fn without_coupling(
    catalogue: &mut Vec<&'static Entry>,
    tried: &mut Vec<Tried>,
    alone: &Fit,
) {
    if catalogue.iter().any(|entry| entry.id == COUPLING) {
        return;
    }
    let cost = |tried: &[Tried], id: &str| {
        let one = tried.iter().find(|one| one.entry.id == id);
        one.map(|one| one.fit.cost)
    };
    let stands_for_it = match (cost(tried, PLAY), cost(tried, COUPLING)) {
        (Some(play), Some(coupling)) => {
            play > coupling - BRINGS.0.max(BRINGS.1 * (alone.cost - coupling))
        }
        _ => false,
    };
    let is_kept = |entry: &Entry| entry.id != COUPLING && !(stands_for_it && entry.id == PLAY);
    tried.retain(|one| is_kept(one.entry));
    catalogue.retain(|entry| is_kept(entry));
}

/// Tries the play among `screened` [about the coupling](about_coupling) among `found`: open loop, with the load of that corrected by the balance, and behind a
/// motor that the model moves. Not where the coupling comes as near with its own load followed alike, which then is what brings the play near.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn try_play(
    background: &Background<'_>,
    screened: &[Screened],
    found: &mut Vec<Tried>,
    settled: usize,
) -> Result<(), InputError> {
    spring_of_play(background, found)?;
    if !about_coupling(background, screened, found, settled, None)? {
        return Ok(());
    }
    let play = |found: &[Tried]| found.iter().position(|one| one.entry.id == PLAY);
    if let Some(play) = play(found)
        && let Some((model, fit)) = corrected(background, &found[play], OF_PLAY, STANDS_STILL)?
        && fit.cost < without_play(background, found, OF_PLAY)? - BRINGS.0
    {
        (found[play].model, found[play].fit) = (model, fit);
    }
    // Not where what was found leaves so much less than the coupling already.
    about_coupling(
        background,
        screened,
        found,
        settled,
        Some(Corrects::ByMotor),
    )?;
    Ok(())
}

/// Cost of the coupling among `found` followed so; with none there is no limit.
fn without_play(
    background: &Background<'_>,
    found: &[Tried],
    corrects: Corrects,
) -> Result<f64, InputError> {
    let coupling = found.iter().find(|one| one.entry.id == COUPLING);
    coupling.map_or(Ok(f64::INFINITY), |open| {
        let followed = corrected(background, open, corrects, PROMISES)?;
        Ok(followed.map_or(open.fit.cost, |(_, fit)| fit.cost))
    })
}

/// Tries the play among `screened`, its load followed so, about the coupling among `found`, of which the first `settled` were fitted to the end, and puts
/// it there where it does better than the coupling, and than the play that was found. Says whether the coupling leaves room for a play.
///
/// # Errors
/// The friction model refuses the parameters.
fn about_coupling(
    background: &Background<'_>,
    screened: &[Screened],
    found: &mut Vec<Tried>,
    settled: usize,
    corrects: Option<Corrects>,
) -> Result<bool, InputError> {
    let place = |id: &str| found.iter().position(|one| one.entry.id == id);
    let play = screened.iter().find(|(entry, _)| entry.id == PLAY);
    let (Some((play, _)), Some(coupling)) = (play, place(COUPLING)) else {
        return Ok(true);
    };
    let Tried {
        model: with,
        fit: coupled,
        ..
    } = &found[coupling];
    let brought = background.fit.cost - coupled.cost;
    let costs = found.iter().map(|one| one.fit.cost);
    let least = costs.fold(f64::INFINITY, f64::min);
    let (times, part) = NO_PLAY;
    let no_play = background.fit.cost - least > times * brought && least < part * coupled.cost;
    if brought < BRINGS.0 || no_play {
        return Ok(false);
    }
    // With flanks that meet at other moments no fit goes from one play to another.
    let known = &background.fit.jacobian;
    let fitted_until = |stands_still: f64, model: &Model, at: Vec<f64>| {
        let (records, weights) = (background.records, background.weights);
        fit_near_until(stands_still, model, records, weights, at, known)
    };
    let fitted = |model: &Model, at: Vec<f64>| fitted_until(STANDS_STILL, model, at);
    let coupled = &if coupling < settled {
        coupled.clone()
    } else {
        fitted(with, coupled.at.clone())?
    };
    let brought = background.fit.cost - coupled.cost;
    let found_before = place(PLAY).map_or(f64::INFINITY, |at| found[at].fit.cost);
    let enough = coupled.cost - BRINGS.0.max(BRINGS.1 * brought);
    // No play leaves so little.
    if enough <= 0.0 {
        return Ok(false);
    }
    let enough = match corrects {
        Some(corrects) => enough.min(without_play(background, found, corrects)? - BRINGS.0),
        None => enough,
    };
    let own = &coupled.at[..background.model.free.len()];
    let begun = |starts: Vec<Start>| {
        let tried = starts.into_iter().map(|start| {
            let mut model = background.with(play, &start);
            // Both are read alike.
            model.scales_effort = with.scales_effort;
            model.corrects = corrects;
            let mut at = own.to_vec();
            at.extend(model.start().into_iter().skip(at.len()));
            let left_over = model.left_over(background.records, &at)?;
            Ok((background.weighted(&left_over).norm_squared(), model, at))
        });
        let tried = tried.collect::<Result<Vec<_>, InputError>>()?;
        Ok(tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)))
    };
    let mut begun: Vec<_> = starts(background, play, with, coupled)
        .into_par_iter()
        .map(begun)
        .collect::<Result<Vec<_>, InputError>>()?
        .into_iter()
        .flatten()
        .collect();
    begun.sort_by(|a, b| a.0.total_cmp(&b.0));
    begun.truncate(FITTED);
    let best = begun
        .into_par_iter()
        .map(|(_, model, at)| Ok((fitted_until(PROMISES, &model, at)?, model)))
        .collect::<Result<Vec<(Fit, Model)>, InputError>>()?
        .into_iter()
        // Another one only where it does clearly better than the one that promised most.
        .reduce(|best, other| {
            if other.0.cost < best.0.cost - BRINGS.0 {
                other
            } else {
                best
            }
        });
    let Some((fit, model)) = best else {
        return Ok(true);
    };
    let fit = fitted(&model, fit.at)?;
    if fit.cost < found_before.min(enough) {
        let squares = |left_over: &[f64]| background.weighted(left_over).norm_squared();
        let near = descended(background, &model, fit.at.clone(), squares)?;
        let again = fitted(&model, near)?;
        let fit = if again.cost < fit.cost - BRINGS.0 {
            again
        } else {
            fit
        };
        let entry = *play;
        found.retain(|one| one.entry.id != PLAY);
        found.push(Tried { entry, model, fit });
    }
    Ok(true)
}

/// A coupling with its load [corrected](corrected), where that does better: one that swings undamped keeps its errors. Any other effect as it is.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn corrected_coupling(
    background: &Background<'_>,
    tried: Tried,
) -> Result<Tried, InputError> {
    if tried.entry.id != COUPLING {
        return Ok(tried);
    }
    let better = corrected(background, &tried, OF_COUPLING, STANDS_STILL)?;
    let entry = tried.entry;
    Ok(better.map_or(tried, |(model, fit)| Tried { entry, model, fit }))
}

/// A play or a coupling fitted once more, until the cost changes by less than a part of itself, with its load
/// [corrected](crate::inverse::Model::corrects), from where it came out open loop, which leads farther; the correction leads nearer. None where
/// it is no better, nor where it ends at what is physical: so the correction alone follows whatever is missing.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn corrected(
    background: &Background<'_>,
    open: &Tried,
    corrects: Corrects,
    stands_still: f64,
) -> Result<Option<(Model, Fit)>, InputError> {
    if !may_be_corrected(background, &open.model, corrects) {
        return Ok(None);
    }
    let mut model = open.model.clone();
    model.corrects = Some(corrects);
    let (records, weights) = (background.records, background.weights);
    let (from, known) = (open.fit.at.clone(), &background.fit.jacobian);
    let fit = fit_near_until(stands_still, &model, records, weights, from, known)?;
    let better = fit.cost < open.fit.cost && !model.ends_at_limit(&fit.at);
    Ok(better.then_some((model, fit)))
}

/// Whether the last effect of a model puts a load behind a coupling that this [corrects](Corrects::applies).
pub(super) fn may_be_corrected(
    background: &Background<'_>,
    model: &Model,
    corrects: Corrects,
) -> bool {
    let inertia_kg_m2 = model.believed.whole_inertia_kg_m2();
    model.effects.last().is_some_and(|added| {
        let effect = (added.entry.build)(&added.values, background.scale.unit);
        let coupling = effect.coupling(inertia_kg_m2);
        coupling.is_some_and(|coupling| corrects.applies(&coupling))
    })
}

/// From `at` downhill by one parameter of the play after the other, by this loss of what is left over: its flanks meet at moments that a slope does not
/// know of.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn descended(
    background: &Background<'_>,
    model: &Model,
    mut at: Vec<f64>,
    loss: impl Fn(&[f64]) -> f64 + Sync,
) -> Result<Vec<f64>, InputError> {
    let loss = |at: &Vec<f64>| {
        let left_over = model.left_over(background.records, at)?;
        Ok::<f64, InputError>(loss(&left_over))
    };
    let mut least = loss(&at)?;
    for step in STEPS {
        for i in background.model.free.len()..at.len() {
            let free = &model.free[i];
            let [low, high] = free.range.map(|end| free.coordinate(end));
            let tried = [-step, step].into_par_iter().map(|step| {
                let mut at = at.clone();
                at[i] = (at[i] + step).clamp(low, high);
                Ok((loss(&at)?, at))
            });
            for (loss, there) in tried.collect::<Result<Vec<_>, InputError>>()? {
                if loss < least {
                    (least, at) = (loss, there);
                }
            }
        }
    }
    Ok(at)
}

/// Plays about a coupling, by [values of the two effects](bristle_plant::effect::ALL): those of each gap.
fn starts(
    background: &Background<'_>,
    play: &'static Entry,
    with: &Model,
    coupled: &Fit,
) -> Vec<Vec<Start>> {
    let point = with.at(&coupled.at);
    let Some(coupling) = point.effects().last() else {
        return Vec::new();
    };
    let [compliance, share, damping_ratio, on_motor] = coupling.values[..] else {
        return Vec::new();
    };
    let inertia = Coupling::reduced_kg_m2(point.believed().whole_inertia_kg_m2(), share);
    let resonance_hz = (inertia * compliance).sqrt().recip() / TAU;
    let [smallest, _] = (play.parameters[0].range)(background.scale);
    let about = |gap: f64| {
        let of = |(stiffer, damped): (f64, f64)| Start {
            values: vec![
                gap * smallest,
                share,
                stiffer * resonance_hz,
                damped * damping_ratio,
                on_motor,
            ],
            phases: Vec::new(),
            gain: 0.0,
            guessed: false,
        };
        let couplings = STIFFER
            .into_iter()
            .flat_map(|stiffer| DAMPED.map(|damped| (stiffer, damped)));
        couplings.map(of).collect()
    };
    GAPS.into_iter().map(about).collect()
}
