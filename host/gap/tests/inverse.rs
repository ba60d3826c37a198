//! What inverse dynamics leaves over of an axis that is exactly the model.

use bristle_gap::believed::Noise;
use bristle_gap::inverse::{Model, Record};
use bristle_gap::log::{Effort, EffortKind, Position, PositionKind};
use bristle_gap::signal::rms;
use bristle_gap::{AxisFile, Believed, Log, Unit};
use std::path::Path;

/// A fine encoder, and bristles on which the axis rings at 80 Hz: sqrt(20/8e-5)/(2 pi).
const AXIS: &str = "
[axis]
inertia_kg_m2 = 8e-5
counts_per_rev = 4000000
[friction]
model = \"elasto-plastic\"
coulomb_nm = 0.03
stiction_nm = 0.04
stribeck_velocity_rad_s = 1.0
stiffness_nm_rad = 20.0
damping_nm_s_rad = 0.01
viscous_nm_s_rad = 1e-4
breakaway_ratio = 0.7
";
const STEP_S: f64 = 2e-3;

/// Rests and break-aways, both ways.
fn torque_nm(k: usize) -> f64 {
    let (round, within) = (k / 250, k % 250);
    let way = if round.is_multiple_of(2) { 1.0 } else { -1.0 };
    if within < 100 {
        way * 0.05 * within as f64 / 100.0
    } else {
        0.0
    }
}

#[test]
fn break_aways_within_few_samples_are_followed() {
    let path = Path::new("axis.toml");
    let file = AxisFile::parse(AXIS, path).unwrap();
    let believed = Believed::new(&file, path).unwrap();
    let mut axis = believed
        .axis(believed.model, STEP_S, Noise::default(), 0)
        .unwrap()
        .starting_at(0.0, 0.0);
    let (mut efforts, mut positions) = (Vec::new(), Vec::new());
    for k in 0..5000 {
        positions.push(axis.reading().counts as f64 * believed.rad_per_count());
        efforts.push(torque_nm(k));
        axis.advance(torque_nm(k));
    }
    let log = Log::new(
        "break-away.csv",
        Unit::Rotary,
        (0..5000).map(|k| k as f64 * STEP_S).collect(),
        vec![Effort {
            kind: EffortKind::TorqueMeasured,
            values: efforts,
        }],
        Position {
            kind: PositionKind::Rad,
            values: positions,
        },
    );
    let records = [Record::new(&log, &file, &believed, &[]).unwrap()];
    let model = Model::base(&believed, &records, 0.15).unwrap();
    let left_over = model.left_over(&records, &model.start()).unwrap();
    let share = rms(left_over) / believed.coulomb_nm;
    // A motion smoothed over four samples leaves 0.33 of Coulomb friction over, friction at the end of each step 0.088.
    println!("{share:.3} of Coulomb friction");
    assert!(share < 0.085, "{share}");
}
