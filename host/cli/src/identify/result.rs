//! The result as JSON.

use super::steps::Step;
use bristle_gap::Unit;
use bristle_gap::identify::joint::{Errors, Estimate, Identified, Provenance};
use serde::Serialize;
use std::collections::BTreeMap;

/// Everything that was found.
#[derive(Serialize)]
pub struct Summary {
    schema: u32,
    unit: &'static str,
    model: &'static str,
    parameters: BTreeMap<String, Parameter>,
    timing: Option<Parameter>,
    correlation: Correlation,
    models: Vec<Model>,
    errors: Vec<Error>,
    steps: Vec<StepResult>,
    notes: Vec<String>,
    provenance: Origin,
}

#[derive(Serialize)]
struct Parameter {
    value: f64,
    low: Option<f64>,
    high: Option<f64>,
    interval: &'static str,
    verdict: &'static str,
    advice: Option<String>,
}

#[derive(Serialize)]
struct Correlation {
    names: Vec<String>,
    values: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct Model {
    model: &'static str,
    score: f64,
    standard_error: f64,
    rest_rms: f64,
    chosen: bool,
}

#[derive(Serialize)]
struct Error {
    log: String,
    held_out: bool,
    effort_rms: f64,
    effort_relative: f64,
    position_windowed_rms: Option<f64>,
    position_free_rms: f64,
}

#[derive(Serialize)]
struct StepResult {
    step: &'static str,
    log: String,
    refused: Option<String>,
    parameters: BTreeMap<String, Parameter>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct Origin {
    command: String,
    version: String,
    date: String,
    logs: BTreeMap<String, String>,
}

fn parameter(estimate: &Estimate) -> Parameter {
    Parameter {
        value: estimate.value,
        low: estimate.low,
        high: estimate.high,
        interval: if estimate.profiled {
            "profile"
        } else {
            "normal"
        },
        verdict: estimate.verdict.name(),
        advice: estimate.advice.clone(),
    }
}

impl Summary {
    /// From what was found.
    pub fn new(
        identified: &Identified,
        held_out: &[Errors],
        steps: &[Step],
        provenance: &Provenance,
        notes: &[String],
        unit: Unit,
    ) -> Self {
        let names: Vec<String> = identified
            .estimates
            .iter()
            .map(|estimate| estimate.name.clone())
            .collect();
        let error = |errors: &Errors, held_out: bool| Error {
            log: errors.log.clone(),
            held_out,
            effort_rms: errors.effort_nm,
            effort_relative: errors.relative,
            position_windowed_rms: errors.windowed_rad,
            position_free_rms: errors.free_rad,
        };
        Self {
            schema: 1,
            unit: unit.effort(),
            model: identified.joint.kind.name(),
            parameters: names
                .iter()
                .cloned()
                .zip(identified.estimates.iter().map(parameter))
                .collect(),
            timing: identified.timing.as_ref().map(parameter),
            correlation: Correlation {
                names,
                values: identified.correlation.clone(),
            },
            models: identified
                .compared
                .iter()
                .map(|model| Model {
                    model: model.kind.name(),
                    score: model.score,
                    standard_error: model.error,
                    rest_rms: model.rms_nm,
                    chosen: model.kind == identified.joint.kind,
                })
                .collect(),
            errors: identified
                .errors
                .iter()
                .map(|errors| error(errors, false))
                .chain(held_out.iter().map(|errors| error(errors, true)))
                .collect(),
            steps: steps
                .iter()
                .map(|step| StepResult {
                    step: step.name,
                    log: step.log.clone(),
                    refused: step.refused.clone(),
                    parameters: step
                        .estimates
                        .iter()
                        .map(|estimate| {
                            let end = |x: f64| x.is_finite().then_some(x);
                            let parameter = Parameter {
                                value: estimate.value,
                                low: end(estimate.low),
                                high: end(estimate.high),
                                interval: "step",
                                verdict: estimate.verdict.name(),
                                advice: estimate.advice.clone(),
                            };
                            (estimate.parameter.name(unit).to_string(), parameter)
                        })
                        .collect(),
                    notes: step.notes.clone(),
                })
                .collect(),
            notes: notes.to_vec(),
            provenance: Origin {
                command: provenance.command.clone(),
                version: provenance.version.clone(),
                date: provenance.date.clone(),
                logs: provenance.logs.iter().cloned().collect(),
            },
        }
    }
}
