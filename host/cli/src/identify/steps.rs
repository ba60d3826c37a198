//! The three classical steps, each on every log that can support it.

use bristle_gap::AxisFile;
use bristle_gap::identify::Estimate;
use bristle_gap::identify::dahl_curve::{self, DahlCurve};
use bristle_gap::identify::joint::Usable;
use bristle_gap::identify::presliding::{self, Presliding};
use bristle_gap::identify::steady::{self, Settings, SteadyFit, SteadyMap};

/// A step on a log.
pub struct Step {
    /// Its name.
    pub name: &'static str,
    /// Name of the log.
    pub log: String,
    /// Why the log cannot support it.
    pub refused: Option<String>,
    /// What it gave.
    pub estimates: Vec<Estimate>,
    /// What the data cannot support.
    pub notes: Vec<String>,
    /// For plots.
    pub found: Option<Found>,
}

/// What a step found.
pub enum Found {
    /// Torque against constant speed.
    Steady(SteadyMap, SteadyFit),
    /// The axis in stick.
    Presliding(Presliding),
    /// The slow loop.
    Dahl(DahlCurve),
}

/// Every step on every log.
pub fn all(logs: &[Usable], axis: &AxisFile) -> Vec<Step> {
    let mut steps = Vec::new();
    for Usable { log, .. } in logs {
        let name = log.file.display().to_string();
        let mut add =
            |step: &'static str, result: Result<(Vec<Estimate>, Vec<String>, Found), _>| {
                let (refused, estimates, notes, found) = match result {
                    Ok((estimates, notes, found)) => (None, estimates, notes, Some(found)),
                    Err(bristle_gap::InputError { message, .. }) => {
                        (Some(message), Vec::new(), Vec::new(), None)
                    }
                };
                steps.push(Step {
                    name: step,
                    log: name.clone(),
                    refused,
                    estimates,
                    notes,
                    found,
                });
            };
        let steady = SteadyMap::from_log(log, axis, &Settings::default()).and_then(|map| {
            let fit = steady::fit(&map)?;
            Ok((
                fit.estimates.clone(),
                fit.notes.clone(),
                Found::Steady(map, fit),
            ))
        });
        add("steady state", steady);
        add(
            "presliding",
            presliding::identify(log, axis).map(|found| {
                (
                    found.estimates.clone(),
                    found.notes.clone(),
                    Found::Presliding(found),
                )
            }),
        );
        add(
            "Dahl curve",
            dahl_curve::identify(log, axis).map(|found| {
                (
                    found.estimates.clone(),
                    found.notes.clone(),
                    Found::Dahl(found),
                )
            }),
        );
    }
    steps
}
