//! The simulated axis under a given input: a torque, measured or commanded, or a position reference in closed loop.

use crate::axis_file::AxisFile;
use crate::believed::{Believed, Noise};
use crate::error::InputError;
use crate::experiments::Named;
use crate::log::{Effort, EffortKind, Log, Position};
use crate::signal::{derivative, interpolate, means, samples};
use bristle_core::experiment::{Player, Reference};
use bristle_plant::Unit;
use bristle_plant::drive::DriveConfig;
use std::path::Path;

/// What drives a simulation.
pub enum Input<'a> {
    /// A file read by [`Log::read_input`].
    Log(&'a Log),
    /// A built-in experiment for so many seconds, at the observers' rate.
    Experiment(Named, f64),
}

/// A simulated record, even in time. A linear axis reads m for rad and N for N m.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Simulated {
    /// What was done to the input's times, for the user.
    pub timing: String,
    /// s
    pub time_s: Vec<f64>,
    /// Mean torque on the rotor until the next sample.
    pub torque_nm: Vec<f64>,
    /// Torque reference, where the input was one or the loop made one.
    pub torque_ref_nm: Option<Vec<f64>>,
    /// Position reference, where there was one.
    pub position_ref_rad: Option<Vec<f64>>,
    /// Position as the encoder reads it.
    pub position_rad: Vec<f64>,
    /// True velocity.
    pub velocity_rad_s: Vec<f64>,
    /// True bristle deflection.
    pub z_rad: Vec<f64>,
    /// True friction.
    pub friction_nm: Vec<f64>,
}

impl Simulated {
    /// The log that a recorder with a torque sensor would have made of it.
    pub fn log(self, unit: Unit, file: &Path) -> Log {
        Log {
            position_ref: self.position_ref_rad,
            ..Log::new(
                file,
                unit,
                self.time_s,
                vec![Effort {
                    kind: EffortKind::TorqueMeasured,
                    values: self.torque_nm,
                }],
                Position::of(unit, self.position_rad),
            )
        }
    }
}

/// Torque for each sample, or a reference for the loop.
enum Drive {
    Measured(Vec<f64>),
    Commanded(Vec<f64>),
    Loop(Vec<Reference<f64>>),
}

/// Simulates. `progress` is called with the share done.
///
/// # Errors
/// Input and axis file do not fit, or a number is out of range.
pub fn simulate(
    input: &Input<'_>,
    axis: &AxisFile,
    believed: &Believed,
    noise: Noise,
    seed: u64,
    mut progress: impl FnMut(f64),
) -> Result<Simulated, InputError> {
    let (mut out, drive, step_s) = prepare(input, axis, believed)?;
    let mut virtual_axis = {
        let mut believed = believed.clone();
        if matches!(drive, Drive::Measured(_)) {
            // A measured torque is what the drive put out.
            believed.drive = DriveConfig::default();
        }
        believed.axis(believed.model, step_s, noise, seed)?
    };
    let start = match input {
        Input::Log(log) if log.position.values.is_empty() => 0.0,
        Input::Log(log) => log.position_rad(axis)?[0],
        Input::Experiment(..) => 0.0,
    };
    virtual_axis = virtual_axis.starting_at(start, 0.0);
    let count = believed.rad_per_count();
    let origin = virtual_axis.reading();
    let mut controller = match &drive {
        Drive::Loop(_) => {
            let tick = believed.tick::<f64>(step_s)?;
            let state = tick.start(origin.raw());
            Some((tick, state))
        }
        _ => None,
    };
    let samples = out.time_s.len();
    for k in 0..samples {
        let reading = virtual_axis.reading();
        let truth = virtual_axis.truth();
        if !truth.motion.position_rad.is_finite() {
            return Err(believed.diverged(truth.time_s));
        }
        let torque = match &drive {
            Drive::Measured(torque) | Drive::Commanded(torque) => torque[k],
            Drive::Loop(references) => controller.as_mut().map_or(0.0, |(tick, state)| {
                tick.follow(state, reading.raw(), references[k])
                    .torque_ref_nm
            }),
        };
        virtual_axis.advance(torque);
        if let Some(references) = &mut out.torque_ref_nm {
            references.push(torque);
        }
        out.torque_nm.push(virtual_axis.truth().torque_nm);
        out.position_rad.push(reading.counts as f64 * count);
        out.velocity_rad_s.push(truth.motion.velocity_rad_s);
        out.z_rad.push(truth.z_rad);
        out.friction_nm.push(truth.friction_nm);
        if k % 4096 == 0 {
            progress(k as f64 / samples as f64);
        }
    }
    Ok(out)
}

/// Even times, what drives each sample, and the sample time.
fn prepare(
    input: &Input<'_>,
    axis: &AxisFile,
    believed: &Believed,
) -> Result<(Simulated, Drive, f64), InputError> {
    match input {
        Input::Experiment(named, seconds) => {
            let rate_hz = believed.rate_hz;
            let samples = samples(*seconds, rate_hz)?;
            let mut player = Player::new(named.experiment::<f64>(believed, rate_hz), 1.0 / rate_hz);
            let references: Vec<_> = (0..samples).map(|_| player.next_tick()).collect();
            let positions: Option<Vec<f64>> = references
                .iter()
                .map(|reference| match reference {
                    Reference::Position { position_rad, .. } => Some(*position_rad),
                    _ => None,
                })
                .collect();
            let out = Simulated {
                timing: format!("{samples} samples at {rate_hz} Hz"),
                time_s: (0..samples).map(|k| k as f64 / rate_hz).collect(),
                torque_ref_nm: Some(Vec::new()),
                position_ref_rad: positions,
                ..Simulated::default()
            };
            Ok((out, Drive::Loop(references), 1.0 / rate_hz))
        }
        Input::Log(log) => {
            let step_s = log.median_step_s();
            let (time_s, timing) = if log.is_uniform() {
                (
                    log.time_s.clone(),
                    format!("{} samples at {:.6} Hz", log.len(), 1.0 / step_s),
                )
            } else {
                let span = log.time_s[log.len() - 1] - log.time_s[0];
                let samples = samples(span + step_s, 1.0 / step_s)?;
                let even: Vec<f64> = (0..samples)
                    .map(|k| log.time_s[0] + k as f64 * step_s)
                    .collect();
                let words = format!(
                    "the input is uneven in time and was brought to {:.6} Hz",
                    1.0 / step_s
                );
                (even, words)
            };
            let mut out = Simulated {
                timing,
                time_s,
                ..Simulated::default()
            };
            if log.efforts.is_empty() {
                log.unit_on(axis)?;
                let positions = log.position_ref.as_deref().unwrap_or_default();
                let positions = interpolate(&log.time_s, positions, &out.time_s);
                let velocities = derivative(&positions, step_s);
                let first = positions[0];
                let references = positions
                    .iter()
                    .zip(&velocities)
                    .map(|(position, &velocity_rad_s)| Reference::Position {
                        position_rad: position - first,
                        velocity_rad_s,
                    })
                    .collect();
                out.position_ref_rad = Some(positions);
                out.torque_ref_nm = Some(Vec::new());
                return Ok((out, Drive::Loop(references), step_s));
            }
            let kind = log.best_effort(axis)?.kind;
            let torque = means(&log.time_s, &log.effort_nm(axis)?, &out.time_s, step_s);
            let drive = match kind {
                EffortKind::TorqueMeasured | EffortKind::Current => Drive::Measured(torque),
                EffortKind::TorqueReference | EffortKind::Voltage => {
                    out.torque_ref_nm = Some(Vec::new());
                    Drive::Commanded(torque)
                }
            };
            Ok((out, drive, step_s))
        }
    }
}
