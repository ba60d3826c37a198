//! Inverse dynamics: the model is taken along the measured motion and says what torque is left over.
//!
//! Friction states, effects and a second inertia are driven by what the encoder saw, so that an error of one moment is
//! not carried into the next, and an evaluation costs one pass over the record.

use super::load::{Corrects, Load, Motor, leads_rad_s};
use super::record::{Record, Stretch};
use crate::signal::extent;
use bristle_plant::affected::{Affected, changed};
use bristle_plant::contact::{Contact, Levels};
use bristle_plant::drive::{Drive, DriveConfig};
use bristle_plant::effect::{Coupling, Effect, FELT_S, Instant, Plain};
use bristle_plant::mechanics::Motion;
use statrs::function::erf::erfc;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_PI};

/// An axis put together to be followed along one stretch.
pub struct Running {
    /// All of the inertia, kg m^2.
    pub inertia_kg_m2: f64,
    /// Friction without the effects.
    pub contact: Box<dyn Contact>,
    /// sigma0, where the friction has bristles: their load at the start is that of the effort, N m/rad.
    pub stiffness_nm_rad: Option<f64>,
    /// The load behind a spring that the axis is believed to have.
    pub coupling: Option<Coupling>,
    /// The drive, where the effort is a reference; its lag, where torque runs within a sample as that says.
    pub drive: DriveConfig,
    /// Constant torque beside the effort, N m.
    pub offset_nm: f64,
    /// Effects between the drive and the axis.
    pub effects: Vec<Box<dyn Effect>>,
    /// Makes the effects of the sensor anew, where there are any.
    pub sensors: Option<MakeSensors>,
    /// How much later than recorded the effort acts, samples.
    pub skew_samples: f64,
    /// The effort is taken as so many times what was recorded.
    pub times: f64,
    /// Speed that noise on the rotor gives bristles which drift under it, rms, rad/s.
    pub shaken_rad_s: f64,
    /// What corrects a load behind a spring.
    pub corrects: Option<Corrects>,
}

/// Effort on its way to the axis: through the recorder's skew, and through the drive where it is a reference.
struct Arriving {
    later: Later,
    drive: Option<Drive>,
    commanded: bool,
    step_s: f64,
    keeps: f64,
    /// See [`Drive::late_part`].
    late_part: f64,
    /// Torque that a position lacks at the end of the sample beside its mean throughout, N m.
    late_nm: f64,
    /// By how much more than at its start: what a node between two samples lacks of their mean, N m.
    lacks_nm: f64,
}

impl Arriving {
    fn new(record: &Record, config: DriveConfig, skew_samples: f64) -> Self {
        let (drive, step_s) = (Drive::new(config), record.step_s);
        Self {
            later: Later::new(skew_samples),
            keeps: drive.keeps(step_s),
            late_part: drive.late_part(step_s),
            drive: (record.commanded || config.lag_s > 0.0).then_some(drive),
            commanded: record.commanded,
            step_s,
            late_nm: 0.0,
            lacks_nm: 0.0,
        }
    }

    /// Mean during sample `k`, of so many times what was recorded, N m; sample after sample.
    fn next(&mut self, stretch: &Stretch, k: usize, times: f64) -> f64 {
        let effort_nm = times * self.later.at(&stretch.effort_nm, k);
        let Some(drive) = &mut self.drive else {
            return effort_nm;
        };
        let start_nm = drive.torque_nm();
        drive.accept(if self.commanded {
            effort_nm
        } else {
            drive.reference_for(effort_nm, self.step_s, self.keeps)
        });
        let mean_nm = drive.advance(self.step_s, self.keeps);
        let late_nm = self.late_part * (drive.torque_nm() - start_nm);
        self.lacks_nm = late_nm - self.late_nm;
        self.late_nm = late_nm;
        mean_nm
    }
}

/// Appends the effort at each node of a stretch as it arrives at the axis, of so many times what was recorded, N m.
pub fn arriving(
    record: &Record,
    stretch: &Stretch,
    drive: DriveConfig,
    skew_samples: f64,
    times: f64,
    out: &mut Vec<f64>,
) {
    let mut arriving = Arriving::new(record, drive, skew_samples);
    let arrivals: Vec<(f64, f64)> = (0..stretch.effort_nm.len() - 1)
        .map(|k| (arriving.next(stretch, k, times), arriving.lacks_nm))
        .collect();
    let mut nodes = arrivals
        .windows(2)
        .map(|pair| 0.5 * (pair[0].0 + pair[1].0) - pair[1].1)
        .collect();
    record.kernel.apply(&mut nodes, out);
}

/// Makes effects of a sensor: each round of undoing them starts from their beginning.
pub type MakeSensors = Box<dyn Fn() -> Vec<Box<dyn Effect>>>;

/// Rounds of undoing a sensor's error; each leaves the error's slope times what the one before left.
const SENSOR_ROUNDS: usize = 3;

/// Where the friction that the model itself has along a motion comes from, before effects change it. Where effects have
/// changed the contact or its motion, and where torque decides since it holds at rest, it is always made anew.
pub enum Rubbing<'a> {
    /// From the contact.
    Anew,
    /// From the contact, and that of each sample is put here, N m.
    Kept(&'a mut [f64]),
    /// As it was kept: for an axis with the same contact.
    Known(&'a [f64]),
}

impl<'a> Rubbing<'a> {
    /// The same once more.
    pub fn again(&mut self) -> Rubbing<'_> {
        match self {
            Self::Anew => Rubbing::Anew,
            Self::Kept(kept_nm) => Rubbing::Kept(kept_nm),
            Self::Known(known_nm) => Rubbing::Known(known_nm),
        }
    }

    /// After the pass that kept it.
    pub fn known(self) -> Self {
        match self {
            Self::Kept(kept_nm) => Self::Known(kept_nm),
            other => other,
        }
    }

    /// Takes that of the first so many samples.
    pub fn split_off(&mut self, samples: usize) -> Self {
        match std::mem::replace(self, Self::Anew) {
            Self::Anew => Self::Anew,
            Self::Kept(kept_nm) => {
                let (first, rest) = kept_nm.split_at_mut(samples);
                *self = Self::Kept(rest);
                Self::Kept(first)
            }
            Self::Known(known_nm) => {
                let (first, rest) = known_nm.split_at(samples);
                *self = Self::Known(rest);
                Self::Known(first)
            }
        }
    }
}

/// Appends what torque is left over at each node of a stretch, N m.
pub fn left_over(
    record: &Record,
    stretch: &Stretch,
    mut running: Running,
    mut rubbing: Rubbing<'_>,
    out: &mut Vec<f64>,
) {
    let step_s = record.step_s;
    let intervals = stretch.effort_nm.len() - 1;
    let corrected = running
        .sensors
        .as_ref()
        .map(|make| undo_sensor(stretch, step_s, make));
    let stretch_motion = corrected.as_ref().unwrap_or(stretch);
    let (measured, smooth, velocity) = (
        &stretch_motion.position_rad,
        &stretch_motion.smooth_rad,
        &stretch_motion.velocity_rad_s,
    );
    let inertia = running.inertia_kg_m2;
    let mut contact = running.contact;
    let mut coupling = running.coupling;
    let plain = Plain {
        inertia_kg_m2: inertia,
        levels: Levels::of(contact.as_ref()),
    };
    let of_model: *const dyn Contact = contact.as_ref();
    for effect in &mut running.effects {
        effect.begin(&plain);
        contact = effect.contact(contact);
        coupling = effect.coupling(inertia).or(coupling);
    }
    let on_motor = coupling.is_none_or(|coupling| coupling.friction_on_motor);
    let of_model = std::ptr::addr_eq(of_model, std::ptr::from_ref(contact.as_ref()));
    let held_nm = if on_motor { 0.0 } else { stretch.effort_nm[0] };
    let bristles_nm_rad = running.stiffness_nm_rad.unwrap_or(0.0);
    let mut load = coupling.map(|coupling| {
        Load::new(
            coupling,
            inertia,
            bristles_nm_rad,
            held_nm,
            step_s,
            running.corrects,
            Motor {
                position_rad: smooth[0],
                velocity_rad_s: velocity[0],
                leads_rad_s: leads_rad_s(
                    plain.levels.coulomb_nm / inertia,
                    record.position_noise_rad,
                    step_s,
                ),
            },
        )
    });
    let edge_rad_s = load.as_ref().map(|_| at_edges(smooth, velocity, step_s));
    let mut contact = Affected::of_means(contact, &running.effects);
    let as_measured = of_model && on_motor && corrected.is_none() && !contact.levelled();
    if let Some(stiffness) = running.stiffness_nm_rad {
        contact.bear(stretch.effort_nm[0], stiffness, step_s);
    }
    let holds = contact.holds_at_rest();
    let rest_rad_s = record.rest_velocity_rad_s();
    let mut arriving = Arriving::new(record, running.drive, running.skew_samples);
    let per = inertia / (step_s * step_s);
    let mut nodes = Vec::with_capacity(intervals);
    let mut interval_before: Option<(f64, f64)> = None;
    let mut before_rad_s = 0.0;
    let mut felt_nm: Option<f64> = None;
    let mut rubbed_nm = stretch.effort_nm[0];
    let still_felt = (-step_s / FELT_S).exp();
    for k in 0..intervals {
        let mut v = (smooth[k + 1] - smooth[k]) / step_s;
        // A jump of the encoder bends no bristles.
        if stretch.jumps.contains(&k) {
            v = before_rad_s;
        }
        before_rad_s = v;
        if holds && v.abs() < rest_rad_s {
            v = 0.0;
        }
        let position_rad = 0.5 * (smooth[k] + smooth[k + 1]);
        let acceleration = (velocity[k + 1] - velocity[k]) / step_s;
        let (load_position_rad, load_velocity_rad_s) =
            load.as_ref().map_or((position_rad, v), |load| {
                (position_rad - load.twist_rad, v - load.twisting_rad_s)
            });
        let effort = arriving.next(stretch, k, running.times);
        let mut now = Instant {
            time_s: stretch.start_s + (k as f64 + 0.5) * step_s,
            step_s,
            motion: Motion {
                position_rad,
                velocity_rad_s: v,
                load_position_rad,
                load_velocity_rad_s,
            },
            acceleration_rad_s2: acceleration,
            torque_nm: effort,
        };
        for effect in &mut running.effects {
            now.torque_nm = effect.actuator(&now);
        }
        let mut torque = now.torque_nm + running.offset_nm;
        let mut share = 1.0;
        for effect in &mut running.effects {
            torque += effect.mechanics(&now);
            share *= effect.inertia(&now);
        }
        let accelerates_nm = share * inertia * acceleration;
        let motor_rad_s2 = edge_rad_s
            .as_ref()
            .map_or(acceleration, |v| (v[k + 1] - v[k]) / step_s);
        let driven_rad_s2 = |load: &Load| {
            let rubs_nm = if on_motor { rubbed_nm } else { 0.0 };
            load.driven_rad_s2(torque - rubs_nm, [smooth[k], velocity[k]], motor_rad_s2)
        };
        let driven_rad_s2 = load.as_ref().map_or(motor_rad_s2, driven_rad_s2);
        if let Some(load) = load.as_mut().filter(|_| on_motor) {
            torque -= load.advance(&now, driven_rad_s2, motor_rad_s2, |_, _| 0.0);
            now.motion.load_position_rad = position_rad;
            now.motion.load_velocity_rad_s = v;
        }
        // What was measured is a mean over samples, which a torque that jumps is not.
        if load.is_none()
            && let Some(felt_nm) = felt_nm
        {
            now.acceleration_rad_s2 = (torque - felt_nm) / (share * inertia);
        }
        let opposed = if as_measured && !(holds && v == 0.0) {
            let own_nm = match &rubbing {
                Rubbing::Known(known_nm) => known_nm[k],
                _ => contact.step(&mut [], &now, torque - accelerates_nm),
            };
            if let Rubbing::Kept(kept_nm) = &mut rubbing {
                kept_nm[k] = own_nm;
            }
            changed(&mut running.effects, &now, own_nm)
        } else if let Some(load) = load.as_mut().filter(|_| !on_motor) {
            load.advance(&now, driven_rad_s2, motor_rad_s2, |now, applied_nm| {
                contact.step(&mut running.effects, now, applied_nm)
            })
        } else {
            contact.step(&mut running.effects, &now, torque - accelerates_nm)
        };
        let shakes_rad_s = beyond_mean(v, running.shaken_rad_s);
        if let Some(stiffness) = running.stiffness_nm_rad.filter(|_| shakes_rad_s > 0.0) {
            contact.slip(shakes_rad_s * step_s, v, stiffness);
        }
        let before_nm = felt_nm.unwrap_or(opposed);
        felt_nm = Some(opposed + still_felt * (before_nm - opposed));
        rubbed_nm = opposed;
        let balance = torque - opposed;
        if let Some((balance_before, share_before)) = interval_before.replace((balance, share)) {
            let bend = measured[k + 1] - 2.0 * measured[k] + measured[k - 1];
            let lacks_nm = 0.5 * (balance_before + balance)
                - arriving.lacks_nm
                - 0.5 * (share_before + share) * per * bend;
            if let Some(load) = &mut load {
                load.correct(lacks_nm);
            }
            nodes.push(lacks_nm);
        }
    }
    let stays = |stiffness| stays_within(smooth, plain.levels.coulomb_nm / stiffness);
    if running.stiffness_nm_rad.is_some_and(stays) {
        without_mean(&mut nodes);
    }
    record.kernel.apply(&mut nodes, out);
}

/// Whether a motion stays within so much.
fn stays_within(smooth_rad: &[f64], most_rad: f64) -> bool {
    let (low, high) = extent(smooth_rad);
    high - low < most_rad
}

/// What bristles bore at the start is known to a part of a count, and to the noise of a sample. Where they never bend anew all of that stays in the
/// balance, where nothing tells it from an offset.
fn without_mean(balance_nm: &mut [f64]) {
    let mean = balance_nm.iter().sum::<f64>() / balance_nm.len().max(1) as f64;
    for nm in balance_nm {
        *nm -= mean;
    }
}

/// By how much the mean speed is more than that of the mean velocity where white noise shakes it, rad/s.
fn beyond_mean(velocity_rad_s: f64, rms_rad_s: f64) -> f64 {
    let times = velocity_rad_s.abs() / rms_rad_s;
    // A Gaussian beyond five of its widths is of the other sign once in three million.
    if rms_rad_s == 0.0 || times > 5.0 {
        return 0.0;
    }
    let density = (-0.5 * times * times).exp() * FRAC_2_PI.sqrt();
    rms_rad_s * (density - times * erfc(times * FRAC_1_SQRT_2))
}

/// Velocity at each sample of a motion that goes so far between samples, by cubic interpolation of that; where there is no room,
/// as it is. A load behind a spring resonates within few samples, over which the mean of two intervals is flattened.
fn at_edges(smooth_rad: &[f64], velocity_rad_s: &[f64], step_s: f64) -> Vec<f64> {
    let mut edges = velocity_rad_s.to_vec();
    for k in 2..smooth_rad.len().saturating_sub(2) {
        let near = smooth_rad[k + 1] - smooth_rad[k - 1];
        let far = smooth_rad[k + 2] - smooth_rad[k - 2];
        edges[k] = (8.0 * near - far) / (12.0 * step_s);
    }
    edges
}

/// Where the sensor would have to be for its effects to show what was recorded.
fn undo_sensor(stretch: &Stretch, step_s: f64, make: &dyn Fn() -> Vec<Box<dyn Effect>>) -> Stretch {
    let mut truth = stretch.smooth_rad.clone();
    for round in 0..SENSOR_ROUNDS {
        let mut sensors = make();
        // Round after round an error that grows with what came before would be undone by one step more.
        let mut error_before = 0.0;
        truth = truth
            .iter()
            .zip(&stretch.smooth_rad)
            .zip(&stretch.velocity_rad_s)
            .enumerate()
            .map(|(k, ((&at, &seen), &velocity_rad_s))| {
                let at = if round == 0 { at + error_before } else { at };
                let mut now = Instant {
                    time_s: stretch.start_s + k as f64 * step_s,
                    step_s,
                    ..Instant::default()
                };
                now.motion.position_rad = at;
                now.motion.velocity_rad_s = velocity_rad_s;
                for sensor in &mut sensors {
                    now.motion.position_rad = sensor.sensor(&now);
                }
                error_before = at - now.motion.position_rad;
                seen + error_before
            })
            .collect();
    }
    let error: Vec<f64> = truth
        .iter()
        .zip(&stretch.smooth_rad)
        .map(|(t, s)| t - s)
        .collect();
    let slope = crate::signal::derivative(&error, step_s);
    let plus = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect();
    Stretch {
        position_rad: plus(&stretch.position_rad, &error),
        velocity_rad_s: plus(&stretch.velocity_rad_s, &slope),
        smooth_rad: truth,
        ..Stretch::default()
    }
}

/// A signal that acts later by a part of a sample, or several.
pub struct Later {
    whole: isize,
    part: f64,
}

impl Later {
    /// By so many samples.
    pub fn new(samples: f64) -> Self {
        let whole = samples.floor();
        Self {
            whole: whole as isize,
            part: samples - whole,
        }
    }

    /// The value that acts during sample `k`; before its start a signal is as at its start.
    pub fn at(&self, values: &[f64], k: usize) -> f64 {
        let last = values.len() as isize - 1;
        let value = |k: isize| values[k.clamp(0, last) as usize];
        let k = k as isize - self.whole;
        (1.0 - self.part) * value(k) + self.part * value(k - 1)
    }
}
