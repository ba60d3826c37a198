//! The diagnosis as other programs read it.

use super::ceiling::ceiling;
use super::closed::{Closed, closed};
use super::credit::credits;
use super::locate::{self, Region};
use super::moved::Moved;
use super::reproduce::Reproduced;
use super::tried::Search;
use super::verdict::{Doubt, Kind, Verdict};
use crate::believed::Believed;
use crate::inverse::Owner;
use crate::report::short;
use bristle_plant::Unit;
use serde::Serialize;
use std::collections::BTreeMap;

/// Version of the layout.
const SCHEMA: u32 = 1;

/// What `bristle diagnose --json` writes.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// Version of the layout.
    pub schema: u32,
    /// The conclusion.
    pub verdict: Conclusion,
    /// Size of the gap before and after.
    pub gap: Gap,
    /// Where it lies.
    #[serde(rename = "where")]
    pub located: Where,
    /// Every effect that was fitted, most probable first.
    pub candidates: Vec<Candidate>,
    /// Groups of effects that these logs cannot tell apart.
    pub confusable: Vec<Vec<String>>,
    /// What to record to decide, where that is open.
    pub next_experiment: Option<NextExperiment>,
    /// Probability of the answers that name no effect.
    pub others: Others,
    /// The simulator's own parameters that moved.
    pub moved: Vec<Moved>,
    /// How well records are reproduced with the named effects, by view, log and regime; left out where nobody asked.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reproduced: Vec<Reproduced>,
    /// What the numbers rest on, a line each.
    pub notes: Vec<String>,
}

/// The conclusion.
#[derive(Clone, Debug, Serialize)]
pub struct Conclusion {
    /// What kind.
    pub kind: Kind,
    /// The effects it names.
    pub effects: Vec<String>,
    /// How probable it is.
    pub probability: f64,
}

/// The gap, rms on data that took no part in fitting.
#[derive(Clone, Debug, Serialize)]
pub struct Gap {
    /// N m or N.
    pub unit: &'static str,
    /// Of the simulator with its parameters refitted.
    pub before: f64,
    /// With the named effects.
    pub after: f64,
    /// What no model explains.
    pub floor: f64,
    /// Slow drift of the effort from one repeat to the next; left out where no reference of a position repeats exactly.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift: Option<f64>,
    /// Share of the gap that is closed.
    pub closed_fraction: Closed,
    /// Share of it that a smooth black box closes, where the effect is unknown: what could be closed at best by a function of where the axis
    /// is, how it moves, what drives it and when.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ceiling: Option<Closed>,
}

/// Where the gap lies.
#[derive(Clone, Debug, Serialize)]
pub struct Where {
    /// sensor, actuator, friction, mechanics or disturbance; none where no effect is named.
    pub block: Option<String>,
    /// Largest shares first.
    pub regions: Vec<Region>,
}

/// An effect and what it would explain.
#[derive(Clone, Debug, Serialize)]
pub struct Candidate {
    /// Its id.
    pub effect: String,
    /// Its block.
    pub block: String,
    /// How probable it is.
    pub probability: f64,
    /// Rms with it on held-out data.
    pub gap_after: f64,
    /// Share of the gap that it closes.
    pub closed_fraction: Closed,
    /// Its part of the share that the named effects close together, where there are two: they add up to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub credit: Option<f64>,
    /// Fitted values by name.
    pub parameters: BTreeMap<String, f64>,
}

/// What to record next.
#[derive(Clone, Debug, Serialize)]
pub struct NextExperiment {
    /// Why.
    pub why: String,
    /// What.
    pub what: String,
    /// Name of the built-in experiment; none where none decides.
    pub experiment: Option<&'static str>,
    /// By how much it speaks against the wrong one of the two that are hardest to tell apart, nats.
    pub separation_nats: Option<f64>,
}

/// Probabilities of the answers that name no effect.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Others {
    /// Nothing is missing.
    pub none: f64,
    /// Only parameters were wrong.
    pub parameters: f64,
    /// The effect is not in the catalogue.
    pub unknown: f64,
}

impl Diagnosis {
    /// Takes the verdict back: the logs show nothing.
    pub(super) fn undecided(&mut self) {
        self.verdict = Conclusion {
            kind: Kind::Insufficient,
            effects: Vec::new(),
            probability: 1.0,
        };
        self.others = Others {
            none: 0.0,
            parameters: 0.0,
            unknown: 0.0,
        };
        self.moved.clear();
    }
}

/// A search and what is concluded from it, as other programs read them.
pub fn conclude(search: &Search, verdict: &Verdict, believed: &Believed) -> Diagnosis {
    let unit = believed.unit;
    let named: Vec<String> = verdict
        .named
        .iter()
        .flat_map(|&i| verdict.ranked[i].0.ids())
        .map(str::to_string)
        .collect();
    let candidates = candidates(search, verdict, unit);
    let [before, after, floor] = verdict.rms_nm;
    let closed_fraction = verdict.named.first().map_or_else(Closed::default, |&i| {
        closed(search, &verdict.ranked[i].0.held_out)
    });
    let says_effect = !named.is_empty();
    let unlisted = search.is_unlisted().then(|| {
        "positions show noise or lost counts of a sensor effect that was left out of the candidates"
            .to_string()
    });
    let shaken = search
        .records
        .first()
        .filter(|record| record.shakes_nm > 0.0);
    let drift = shaken.map(|record| {
        format!(
            "bristles let go of what they hold as under torque noise on the rotor of {} {} rms in samples of {} s, which is part of \
             the simulator here",
            short(record.shakes_nm),
            unit.effort(),
            short(record.step_s)
        )
    });
    let form = verdict.in_another_form.map(|id| {
        format!(
            "{id} acts in another form than the catalogue's: what that leaves over goes by the same variable, and a model of the form \
             would close more"
        )
    });
    let doubt = verdict.doubt.map(|(id, doubt)| {
        let why = match doubt {
            Doubt::Strains => {
                "only with parameters of the simulator that are far from those of the axis file: check these"
            }
            Doubt::IsUnusual => {
                "but only beside a second effect, and one of both has a form that no axis is known by: they may stand for another"
            }
            Doubt::AsksForAnother => {
                "but a second effect gains beside it what it would not where nothing else is: it may stand for another"
            }
            Doubt::BendsAll => {
                "but carries nearly all of friction: what is missing is that friction bends before it slides, in whatever form"
            }
        };
        format!("{id} would explain what there is, {why}")
    });
    Diagnosis {
        schema: SCHEMA,
        located: Where {
            block: named.first().map(|id| block(id)),
            regions: locate::regions(
                search,
                verdict.named.first().map(|&at| &verdict.ranked[at].0),
            ),
        },
        verdict: Conclusion {
            kind: verdict.kind,
            probability: verdict.probability,
            effects: named,
        },
        gap: Gap {
            unit: unit.effort(),
            before,
            after: if says_effect { after } else { before },
            floor: floor.min(after).min(before),
            drift: None,
            closed_fraction,
            ceiling: (verdict.kind == Kind::Unknown).then(|| ceiling(search)),
        },
        confusable: super::confusable::groups(search, verdict),
        next_experiment: None,
        others: Others {
            none: verdict.none,
            parameters: verdict.parameters,
            unknown: verdict.unknown,
        },
        moved: verdict.moved.clone(),
        reproduced: Vec::new(),
        notes: unlisted
            .into_iter()
            .chain(doubt)
            .chain(form)
            .chain(drift)
            .collect(),
        candidates,
    }
}

/// Every effect that was fitted, once: by itself if it was, and with the probability of all hypotheses that hold it, those
/// with several effects shared among them.
fn candidates(search: &Search, verdict: &Verdict, unit: Unit) -> Vec<Candidate> {
    let mut candidates: Vec<Candidate> = Vec::new();
    let pair = (verdict.kind == Kind::Effects)
        .then(|| verdict.named.first())
        .flatten();
    let credits = pair.and_then(|&at| credits(search, &verdict.ranked[at].0));
    let credit = |id: &str| {
        let of = credits?.into_iter().find(|(other, _)| *other == id);
        of.map(|(_, credit)| credit)
    };
    let alone_first = |len: usize| {
        verdict
            .ranked
            .iter()
            .filter(move |(h, _)| h.added.len() == len)
    };
    for len in 1..=super::beside::MOST_EFFECTS {
        for (hypothesis, probability) in alone_first(len) {
            for id in hypothesis.ids() {
                // What the verdict names takes all of it; else the effects share it.
                let named = |id: &str| {
                    let of = |&i: &usize| verdict.ranked[i].0.ids().contains(&id);
                    verdict.named.iter().any(of)
                };
                let takes = hypothesis.ids().into_iter().filter(|id| named(id)).count();
                let part = match takes {
                    0 => probability / len as f64,
                    takes if named(id) => probability / takes as f64,
                    _ => 0.0,
                };
                if let Some(known) = candidates.iter_mut().find(|known| known.effect == id) {
                    known.probability += part;
                    continue;
                }
                candidates.push(Candidate {
                    effect: id.to_string(),
                    block: block(id),
                    probability: part,
                    gap_after: search.noise.rms(&search.nodes, &hypothesis.held_out).1,
                    closed_fraction: closed(search, &hypothesis.held_out),
                    credit: credit(id),
                    parameters: parameters(search, hypothesis, unit),
                });
            }
        }
    }
    candidates.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    candidates
}

/// The block of an effect's id.
fn block(id: &str) -> String {
    id.split('.').next().unwrap_or_default().to_string()
}

/// Values of what was added, by name; of several effects with the id before it.
pub fn parameters(
    search: &Search,
    hypothesis: &super::hypothesis::Hypothesis,
    unit: Unit,
) -> BTreeMap<String, f64> {
    let believed = search.base.model.effects.len();
    let point = hypothesis.model.at(&hypothesis.fit.at);
    let several = hypothesis.added.len() > 1;
    let mut values = BTreeMap::new();
    for added in &point.effects()[believed..] {
        for (parameter, value) in added.entry.parameters.iter().zip(&added.values) {
            let name = parameter.name(unit);
            let name = if several {
                format!("{}:{name}", added.entry.id)
            } else {
                name.to_string()
            };
            values.insert(name, *value);
        }
    }
    for (free, value) in hypothesis
        .model
        .free
        .iter()
        .zip(hypothesis.model.values(&hypothesis.fit.at))
    {
        if let Owner::OnRecord(_, _, record) = free.owner {
            values.insert(format!("{}_of_log_{}", free.name, record + 1), value);
        }
    }
    values
}
