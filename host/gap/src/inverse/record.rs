//! A log prepared for inverse dynamics: even stretches of effort and smoothed motion, at some 2 kHz at most.

use super::kernel::{EFFORT, Kernel, SECOND_DIFFERENCE};
use super::motion::{position_noise_rad, resting_on_edges, shortest_path, smooth};
use crate::axis_file::AxisFile;
use crate::believed::Believed;
use crate::error::InputError;
use crate::log::{EffortKind, Log};
use crate::sensor::{Shown, shown};
use crate::signal::{interpolate, means, rms, rms_by_median};
use bristle_plant::drive::DriveConfig;
use std::ops::Range;

/// Faster logs are averaged down to this: nothing that this method tells apart happens within half a millisecond.
const FASTEST_HZ: f64 = 2500.0;
/// Longest kernel: three running means of 9 ms see a break-away of some 10 ms.
const LONGEST_KERNEL_S: f64 = 0.009;
/// Bristles that bend over fewer counts than these follow the shortest path rather than every count: what the path does not
/// know, half a count at a turn, is then less than what an encoder makes that trembles on an edge. On a finer one the
/// path's error outweighs the noise of counts, which averages out.
const COARSE: f64 = 20.0;
/// A count in this time, or less, is rest, s.
const REST_S: f64 = 0.02;
/// A count in this time, or less, is as good as none, s.
const STILL_S: f64 = 0.1;
/// Shortest stretch between gaps that is used, s.
const SHORTEST_S: f64 = 0.25;
/// Where no one should fit, what is so many times as fast as the axis was elsewhere is no motion.
const JUMPS: f64 = 2.0;
/// A lag of up to so many samples is told from the means of its torque, by a kernel of one sample and by a longer one: their noise comes out
/// alternating, which a longer one takes away, and half a sample adds less than a fifth.
const TOLD_LAG: [f64; 2] = [0.5, 2.5];
/// Noise of the acceleration may be this part of Coulomb friction, or as much as the effort's own noise.
const ACCELERATION_NOISE: f64 = 0.005;

/// A log, ready to be followed. A linear axis reads m for rad and N for N m.
#[derive(Clone, Debug)]
pub struct Record {
    /// Name of the log.
    pub name: String,
    /// Length of a sample, s.
    pub step_s: f64,
    /// Length of a sample of the log, s.
    pub log_step_s: f64,
    /// Samples of the log in one that was averaged over.
    pub averaged: usize,
    /// The effort is what was asked of the drive, not what it gave.
    pub commanded: bool,
    /// Stretches between gaps.
    pub stretches: Vec<Stretch>,
    /// What the balance is seen through.
    pub kernel: Kernel,
    /// Noise of position after averaging, without that of the clock, rad rms.
    pub position_noise_rad: f64,
    /// Noise of effort after averaging, N m rms, as its second differences show it.
    pub effort_noise_nm: f64,
    /// Torque noise on the rotor that the effort does not show, N m rms a sample, where it is known.
    pub rotor_noise_nm: f64,
    /// Torque noise on the rotor that bristles drift by, which may be in the effort, too, N m rms a sample, where it is known.
    pub shakes_nm: f64,
    /// Travel of a count as the axis file says it, or of the grid that the positions show if that is coarser, rad.
    pub rad_per_count: f64,
    /// What the positions say of their sensor.
    pub sensor: Shown,
    /// What its nodes lack of what is left over in shorter samples, N m; empty where it was not made [coarser](super::coarser).
    pub lacks_nm: Vec<f64>,
}

/// An even stretch without gaps; one entry a sample.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    /// Time of its first sample, s from the log's start.
    pub start_s: f64,
    /// Mean effort until the next sample, N m.
    pub effort_nm: Vec<f64>,
    /// Measured position, rad.
    pub position_rad: Vec<f64>,
    /// Smoothed position, rad.
    pub smooth_rad: Vec<f64>,
    /// Smoothed velocity, rad/s.
    pub velocity_rad_s: Vec<f64>,
    /// Samples that no one should fit.
    pub excluded: Vec<bool>,
    /// Samples from which to the next one the encoder jumped rather than the axis moved.
    pub jumps: Vec<usize>,
    /// Effort as the kernel sees it, a value a node, N m.
    pub effort_nodes_nm: Vec<f64>,
}

impl Record {
    /// Prepares a log; `excluded` are ranges of its samples.
    ///
    /// # Errors
    /// Log and axis file do not fit, or no stretch is long enough.
    pub fn new(
        log: &Log,
        axis: &AxisFile,
        believed: &Believed,
        excluded: &[Range<usize>],
    ) -> Result<Self, InputError> {
        let position = log.position_rad(axis)?;
        let sensor = shown(&position, log.median_step_s(), believed.rad_per_count());
        Self::of_sensor(log, axis, believed, excluded, sensor)
    }

    /// The same where it is known what the positions say of their sensor.
    ///
    /// # Errors
    /// See [`Record::new`].
    pub fn of_sensor(
        log: &Log,
        axis: &AxisFile,
        believed: &Believed,
        excluded: &[Range<usize>],
        sensor: Shown,
    ) -> Result<Self, InputError> {
        let effort = log.effort_nm(axis)?;
        let position = log.position_rad(axis)?;
        let rad_per_count = believed.rad_per_count().max(sensor.coarse_rad());
        let coarse = believed.model.has_bristles()
            && believed.coulomb_nm < COARSE * rad_per_count * believed.stiffness_nm_rad;
        let kind = log.best_effort(axis)?.kind;
        let original_s = log.median_step_s();
        let averaged = ((1.0 / original_s / FASTEST_HZ).round() as usize).max(1);
        let step_s = original_s * averaged as f64;
        let mut stretches = Vec::new();
        let mut noise_rad = 0.0;
        for range in log.stretches() {
            let span_s = log.time_s[range.end - 1] - log.time_s[range.start];
            if span_s < SHORTEST_S {
                continue;
            }
            let time = &log.time_s[range.clone()];
            let even: Vec<f64> = (0..=((span_s / original_s).floor() as usize))
                .map(|k| time[0] + k as f64 * original_s)
                .collect();
            let q = interpolate(time, &position[range.clone()], &even);
            let u = means(time, &effort[range.clone()], &even, original_s);
            let full_noise = position_noise_rad(&q, rad_per_count);
            noise_rad = f64::max(noise_rad, full_noise / (averaged as f64).sqrt());
            let q = if coarse {
                shortest_path(&q, rad_per_count)
            } else {
                resting_on_edges(&q, rad_per_count)
            };
            let mut out: Vec<bool> = vec![false; range.len()];
            for part in excluded {
                for k in part.start.max(range.start)..part.end.min(range.end) {
                    out[k - range.start] = true;
                }
            }
            let mut stretch = averaged_down(&q, &u, &out, averaged);
            stretch.start_s = time[0] - log.time_s[0];
            let smoothed = smooth(&stretch.position_rad, step_s, noise_rad);
            stretch.smooth_rad = smoothed.position_rad;
            stretch.velocity_rad_s = smoothed.velocity_rad_s;
            stretch.jumps = jumps(&stretch, step_s);
            stretches.push(stretch);
        }
        if stretches.is_empty() {
            return Err(InputError::new(
                &log.file,
                format!("no stretch without gaps is as long as {SHORTEST_S} s"),
                "record for longer",
            ));
        }
        let effort_noise_nm = effort_noise_nm(&stretches);
        let speed_rad_s = rms(stretches.iter().flat_map(|s| &s.velocity_rad_s).copied());
        let clock_rad = sensor.clock_noise_rad(speed_rad_s, averaged);
        // The clock's part grows with speed, and is counted by itself.
        let count_rad = rad_per_count / (12.0 * averaged as f64).sqrt();
        let still_rad = (noise_rad * noise_rad - clock_rad * clock_rad)
            .max(count_rad * count_rad)
            .sqrt();
        let kernel = kernel(
            step_s,
            believed.whole_inertia_kg_m2() * still_rad.hypot(clock_rad),
            effort_noise_nm,
            believed.coulomb_nm,
        );
        let record = Self {
            name: log.file.display().to_string(),
            step_s,
            log_step_s: original_s,
            averaged,
            commanded: matches!(kind, EffortKind::TorqueReference | EffortKind::Voltage),
            stretches,
            kernel,
            position_noise_rad: still_rad,
            effort_noise_nm,
            rotor_noise_nm: 0.0,
            shakes_nm: 0.0,
            rad_per_count,
            sensor,
            lacks_nm: Vec::new(),
        };
        Ok(record.seen_through(kernel))
    }

    /// The same, its balance seen through this kernel.
    #[must_use]
    pub fn seen_through(mut self, kernel: Kernel) -> Self {
        self.kernel = kernel;
        for stretch in &mut self.stretches {
            let u = &stretch.effort_nm;
            let mut pairs: Vec<f64> = (1..u.len() - 1).map(|k| 0.5 * (u[k - 1] + u[k])).collect();
            stretch.effort_nodes_nm.clear();
            kernel.apply(&mut pairs, &mut stretch.effort_nodes_nm);
        }
        self
    }

    /// The drive between this effort and the axis: none where the effort was measured. Its delay is in whole samples of
    /// this record.
    pub fn drive(&self, drive: DriveConfig) -> DriveConfig {
        if !self.commanded {
            return DriveConfig::default();
        }
        DriveConfig {
            delay_samples: self.delay_samples(drive).round() as usize,
            ..drive
        }
    }

    /// Lag by which measured torque runs within a sample, s: none where that is much longer than a sample or samples are means of several,
    /// nor where the effort's noise would hide it.
    pub fn lag_within_s(&self, drive: DriveConfig) -> f64 {
        let most = TOLD_LAG[usize::from(self.kernel.length > 1)];
        if self.commanded || self.averaged > 1 || drive.lag_s > most * self.log_step_s {
            0.0
        } else {
            drive.lag_s
        }
    }

    /// Delay of the drive in samples of this record, which may be longer than those of the log.
    pub fn delay_samples(&self, drive: DriveConfig) -> f64 {
        if self.commanded {
            drive.delay_samples as f64 * self.log_step_s / self.step_s
        } else {
            0.0
        }
    }

    /// Steps from sample to sample in all stretches.
    pub fn intervals(&self) -> usize {
        let of = |stretch: &Stretch| stretch.effort_nm.len() - 1;
        self.stretches.iter().map(of).sum()
    }

    /// Nodes of all stretches.
    pub fn nodes(&self) -> usize {
        self.stretches
            .iter()
            .map(|stretch| self.nodes_of(stretch))
            .sum()
    }

    /// Nodes of a stretch: its balance has a value for every sample but the first and the last.
    pub fn nodes_of(&self, stretch: &Stretch) -> usize {
        self.kernel.nodes(stretch.effort_nm.len() - 2)
    }

    /// The sample at the middle of a node of a stretch.
    pub fn middle(&self, node: usize) -> usize {
        self.kernel.middle(node) + 1
    }

    /// Slower than this the axis counts as at rest where friction is defined by rest, rad/s.
    pub fn rest_velocity_rad_s(&self) -> f64 {
        self.rad_per_count / REST_S
    }

    /// Slower than this the encoder tells nothing of the motion, rad/s.
    pub fn still_rad_s(&self) -> f64 {
        self.rad_per_count / STILL_S
    }

    /// Noise of effort of a sample before averaging, N m rms.
    pub fn sample_noise_nm(&self) -> f64 {
        self.effort_noise_nm * (self.averaged as f64).sqrt()
    }

    /// Noise of a node from encoder, its clock and effort alone, N m rms, at an inertia and a speed.
    pub fn noise_nm(&self, inertia_kg_m2: f64, speed_rad_s: f64) -> f64 {
        let motion = self.inertia_noise_nm(inertia_kg_m2, speed_rad_s);
        (self.effort_noise_nm * self.kernel.of_effort())
            .hypot(motion * self.kernel.of_second_difference())
    }

    /// The same over frequency, in waves a node: its mean over all frequencies is the square of that, N^2 m^2.
    pub fn noise_power(&self, inertia_kg_m2: f64, speed_rad_s: f64, waves: f64) -> f64 {
        let motion = self.inertia_noise_nm(inertia_kg_m2, speed_rad_s);
        self.effort_noise_nm.powi(2) * self.kernel.power(&EFFORT, waves)
            + motion.powi(2) * self.kernel.power(&SECOND_DIFFERENCE, waves)
    }

    /// Noise of encoder and clock in units of effort, before it is differentiated.
    fn inertia_noise_nm(&self, inertia_kg_m2: f64, speed_rad_s: f64) -> f64 {
        let clock_rad = self.sensor.clock_noise_rad(speed_rad_s, self.averaged);
        inertia_kg_m2 * self.position_noise_rad.hypot(clock_rad) / self.step_s.powi(2)
    }

    /// Time from node to node, s.
    pub fn node_s(&self) -> f64 {
        self.step_s * self.kernel.length as f64
    }
}

fn averaged_down(q: &[f64], u: &[f64], excluded: &[bool], by: usize) -> Stretch {
    let samples = q.len() / by;
    let half = by / 2;
    let mut stretch = Stretch::default();
    for k in 0..samples {
        let at = k * by;
        // The mean about the sample's edge, as wide as a sample where there is room.
        let room = half.min(at).min(q.len() - 1 - at);
        let window = &q[at - room..=at + room];
        stretch
            .position_rad
            .push(window.iter().sum::<f64>() / window.len() as f64);
        stretch
            .effort_nm
            .push(u[at..at + by].iter().sum::<f64>() / by as f64);
        let end = (at + by).min(excluded.len());
        stretch
            .excluded
            .push(excluded[at.min(end)..end].contains(&true));
    }
    stretch
}

fn jumps(stretch: &Stretch, step_s: f64) -> Vec<usize> {
    let pairs = stretch.velocity_rad_s.iter().zip(&stretch.excluded);
    let fastest_rad_s = pairs
        .filter(|(_, excluded)| !**excluded)
        .fold(0.0, |most: f64, (v, _)| v.abs().max(most));
    let intervals = stretch
        .smooth_rad
        .windows(2)
        .zip(stretch.excluded.windows(2));
    intervals
        .enumerate()
        .filter(|(_, (q, excluded))| {
            excluded.contains(&true) && (q[1] - q[0]).abs() > JUMPS * fastest_rad_s * step_s
        })
        .map(|(k, _)| k)
        .collect()
}

/// From the second difference of effort, whose square is 6 for white noise of 1; the median, so that steps do not count.
fn effort_noise_nm(stretches: &[Stretch]) -> f64 {
    let mut second: Vec<f64> = stretches
        .iter()
        .flat_map(|stretch| stretch.effort_nm.windows(3))
        .map(|u| (u[2] - 2.0 * u[1] + u[0]).abs())
        .collect();
    rms_by_median(&mut second) / 6.0_f64.sqrt()
}

/// The shortest kernel that keeps the acceleration's noise down.
fn kernel(step_s: f64, momentum_noise: f64, effort_noise_nm: f64, coulomb_nm: f64) -> Kernel {
    let longest = ((LONGEST_KERNEL_S / step_s) as usize).max(1);
    let mut kernel = Kernel { length: 1 };
    while kernel.length + 2 <= longest {
        let motion = momentum_noise / step_s.powi(2) * kernel.of_second_difference();
        let effort = effort_noise_nm * kernel.of_effort();
        if motion <= effort.max(ACCELERATION_NOISE * coulomb_nm) {
            break;
        }
        kernel.length += 2;
    }
    kernel
}
