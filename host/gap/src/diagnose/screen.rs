//! Which effects are worth a fit: the fall of squares that each promises where the simulator stands, and the fits of those that
//! promise most.

use super::candidate::{Background, Screened, Start};
use super::play;
use crate::error::InputError;
use crate::inverse::{Fit, Model, PROMISES, STANDS_STILL};
use bristle_plant::effect::Entry;
use rayon::prelude::*;

/// So many of the best fits go on until they stand still.
const SETTLED: usize = 3;
/// A further start is worth a fit if it promises this part of what the first one does, and is no start of the same fit.
const CLOSE: f64 = 0.35;
/// So many starts of an effect are fitted at most.
const STARTS: usize = 3;
/// Fall of the sum of squares below which a start is not worth a fit: three nats for each of two parameters.
pub(super) const WORTH_A_FIT: f64 = 12.0;

/// Effects that are screened at once: parts of each are serial.
const AT_ONCE: usize = 8;

/// An effect, the simulator with it, and its fit.
pub(super) struct Tried {
    pub(super) entry: &'static Entry,
    pub(super) model: Model,
    /// Without a Jacobian where it was not fitted further.
    pub(super) fit: Fit,
}

/// What the best start of an effect promises.
pub(super) fn gain(starts: &[Start]) -> f64 {
    starts.first().map_or(0.0, |start| start.gain)
}

/// The starts of each effect, most promising effect first.
pub(super) fn screen(
    background: &Background<'_>,
    catalogue: &[&'static Entry],
    progress: &dyn Fn(f64),
) -> Vec<Screened> {
    let mut screened: Vec<Screened> = Vec::new();
    for some in catalogue.chunks(AT_ONCE) {
        let starts = some.par_iter();
        screened.par_extend(starts.map(|&entry| (entry, background.starts(entry))));
        progress(screened.len() as f64 / catalogue.len() as f64);
    }
    by_promise(&mut screened);
    screened
}

/// Sorts by what the best starts promise, most first.
pub(super) fn by_promise(screened: &mut [Screened]) {
    screened.sort_by(|a, b| gain(&b.1).total_cmp(&gain(&a.1)));
}

/// Of effects, most promising first, fits of as many as `most` that promise anything, and of those that are worth a fit whatever they promise, by their
/// place, from their best starts. Where they are many, all are fitted as far as shows what they promise, and the best of them to the end. A play is looked
/// for about a coupling where `plays`: where anything is left that one may explain.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn fit_best(
    background: &Background<'_>,
    screened: &[Screened],
    most: usize,
    plays: bool,
    whatever: impl Fn(usize, &Entry) -> bool,
) -> Result<Vec<Tried>, InputError> {
    let all: Vec<&Screened> = screened
        .iter()
        .enumerate()
        .filter(|(place, (entry, starts))| {
            let promises = *place < most && gain(starts) > WORTH_A_FIT;
            promises || !starts.is_empty() && whatever(*place, entry)
        })
        .map(|(_, one)| one)
        .collect();
    let effects = all.len();
    let mut all: Vec<(&'static Entry, &Start)> = all
        .into_iter()
        .flat_map(|(entry, starts)| {
            let close = || starts.iter().filter(|s| s.gain > CLOSE * gain(starts));
            let first = starts.first();
            let other_form =
                close().find(|s| first.is_some_and(|one| one.is_of_another_form(s, entry)));
            let mut apart: Vec<&Start> = first.into_iter().chain(other_form).collect();
            for start in close() {
                if apart.len() < STARTS && apart.iter().all(|one| one.leads_elsewhere(start, entry))
                {
                    apart.push(start);
                }
            }
            apart.into_iter().map(|start| (*entry, start))
        })
        .collect();
    let mut further = Vec::new();
    if effects > SETTLED {
        further = fitted(background, PROMISES, &all)?;
        let settled = further.drain(..SETTLED.min(further.len()));
        all = settled.map(|(start, one)| (one.entry, start)).collect();
    }
    let settled = fitted(background, STANDS_STILL, &all)?;
    let settles = settled.len();
    let found = settled.into_iter().chain(further).map(|(_, one)| one);
    let mut found: Vec<Tried> = found.collect();
    if plays {
        play::try_play(background, screened, &mut found, settles)?;
    }
    Ok(found)
}

/// Each effect from the start that it does best from, best first, fitted until the cost changes by less than a part of itself.
fn fitted<'a>(
    background: &Background<'_>,
    cost_stands_still: f64,
    starts: &[(&'static Entry, &'a Start)],
) -> Result<Vec<(&'a Start, Tried)>, InputError> {
    let fitted = starts.par_iter().map(|&(entry, start)| {
        let (model, fit) = background.fitted(cost_stands_still, entry, start)?;
        Ok((start, Tried { entry, model, fit }))
    });
    let mut fitted = fitted.collect::<Result<Vec<_>, InputError>>()?;
    fitted.sort_by(|a, b| a.1.fit.cost.total_cmp(&b.1.fit.cost));
    let mut seen: Vec<&str> = Vec::new();
    fitted.retain(|(_, one)| {
        let first = !seen.contains(&one.entry.id);
        seen.push(one.entry.id);
        first
    });
    Ok(fitted)
}
