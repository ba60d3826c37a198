//! What an answer is worth, given what was withheld.

use super::miss::{Miss, why};
use super::path::{list, text};
use super::seal::Answer;
use bristle_withheld::{Class, LISTED, Truth};
use serde::Serialize;
use serde_json::Value;

/// Effects that look alike on most records; a wrong answer from the same group is a near miss. Any other effect is alone.
const FAMILIES: [&[&str]; 9] = [
    &[
        "actuator.lag",
        "actuator.delay",
        "sensor.delay",
        "mechanics.compliance",
    ],
    &[
        "friction.presliding",
        "friction.nonlocal",
        "mechanics.backlash",
    ],
    &[
        "actuator.gain",
        "actuator.saturation",
        "actuator.voltage_limit",
    ],
    &["actuator.cogging", "actuator.ripple", "friction.position"],
    &["friction.asymmetry", "mechanics.offset"],
    &["friction.stribeck", "friction.dwell", "friction.lag"],
    &[
        "mechanics.unbalance",
        "sensor.eccentricity",
        "mechanics.inertia_change",
    ],
    &["sensor.quantization", "sensor.jitter", "sensor.lost_counts"],
    &["friction.load", "friction.quadratic", "friction.thermal"],
];

/// How strong an effect came out against the floor; the bins stand at equal ratios about 4, 1 and a quarter.
pub fn strength(ratio: f64) -> &'static str {
    if ratio >= 2.0 {
        "4x"
    } else if ratio >= 0.5 {
        "1x"
    } else {
        "1/4x"
    }
}

/// A case's score.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Its name.
    pub case: String,
    /// Its class.
    pub class: Class,
    /// `4x`, `1x` or `1/4x` of the floor, of the weakest effect; empty where there is none.
    pub strength: &'static str,
    /// What it has.
    pub truth: Vec<String>,
    /// What was said: the verdict's kind, or `error`.
    pub kind: String,
    /// The effects that the verdict names.
    pub named: Vec<String>,
    /// The verdict's probability.
    pub probability: Option<f64>,
    /// The verdict is what is withheld, no more and no less.
    pub exact: bool,
    /// The verdict leaves it open between effects of which the true one is one.
    pub tied: bool,
    /// An effect of the true one's family was named, or the verdict is exact.
    pub family: bool,
    /// The true effect is among the first three candidates.
    pub top3: bool,
    /// The block is right.
    pub block: bool,
    /// An axis without an effect was said to have one, known or not.
    pub accused: bool,
    /// Effects of a pair that were named.
    pub found: usize,
    /// Closed fraction that the answer claims on withheld data, over the oracle's, which is 1: whoever knows the effect is
    /// left with the floor.
    pub closed: Option<f64>,
    /// Largest relative error of the named effect's parameters, as far as both have them, orders and phases aside.
    pub magnitude_error: Option<f64>,
    /// How long the answer took.
    pub seconds: f64,
    /// The most likely candidates, for the list of misses.
    pub first: Vec<String>,
    /// What the answer would record next.
    pub next: String,
    /// Why there is no answer.
    pub error: Option<String>,
    /// Why the answer is wrong, if it is.
    pub miss: Option<Miss>,
}

fn family(a: &str, b: &str) -> bool {
    a == b
        || FAMILIES
            .iter()
            .any(|group| group.contains(&a) && group.contains(&b))
}

/// Scores an answer.
pub fn score(truth: &Truth, sealed: &Answer) -> Outcome {
    let nothing = Value::Null;
    let answer = sealed.answer.as_ref().unwrap_or(&nothing);
    let kind = match text(answer, "/verdict/kind") {
        "" => "error",
        kind => kind,
    };
    let named: Vec<String> = list(answer, "/verdict/effects")
        .filter_map(|id| id.as_str().map(str::to_owned))
        .collect();
    let candidates: Vec<&Value> = list(answer, "/candidates").collect();
    let candidate_ids: Vec<&str> = candidates
        .iter()
        .map(|candidate| text(candidate, "/effect"))
        .collect();
    let ids: Vec<&str> = truth
        .effects
        .iter()
        .map(|effect| effect.id.as_str())
        .collect();
    let found = ids
        .iter()
        .filter(|id| named.iter().any(|name| name == **id))
        .count();
    let exact = match truth.class {
        Class::Single => kind == "effect" && named.len() == 1 && found == 1,
        Class::Pair => kind == "effects" && named.len() == 2 && found == 2,
        Class::Unknown => kind == "unknown",
        Class::Clean => kind == "none",
        Class::Parameters => kind == "parameters",
    };
    let listed = ids.iter().all(|id| LISTED.contains(id)) && !ids.is_empty();
    let names_something = matches!(kind, "effect" | "effects" | "ambiguous");
    let weakest = truth
        .effects
        .iter()
        .map(|effect| effect.ratio)
        .fold(f64::INFINITY, f64::min);
    let mut outcome = Outcome {
        case: sealed.case.clone(),
        class: truth.class,
        strength: if weakest.is_finite() {
            strength(weakest)
        } else {
            ""
        },
        truth: ids.iter().map(|id| (*id).to_owned()).collect(),
        kind: kind.to_owned(),
        probability: answer
            .pointer("/verdict/probability")
            .and_then(Value::as_f64),
        exact,
        tied: truth.class == Class::Single && kind == "ambiguous" && found == 1,
        family: exact
            || (listed
                && names_something
                && named
                    .iter()
                    .any(|name| ids.iter().any(|id| family(id, name)))),
        top3: listed
            && ids.iter().all(|id| {
                candidate_ids
                    .iter()
                    .take(3.max(ids.len()))
                    .any(|one| one == id)
            }),
        block: truth
            .effects
            .iter()
            .any(|effect| effect.block == text(answer, "/where/block")),
        accused: matches!(truth.class, Class::Clean | Class::Parameters)
            && (names_something || kind == "unknown"),
        found,
        closed: answer
            .pointer("/gap/closed_fraction/value")
            .and_then(Value::as_f64),
        magnitude_error: magnitude_error(truth, &candidates),
        seconds: sealed.seconds,
        first: candidate_ids
            .iter()
            .take(3)
            .map(|id| (*id).to_owned())
            .collect(),
        next: text(answer, "/next_experiment/what").to_owned(),
        error: sealed.error.clone(),
        miss: None,
        named,
    };
    outcome.miss = (!outcome.right()).then(|| why(truth, sealed.answer.as_ref()));
    outcome
}

impl Outcome {
    /// Right, as far as the record can be expected to tell.
    pub fn right(&self) -> bool {
        self.exact || self.tied
    }
}

/// Of a single effect that is among the candidates.
fn magnitude_error(truth: &Truth, candidates: &[&Value]) -> Option<f64> {
    let [effect] = &truth.effects[..] else {
        return None;
    };
    let said = candidates
        .iter()
        .find(|candidate| text(candidate, "/effect") == effect.id)?;
    effect
        .parameters
        .iter()
        .filter(|(name, value)| !name.starts_with("order_") && **value != 0.0)
        .filter_map(|(name, value)| {
            let said = said.pointer("/parameters")?.get(name)?.as_f64()?;
            Some((said / value - 1.0).abs())
        })
        .reduce(f64::max)
}
