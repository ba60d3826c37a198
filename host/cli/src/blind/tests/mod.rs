//! The scorer on fabricated answers, and seals that were broken.

mod scoring;
mod seals;
mod withholding;

use super::miss::Reason;
use super::score::{Outcome, score};
use super::seal::{self, Answer};
use bristle_withheld::{Changed, Class, Effect, Truth};
use serde_json::{Value, json};
use std::collections::BTreeMap;

fn truth(class: Class, ids: &[(&str, &str)]) -> Truth {
    Truth {
        seed: 7,
        class,
        ratio: (!ids.is_empty()).then_some(4.0),
        effects: ids
            .iter()
            .map(|(id, block)| Effect {
                id: (*id).to_owned(),
                block: (*block).to_owned(),
                resembles: None,
                size: 0.1,
                parameters: BTreeMap::from([
                    ("amplitude_nm".to_owned(), 0.02),
                    ("order_per_rev".to_owned(), 24.0),
                ]),
                gap_rms_nm: 0.04,
                ratio: 4.0,
            })
            .collect(),
        changed: Vec::new(),
        linear: false,
        rate_hz: 1000.0,
        experiments: vec!["sine".to_owned()],
        floor_rms_nm: 0.01,
        before_rms_nm: 0.041,
    }
}

fn said(kind: &str, effects: &[&str], probability: f64, candidates: &[&str]) -> Value {
    json!({
        "schema": 1,
        "verdict": {"kind": kind, "effects": effects, "probability": probability},
        "gap": {"before": 0.041, "after": 0.011, "floor": 0.01, "closed_fraction": {"value": 0.97, "low": 0.9, "high": 1.0}},
        "where": {"block": effects.first().map_or("", |id| id.split('.').next().unwrap())},
        "candidates": candidates.iter().map(|id| json!({
            "effect": id, "parameters": {"amplitude_nm": 0.025, "order_per_rev": 12.0},
        })).collect::<Vec<_>>(),
        "next_experiment": {"what": "a slow speed ladder"},
    })
}

fn sealed(case: &str, said: Value) -> Answer {
    let mut answer = Answer {
        case: case.to_owned(),
        files: BTreeMap::new(),
        time: String::new(),
        program: seal::program(),
        seconds: 1.5,
        answer: Some(said),
        error: None,
        sha256: String::new(),
    };
    answer.sha256 = answer.hash();
    answer
}

fn scored(truth: &Truth, answer: Value) -> Outcome {
    score(truth, &sealed("case-0001", answer))
}

/// Id and block.
const COGGING: (&str, &str) = ("actuator.cogging", "actuator");
const OFFSET: (&str, &str) = ("mechanics.offset", "mechanics");
