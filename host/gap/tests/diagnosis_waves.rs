//! Waves over angle whose order a spectrum of the plain rest does not show.

mod trials;

use bristle_gap::diagnose::Kind;
use trials::{diagnosed, drawn_with};

fn is_named(seed: u64, there: &'static str, beside: &str) {
    let trial = drawn_with(seed, &[there], 1.0);
    let said = diagnosed(&trial, &[there, beside]).verdict;
    assert_eq!(
        (said.kind, said.effects),
        (Kind::Effect, vec![there.to_string()])
    );
}

#[test]
fn an_inertia_over_position_shows_at_a_steady_speed() {
    is_named(13352, "mechanics.inertia_change", "actuator.cogging");
}

#[test]
fn a_slow_wave_shows_beside_what_the_simulator_has_taken_of_it() {
    is_named(13375, "friction.position", "actuator.cogging");
}
