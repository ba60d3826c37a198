//! Why an answer went wrong, as far as it and the truth tell.

use super::path::{list, text};
use bristle_withheld::{Class, LISTED, Truth};
use serde::Serialize;
use serde_json::Value;
use std::fmt;

/// What wrong answers have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The diagnosis failed.
    NoAnswer,
    /// The logs were said not to suffice.
    Undecided,
    /// The true effect was not fitted to all records.
    NotFitted,
    /// No effect was named, and the true one is the best of those that were tried.
    TooWeak,
    /// No effect was named, and another is the best of those that were tried.
    TakenUp,
    /// Another effect was named in its place.
    Other,
    /// The true effect was named, and another one with it.
    Beside,
    /// Of two effects that are there fewer were named.
    OneOfTwo,
    /// An effect of the catalogue was not recognised.
    Unrecognised,
    /// An effect that the catalogue does not have was taken for one that it has.
    Resembles,
    /// An effect that the catalogue does not have was taken for wrong parameters, or not seen.
    Unseen,
    /// There is no effect, and one was said to be there.
    Accused,
    /// There is no effect, and parameters that are wrong were missed, or right ones said to be wrong.
    Moved,
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoAnswer => "no answer",
            Self::Undecided => "the logs are said to decide nothing",
            Self::NotFitted => "the true effect did not get among those that were fitted to all records",
            Self::TooWeak => "the true effect is the best candidate, and gains too little beside the refitted parameters",
            Self::TakenUp => "refitted parameters take it up, and another candidate is better",
            Self::Other => "another effect explains as much or more",
            Self::Beside => "the true effect is named, and a second one with it",
            Self::OneOfTwo => "one of two effects is missed",
            Self::Unrecognised => "no candidate explains enough, though the catalogue has the effect",
            Self::Resembles => "an effect of the catalogue explains what it does not have",
            Self::Unseen => "refitted parameters take up an effect that the catalogue does not have",
            Self::Accused => "an effect is said to be there, and is not",
            Self::Moved => "whether parameters were wrong is misjudged",
        })
    }
}

/// Why an answer is wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Miss {
    /// In a word.
    pub reason: Reason,
    /// What the refitted simulator, what is named and the true effect's own candidate leave of the gap.
    pub figures: String,
}

/// A wrong answer's reason.
pub fn why(truth: &Truth, answer: Option<&Value>) -> Miss {
    let said = Said::new(answer.unwrap_or(&Value::Null));
    let ids: Vec<&str> = truth
        .effects
        .iter()
        .map(|effect| effect.id.as_str())
        .collect();
    let named = |id: &&str| said.named.contains(id);
    let reason = match truth.class {
        _ if said.kind.is_empty() => Reason::NoAnswer,
        _ if said.kind == "insufficient" => Reason::Undecided,
        Class::Clean | Class::Parameters if said.accuses() => Reason::Accused,
        Class::Clean | Class::Parameters => Reason::Moved,
        Class::Unknown if said.accuses() => Reason::Resembles,
        Class::Unknown => Reason::Unseen,
        _ if ids.iter().all(|id| said.place(id).is_none()) => Reason::NotFitted,
        Class::Pair if ids.iter().any(named) => Reason::OneOfTwo,
        _ if ids.iter().any(named) => Reason::Beside,
        _ if said.kind == "unknown" => Reason::Unrecognised,
        _ if !said.named.is_empty() => Reason::Other,
        _ if ids.iter().any(|id| said.place(id) == Some(0)) => Reason::TooWeak,
        _ => Reason::TakenUp,
    };
    let mut parts = vec![format!("refit leaves {}", said.over_floor("/gap/before"))];
    if !said.named.is_empty() {
        parts.push(format!("what is named {}", said.over_floor("/gap/after")));
    }
    for id in ids
        .iter()
        .filter(|id| LISTED.contains(id) && said.named != [**id])
    {
        parts.push(match said.place(id) {
            Some(place) => format!(
                "{id} (candidate {}) {}",
                place + 1,
                said.over_floor(&format!("/candidates/{place}/gap_after"))
            ),
            None => format!("{id} was not fitted"),
        });
    }
    if said.named.is_empty()
        && let Some(taken) = farthest(truth, said.answer)
    {
        parts.push(taken);
    }
    Miss {
        reason,
        figures: parts.join(", "),
    }
}

/// What of an answer bears on it.
struct Said<'a> {
    answer: &'a Value,
    kind: &'a str,
    named: Vec<&'a str>,
    candidates: Vec<&'a str>,
}

impl<'a> Said<'a> {
    fn new(answer: &'a Value) -> Self {
        Self {
            answer,
            kind: text(answer, "/verdict/kind"),
            named: list(answer, "/verdict/effects")
                .filter_map(Value::as_str)
                .collect(),
            candidates: list(answer, "/candidates")
                .map(|candidate| text(candidate, "/effect"))
                .collect(),
        }
    }

    fn accuses(&self) -> bool {
        !matches!(self.kind, "none" | "parameters")
    }

    fn place(&self, id: &str) -> Option<usize> {
        self.candidates.iter().position(|one| *one == id)
    }

    /// A gap of the answer in times of its floor.
    fn over_floor(&self, path: &str) -> String {
        let number = |path| self.answer.pointer(path).and_then(Value::as_f64);
        match (number(path), number("/gap/floor")) {
            (Some(gap), Some(floor)) if floor > 0.0 => format!("{:.2}", gap / floor),
            _ => "-".to_owned(),
        }
    }
}

/// The refitted parameter that ended farthest from the truth.
fn farthest(truth: &Truth, answer: &Value) -> Option<String> {
    let off = list(answer, "/moved").filter_map(|moved| {
        let name = moved.get("parameter")?.as_str()?;
        let changed = truth.changed.iter().find(|one| one.key == name)?;
        let times = moved.get("after")?.as_f64()? / changed.truth;
        (times > 0.0).then_some((name, times))
    });
    let (name, times) = off.max_by(|a, b| a.1.ln().abs().total_cmp(&b.1.ln().abs()))?;
    Some(format!("{name} refitted to {times:.3} of the truth"))
}
