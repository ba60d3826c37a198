//! Weights that a wrong fit leaves hold a regime as noise in which it failed: what explains that regime must be found all the same.

use bristle_gap::Believed;
use bristle_gap::diagnose::{Kind, Options, catalogue, diagnose};
use bristle_gap::trial::{self, Wanted};

/// Verdict on the trial of an offset of a seed, with an offset and what stands for it in the catalogue.
fn verdict(seed: u64) -> (Kind, Vec<String>) {
    let wanted = Wanted {
        effects: vec!["mechanics.offset"],
        share: 4.0,
        parameter_error: 0.1,
    };
    let trial = trial::draw(seed, &wanted).unwrap().unwrap();
    let believed = Believed::new(&trial.axis, &trial.path).unwrap();
    let accused = [
        "actuator.deadzone",
        "actuator.saturation",
        "friction.asymmetry",
        "friction.lag",
        "mechanics.offset",
        "mechanics.spring",
    ];
    let options = Options {
        catalogue: catalogue()
            .into_iter()
            .filter(|entry| accused.contains(&entry.id))
            .collect(),
    };
    let outcome = diagnose(&trial.logs, &trial.axis, &believed, &options, &|_| ()).unwrap();
    let said = outcome.diagnosis.verdict;
    (said.kind, said.effects)
}

#[test]
fn the_noise_of_what_explains_all_needs_no_second_effect() {
    // With the noise of its first fit it left 1.3 times what is open in sliding, which friction that lags took away.
    let (kind, effects) = verdict(3154);
    assert_eq!(
        (kind, &effects[..]),
        (Kind::Effect, &["mechanics.offset".to_string()][..])
    );
}

#[test]
fn what_is_unknown_is_looked_at_again() {
    // The refitted simulator had put a sixth of the stiffness in the place of the offset, and with its noise nothing explained the rest.
    let (kind, effects) = verdict(8920);
    assert_eq!(
        (kind, &effects[..]),
        (Kind::Effect, &["mechanics.offset".to_string()][..])
    );
}
