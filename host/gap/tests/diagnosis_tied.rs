//! Effects that the method's own error may decide between tie.

mod trials;

use bristle_gap::diagnose::Kind;
use bristle_gap::trial::Trial;
use trials::{diagnosed, drawn, drawn_with};

fn ties(trial: &Trial, effects: &[&str]) {
    let said = diagnosed(trial, effects).verdict;
    let mut named = said.effects;
    named.sort_unstable();
    let effects: Vec<String> = effects.iter().map(|id| (*id).to_string()).collect();
    assert_eq!((said.kind, named), (Kind::Ambiguous, effects));
}

#[test]
fn a_lag_ties_with_a_delay_that_explains_a_hundredth_more() {
    // 0.56 ms: 26 nats of 2650 speak for the delays, which leave the same to 0.04 times what is open.
    let effects = ["actuator.delay", "actuator.lag", "sensor.delay"];
    ties(&drawn(13706, &["actuator.lag"]), &effects);
}

#[test]
fn an_eccentricity_ties_with_an_inertia_that_leaves_more_below_what_is_open() {
    // 17 nats of 1930 speak for the inertia above what is open, 300 of 2330 for the encoder with what lies below it.
    let effects = ["mechanics.inertia_change", "sensor.eccentricity"];
    let trial = drawn_with(13760, &["sensor.eccentricity"], 1.0);
    ties(&trial, &effects);
}
