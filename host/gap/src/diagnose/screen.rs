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
/// Starts that a fit is tried from.
const STARTS: usize = 2;
/// A second start is worth a fit if it promises this part of what the first one does.
const CLOSE: f64 = 0.6;
/// Fall of the sum of squares below which a start is not worth a fit: three nats for each of two parameters.
const WORTH_A_FIT: f64 = 12.0;

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
    for (done, entry) in catalogue.iter().enumerate() {
        screened.push((entry, background.starts(entry)));
        progress(done as f64 / catalogue.len() as f64);
    }
    by_promise(&mut screened);
    screened
}

/// Sorts by what the best starts promise, most first.
pub(super) fn by_promise(screened: &mut [Screened]) {
    screened.sort_by(|a, b| gain(&b.1).total_cmp(&gain(&a.1)));
}

/// Fits of the most promising effects, and where `unpromising` of those that are never zero, from their best starts. Where they are many, all
/// are fitted as far as shows what they promise, and the best of them to the end.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn fit_best(
    background: &Background<'_>,
    screened: &[Screened],
    most: usize,
    unpromising: bool,
) -> Result<Vec<(&'static Entry, Model, Fit)>, InputError> {
    let promising = screened
        .iter()
        .take(most)
        .filter(|(_, starts)| gain(starts) > WORTH_A_FIT);
    // What is never zero may be far off wherever it is tried, until everything else has moved with it.
    let never_zero = screened
        .iter()
        .enumerate()
        .filter(|(place, (entry, starts))| {
            let promises = *place < most && gain(starts) > WORTH_A_FIT;
            unpromising && !promises && !starts.is_empty() && background.never_zero(entry)
        })
        .map(|(_, one)| one);
    let all: Vec<&Screened> = promising.chain(never_zero).collect();
    let mut all: Vec<(&'static Entry, Vec<Start>)> = all
        .into_iter()
        .map(|(entry, starts)| {
            let close = |start: &&Start| start.gain > CLOSE * gain(starts);
            let first = starts.iter().take(1);
            let close = starts.iter().take(STARTS).skip(1).filter(close);
            (*entry, first.chain(close).cloned().collect())
        })
        .collect();
    let fitted = |cost_stands_still: f64, all: &[Screened]| -> Result<Vec<_>, InputError> {
        let fitted = all.par_iter().map(|(entry, starts)| {
            let fit = background.try_until(cost_stands_still, entry, starts)?;
            Ok(fit.map(|(model, fit)| (*entry, model, fit)))
        });
        Ok(fitted
            .collect::<Result<Vec<_>, InputError>>()?
            .into_iter()
            .flatten()
            .collect())
    };
    let mut further = Vec::new();
    if all.len() > SETTLED {
        further = fitted(PROMISES, &all)?;
        further.sort_by(|a, b| a.2.cost.total_cmp(&b.2.cost));
        let settled: Vec<&str> = further
            .drain(..SETTLED.min(further.len()))
            .map(|one| one.0.id)
            .collect();
        all.retain(|(entry, _)| settled.contains(&entry.id));
    }
    let mut found = fitted(STANDS_STILL, &all)?;
    found.extend(further);
    play::try_about_coupling(background, screened, &mut found)?;
    Ok(found)
}
