//! What acts once in all logs is named, though no other part of the data tells of it; what cuts few moments, though others gain more below
//! what is open.

mod trials;

use bristle_gap::Believed;
use bristle_gap::diagnose::{Kind, Options, diagnose};
use bristle_gap::trial::{Wanted, draw};
use trials::{diagnosed, drawn};

#[test]
fn a_stop_that_was_hit_once_is_named() {
    // Two nodes of one log, 65 times what is open there.
    let there = "mechanics.end_stop";
    let accused = [there, "friction.load", "mechanics.compliance"];
    let said = diagnosed(&drawn(11925, &[there]), &accused).verdict;
    assert_eq!(
        (said.kind, said.effects),
        (Kind::Effect, vec![there.to_string()])
    );
}

#[test]
fn a_limit_is_kept_beside_what_gains_below_what_is_open() {
    // The limit cuts so little that nine effects gain more where a rest below what is open counts.
    let there = "actuator.saturation";
    let wanted = Wanted {
        effects: vec![there],
        share: 1.0,
        parameter_error: 0.1,
    };
    let trial = draw(11755, &wanted).unwrap().unwrap();
    let believed = Believed::new(&trial.axis, &trial.path).unwrap();
    let options = Options::default();
    let outcome = diagnose(&trial.logs, &trial.axis, &believed, &options, &|_| ()).unwrap();
    let said = outcome.diagnosis.verdict;
    assert_eq!(
        (said.kind, said.effects),
        (Kind::Effect, vec![there.to_string()])
    );
}
