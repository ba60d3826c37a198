//! What no effect of the list explains is unknown, and what the simulator leaves over of its own records is not.

mod trials;

use bristle_gap::diagnose::{Diagnosis, Kind};
use trials::{diagnosed, drawn};

/// What is said of the trial of a seed that has these effects, with a few others in the catalogue.
fn said(seed: u64, effects: &[&'static str]) -> Diagnosis {
    let accused = ["actuator.deadzone", "friction.lag", "mechanics.offset"];
    diagnosed(&drawn(seed, effects), &accused)
}

fn verdict(seed: u64, effects: &[&'static str]) -> Kind {
    said(seed, effects).verdict.kind
}

/// A Stribeck fall is unknown where only a dwell may be accused, and named where it may be, too.
fn a_dwell_is_no_stribeck_fall(seed: u64) {
    let trial = drawn(seed, &["friction.stribeck"]);
    let said = |accused: &[&str]| diagnosed(&trial, accused).verdict;
    assert_eq!(said(&["friction.dwell"]).kind, Kind::Unknown);
    let with_it = said(&["friction.dwell", "friction.stribeck"]);
    assert_eq!(
        (with_it.kind, &with_it.effects[..]),
        (Kind::Effect, &["friction.stribeck".to_string()][..])
    );
}

#[test]
fn a_black_box_says_how_much_could_be_closed_at_best() {
    let ceiling = |seed, effect| said(seed, &[effect]).gap.ceiling.unwrap();
    // A wave of the angle is learnt from four fifths of the data, and noise of the clock from none.
    let (wave, noise) = (
        ceiling(9201, "mechanics.unbalance"),
        ceiling(9204, "sensor.jitter"),
    );
    assert!(wave.low > 0.9, "{wave:?}");
    assert!(noise.value < 0.1, "{noise:?}");
    // Where an effect is named there is none.
    assert!(said(8955, &["mechanics.offset"]).gap.ceiling.is_none());
}

#[test]
fn noise_of_the_sensor_that_no_effect_of_the_list_makes_is_unknown() {
    // It takes nothing of the torque that a model would miss: refitted parameters explain the rest.
    assert_eq!(verdict(9204, &["sensor.jitter"]), Kind::Unknown);
    assert_eq!(verdict(9205, &["sensor.lost_counts"]), Kind::Unknown);
    assert_eq!(verdict(9206, &["sensor.quantization"]), Kind::Unknown);
}

#[test]
fn noise_that_the_simulator_makes_of_its_own_records_is_no_gap() {
    // The effort's noise shakes bristles at 500 Hz: 3.7 times what is open were left over, and are of the simulator's own records.
    assert_eq!(verdict(9103, &[]), Kind::Parameters);
}

#[test]
fn what_depends_on_speed_beside_a_near_relative_is_unknown() {
    // Times of what is open say that next to nothing is left, but three fifths of it depend on the speed.
    a_dwell_is_no_stribeck_fall(12262);
}

#[test]
fn what_depends_on_speed_in_a_model_s_own_records_is_the_method_s() {
    // A third of what a drag leaves beside bristles below what is open depends on the speed, and half of what it leaves of its own records.
    let there = "friction.quadratic";
    let trial = drawn(419, &[there]);
    let said = diagnosed(&trial, &[there, "actuator.gain", "friction.dwell"]).verdict;
    assert_eq!(
        (said.kind, &said.effects[..]),
        (Kind::Effect, &[there.to_string()][..])
    );
}

#[test]
fn an_inertia_that_is_wrong_is_parameters_however_little_its_gap() {
    // A fifteenth of the inertia, which leaves 1.02 times what is open.
    let said = said(9450, &[]);
    assert_eq!(said.verdict.kind, Kind::Parameters);
    assert!(
        said.moved
            .iter()
            .any(|moved| moved.parameter == "inertia_kg_m2")
    );
}

#[test]
fn what_is_left_in_sliding_beyond_what_a_model_leaves_of_its_own_records_is_unknown() {
    // A dwell explains two thirds of a Stribeck fall, and leaves 1.6 times what is open in sliding; fitted to its own records nothing.
    a_dwell_is_no_stribeck_fall(14215);
}

#[test]
fn a_regime_of_a_record_that_a_near_relative_does_not_explain_is_unknown() {
    // An offset explains 0.96 of an asymmetry, and leaves seven times what is open where an axis rests and breaks away.
    let trial = drawn(13804, &["friction.asymmetry"]);
    let said = diagnosed(&trial, &["mechanics.offset"]).verdict;
    assert_eq!(said.kind, Kind::Unknown);
    let said = diagnosed(&trial, &["friction.asymmetry", "mechanics.offset"]).verdict;
    assert!(
        said.effects.contains(&"friction.asymmetry".to_string()),
        "{said:?}"
    );
}

#[test]
fn friction_that_grows_with_load_stands_for_no_ripple() {
    // It follows errors of a measured acceleration: by that it leaves 2.5 of 3.8 times what is open, and as much of records of its own.
    let trial = drawn(17830, &["actuator.ripple"]);
    let said = diagnosed(&trial, &["friction.load", "friction.position"]).verdict;
    assert_eq!(said.kind, Kind::Unknown, "{said:?}");
}

#[test]
fn a_coupling_that_is_left_out_is_no_play() {
    // It is one of half the smallest usual gap, which brings no more than the coupling that it stands for.
    let trial = drawn(18403, &["mechanics.compliance"]);
    let said = diagnosed(&trial, &["mechanics.backlash", "friction.lag"]).verdict;
    assert_eq!(said.kind, Kind::Unknown);
}

#[test]
fn two_effects_that_follow_together_what_neither_is_are_unknown() {
    let verdict = |seed, effect, accused: &[&str]| {
        let said = diagnosed(&drawn(seed, &[effect]), accused).verdict;
        assert_eq!(said.kind, Kind::Unknown, "{seed}: {said:?}");
    };
    // A disturbance of the frequency at which the axis is moved to and fro is any function of where it is.
    let accused = [
        "disturbance.periodic",
        "friction.asymmetry",
        "mechanics.offset",
    ];
    verdict(18407, "mechanics.spring", &accused);
    // So are harmonics of cogging that the axis passes less than twice.
    let accused = ["actuator.cogging", "friction.asymmetry", "mechanics.offset"];
    verdict(19523, "mechanics.spring", &accused);
    // And cogging that it passes hardly more than once, with no harmonics.
    verdict(14625, "mechanics.spring", &accused);
    // A coupling that is damped three times as much as any is no coupling.
    let accused = ["actuator.delay", "mechanics.compliance"];
    verdict(18914, "actuator.lag", &accused);
}

#[test]
fn a_tone_that_is_left_out_is_no_noise() {
    // Refitted parameters leave it as large in every record and regime of motion, and a little beside it.
    let trial = drawn(19507, &["disturbance.periodic"]);
    let said = diagnosed(&trial, &["mechanics.offset", "actuator.deadzone"]).verdict;
    assert_eq!(said.kind, Kind::Unknown, "{said:?}");
}
