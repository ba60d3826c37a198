//! What inverse dynamics leaves over of an axis that is exactly the model.

use bristle_gap::believed::Noise;
use bristle_gap::inverse::{Added, Model, Record};
use bristle_gap::log::{Effort, EffortKind, Position, PositionKind};
use bristle_gap::signal::rms;
use bristle_gap::{AxisFile, Believed, Log, Unit};
use bristle_plant::effect;
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
const SAMPLES: usize = 5000;

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

/// An axis from this text, at rest, and a log of the efforts that it is given.
fn recorded(text: &str, torque_nm: impl Fn(usize) -> f64) -> (AxisFile, Believed, Log) {
    let path = Path::new("axis.toml");
    let file = AxisFile::parse(text, path).unwrap();
    let believed = Believed::new(&file, path).unwrap();
    let mut axis = believed
        .axis(believed.model, STEP_S, Noise::default(), 0)
        .unwrap()
        .starting_at(0.0, 0.0);
    let (mut efforts, mut positions) = (Vec::new(), Vec::new());
    for k in 0..SAMPLES {
        positions.push(axis.reading().counts as f64 * believed.rad_per_count());
        axis.advance(torque_nm(k));
        efforts.push(axis.truth().torque_nm);
    }
    let log = Log::new(
        "log.csv",
        Unit::Rotary,
        (0..SAMPLES).map(|k| k as f64 * STEP_S).collect(),
        vec![Effort {
            kind: EffortKind::TorqueMeasured,
            values: efforts,
        }],
        Position {
            kind: PositionKind::Rad,
            values: positions,
        },
    );
    (file, believed, log)
}

#[test]
fn break_aways_within_few_samples_are_followed() {
    let (file, believed, log) = recorded(AXIS, torque_nm);
    let records = [Record::new(&log, &file, &believed, &[]).unwrap()];
    let model = Model::base(&believed, &records, 0.15).unwrap();
    let left_over = model.left_over(&records, &model.start()).unwrap();
    let share = rms(left_over) / believed.coulomb_nm;
    // A motion smoothed over four samples leaves 0.33 of Coulomb friction over, friction at the end of each step 0.088.
    println!("{share:.3} of Coulomb friction");
    assert!(share < 0.085, "{share}");
}

/// What an axis from this text leaves over of records, nothing fitted.
fn left_over_nm(text: &str, records: &[Record]) -> Vec<f64> {
    let path = Path::new("axis.toml");
    let believed = Believed::new(&AxisFile::parse(text, path).unwrap(), path).unwrap();
    let mut model = Model::base(&believed, records, 0.15).unwrap();
    model.free.clear();
    model.left_over(records, &[]).unwrap()
}

#[test]
fn torque_runs_within_a_sample_as_the_drive_lags() {
    let text = format!("{AXIS}[drive]\nlag_s = 6e-4\n");
    // Sliding one way and the other: a step of 0.2 N m every 0.2 s.
    let torque_nm = |k: usize| {
        if (k / 100).is_multiple_of(2) {
            0.1
        } else {
            -0.1
        }
    };
    let (file, believed, log) = recorded(&text, torque_nm);
    let records = [Record::new(&log, &file, &believed, &[]).unwrap()];
    let [with, without] = [text.as_str(), AXIS].map(|text| {
        let at_steps = |node: usize| (records[0].middle(node) + 3) % 100 < 6;
        let left_over = left_over_nm(text, &records).into_iter().enumerate();
        let at_steps = left_over.filter(|(node, _)| at_steps(*node));
        at_steps.fold(0.0, |most: f64, (_, r)| most.max(r.abs()))
    });
    println!("{without:.3e} N m at most where it steps without the lag, {with:.3e} with it");
    // Of a step the second difference of positions lacks 0.068, and has it too much a sample later: through three running means of
    // three samples 3/27 of it is left.
    assert!(
        (without / (0.068 * 0.2 * 3.0 / 27.0) - 1.0).abs() < 0.2,
        "{without:e}"
    );
    assert!(with < 0.1 * without, "{with:e}");
}

#[test]
fn an_old_reading_is_a_late_torque() {
    let delayed = |id: &str| format!("{AXIS}[[effect]]\nid = \"{id}\"\ndelay_s = 5e-3\n");
    // Swinging at 2 Hz, twice the break-away torque.
    let torque_nm = |k| 0.08 * (std::f64::consts::TAU * 2.0 * k as f64 * STEP_S).sin();
    let (file, believed, log) = recorded(&delayed("sensor.delay"), torque_nm);
    let records = [Record::new(&log, &file, &believed, &[]).unwrap()];
    let without = left_over_nm(AXIS, &records);
    let [as_late, as_old] =
        ["actuator.delay", "sensor.delay"].map(|id| left_over_nm(&delayed(id), &records));
    assert_eq!(as_late, as_old);
    let (before, after) = (rms(without), rms(as_old));
    println!("{before:.3e} N m without the delay, {after:.3e} with it");
    // A torque that swings at 2 Hz is 0.08 * 2 pi 2/s * 5 ms = 5 mN m off by it.
    assert!(before > 2e-3 && after < 0.3 * before, "{before} {after}");
}

#[test]
fn inertia_is_the_same_whoever_brings_it() {
    let (file, believed, log) = recorded(AXIS, torque_nm);
    let records = [Record::new(&log, &file, &believed, &[]).unwrap()];
    let own = left_over_nm(AXIS, &records);
    // A quarter of it, and three times as much again from the start on.
    let quarter = AXIS.replace("inertia_kg_m2 = 8e-5", "inertia_kg_m2 = 2e-5");
    let effect = "id = \"mechanics.inertia_change\"\nshare = 3.0\nstart_s = -1.0\n";
    let brought = left_over_nm(&format!("{quarter}[[effect]]\n{effect}"), &records);
    let apart = own.iter().zip(&brought).map(|(a, b)| a - b);
    // The sum of the same numbers in another order.
    assert!(rms(apart) < 1e-9 * rms(own.iter().copied()));
}

/// Whether an effect changes how much effort arrives on an axis whose friction holds at rest, of efforts that it is given.
fn changes_gain(torque_nm: impl Fn(usize) -> f64, id: &str, name: &str, value: f64) -> bool {
    let holding = AXIS.replace("elasto-plastic", "stribeck");
    let (file, believed, log) = recorded(&holding, torque_nm);
    let records = [Record::new(&log, &file, &believed, &[]).unwrap()];
    let mut model = Model::base(&believed, &records, 0.15).unwrap();
    let parameters = [(name.to_owned(), value)].into();
    let (entry, values) = effect::values(id, &parameters, Unit::Rotary).unwrap();
    model.effects.push(Added { entry, values });
    (model.gains(&records[..1], &model.start()).unwrap()[0] - 1.0).abs() > 0.01
}

#[test]
fn what_friction_holds_at_rest_is_no_loss_of_effort() {
    assert!(!changes_gain(
        torque_nm,
        "friction.position",
        "amplitude_share",
        1e-3
    ));
    assert!(changes_gain(torque_nm, "actuator.gain", "share", 0.1));
}

#[test]
fn a_load_that_rubs_behind_a_coupling_is_followed() {
    // 0.2 rad/N m between halves of the inertia: 80 Hz, sqrt(5/2e-5)/(2 pi).
    let coupling = "[[effect]]\nid = \"mechanics.compliance\"\ncompliance_rad_nm = 0.2\nload_share = 0.5\n\
        damping_ratio = 0.03\nfriction_on_motor = 0\n";
    let text = format!("{AXIS}{coupling}");
    // Swinging at 3 and at 17 Hz, now and then beyond break-away.
    let swing = |hz: f64, k: usize| (std::f64::consts::TAU * hz * k as f64 * STEP_S).sin();
    let torque_nm = |k| 0.03 * swing(3.0, k) + 0.02 * swing(17.0, k);
    let (file, believed, log) = recorded(&text, torque_nm);
    let records = [Record::new(&log, &file, &believed, &[]).unwrap()];
    let [with, without] = [text.as_str(), AXIS].map(|text| rms(left_over_nm(text, &records)));
    println!("{without:.3e} N m without the coupling, {with:.3e} with it");
    // Friction by the velocity at the start of each step left 0.26 of it.
    assert!(with < 0.2 * without, "{with:e} {without:e}");
}
