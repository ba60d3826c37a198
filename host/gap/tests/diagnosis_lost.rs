//! Counts that an encoder loses are steps of the position: named, taken out, and what else is missing is found beside.

mod common;
mod trials;

use bristle_gap::diagnose::Kind;
use bristle_gap::experiments::Named;
use bristle_gap::{AxisFile, Log};
use common::{diagnosed, effect, logs_of};
use std::path::Path;
use trials::drawn;

const AXIS: &str = "[axis]\ninertia_kg_m2 = 4.9e-5\ncounts_per_rev = 8192\n[friction]\nmodel = \"elasto-plastic\"\n\
    coulomb_nm = 0.0303\nstiction_nm = 0.045\nstribeck_velocity_rad_s = 0.49\nstiffness_nm_rad = 1.46\n\
    damping_nm_s_rad = 4.9e-3\nviscous_nm_s_rad = 1.1e-4\nbreakaway_ratio = 0.7\n[drive]\ntorque_limit_nm = 0.2\nspeed_limit_rad_s = 40\n\
    [observer]\nrate_hz = 1000\n";
const COUNT_RAD: f64 = std::f64::consts::TAU / 8192.0;
const EXPERIMENTS: [(Named, f64); 2] = [(Named::Sine, 5.0), (Named::Moves, 12.0)];
const ACCUSED: [&str; 4] = [
    "sensor.lost_counts",
    "mechanics.spring",
    "mechanics.compliance",
    "friction.load",
];

fn axis() -> AxisFile {
    AxisFile::parse(AXIS, Path::new("axis.toml")).unwrap()
}

/// Loses 30 counts each time 0.2 rad is passed upward while it moves faster than a count a sample.
fn losing(mut log: Log) -> (Log, usize) {
    let q = log.position.values.clone();
    let passes: Vec<usize> = (1..q.len())
        .filter(|&k| q[k - 1] < 0.2 && q[k] >= 0.2 && q[k] - q[k - 1] > COUNT_RAD)
        .collect();
    for &k in &passes {
        for value in &mut log.position.values[k..] {
            *value -= 30.0 * COUNT_RAD;
        }
    }
    (log, passes.len())
}

/// Verdict, and how much is lost, and whether it is given back.
fn named(truth: &AxisFile) -> (Kind, Vec<String>, [f64; 2]) {
    let logs = logs_of(truth, &EXPERIMENTS, 3e-4);
    let (logs, lost): (Vec<Log>, Vec<usize>) = logs.into_iter().map(losing).unzip();
    assert!(lost.iter().sum::<usize>() >= 2, "{lost:?}");
    let diagnosis = diagnosed(&axis(), &logs, &ACCUSED).diagnosis;
    let candidate = diagnosis
        .candidates
        .iter()
        .find(|candidate| candidate.effect == ACCUSED[0])
        .unwrap();
    let parameters = &candidate.parameters;
    (
        diagnosis.verdict.kind,
        diagnosis.verdict.effects,
        [parameters["lost_rad"], parameters["given_back"]],
    )
}

#[test]
fn lost_counts_are_named_with_their_size() {
    let (kind, effects, [lost_rad, given_back]) = named(&axis());
    assert_eq!(
        (kind, &effects[..]),
        (Kind::Effect, &[ACCUSED[0].into()][..])
    );
    println!("{:.2} counts", lost_rad / COUNT_RAD);
    // Rounding of the four positions next to a step leaves a count and a half.
    assert!((lost_rad / COUNT_RAD - 30.0).abs() < 1.5, "{lost_rad}");
    assert_eq!(given_back, 0.0);
}

#[test]
fn a_spring_is_found_beside_them() {
    let mut truth = axis();
    let values = [("stiffness_nm_rad", 0.004), ("rest_rad", 0.0)];
    truth.effects.push(effect("mechanics.spring", &values));
    let (kind, effects, _) = named(&truth);
    assert_eq!(kind, Kind::Effects);
    assert_eq!(effects, [ACCUSED[0], ACCUSED[1]]);
}

#[test]
fn where_none_are_lost_none_are_named() {
    let logs = logs_of(&axis(), &EXPERIMENTS, 3e-4);
    let verdict = diagnosed(&axis(), &logs, &ACCUSED).diagnosis.verdict;
    assert_eq!(verdict.kind, Kind::None, "{verdict:?}");
}

#[test]
fn a_few_at_a_place_and_a_moment_are_found_beside_another_effect() {
    // Two and seven um on a scale of 0.1 um: effort could have moved the axis as far, so that no step shows by itself. A fit that counted
    // on the slope of their place went nowhere once another effect was added.
    let there = ["friction.load", ACCUSED[0]];
    let mut said = trials::diagnosed(&drawn(11606, &there), &ACCUSED)
        .verdict
        .effects;
    said.sort_unstable();
    assert_eq!(said, there);
}

#[test]
fn steps_no_larger_than_effort_could_make_are_named_by_their_one_place() {
    // Nine of 1.8e-3 rad in each of two logs.
    let said = trials::diagnosed(&drawn(19714, &[ACCUSED[0]]), &ACCUSED);
    assert_eq!(said.verdict.effects, [ACCUSED[0]]);
}

#[test]
fn a_step_that_does_not_tell_hides_no_others() {
    // Eighteen counts of rest, which effort could have moved, and six at a place of each turn, which no step shows.
    let said = trials::diagnosed(&drawn(34001, &[ACCUSED[0]]), &ACCUSED);
    assert_eq!(said.verdict.effects, [ACCUSED[0]]);
}
