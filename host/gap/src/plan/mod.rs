//! A plan: experiments with their numbers, bounds and lengths, one after the other, as a TOML file.
//!
//! Inside, times are ticks at the axis's observer rate; in the file they are seconds. What a file leaves out is sized for
//! the axis as `bristle run EXPERIMENT` does.

mod fields;
mod parse;
mod write;

use crate::believed::Believed;
use crate::error::InputError;
use crate::experiments::Named;
use bristle_core::experiment::fields::{in_single_precision, is_playable};
use bristle_core::experiment::{Bounds, Experiment};
use bristle_plant::Unit;
use fields::{Bound, Time};
use std::path::Path;

/// Rest between two experiments where none is given, s.
const REST_S: f64 = 0.5;
/// Longest plan where no limit is given, s.
const MOST_S: f64 = 3600.0;
/// Most experiments of a plan.
pub const MOST_STEPS: usize = 1000;

/// Experiments one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Longest that all may take, rests included, s.
    pub most_s: f64,
    /// The experiments.
    pub steps: Vec<Step>,
}

/// An experiment of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The signal.
    pub experiment: Experiment<f64>,
    /// What it may do, and for how long it plays.
    pub bounds: Bounds<f64>,
    /// Ticks of rest before it.
    pub rest_ticks: u32,
    /// What it is for, in words; may be empty.
    pub why: String,
}

/// What is wrong with a step: the key in the file that it concerns, what, and the remedy.
struct Fault {
    key: &'static str,
    message: String,
    remedy: String,
}

/// Furthest that an axis may move from where a plan begins: its limit, or else 100 rad or 0.25 m.
pub fn travel_limit_rad(axis: &Believed) -> f64 {
    axis.travel_limit_rad.unwrap_or(match axis.unit {
        Unit::Rotary => 100.0,
        Unit::Linear => 0.25,
    })
}

impl Step {
    /// An experiment sized for the axis, bounded by the axis's own limits.
    pub fn new(named: Named, axis: &Believed) -> Self {
        let ticks = |seconds: f64| (seconds * axis.rate_hz).round().max(1.0) as u32;
        Self {
            experiment: named.experiment(axis, axis.rate_hz),
            bounds: Bounds {
                travel_rad: travel_limit_rad(axis),
                speed_rad_s: axis.speed_limit_rad_s,
                torque_nm: axis.torque_limit_nm(),
                ticks: ticks(named.seconds()),
            },
            rest_ticks: ticks(REST_S),
            why: String::new(),
        }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        Named::of(&self.experiment).name()
    }

    /// Its length and that of the rest before it, s.
    pub fn seconds(&self, axis: &Believed) -> (f64, f64) {
        (
            f64::from(self.bounds.ticks) / axis.rate_hz,
            f64::from(self.rest_ticks) / axis.rate_hz,
        )
    }

    fn fault(&self, axis: &Believed) -> Option<Fault> {
        let bounds = &self.bounds;
        let needs = self.experiment.needs(1.0 / axis.rate_hz);
        let fault = |key, message, remedy: &str| {
            Some(Fault {
                key,
                message,
                remedy: remedy.to_owned(),
            })
        };
        if !is_playable(&in_single_precision(&self.experiment)) {
            let name = self.name();
            return fault(
                "kind",
                format!("the {name} has a value out of range"),
                "ratio is from above 0 to 1, a multisine's period at least 1024 ticks, pauses at most 1024",
            );
        }
        for (bound, value, limit, need) in [
            (
                Bound::Travel,
                bounds.travel_rad,
                travel_limit_rad(axis),
                needs.travel_rad,
            ),
            (
                Bound::Speed,
                bounds.speed_rad_s,
                axis.speed_limit_rad_s,
                needs.speed_rad_s,
            ),
            (
                Bound::Torque,
                bounds.torque_nm,
                axis.torque_limit_nm(),
                needs.torque_nm,
            ),
        ] {
            let (key, of_axis, unit) = bound.names(axis.unit);
            if value > limit || value.is_nan() {
                return fault(
                    key,
                    format!("{key} is {value:?}, and the axis allows {limit:?} {unit}"),
                    &format!("lower it, or raise {of_axis} in the axis file"),
                );
            }
            if need > value {
                return fault(
                    "kind",
                    format!(
                        "the {} asks for {need:.4e} {unit}, beyond its {key} of {value:?}",
                        self.name()
                    ),
                    &format!("make it smaller, or raise {key}"),
                );
            }
        }
        None
    }
}

impl Plan {
    /// These experiments, in an hour at most.
    pub fn new(steps: Vec<Step>) -> Self {
        Self {
            most_s: MOST_S,
            steps,
        }
    }

    /// Length with all rests, s.
    pub fn total_s(&self, axis: &Believed) -> f64 {
        let times = self.steps.iter().map(|step| step.seconds(axis));
        times.map(|(plays, rests)| plays + rests).sum()
    }

    /// Holds the plan against the axis's limits; `path` is for the message.
    ///
    /// # Errors
    /// The first experiment that asks for more than its bounds or the axis allow, or a plan that takes too long.
    pub fn check(&self, axis: &Believed, path: &Path) -> Result<(), InputError> {
        for (number, step) in self.steps.iter().enumerate() {
            if let Some(fault) = step.fault(axis) {
                let message = format!("experiment {}: {}", number + 1, fault.message);
                return Err(InputError::new(path, message, fault.remedy));
            }
        }
        self.duration(axis)
            .map_err(|(message, remedy)| InputError::new(path, message, remedy))
    }

    fn duration(&self, axis: &Believed) -> Result<(), (String, String)> {
        let total_s = self.total_s(axis);
        // Seconds and ticks round differently.
        if total_s <= self.most_s * (1.0 + 1e-9) {
            return Ok(());
        }
        Err((
            format!(
                "the plan takes {total_s:.1} s, and {} is {} s",
                Time::MOST,
                self.most_s
            ),
            format!("shorten it, or raise {} below [plan]", Time::MOST),
        ))
    }
}

#[cfg(test)]
mod tests;
