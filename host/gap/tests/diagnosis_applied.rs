//! The loop closes: what a diagnosis writes simulates the axis better, and cancels what can be cancelled.

mod common;

use bristle_core::experiment::Experiment;
use bristle_gap::axis_file::EffectEntry;
use bristle_gap::believed::Noise;
use bristle_gap::diagnose::{Kind, next};
use bristle_gap::experiments::Named;
use bristle_gap::feed_forward::Table;
use bristle_gap::inverse::{Model, Record};
use bristle_gap::plan::Plan;
use bristle_gap::signal::rms;
use bristle_gap::simulate::{Input, simulate};
use bristle_gap::{AxisFile, Believed, Log};
use bristle_plant::rig::Rig;
use common::{diagnosed, effect, logs_of};
use std::path::Path;

const ROTARY: &str = "[axis]\ninertia_kg_m2 = 1e-4\ncounts_per_rev = 65536\n[friction]\nmodel = \"elasto-plastic\"\n\
    coulomb_nm = 0.02\nstiction_nm = 0.022\nstribeck_velocity_rad_s = 1.0\nstiffness_nm_rad = 20\n\
    damping_nm_s_rad = 0.02\nviscous_nm_s_rad = 0.001\n[drive]\ntorque_limit_nm = 0.2\nspeed_limit_rad_s = 40\n\
    [observer]\nrate_hz = 2000\n";

const LINEAR: &str = "[axis]\nmass_kg = 4\ncounts_per_m = 2e6\n[friction]\nmodel = \"elasto-plastic\"\n\
    coulomb_n = 10\nstiction_n = 11\nstribeck_velocity_m_s = 0.02\nstiffness_n_m = 2e6\ndamping_n_s_m = 2000\n\
    viscous_n_s_m = 40\n[drive]\nforce_limit_n = 100\nspeed_limit_m_s = 1\n[observer]\nrate_hz = 2000\n";

/// Effects that stand for the catalogue: the whole of it takes minutes on a small machine.
const ACCUSED: [&str; 5] = [
    "actuator.cogging",
    "actuator.lag",
    "friction.asymmetry",
    "mechanics.offset",
    "sensor.eccentricity",
];

/// The axis without the effect, slightly wrong, and logs of the axis with it.
fn case(text: &str, there: &EffectEntry, noise_nm: f64) -> (AxisFile, Vec<Log>) {
    let path = Path::new("axis.toml");
    let mut truth = AxisFile::parse(text, path).unwrap();
    truth.effects.push(there.clone());
    let experiments = [(Named::Ladder, 6.0), (Named::Reversals, 4.0)];
    let logs = logs_of(&truth, &experiments, noise_nm);
    let mut axis = AxisFile::parse(text, path).unwrap();
    axis.axis.inertia *= 1.05;
    axis.friction.coulomb = axis.friction.coulomb.map(|x| 1.04 * x);
    (axis, logs)
}

/// Effort that an axis file leaves over along the logs, while they move: nothing is fitted.
fn left_over_nm(axis: &AxisFile, logs: &[Log]) -> f64 {
    let believed = Believed::new(axis, Path::new("axis.toml")).unwrap();
    let records: Vec<Record> = logs
        .iter()
        .map(|log| Record::new(log, axis, &believed, &[]).unwrap())
        .collect();
    let mut model = Model::base(&believed, &records, 0.1).unwrap();
    model.free.clear();
    let rest = model.left_over(&records, &[]).unwrap();
    let nodes =
        bristle_gap::diagnose::nodes(&records, believed.coulomb_nm / believed.stiffness_nm_rad);
    let moves = |node: &bristle_gap::diagnose::Node| {
        !node.excluded && node.regime != bristle_gap::diagnose::Regime::Rest
    };
    rms(rest
        .iter()
        .zip(&nodes)
        .filter(|(_, n)| moves(n))
        .map(|(r, _)| *r))
}

/// Rms of the position that an axis file makes of the measured effort, against the log.
fn free_run_rad(axis: &AxisFile, log: &Log) -> f64 {
    let believed = Believed::new(axis, Path::new("axis.toml")).unwrap();
    let made = simulate(
        &Input::Log(log),
        axis,
        &believed,
        Noise::default(),
        1,
        |_| (),
    )
    .unwrap();
    rms(made
        .position_rad
        .iter()
        .zip(&log.position.values)
        .map(|(a, b)| a - b))
}

#[test]
fn an_applied_file_leaves_what_the_diagnosis_says() {
    let folder = tempfile::tempdir().unwrap();
    for (text, there, noise_nm) in [
        (
            ROTARY,
            effect(
                "actuator.cogging",
                &[
                    ("amplitude_nm", 0.004),
                    ("order_per_rev", 12.0),
                    ("phase_rad", 0.4),
                ],
            ),
            2e-4,
        ),
        (
            ROTARY,
            effect("friction.asymmetry", &[("share", 0.25)]),
            2e-4,
        ),
        (
            ROTARY,
            effect("mechanics.offset", &[("torque_nm", 0.006)]),
            2e-4,
        ),
        (
            LINEAR,
            effect("friction.asymmetry", &[("share", 0.25)]),
            0.1,
        ),
    ] {
        let (axis, logs) = case(text, &there, noise_nm);
        let outcome = diagnosed(&axis, &logs, &ACCUSED);
        let diagnosis = &outcome.diagnosis;
        assert!(
            diagnosis.verdict.effects.contains(&there.id),
            "{}: {:?}",
            there.id,
            diagnosis.verdict
        );
        let applied = outcome.applied(&axis);
        let path = folder.path().join("applied.toml");
        applied
            .axis
            .write_under(&applied.provenance, &path)
            .unwrap();
        let again = AxisFile::read(&path).unwrap();
        assert_eq!(again, applied.axis);
        assert!(
            std::fs::read_to_string(&path)
                .unwrap()
                .starts_with("# logs: ")
        );
        let (before, after) = (left_over_nm(&axis, &logs), left_over_nm(&again, &logs));
        let stated = diagnosis.gap.after;
        println!(
            "{}: {before:.3e} to {after:.3e}, stated {stated:.3e}",
            there.id
        );
        // The stated figure is of data left out of the fit, this one is not; the fitted skew of the recorder, some
        // hundredths of a sample, has no place in an axis file.
        assert!(
            (after / stated - 1.0).abs() < 0.15,
            "{}: {after} against {stated}",
            there.id
        );
        assert!(after < 0.6 * before, "{}: {before} to {after}", there.id);
        let run = [&axis, &again].map(|file| free_run_rad(file, &logs[0]));
        println!("{}: free run {:.3e} to {:.3e}", there.id, run[0], run[1]);
        // Without the offset an axis runs away, with it it stays; a free run is too touchy at rest to promise more.
        assert!(run[1] < run[0], "{}: free run {run:?}", there.id);
    }
}

#[test]
fn feed_forward_of_the_named_effect_follows_closer() {
    for there in [
        effect(
            "actuator.cogging",
            &[
                ("amplitude_nm", 0.006),
                ("order_per_rev", 12.0),
                ("phase_rad", 0.4),
            ],
        ),
        effect("mechanics.offset", &[("torque_nm", 0.008)]),
        effect("friction.asymmetry", &[("share", 0.3)]),
    ] {
        let (axis, logs) = case(ROTARY, &there, 2e-4);
        let outcome = diagnosed(&axis, &logs, &ACCUSED);
        let path = Path::new("axis.toml");
        let applied = Believed::new(&outcome.applied(&axis).axis, path).unwrap();
        let table = Table::new(&applied, [-10.0, 10.0]).unwrap().unwrap();
        let mut clean = AxisFile::parse(ROTARY, path).unwrap();
        // An integral would hide a constant torque, and hunt at reversals whatever is fed forward.
        clean.control.velocity_integral_1_s = Some(0.0);
        let mut truth = clean.clone();
        truth.effects.push(there.clone());
        let [clean, real] = [clean, truth].map(|file| Believed::new(&file, path).unwrap());
        let step_s = 1.0 / real.rate_hz;
        let experiment = Experiment::Reversals {
            amplitude_rad: 1.0,
            period_ticks: 4000,
        };
        let path_rad = |axis: &Believed, table: Option<&Table>| -> Vec<f64> {
            let tick = clean.tick::<f64>(step_s).unwrap();
            let axis = axis.axis(axis.model, step_s, Noise::default(), 1).unwrap();
            let mut rig = Rig::new(tick, axis, experiment);
            if let Some(table) = table {
                rig = rig.with_feed_forward(table.for_control().unwrap());
            }
            (0..8000)
                .map(|_| rig.advance().truth.motion.position_rad)
                .collect()
        };
        let mut player = bristle_core::experiment::Player::new(experiment, step_s);
        let wanted: Vec<f64> = (0..8000)
            .map(|_| match player.next_tick() {
                bristle_core::experiment::Reference::Position { position_rad, .. } => position_rad,
                _ => 0.0,
            })
            .collect();
        let apart = |a: &[f64], b: &[f64]| rms(a.iter().zip(b).map(|(a, b)| a - b));
        let [plain, without, with] = [
            path_rad(&clean, None),
            path_rad(&real, None),
            path_rad(&real, Some(&table)),
        ];
        let [of_plain, before, after] = [&plain, &without, &with].map(|q| apart(q, &wanted));
        println!(
            "{}: {before:.3e} to {after:.3e} rad, {of_plain:.3e} without it",
            there.id
        );
        assert!(after < before, "{}: {before} to {after}", there.id);
        // A tenth or so of an effect is left by the fit, and the blend of directions leaves some about each reversal.
        let (far, near) = (apart(&without, &plain), apart(&with, &plain));
        assert!(near < 0.4 * far, "{}: {far} to {near}", there.id);
    }
}

#[test]
fn a_tie_brings_a_plan_that_can_be_played() {
    // A constant force and friction that differs by direction look alike where all the axis does is slide.
    let there = effect("mechanics.offset", &[("torque_nm", 0.006)]);
    let (axis, logs) = case(ROTARY, &there, 2e-4);
    let mut outcome = diagnosed(&axis, &logs, &ACCUSED);
    // Sure, or held against another answer.
    let sure = outcome.verdict.kind == Kind::Effect && outcome.verdict.probability > 0.75;
    assert_eq!(next(&outcome, &axis).unwrap().is_none(), sure);
    let place = |id: &str| {
        let found = outcome
            .verdict
            .ranked
            .iter()
            .position(|(h, _)| h.ids() == [id]);
        found.unwrap_or_else(|| panic!("{id} was not fitted"))
    };
    let pair = vec![place("mechanics.offset"), place("friction.asymmetry")];
    outcome.verdict.kind = Kind::Ambiguous;
    outcome.verdict.named = pair;
    let proposal = next(&outcome, &axis).unwrap().unwrap();
    println!("{:?}", proposal.said);
    let plan = proposal.plan.unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plan.toml");
    let believed = Believed::new(&axis, Path::new("axis.toml")).unwrap();
    plan.write(&path, &believed).unwrap();
    assert_eq!(Plan::read(&path, &believed).unwrap(), plan);
    // An effect against itself leaves nothing.
    let same = outcome.verdict.named[0];
    outcome.verdict.named = vec![same, same];
    let none = next(&outcome, &axis).unwrap().unwrap();
    assert!(none.plan.is_none(), "{:?}", none.said);
    // Parameters alone are held against the best effect while they are unsure.
    outcome.verdict.kind = Kind::Parameters;
    outcome.verdict.named = Vec::new();
    outcome.verdict.probability = 0.3;
    let against = next(&outcome, &axis).unwrap().unwrap();
    let best = outcome.verdict.ranked[0].0.ids().join(" + ");
    let says = format!("the plain simulator and {best}");
    assert!(against.said.why.contains(&says), "{:?}", against.said);
    outcome.verdict.kind = Kind::Unknown;
    assert!(next(&outcome, &axis).unwrap().is_none());
}
