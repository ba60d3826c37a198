//! An effect smaller than what a coarse encoder leaves open of the torque is named where it gains more than on records without it.

mod common;

use bristle_gap::AxisFile;
use bristle_gap::diagnose::Kind;
use bristle_gap::experiments::Named;
use common::{diagnosed, effect, logs_of};
use std::path::Path;

const AXIS: &str = "[axis]\ninertia_kg_m2 = 4.9e-5\ncounts_per_rev = 4096\n[friction]\nmodel = \"lugre\"\n\
    coulomb_nm = 0.0303\nstiction_nm = 0.045\nstribeck_velocity_rad_s = 0.49\nstiffness_nm_rad = 1.46\n\
    damping_nm_s_rad = 4.9e-3\nviscous_nm_s_rad = 1.1e-4\n[drive]\ntorque_limit_nm = 0.2\nspeed_limit_rad_s = 40\n\
    [observer]\nrate_hz = 1000\n";
const ACCUSED: [&str; 3] = ["actuator.deadzone", "friction.load", "friction.lag"];

/// The verdict, its effects, and the nats that the best one gains above what is open.
fn diagnosis_of(width_nm: Option<f64>) -> (Kind, Vec<String>, f64) {
    let axis = AxisFile::parse(AXIS, Path::new("axis.toml")).unwrap();
    let mut truth = axis.clone();
    if let Some(width_nm) = width_nm {
        let values = [("width_nm", width_nm), ("jump_share", 0.5)];
        truth.effects.push(effect("actuator.deadzone", &values));
    }
    let experiments = [Named::BreakAway, Named::Sine, Named::Multisine];
    // A hundredth of Coulomb friction as noise.
    let logs = logs_of(&truth, &experiments.map(|named| (named, 5.0)), 3e-4);
    let outcome = diagnosed(&axis, &logs, &ACCUSED);
    let search = &outcome.search;
    let gained = search.single[0].score - search.base.score;
    println!("{:?} by {gained:.1} nats", outcome.diagnosis.verdict);
    (
        outcome.verdict.kind,
        outcome.diagnosis.verdict.effects,
        gained,
    )
}

#[test]
fn a_dead_zone_below_what_is_open_is_named() {
    let (kind, effects, gained) = diagnosis_of(Some(1.4e-3));
    assert_eq!(
        (kind, effects),
        (Kind::Effect, vec!["actuator.deadzone".to_string()])
    );
    // Above what is open nothing is accused for less.
    assert!(gained < 20.0, "{gained}");
}

#[test]
fn without_one_nothing_is() {
    let (kind, effects, _) = diagnosis_of(None);
    assert_eq!((kind, effects), (Kind::None, Vec::new()));
}
