//! A play as wide as its flanks give way is told from a coupling without one, and the coupling from a play.

mod common;

use bristle_gap::AxisFile;
use bristle_gap::diagnose::Kind;
use bristle_gap::experiments::Named;
use common::{diagnosed, effect, logs_of};
use std::path::Path;

const AXIS: &str = "[axis]\nmass_kg = 4.38\ncounts_per_m = 50000000\n[friction]\nmodel = \"elasto-plastic\"\n\
    coulomb_n = 8.45\nstiction_n = 10.5\nstribeck_velocity_m_s = 9.9e-3\nstiffness_n_m = 1.15e6\n\
    damping_n_s_m = 1540\nviscous_n_s_m = 5.6\nbreakaway_ratio = 0.75\n[drive]\nforce_limit_n = 60\nspeed_limit_m_s = 0.3\n\
    [observer]\nrate_hz = 1000\n";
const EXPERIMENTS: [(Named, f64); 2] = [(Named::Multisine, 5.0), (Named::Sine, 5.0)];
const PLAY: &str = "mechanics.backlash";
const COUPLING: &str = "mechanics.compliance";
/// With a share of 0.44 behind it: sqrt(k/(J s (1 - s))) at 161 Hz.
const COMPLIANCE_M_N: f64 = 9e-7;

/// What is named, and its first parameter.
fn named(id: &str, values: &[(&str, f64)]) -> (Vec<String>, f64) {
    let axis = AxisFile::parse(AXIS, Path::new("axis.toml")).unwrap();
    let mut truth = axis.clone();
    truth.effects.push(effect(id, values));
    let logs = logs_of(&truth, &EXPERIMENTS, 0.1);
    let diagnosis = diagnosed(&axis, &logs, &[PLAY, COUPLING, "friction.lag"]).diagnosis;
    assert_eq!(diagnosis.verdict.kind, Kind::Effect);
    let found = &diagnosis.candidates[0].parameters;
    println!("{:?} {found:?}", diagnosis.verdict.effects);
    (diagnosis.verdict.effects, found[values[0].0])
}

#[test]
fn a_play_is_told_from_a_coupling() {
    let gap_m = 2e-6;
    let (effects, found_m) = named(
        PLAY,
        &[
            ("gap_m", gap_m),
            ("load_share", 0.44),
            ("frequency_hz", 220.0),
            ("damping_ratio", 0.15),
        ],
    );
    assert_eq!(effects, [PLAY]);
    // The flanks give way by 4 um under friction, twice the play, and resonate within five samples: what of it is play is told
    // to a factor.
    assert!((0.5..2.0).contains(&(found_m / gap_m)), "{found_m}");
}

#[test]
fn a_coupling_is_no_play() {
    let (effects, found) = named(
        COUPLING,
        &[
            ("compliance_m_n", COMPLIANCE_M_N),
            ("load_share", 0.44),
            ("damping_ratio", 0.1),
        ],
    );
    assert_eq!(effects, [COUPLING]);
    // Six samples to a period of it flatten its peaks by some percent, and the share behind it makes up for a stiffness.
    assert!((found / COMPLIANCE_M_N - 1.0).abs() < 0.25, "{found}");
}
