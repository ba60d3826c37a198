//! How probable each answer is: the verdict by how often such a verdict was right on development cases, all others by their evidence.

use super::accuse::ACCUSES;
use super::chosen::Chosen;
use super::hypothesis::Hypothesis;
use super::left::Left;
use super::tried::Search;
use super::verdict::Kind;

/// Evidence is divided by this: nodes are less independent than their correlation says, and models are not exact.
const TEMPERATURE: f64 = 8.0;
/// How often answers were right on development cases, as a logistic function: `unknown` of the logarithm of the times that
/// are left; an effect of the share that it explains. See docs/diagnosis-method.md.
const UNKNOWN_IS: (f64, f64) = (1.2, 1.0);
const EFFECT_IS: (f64, f64) = (-2.0, 6.0);
/// An effect by evidence where it takes little of times over all regimes.
const EFFECT_IS_AT_LEAST: f64 = 0.6;
/// The same of the answers that have no such measure.
const EFFECTS_ARE: f64 = 0.84;
const SMALL_IS: f64 = 0.7;
const NONE_IS: f64 = 0.92;
const PARAMETERS_ARE: f64 = 0.65;
const NOISE_IS: f64 = 0.85;
/// Of what a verdict leaves open this part is for an effect that no list has.
const UNKNOWN_ELSE: f64 = 0.2;

/// How probable a verdict is; `small` where what it names lies below what is open.
pub(super) fn probability(
    search: &Search,
    kind: Kind,
    chosen: &Chosen<'_>,
    left: &Left,
    small: bool,
) -> f64 {
    match kind {
        Kind::Unknown if search.is_unlisted() => NOISE_IS,
        Kind::Unknown => {
            let most = left.times.into_iter().fold(1.0, f64::max);
            logistic(UNKNOWN_IS.0 + UNKNOWN_IS.1 * most.ln())
        }
        Kind::None => NONE_IS,
        Kind::Parameters => PARAMETERS_ARE,
        Kind::Effects => EFFECTS_ARE,
        _ if small => SMALL_IS,
        _ if chosen.is_by_itself() => NOISE_IS,
        _ => logistic(EFFECT_IS.0 + EFFECT_IS.1 * chosen.explained).max(EFFECT_IS_AT_LEAST),
    }
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// Probabilities of all answers; what the verdict does not take is shared by all others as their evidence says.
pub(super) struct Shares {
    /// Of each hypothesis.
    pub(super) ranked: Vec<f64>,
    /// That no effect is missing.
    pub(super) plain: f64,
    /// That the effect is not in the catalogue.
    pub(super) unknown: f64,
}

impl Shares {
    /// Beside a verdict of this probability that names the hypotheses at these places.
    pub(super) fn new(
        base: &Hypothesis,
        ranked: &[Hypothesis],
        kind: Kind,
        named: &[usize],
        probability: f64,
    ) -> Self {
        let plain = base.log_evidence();
        let top = ranked
            .first()
            .map_or(plain, |h| h.log_evidence().max(plain));
        let weight = |evidence: f64| ((evidence - top) / TEMPERATURE).exp();
        let ids: Vec<&str> = named.iter().flat_map(|&at| ranked[at].ids()).collect();
        let says = |h: &Hypothesis| h.ids().iter().any(|id| ids.contains(id));
        let weights: Vec<f64> = ranked
            .iter()
            .map(|h| weight(h.log_evidence() - ACCUSES * h.added.len() as f64))
            .collect();
        let plain = weight(plain);
        let [mut named_sum, mut others_sum] = [0.0; 2];
        for (h, w) in ranked.iter().zip(&weights) {
            *(if says(h) {
                &mut named_sum
            } else {
                &mut others_sum
            }) += w;
        }
        let without_effect = [Kind::None, Kind::Parameters].contains(&kind);
        let open = 1.0 - probability;
        let shared = match kind {
            Kind::Unknown => open,
            _ => (1.0 - UNKNOWN_ELSE) * open,
        };
        if !without_effect {
            others_sum += plain;
        }
        let mut per_other = shared / others_sum.max(f64::MIN_POSITIVE);
        let per_named = probability / named_sum.max(f64::MIN_POSITIVE);
        if !named.is_empty() {
            // No other answer is more probable than what is named.
            let least = named
                .iter()
                .map(|&at| per_named * weights[at] / ranked[at].added.len() as f64);
            let least = least.fold(f64::INFINITY, f64::min);
            let other = ranked.iter().zip(&weights).filter(|(h, _)| !says(h));
            let most = other.fold(plain, |most, (_, w)| most.max(*w));
            per_other = per_other.min(least / most.max(f64::MIN_POSITIVE));
        }
        let of = |(h, w): (&Hypothesis, &f64)| w * if says(h) { per_named } else { per_other };
        Self {
            plain: if without_effect {
                probability
            } else {
                plain * per_other
            },
            unknown: match kind {
                Kind::Unknown => probability,
                _ => open - per_other * others_sum,
            },
            ranked: ranked.iter().zip(&weights).map(of).collect(),
        }
    }
}
