//! Effects beside the best one.

use super::accuse::{foremost, leaves_room};
use super::candidate::Background;
use super::hypothesis::{Hypothesis, Judge, of_noise};
use super::screen::{fit_best, screen};
use super::single::no_worse;
use crate::error::InputError;
use crate::inverse::fit_at;
use bristle_plant::effect::{Entry, Scale};

/// Effects that are tried beside the best one.
pub(super) const BESIDE: usize = 4;
/// Most effects at once.
pub const MOST_EFFECTS: usize = 2;

/// The hypotheses of several effects, best first.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn beside(
    judge: &Judge<'_>,
    scale: &Scale,
    base: &Hypothesis,
    single: &[Hypothesis],
    entries: &[&'static Entry],
    progress: &dyn Fn(f64),
) -> Result<Vec<Hypothesis>, InputError> {
    let &Judge {
        records,
        nodes,
        weights,
        noise,
    } = judge;
    let mut several: Vec<Hypothesis> = Vec::new();
    let mut best = foremost(single, base).cloned();
    for _ in 1..MOST_EFFECTS {
        let room = |h: &Hypothesis| leaves_room(noise, nodes, &h.held_out);
        let Some(from) = best.take().filter(room) else {
            break;
        };
        // Noise leaves the model as it is.
        let ground = if of_noise(&from) { base } else { &from };
        let (model, fit) = (&ground.model, &ground.fit);
        let background = Background::new(model, records, nodes, scale, weights, fit);
        let others: Vec<&'static Entry> = entries
            .iter()
            .copied()
            .filter(|entry| from.added.iter().all(|added| added.id != entry.id))
            .collect();
        let screened = screen(&background, &others, progress);
        let mut found: Vec<Hypothesis> = fit_best(&background, &screened, BESIDE, false)?
            .into_iter()
            .map(|(entry, model, fit)| {
                let mut added = from.added.clone();
                added.push(entry);
                let fit = fit_at(&model, records, weights, fit.at)?;
                let fit = no_worse(&model, fit, &ground.fit, records, weights)?;
                let both = judge.hypothesis(added, model, fit)?;
                Ok(if of_noise(&from) {
                    both.beside_noise(&from, base)
                } else {
                    both
                })
            })
            .collect::<Result<_, InputError>>()?;
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        best = found
            .first()
            .filter(|next| next.score > from.score)
            .cloned();
        several.extend(found);
    }
    several.sort_by(|a, b| b.score.total_cmp(&a.score));
    Ok(several)
}
