//! Simulated logs, and their diagnosis, that tests of the diagnosis share.

use bristle_gap::axis_file::EffectEntry;
use bristle_gap::believed::Noise;
use bristle_gap::diagnose::{Options, Outcome, diagnose};
use bristle_gap::experiments::Named;
use bristle_gap::simulate::{Input, simulate};
use bristle_gap::{AxisFile, Believed, Log};
use bristle_plant::effect::ALL;
use std::path::Path;

/// An effect as it stands in an axis file.
pub fn effect(id: &str, values: &[(&str, f64)]) -> EffectEntry {
    EffectEntry {
        id: id.to_string(),
        parameters: values.iter().map(|(n, x)| (n.to_string(), *x)).collect(),
    }
}

/// Logs of experiments of so many seconds, with noise on the measured torque.
pub fn logs_of(truth: &AxisFile, experiments: &[(Named, f64)], torque_nm: f64) -> Vec<Log> {
    let real = Believed::new(truth, Path::new("axis.toml")).unwrap();
    let noise = Noise {
        torque_nm,
        position_rad: 0.0,
    };
    let one = |(seed, (named, seconds)): (usize, &(Named, f64))| {
        let input = Input::Experiment(*named, *seconds);
        simulate(&input, truth, &real, noise, seed as u64, |_| ())
            .unwrap()
            .log(real.unit, Path::new(named.name()))
    };
    experiments.iter().enumerate().map(one).collect()
}

/// The diagnosis that may accuse these effects.
pub fn diagnosed(axis: &AxisFile, logs: &[Log], accused: &[&str]) -> Outcome {
    let believed = Believed::new(axis, Path::new("axis.toml")).unwrap();
    let options = Options {
        catalogue: ALL.iter().filter(|e| accused.contains(&e.id)).collect(),
    };
    diagnose(logs, axis, &believed, &options, &|_| ()).unwrap()
}
