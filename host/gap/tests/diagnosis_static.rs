//! Friction without bristles: what they would explain lies where the axis hardly moves, and where whatever holds holds.

use bristle_gap::Believed;
use bristle_gap::diagnose::{Kind, Options, catalogue, diagnose};
use bristle_gap::trial::{self, Wanted};

/// What is named on the trial of a seed that has this effect, with a few others in the catalogue.
fn named(seed: u64, effect: &'static str) -> (Kind, Vec<String>) {
    let wanted = Wanted {
        effects: vec![effect],
        share: 4.0,
        parameter_error: 0.1,
    };
    let trial = trial::draw(seed, &wanted).unwrap().unwrap();
    assert!(!trial.axis.friction.model.unwrap().has_bristles());
    let believed = Believed::new(&trial.axis, &trial.path).unwrap();
    let accused = [
        "friction.lag",
        "friction.nonlocal",
        "friction.presliding",
        "mechanics.compliance",
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
fn bristles_that_are_missing_are_named_and_told_apart() {
    for (seed, effect) in [(3239, "friction.presliding"), (3237, "friction.nonlocal")] {
        let (kind, effects) = named(seed, effect);
        assert_eq!(
            (kind, &effects[..]),
            (Kind::Effect, &[effect.to_string()][..]),
            "{seed}"
        );
    }
}
