//! A record that a known axis would have left: the axis is simulated with the same efforts and led along the measured
//! motion by what moves it back to it, and that is recorded as effort too. What the method makes of it is the method's own
//! doing: coarse positions and smoothing, and noise where it is asked for.

use super::record::Record;
use crate::axis_file::AxisFile;
use crate::believed::{Believed, Noise};
use crate::error::InputError;
use crate::log::{Effort, EffortKind, Log, Position};
use crate::sensor::shown_on;
use crate::signal::interpolate;
use bristle_plant::drive::{Drive, DriveConfig};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::path::PathBuf;

/// Bandwidth of what leads a twin along the measured motion, rad/s.
const LEADS: f64 = 125.0;
/// Steps in a sample at most. A stiff effect asks for up to a thousand, where a step moves its fastest rate by a fiftieth; with a fifth the
/// axis stays with the motion, and a node sees the mean of many.
const MOST_STEPS: u32 = 100;

/// The records of such an axis, each along the longest stretch of one of these, with so many times that one's noise on the rotor and of the
/// measured effort; each with a seed of its own from the first on.
///
/// # Errors
/// The friction model refuses the parameters, or the axis does not stay with the motion.
pub fn twins(
    axis: &Believed,
    records: &[Record],
    noise_times: f64,
    first_seed: u64,
) -> Result<Vec<Record>, InputError> {
    records
        .par_iter()
        .enumerate()
        .map(|(place, record)| twin(axis, record, noise_times, first_seed + place as u64))
        .collect()
}

/// The twin of one record.
fn twin(
    axis: &Believed,
    record: &Record,
    noise_times: f64,
    seed: u64,
) -> Result<Record, InputError> {
    let log = log_of(axis, record, noise_times, seed)?;
    let file = AxisFile::new(axis.unit, 1.0);
    let position = log.position_rad(&file)?;
    let step_s = log.median_step_s();
    let sensor = shown_on(
        record.sensor.grid_rad,
        &position,
        step_s,
        axis.rad_per_count(),
    );
    // Without noise it would be seen through a longer one, in which errors of single moments average out.
    let twin = Record::of_sensor(&log, &file, axis, &[], sensor)?;
    Ok(Record {
        shakes_nm: noise_times * record.shakes_nm,
        ..twin.seen_through(record.kernel)
    })
}

/// Acceleration that leads a simulated motion, which is so far off and so much too slow, along a measured one, rad/s^2: critically damped, with this bandwidth
/// in rad/s.
pub(super) fn leads_rad_s2(bandwidth_rad_s: f64, off_rad: f64, off_rad_s: f64) -> f64 {
    bandwidth_rad_s * bandwidth_rad_s * off_rad + 2.0 * bandwidth_rad_s * off_rad_s
}

fn log_of(
    axis: &Believed,
    record: &Record,
    noise_times: f64,
    seed: u64,
) -> Result<Log, InputError> {
    let noise_nm = noise_times * record.sample_noise_nm();
    let mut axis = axis.clone();
    let file = PathBuf::from(&record.name);
    let step_s = record.log_step_s;
    if !record.commanded {
        // A longer lag is the twin's where the method tells it, too; else torque is as good as its mean within a sample.
        let lag_s = axis.drive.lag_s;
        axis.drive = DriveConfig {
            lag_s: if lag_s < step_s {
                lag_s
            } else {
                record.lag_within_s(axis.drive)
            },
            ..DriveConfig::default()
        };
    }
    let mut drive = Drive::new(axis.drive);
    let keeps = drive.keeps(step_s);
    let empty = || InputError::new(&file, "has no stretch to simulate", "record for longer");
    let stretch = record
        .stretches
        .iter()
        .max_by_key(|stretch| stretch.effort_nm.len())
        .ok_or_else(empty)?;
    let samples = stretch.effort_nm.len() * record.averaged;
    let time_s: Vec<f64> = (0..samples).map(|k| k as f64 * step_s).collect();
    let edges = |late: f64| -> Vec<f64> {
        (0..stretch.effort_nm.len())
            .map(|k| (k as f64 + late) * record.step_s)
            .collect()
    };
    let coarse = edges(0.0);
    // Means of the effort hold in their middles; between them the drive goes on from one to the next.
    let acts_s: Vec<f64> = time_s.iter().map(|t| t + 0.5 * step_s).collect();
    let acts = interpolate(&edges(0.5), &stretch.effort_nm, &acts_s);
    // A count is read from its lower edge on: what rests is on average in its middle.
    let middle: Vec<f64> = stretch
        .smooth_rad
        .iter()
        .map(|q| q + 0.5 * record.rad_per_count)
        .collect();
    let position = interpolate(&coarse, &middle, &time_s);
    let velocity = interpolate(&coarse, &stretch.velocity_rad_s, &time_s);
    let inertia = axis.whole_inertia_kg_m2();
    let noise = Noise {
        torque_nm: noise_times * record.rotor_noise_nm * (record.averaged as f64).sqrt(),
        position_rad: 0.0,
    };
    let mut simulated = axis
        .axis(axis.model, step_s, noise, seed)?
        .in_at_most(MOST_STEPS)
        .starting_at(position[0], velocity[0]);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let coarser = record.rad_per_count > 1.01 * axis.rad_per_count();
    let (mut efforts, mut positions) = (Vec::new(), Vec::new());
    for k in 0..samples {
        let motion = simulated.truth().motion;
        let lead = leads_rad_s2(
            LEADS,
            position[k] - motion.position_rad,
            velocity[k] - motion.velocity_rad_s,
        );
        let reference = if record.commanded {
            acts[k]
        } else {
            drive.reference_for(acts[k], step_s, keeps)
        };
        let effort = reference + inertia * lead;
        let read_rad = simulated.reading().counts as f64 * axis.rad_per_count();
        positions.push(if coarser {
            (read_rad / record.rad_per_count).floor() * record.rad_per_count
        } else {
            read_rad
        });
        simulated.advance(effort);
        drive.accept(effort);
        drive.advance(step_s, keeps);
        let noise: f64 = StandardNormal.sample(&mut random);
        let recorded_nm = if record.commanded {
            effort
        } else {
            simulated.truth().torque_nm
        };
        efforts.push(recorded_nm + noise_nm * noise);
    }
    if positions.iter().chain(&efforts).any(|x| !x.is_finite()) {
        return Err(axis.diverged(time_s[samples - 1]));
    }
    Ok(Log::new(
        file,
        axis.unit,
        time_s,
        vec![Effort {
            kind: if record.commanded {
                EffortKind::TorqueReference
            } else {
                EffortKind::TorqueMeasured
            },
            values: efforts,
        }],
        Position::of(axis.unit, positions),
    ))
}
