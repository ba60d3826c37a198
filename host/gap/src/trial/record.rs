//! A task played on a virtual axis, and the log of it.

use super::dice::Dice;
use super::experiments::{Script, Task};
use super::plant::Plant;
use crate::believed::{Believed, Noise};
use crate::error::InputError;
use crate::log::{Effort, EffortKind, Log, Position, PositionKind};
use bristle_core::control::{Cascade, FIFTH, State};

/// Speed beyond which an axis has run away, as a multiple of what was planned.
const RUN_AWAY: f64 = 4.0;

/// Plays a task on the axis that is truly there. None: the loop is not stable on it, or torque alone made it run away.
///
/// # Errors
/// A parameter out of range.
pub fn record(
    plant: &Plant,
    truth: &Believed,
    task: &Task,
    place: usize,
    seed: u64,
) -> Result<Option<Log>, InputError> {
    let step_s = plant.step_s;
    let mut dice = Dice::new(seed, 100 + place as u64);
    let noise = Noise {
        torque_nm: plant.rotor_noise_nm,
        position_rad: 0.0,
    };
    let mut axis = truth.axis(truth.model, step_s, noise, dice.seed())?;
    let rad_per_count = truth.rad_per_count();
    let bandwidth = plant.bandwidth_rad_s;
    let loop_ = Cascade::new(
        FIFTH * bandwidth,
        plant.axis.axis.inertia * bandwidth,
        FIFTH * bandwidth,
        truth.torque_limit_nm(),
        step_s,
    )
    .map_err(|error| InputError::new(plant_name(seed), error.to_string(), "draw another axis"))?;
    let mut state = State::default();
    // The drive's estimate of speed: differences of counts through a first-order filter well above the loop.
    let passes = 1.0 - (-4.0 * bandwidth * step_s).exp();
    let mut speed_rad_s = 0.0;
    let mut last_rad = 0.0;
    let mut script = Script::new(task, step_s);
    let mut torques = Vec::with_capacity(task.samples);
    let mut counts = Vec::with_capacity(task.samples);
    for _ in 0..task.samples {
        let reading = axis.reading().counts;
        let position_rad = reading as f64 * rad_per_count;
        speed_rad_s += passes * ((position_rad - last_rad) / step_s - speed_rad_s);
        last_rad = position_rad;
        let (reference, added_nm) = script.next();
        let asked = loop_.step(&mut state, reference, position_rad, speed_rad_s);
        axis.advance(asked + added_nm);
        let truth = axis.truth();
        let speed = truth.motion.velocity_rad_s.abs();
        if speed.is_nan() || speed > RUN_AWAY * plant.top_speed_rad_s {
            return Ok(None);
        }
        torques.push(truth.torque_nm + plant.measured_noise_nm * dice.normal());
        counts.push(reading as f64);
    }
    let (kind, unit) = if plant.in_counts {
        (PositionKind::Counts, 1.0)
    } else {
        let kind = match truth.unit {
            crate::Unit::Rotary => PositionKind::Rad,
            crate::Unit::Linear => PositionKind::M,
        };
        (kind, rad_per_count)
    };
    Ok(Some(Log::new(
        format!("{}-{place}-{}", plant_name(seed), task.name),
        truth.unit,
        (0..task.samples).map(|k| k as f64 * step_s).collect(),
        vec![Effort {
            kind: EffortKind::TorqueMeasured,
            values: torques,
        }],
        Position {
            kind,
            values: counts.iter().map(|count| count * unit).collect(),
        },
    )))
}

/// What a trial is called in errors and reports.
pub fn plant_name(seed: u64) -> String {
    format!("trial-{seed}")
}
