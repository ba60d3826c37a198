//! Weights that a wrong fit leaves hold a regime as noise in which it failed: what explains that regime must be found all the same.

mod trials;

use bristle_gap::diagnose::{Kind, catalogue};
use bristle_gap::trial::Trial;
use trials::{diagnosed, drawn, drawn_with};

fn all() -> Vec<&'static str> {
    catalogue().iter().map(|entry| entry.id).collect()
}

fn names_alone(trial: &Trial, accused: &[&str], there: &str) {
    let said = diagnosed(trial, accused).verdict;
    assert_eq!(
        (said.kind, said.effects),
        (Kind::Effect, vec![there.to_string()])
    );
}

/// What is said of the trial of a seed, with what stands for its effects in the catalogue.
fn verdict(seed: u64, effects: &[&'static str]) -> (Kind, Vec<String>) {
    let accused = [
        "actuator.deadzone",
        "actuator.saturation",
        "friction.asymmetry",
        "friction.dwell",
        "friction.lag",
        "mechanics.inertia_change",
        "mechanics.offset",
        "mechanics.spring",
    ];
    let said = diagnosed(&drawn(seed, effects), &accused).verdict;
    (said.kind, said.effects)
}

#[test]
fn the_noise_of_what_explains_all_needs_no_second_effect() {
    // With the noise of its first fit it left 1.3 times what is open in sliding, which friction that lags took away. An asymmetry
    // may be named beside the offset, where the axis is too seldom at rest.
    let (kind, effects) = verdict(3154, &["mechanics.offset"]);
    assert!(kind == Kind::Effect || kind == Kind::Ambiguous, "{kind:?}");
    assert_eq!(effects[0], "mechanics.offset");
    assert!(
        !effects.contains(&"friction.lag".to_string()),
        "{effects:?}"
    );
}

#[test]
fn what_is_unknown_is_looked_at_again() {
    // With the noise of the first search an inertia that changes explains less than half, and its fit stands still.
    let there = "mechanics.inertia_change";
    names_alone(&drawn(10407, &[there]), &all(), there);
}

#[test]
fn waves_and_limits_are_looked_for_beyond_the_likeliest() {
    let named = |seed, effect: &'static str| {
        let accused = [
            "actuator.cogging",
            "actuator.ripple",
            "actuator.saturation",
            "mechanics.compliance",
            "mechanics.inertia_change",
        ];
        let said = diagnosed(&drawn(seed, &[effect]), &accused).verdict;
        (said.kind, said.effects)
    };
    // The fifth line of a spectrum by power, as the first search weighs it; the simulator's own parameters had taken of it.
    let ripple = "actuator.ripple";
    assert_eq!(
        named(8964, ripple),
        (Kind::Effect, vec![ripple.to_string()])
    );
    // A sixth of the largest effort: where the drive gave no more the controller asked for ever more.
    let limit = "actuator.saturation";
    assert_eq!(named(8965, limit), (Kind::Effect, vec![limit.to_string()]));
}

#[test]
fn an_effect_is_fitted_from_what_was_believed_too() {
    // Without the lag the refit takes the bristles' damping ten standard deviations away; from there the lag stops at two thirds of its own.
    let there = "friction.lag";
    let accused = [there, "friction.nonlocal", "friction.presliding"];
    names_alone(&drawn(14116, &[there]), &accused, there);
}

#[test]
#[ignore = "takes minutes: cargo test -p bristle-gap --test diagnosis_again -- --ignored"]
fn a_lag_is_fitted_from_starts_that_promise_less_too() {
    // From the best start the fit stops at a third of the lag and explains half; that with the share of the reversals that comes out
    // promises two fifths of as much.
    let there = "friction.lag";
    names_alone(&drawn_with(14550, &[there], 1.0), &all(), there);
}

#[test]
#[ignore = "takes a minute: cargo test -p bristle-gap --test diagnosis_again -- --ignored"]
fn a_coupling_s_resonance_is_found_between_others() {
    // At the parameters of the refit no coupling promises anything: it has taken stiction for the load's own motion.
    let there = "mechanics.compliance";
    let accused = [
        "actuator.deadzone",
        "friction.lag",
        "friction.load",
        "mechanics.backlash",
        there,
    ];
    names_alone(&drawn(16001, &[there]), &accused, there);
}

#[test]
#[ignore = "takes minutes: cargo test -p bristle-gap --test diagnosis_again -- --ignored"]
fn a_coupling_that_swings_undamped_is_named() {
    // A Q of 80: open loop its load keeps every error for as many swings, and 1.8 times what is open is left.
    let there = "mechanics.compliance";
    let accused = [
        "actuator.lag",
        "mechanics.backlash",
        "sensor.lost_counts",
        there,
    ];
    names_alone(&drawn(17721, &[there]), &accused, there);
}

#[test]
fn a_coupling_is_looked_for_where_a_play_was_found() {
    // A Q of 33 at 138 Hz, where no coupling is tried; a play of half the smallest usual gap comes there.
    let there = "mechanics.compliance";
    let accused = ["mechanics.backlash", "friction.presliding", there];
    names_alone(&drawn(18403, &[there]), &accused, there);
}

#[test]
#[ignore = "takes minutes: cargo test -p bristle-gap --test diagnosis_again -- --ignored"]
fn the_load_behind_a_coupling_that_swings_undamped_is_found() {
    // A Q of 70: half of the load with a gain of 0.11 came as near as a fit from there goes.
    let there = "mechanics.compliance";
    let accused = ["actuator.gain", "friction.load", there];
    names_alone(&drawn(19705, &[there]), &accused, there);
}

#[test]
#[ignore = "takes minutes: cargo test -p bristle-gap --test diagnosis_again -- --ignored"]
fn a_play_is_looked_for_with_its_friction_on_either_side() {
    // Its coupling fits best with friction on the load, and explains next to nothing: neither is among the best effects.
    let there = "mechanics.backlash";
    let accused = ["friction.load", there, "mechanics.compliance"];
    names_alone(&drawn(20200, &[there]), &accused, there);
}

#[test]
#[ignore = "takes minutes: cargo test -p bristle-gap --test diagnosis_again -- --ignored"]
fn a_load_that_floats_in_a_play_is_followed_behind_a_motor_that_the_model_moves() {
    // Behind the measured motion true values leave 55466 weighted squares, no play 8080.
    let there = "mechanics.backlash";
    let accused = ["friction.presliding", there, "mechanics.compliance"];
    names_alone(&drawn(19921, &[there]), &accused, there);
}

#[test]
fn a_play_is_looked_for_behind_a_motor_that_the_model_moves_at_first() {
    // Behind the measured motion the coupling does better.
    let there = "mechanics.backlash";
    let accused = ["friction.presliding", there, "mechanics.compliance"];
    names_alone(&drawn(20107, &[there]), &accused, there);
}

#[test]
fn a_play_is_looked_for_among_usual_ones() {
    // About the coupling that fits best without one it is as good as rigid, and open loop no slope leads to what it is.
    let there = "mechanics.backlash";
    let accused = ["friction.presliding", there, "mechanics.compliance"];
    names_alone(&drawn(19704, &[there]), &accused, there);
}

#[test]
fn one_of_a_pair_that_does_as_well_alone_stands_for_both() {
    // Alone the fit stops at half its width; beside a limit that cuts nothing it comes to where it is.
    let there = "actuator.deadzone";
    names_alone(
        &drawn(31201, &[there]),
        &["actuator.saturation", there],
        there,
    );
}

#[test]
fn noise_of_the_sampling_that_pulls_the_inertia_is_no_second_effect() {
    // Positions read up to 0.6 ms off their time leave an inertia of 0.6, and something that warms up.
    let there = "sensor.jitter";
    let accused = ["actuator.delay", "friction.thermal", there];
    names_alone(&drawn(19713, &[there]), &accused, there);
}
