//! Simulated logs of the built-in experiments, as a drive would record them.

use bristle_gap::believed::{Believed, Noise};
use bristle_gap::experiments::Named;
use bristle_gap::log::{Effort, EffortKind, Position};
use bristle_gap::simulate::{Input, simulate};
use bristle_gap::{AxisFile, Log};
use std::path::Path;

/// A small servo motor whose friction is slow enough for an observer at 500 Hz; the gain follows the rate.
pub fn rotary(rate_hz: f64, bits: u32) -> AxisFile {
    let text = format!(
        "[axis]\ninertia_kg_m2 = 3.1e-4\ncounts_per_rev = {}\n[friction]\ncoulomb_nm = 0.08\nstiction_nm = 0.10\n\
         stribeck_velocity_rad_s = 0.5\nstiffness_nm_rad = 30.0\ndamping_nm_s_rad = 0.05\nviscous_nm_s_rad = 0.002\n\
         [observer]\nrate_hz = {rate_hz}\nl1_1_s = {}\n",
        1_u32 << bits,
        // Below it the observer's error would not die out where friction falls with speed.
        (0.1 * rate_hz).max(150.0)
    );
    AxisFile::parse(&text, Path::new("axis.toml")).unwrap()
}

/// A ball-screw carriage with a stiff controller.
pub fn linear(rate_hz: f64) -> AxisFile {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes/emps.toml");
    let mut axis = AxisFile::read(path).unwrap();
    axis.axis.counts_per_turn = Some(1e6);
    axis.observer.rate_hz = Some(rate_hz);
    axis.observer.l1_1_s = None;
    axis.control.velocity_gain = axis
        .control
        .velocity_gain
        .map(|gain| gain * (rate_hz / 1e3).min(1.0));
    axis.control.position_gain_1_s = Some(40.0);
    axis
}

/// A record of an experiment; torque noise as a share of F_C.
pub fn record(axis: &AxisFile, named: Named, seconds: f64, noise: f64, seed: u64) -> Log {
    let believed = Believed::new(axis, Path::new("axis.toml")).unwrap();
    let noise = Noise {
        torque_nm: noise * believed.coulomb_nm,
        position_rad: 0.0,
    };
    let input = Input::Experiment(named, seconds);
    let simulated = simulate(&input, axis, &believed, noise, seed, |_| ())
        .unwrap_or_else(|error| panic!("{named:?}: {error}"));
    let mut efforts = vec![Effort {
        kind: EffortKind::TorqueMeasured,
        values: simulated.torque_nm,
    }];
    efforts.extend(simulated.torque_ref_nm.map(|values| Effort {
        kind: EffortKind::TorqueReference,
        values,
    }));
    Log {
        position_ref: simulated.position_ref_rad,
        ..Log::new(
            "log.csv",
            axis.unit,
            simulated.time_s,
            efforts,
            Position::of(axis.unit, simulated.position_rad),
        )
    }
}
