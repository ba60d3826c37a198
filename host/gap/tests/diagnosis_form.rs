//! An effect in another form than the catalogue's is that effect, and what does not act as it does is not.

mod common;

use bristle_gap::AxisFile;
use bristle_gap::axis_file::EffectEntry;
use bristle_gap::diagnose::{Diagnosis, Kind};
use bristle_gap::experiments::Named;
use common::{diagnosed, effect, logs_of};
use std::path::Path;

const AXIS: &str = "[axis]\ninertia_kg_m2 = 1e-4\ncounts_per_rev = 65536\n[friction]\nmodel = \"elasto-plastic\"\n\
    coulomb_nm = 0.02\nstiction_nm = 0.022\nstribeck_velocity_rad_s = 1.0\nstiffness_nm_rad = 20\n\
    damping_nm_s_rad = 0.02\nviscous_nm_s_rad = 0.001\n[drive]\ntorque_limit_nm = 0.2\nspeed_limit_rad_s = 40\n\
    [observer]\nrate_hz = 2000\n";

/// What is said of an axis with all of these, of a few effects.
fn said(there: Vec<EffectEntry>) -> Diagnosis {
    let path = Path::new("axis.toml");
    let axis = AxisFile::parse(AXIS, path).unwrap();
    let mut truth = axis.clone();
    truth.effects = there;
    let logs = logs_of(
        &truth,
        &[(Named::Ladder, 6.0), (Named::Reversals, 4.0)],
        3e-3,
    );
    let accused = ["friction.lag", "friction.position", "mechanics.offset"];
    diagnosed(&axis, &logs, &accused).diagnosis
}

/// Friction that varies once a turn.
fn tight_spot() -> EffectEntry {
    effect(
        "friction.position",
        &[("amplitude_share", 0.3), ("order_per_rev", 1.0)],
    )
}

#[test]
fn harmonics_of_a_wave_are_fitted_with_it() {
    let shares = [("second_cosine_share", 0.25), ("third_sine_share", -0.12)];
    let mut spot = tight_spot();
    let with = |(name, share): (&str, f64)| (name.to_string(), share);
    spot.parameters.extend(shares.map(with));
    let said = said(vec![spot]);
    assert_eq!(
        (said.verdict.kind, &said.verdict.effects[..]),
        (Kind::Effect, &["friction.position".to_string()][..])
    );
    let found = &said.candidates[0].parameters;
    println!("{found:?}");
    for (name, share) in shares {
        // A twentieth of the wave, whose own amplitude comes out to a hundredth.
        assert!((found[name] - share).abs() < 0.05, "{name}: {found:?}");
    }
}

#[test]
fn friction_over_position_is_named_though_it_is_no_sine() {
    // The catalogue fits two and three times a wave with it.
    let harmonic = effect(
        "friction.position",
        &[
            ("amplitude_share", 0.1),
            ("order_per_rev", 5.0),
            ("phase_rad", 1.0),
        ],
    );
    let said = said(vec![tight_spot(), harmonic]);
    assert_eq!(
        (said.verdict.kind, &said.verdict.effects[..]),
        (Kind::Effect, &["friction.position".to_string()][..])
    );
    assert!(
        said.notes.iter().any(|note| note.contains("another form")),
        "{:?}",
        said.notes
    );
}

#[test]
fn a_torque_over_position_beside_it_is_no_form_of_it() {
    let cogging = effect(
        "actuator.cogging",
        &[
            ("amplitude_nm", 0.0012),
            ("order_per_rev", 3.0),
            ("phase_rad", 1.0),
        ],
    );
    assert_eq!(
        said(vec![tight_spot(), cogging]).verdict.kind,
        Kind::Unknown
    );
}
