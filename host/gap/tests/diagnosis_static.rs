//! Friction without bristles: what they would explain lies where the axis hardly moves, and where whatever holds holds.

mod trials;

use bristle_gap::diagnose::Kind;
use trials::{diagnosed, drawn};

/// What is named on the trial of a seed that has this effect, with a few others in the catalogue.
fn named(seed: u64, effect: &'static str) -> (Kind, Vec<String>) {
    let trial = drawn(seed, &[effect]);
    assert!(!trial.axis.friction.model.unwrap().has_bristles());
    let accused = [
        "friction.lag",
        "friction.nonlocal",
        "friction.presliding",
        "mechanics.compliance",
    ];
    let said = diagnosed(&trial, &accused).verdict;
    (said.kind, said.effects)
}

#[test]
fn bristles_that_are_missing_are_named_and_told_apart() {
    // In the last but one elements that slide one after the other gain a twentieth more than the bristles that are there; those of the last one
    // creep under any load.
    for (seed, effect) in [
        (3239, "friction.presliding"),
        (3237, "friction.nonlocal"),
        (12415, "friction.presliding"),
        (313, "friction.presliding"),
    ] {
        let (kind, effects) = named(seed, effect);
        assert_eq!(
            (kind, &effects[..]),
            (Kind::Effect, &[effect.to_string()][..]),
            "{seed}"
        );
    }
}
