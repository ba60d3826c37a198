//! Bristles beside friction that is static: what it leaves open while the axis hardly moves, about half of itself, they do not.

use super::hypothesis::{Hypothesis, Judge};
use super::likelihood::Noise;
use super::own::Own;
use super::round::WORTH_A_ROUND;
use super::single::Ground;
use crate::error::InputError;
use crate::inverse::{Model, fit};
use bristle_plant::effect::Entry;
use rayon::prelude::*;

/// All of dry friction on bristles.
pub(super) const PRESLIDING: &str = "friction.presliding";
/// A part of it on bristles that remember where they turned, beside what carries the rest; the place of that part among its parameters.
const NONLOCAL: (&str, usize) = ("friction.nonlocal", 0);
/// Effects that bring bristles.
const BRISTLES: [&str; 2] = [PRESLIDING, NONLOCAL.0];
/// Part of static friction on bristles from which no friction that does not bend is left beside them. Where friction remembers, the part came out at
/// 0.70 at most in 19 opened cases and trials of static friction; where all of it bends, in another form, at 0.76 to 1.2 in eleven of thirteen.
const NEARLY_ALL: f64 = 0.73;
/// Most fits of them.
const MOST_FITS: usize = 4;

/// Whether an effect brings bristles to the friction of a simulator that is static.
pub(super) fn is_bristles(simulator: &Model, entry: &Entry) -> bool {
    !simulator.believed.model.has_bristles() && BRISTLES.contains(&entry.id)
}

/// Whether nearly all of static friction came out on bristles that remember: then what is missing is that it bends at all, in whatever form.
pub(super) fn bends_nearly_all(simulator: &Model, hypothesis: &Hypothesis) -> bool {
    let (id, part) = NONLOCAL;
    let point = hypothesis.model.at(&hypothesis.fit.at);
    let mut effects = point.effects().iter();
    effects.any(|added| {
        added.entry.id == id
            && is_bristles(simulator, added.entry)
            && added.values[part] > NEARLY_ALL
    })
}

/// Fits the hypotheses that bring bristles with the noise that they leave themselves: by the weights of static friction a fit is blind where bristles
/// bend. Taken where they do better below what is open, and no worse above it.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn fit_bristles(
    ground: &Ground<'_>,
    own: &Own,
    compared: &Noise,
    hypotheses: &mut [Hypothesis],
) -> Result<(), InputError> {
    let &Ground {
        records,
        nodes,
        model,
        ..
    } = ground;
    let bend = |h: &Hypothesis| h.added.iter().any(|entry| is_bristles(model, entry));
    let noise_of = |h: &Hypothesis| {
        let inertia_kg_m2 = h.model.believed.whole_inertia_kg_m2();
        Noise::beside(records, nodes, &h.fit.left_over, inertia_kg_m2, 0.0, own)
    };
    let of_all = |h: &Hypothesis| h.score_of_all(compared, nodes);
    let fitted = hypotheses.par_iter_mut().filter(|h| bend(h));
    fitted.try_for_each(|hypothesis| {
        let mut best = hypothesis.clone();
        for _ in 0..MOST_FITS {
            let weights = noise_of(&best).weights(nodes);
            let judge = Judge {
                records,
                nodes,
                weights: &weights,
                noise: compared,
            };
            let fit = fit(&best.model, records, &weights, best.fit.at.clone())?;
            let anew = judge.hypothesis(best.added.clone(), best.model.clone(), fit);
            let gained = of_all(&anew) - of_all(&best);
            if gained <= 0.0 {
                break;
            }
            best = anew;
            if gained < WORTH_A_ROUND {
                break;
            }
        }
        if best.score > hypothesis.score - WORTH_A_ROUND {
            *hypothesis = best;
        }
        Ok(())
    })
}
