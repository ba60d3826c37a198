//! Two effects of which one hides the other: both are named.

mod trials;

use bristle_gap::diagnose::Kind;
use trials::{diagnosed, drawn};

fn names_both(seed: u64, truth: [&'static str; 2], others: [&str; 2]) {
    let said = diagnosed(&drawn(seed, &truth), &[truth, others].concat()).verdict;
    assert_eq!(said.kind, Kind::Effects, "{said:?}");
    assert!(
        truth
            .iter()
            .all(|id| said.effects.iter().any(|one| one == id)),
        "{said:?}"
    );
}

#[test]
fn bristles_are_found_beside_an_effect_that_explains_all_above_what_is_open() {
    // Alone they are hidden by the cogging, and beside it they gain below what is open only.
    let truth = ["friction.presliding", "actuator.cogging"];
    names_both(12230, truth, ["friction.dwell", "mechanics.offset"]);
}

#[test]
fn what_clears_few_moments_beside_another_effect_is_named() {
    // Beside the bristles the Stribeck curve takes a ninth of the squares, but all that few moments keep, 1.8 times what is open.
    let truth = ["friction.nonlocal", "friction.stribeck"];
    names_both(12227, truth, ["friction.dwell", "friction.load"]);
}

#[test]
fn a_limit_of_speed_and_torque_is_found_where_it_cuts() {
    // No level of both that lies evenly over their ranges comes near.
    let truth = ["actuator.voltage_limit", "mechanics.spring"];
    names_both(17274, truth, ["actuator.cogging", "friction.asymmetry"]);
}

#[test]
fn a_stop_that_is_hit_once_is_named_beside_a_wave() {
    // It promises less of all squares than four others, and takes all that few moments keep.
    let truth = ["mechanics.end_stop", "mechanics.unbalance"];
    names_both(17257, truth, ["mechanics.inertia_change", "friction.load"]);
}

#[test]
fn a_wave_of_inertia_is_found_beside_a_payload() {
    // The payload promises most, and is half of the effect.
    let truth = ["mechanics.inertia_change", "sensor.delay"];
    names_both(19552, truth, ["actuator.lag", "sensor.eccentricity"]);
}

#[test]
fn what_leaves_no_room_for_a_second_effect_and_is_not_all_there_is_has_one() {
    // Noise of the spring alone, correlated for long, hides the asymmetry, which does nothing without the spring.
    let truth = ["mechanics.spring", "friction.asymmetry"];
    names_both(19554, truth, ["sensor.eccentricity", "actuator.cogging"]);
}
