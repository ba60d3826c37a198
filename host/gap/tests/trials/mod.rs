//! Trials, and what is said of them, that tests of the diagnosis share.

use bristle_gap::Believed;
use bristle_gap::diagnose::{Diagnosis, Options, catalogue, diagnose};
use bristle_gap::trial::{self, Trial, Wanted};

/// The trial of a seed that has these effects, each with a gap 4 times the floor.
pub fn drawn(seed: u64, effects: &[&'static str]) -> Trial {
    drawn_with(seed, effects, 4.0)
}

/// The same with a gap so many times the floor.
pub fn drawn_with(seed: u64, effects: &[&'static str], share: f64) -> Trial {
    let wanted = Wanted {
        effects: effects.to_vec(),
        share,
        parameter_error: 0.1,
    };
    trial::draw(seed, &wanted).unwrap().unwrap()
}

/// A diagnosis of a trial that may accuse these effects.
pub fn diagnosed(trial: &Trial, accused: &[&str]) -> Diagnosis {
    let believed = Believed::new(&trial.axis, &trial.path).unwrap();
    let options = Options {
        catalogue: catalogue()
            .into_iter()
            .filter(|entry| accused.contains(&entry.id))
            .collect(),
    };
    let outcome = diagnose(&trial.logs, &trial.axis, &believed, &options, &|_| ()).unwrap();
    outcome.diagnosis
}
