//! What acts once in all logs is named, though no other part of the data tells of it; what cuts few moments, though others gain more below
//! what is open; and waves whose order a spectrum of the plain rest does not show.

mod trials;

use bristle_gap::diagnose::{Kind, catalogue};
use bristle_gap::trial::Trial;
use trials::{diagnosed, drawn, drawn_with};

fn names_alone(trial: &Trial, accused: &[&str], there: &str) {
    let said = diagnosed(trial, accused).verdict;
    assert_eq!(
        (said.kind, said.effects),
        (Kind::Effect, vec![there.to_string()])
    );
}

#[test]
fn a_stop_that_was_hit_once_is_named() {
    // Two nodes of one log, 65 times what is open there.
    let there = "mechanics.end_stop";
    let accused = [there, "friction.load", "mechanics.compliance"];
    names_alone(&drawn(11925, &[there]), &accused, there);
}

#[test]
fn a_limit_is_kept_beside_what_gains_below_what_is_open() {
    // The limit cuts so little that nine effects gain more where a rest below what is open counts.
    let there = "actuator.saturation";
    let all: Vec<&str> = catalogue().iter().map(|entry| entry.id).collect();
    names_alone(&drawn_with(11755, &[there], 1.0), &all, there);
}

#[test]
fn an_inertia_over_position_shows_at_a_steady_speed() {
    let there = "mechanics.inertia_change";
    let trial = drawn_with(13352, &[there], 1.0);
    names_alone(&trial, &[there, "actuator.cogging"], there);
}

#[test]
fn a_slow_wave_shows_beside_what_the_simulator_has_taken_of_it() {
    let there = "friction.position";
    let trial = drawn_with(13375, &[there], 1.0);
    names_alone(&trial, &[there, "actuator.cogging"], there);
}

#[test]
fn a_limit_far_below_what_a_controller_asks_for_is_named() {
    // 6.6 N, a 300th of the reference that winds up behind it.
    let there = "actuator.saturation";
    names_alone(&drawn(18327, &[there]), &[there, "actuator.gain"], there);
}

#[test]
fn few_moments_that_hold_a_regime_as_noise_are_explained() {
    // A stop in a tenth of the nodes that hardly move, forty times what the others leave.
    let there = "mechanics.end_stop";
    let accused = [there, "disturbance.periodic", "friction.load"];
    names_alone(&drawn(20171, &[there]), &accused, there);
    // A limit that cuts three nodes of one log.
    let there = "actuator.voltage_limit";
    let accused = [there, "actuator.cogging", "disturbance.periodic"];
    names_alone(&drawn(20126, &[there]), &accused, there);
}
