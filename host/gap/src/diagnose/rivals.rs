//! Which of two hypotheses that explain nearly the same: records of each one's own are fitted with both, and the measured ones laid beside. How far
//! the method's own errors favour one of them shows so, whatever they are.
//!
//! Source: Cox 1961, "Tests of separate families of hypotheses", Proc. 4th Berkeley Symposium 1, by simulation as Williams 1970,
//! Biometrics 26, 23.

use super::fitted_noise::noisy_twins;
use super::hypothesis::{Hypothesis, is_without_noise, log_belief, makes_steps};
use super::own::Own;
use super::regime::{Node, Regime};
use super::tried::Search;
use crate::error::InputError;
use crate::inverse::{Fit, fit_alone};
use bristle_plant::effect::Entry;

/// Each one's own records come with so many draws of noise.
const DRAWS: u64 = 2;

/// Nats by which two must be told apart on records of their own, and where the measured ones must lie, from those of the other one, 0, to those of
/// the best one, 1, for the other one not to tie. Of 50 opened ties with one that is there the best one was it in all of 14 that come to it; where
/// the measured ones lie a quarter of the way and less, it still was in five of eleven.
const TOLD_APART: (f64, f64) = (10.0, 0.75);

/// Nats that a second effect gains beside the best one, and beyond what it gains there on that one's own records, parts of what it gains on its own and of
/// what the best one gains, from which the best one is not all there is; and the part of that which it must not gain alone: it would be a rival. Of 140
/// opened cases and trials that were named rightly one came to it, where the effect was left out and another one named in its place three of six with a
/// second effect did.
const ASKS_FOR_ANOTHER: (f64, [f64; 2], f64) = (60.0, [0.4, 0.2], 0.5);

/// Nats by which the first of two explains records better than the second.
struct Leads {
    /// Those that were measured.
    measured: f64,
    /// Those of the first one's own, and of the second one's.
    of_own: [f64; 2],
}

impl Leads {
    /// How far each leads on its own records.
    ///
    /// # Errors
    /// One of them cannot be simulated.
    fn of(search: &Search, one: &Hypothesis, other: &Hypothesis) -> Result<Self, InputError> {
        let on_records_of = |by: &Hypothesis| -> Result<f64, InputError> {
            let mut sum = 0.0;
            for draw in 0..DRAWS {
                sum += lead_on_records_of(search, by, [one, other], draw)?;
            }
            Ok(sum / DRAWS as f64)
        };
        Ok(Self {
            measured: lead(search, one, other),
            of_own: [on_records_of(one)?, on_records_of(other)?],
        })
    }

    /// Nats that tell them apart.
    fn apart(&self) -> f64 {
        self.of_own[0] - self.of_own[1]
    }

    /// Where the measured ones lie from the second one's, 0, to the first one's, 1.
    fn toward_first(&self) -> f64 {
        (self.measured - self.of_own[1]) / self.apart()
    }
}

/// Whether one of two that tie is told from the other one.
pub(super) fn is_told_from(search: &Search, one: &Hypothesis, other: &Hypothesis) -> bool {
    let (nats, part) = TOLD_APART;
    Leads::of(search, one, other)
        .is_ok_and(|leads| leads.apart() > nats && leads.toward_first() > part)
}

/// Whether a second effect gains beside one effect what it would not where nothing else is.
pub(super) fn asks_for_another(search: &Search, one: &Hypothesis) -> bool {
    let (nats, [of_own, of_one], alone) = ASKS_FOR_ANOTHER;
    let [id] = one.ids()[..] else {
        return false;
    };
    let gain = |h: &Hypothesis| search.gain_of_all(h);
    let is_second = |entry: &Entry| {
        // Steps choose the moments of the largest rests, which its own records have elsewhere.
        !makes_steps(entry)
            && search
                .alone(entry.id)
                .is_none_or(|h| gain(h) < alone * gain(one))
    };
    let beside = |pair: &&Hypothesis| {
        let mut added = pair.added.iter();
        pair.ids().contains(&id)
            && is_without_noise(pair)
            && pair.is_credible(&search.base)
            && added.all(|&entry| entry.id == id || is_second(entry))
    };
    let pairs = search.several.iter().filter(beside);
    let Some(pair) = pairs.max_by(|a, b| gain(a).total_cmp(&gain(b))) else {
        return false;
    };
    let gained = gain(pair) - gain(one);
    gained > of_one * gain(one)
        && lead(search, pair, one).min(gained) > nats
        && Leads::of(search, pair, one).is_ok_and(|leads| {
            leads.of_own[0] > 0.0
                && leads.measured - leads.of_own[1] > nats
                && leads.toward_first() > of_own
        })
}

/// Nats by which the first one leads on the measured records.
fn lead(search: &Search, one: &Hypothesis, other: &Hypothesis) -> f64 {
    lead_on(
        search,
        &search.nodes,
        [(one, &one.fit), (other, &other.fit)],
    )
}

/// The same on records of one's own, from where both were fitted to the measured ones.
fn lead_on_records_of(
    search: &Search,
    by: &Hypothesis,
    both: [&Hypothesis; 2],
    draw: u64,
) -> Result<f64, InputError> {
    // Each record has a seed of its own.
    let seed = draw * search.records.len() as u64;
    let (records, nodes) = noisy_twins(by, &search.judge(), &search.scale, seed)?;
    let weights = search.noise.weights(&nodes);
    let fitted = |h: &Hypothesis| fit_alone(&h.model, &records, &weights, h.fit.at.clone());
    let [one, other] = both;
    let (of_one, of_other) = rayon::join(|| fitted(one), || fitted(other));
    Ok(lead_on(
        search,
        &nodes,
        [(one, &of_one?), (other, &of_other?)],
    ))
}

fn lead_on(search: &Search, nodes: &[Node], both: [(&Hypothesis, &Fit); 2]) -> f64 {
    let records = search.records.len();
    let [one, other] = both.map(|(_, fit)| Own::new(nodes, &fit.left_over, records));
    let mut nats = 0.0;
    for place in 0..records {
        for regime in Regime::MOVING {
            let independent = search.noise.of(place, regime).independent;
            let [one, other] = [&one, &other].map(|own| own.of(place, regime).rms_nm);
            if one > 0.0 && other > 0.0 {
                nats += independent * (other / one).ln();
            }
        }
    }
    let [one, other] = both.map(|(h, fit)| log_belief(&h.model, &fit.at));
    nats + one - other
}
