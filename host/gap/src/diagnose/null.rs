//! What an effect gains where it is not: it is fitted to records that the refitted simulator alone would have left, with
//! their noise, through the same steps.

use super::candidate::Background;
use super::fitted_noise::{noise_of, noisy_twins};
use super::hypothesis::{Hypothesis, Judge};
use super::play::{PLAY, corrected};
use super::screen::{Tried, fit_best, screen};
use super::tried::{Null, Search};
use crate::error::InputError;
use crate::inverse::{STANDS_STILL, fit, fit_at};
use bristle_plant::effect::Entry;

/// What these effects gain on such records.
///
/// # Errors
/// The refitted simulator cannot be simulated.
pub(super) fn nulls(search: &Search, entries: &[&'static Entry]) -> Result<Vec<Null>, InputError> {
    if entries.is_empty() {
        return Ok(Vec::new());
    }
    let base = &search.base;
    let (twins, nodes) = noisy_twins(base, &search.judge(), &search.scale, 0)?;
    let noise = |left_over: &[f64]| noise_of(&base.model, &twins, &nodes, left_over, &search.own);
    let left_over = base.model.left_over(&twins, &base.fit.at)?;
    let weights = noise(&left_over).weights(&nodes);
    let plain = fit(&base.model, &twins, &weights, base.fit.at.clone())?;
    let noise = noise(&plain.left_over).explaining(&nodes, &plain.left_over);
    let weights = noise.weights(&nodes);
    let plain = fit(&base.model, &twins, &weights, plain.at)?;
    let background = Background::new(&base.model, &twins, &nodes, &search.scale, &weights, &plain);
    // A play's null follows its load as the play's own fit does.
    let fitted = search.single.iter().chain(&search.several);
    let mut plays = fitted.filter(|h| h.ids().contains(&PLAY));
    let corrects = plays.find_map(|play| play.model.corrects);
    let mut found = fit_best(
        &background,
        &screen(&background, entries, &|_| ()),
        entries.len(),
        corrects.is_some(),
        |_, entry| background.never_zero(entry),
    )?;
    let open = |one: &&mut Tried| one.entry.id == PLAY && one.model.corrects != corrects;
    if let Some(corrects) = corrects
        && let Some(play) = found.iter_mut().find(open)
        && let Some((model, fit)) = corrected(&background, play, corrects, STANDS_STILL)?
    {
        (play.model, play.fit) = (model, fit);
    }
    let judge = Judge {
        records: &twins,
        nodes: &nodes,
        weights: &weights,
        noise: &noise,
    };
    let times = |h: &Hypothesis| noise.times_open(&nodes, &h.held_out);
    let without = judge.hypothesis(Vec::new(), base.model.clone(), plain.clone());
    let before = times(&without);
    let mut nulls: Vec<Null> = entries
        .iter()
        .map(|entry| Null {
            id: entry.id,
            nats: 0.0,
            nats_of_all: 0.0,
            times: [before, before],
        })
        .collect();
    for Tried { entry, model, fit } in found {
        let fit = fit_at(&model, &twins, &weights, fit.at)?;
        let with = judge.hypothesis(vec![entry], model, fit);
        if let Some(null) = nulls.iter_mut().find(|null| null.id == entry.id) {
            null.nats = with.score - without.score;
            null.nats_of_all =
                with.score_of_all(&noise, &nodes) - without.score_of_all(&noise, &nodes);
            null.times[1] = times(&with);
        }
    }
    Ok(nulls)
}
