//! Both observers over a recorded log, and how they compare with what can be had from the record without a friction
//! model: the zero-phase filtered derivative, and force less inertia.

use crate::axis_file::AxisFile;
use crate::believed::Believed;
use crate::error::InputError;
use crate::log::{EffortKind, Log};
use crate::signal::{correlation, derivative, interpolate, means, rms, samples, zero_phase};
use bristle_core::observer::{luenberger, time_free};
use bristle_core::stribeck::Curve;
use bristle_core::tick::{Tick, TorquePath, TorquePathState};

/// What to do with a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Samples a second of the observers; the axis file's rate where `None`, and the log's where there is none either.
    pub rate_hz: Option<f64>,
    /// Cut-off of the zero-phase reference, Hz.
    pub cutoff_hz: f64,
}

/// Observers' states along a log, at even times.
#[derive(Clone, Debug, PartialEq)]
pub struct Observed {
    /// How the log was brought to the observers' rate.
    pub resampling: String,
    /// Rate of the observers, Hz.
    pub rate_hz: f64,
    /// s
    pub time_s: Vec<f64>,
    /// Measured position, whole counts as the observers saw it, rad.
    pub position_rad: Vec<f64>,
    /// Mean torque during the sample that ends here, N m.
    pub torque_nm: Vec<f64>,
    /// The Luenberger-like observer's velocity, rad/s.
    pub velocity_rad_s: Vec<f64>,
    /// Plain difference of positions, rad/s.
    pub difference_rad_s: Vec<f64>,
    /// z of the Luenberger-like observer, rad.
    pub luenberger_z_rad: Vec<f64>,
    /// z of the time-free observer, rad.
    pub time_free_z_rad: Vec<f64>,
    /// Friction torque of the Luenberger-like observer, N m.
    pub luenberger_friction_nm: Vec<f64>,
    /// Friction torque of the time-free observer without its damping part, which would amplify single counts, N m.
    pub time_free_friction_nm: Vec<f64>,
    /// Zero-phase filtered derivative, rad/s.
    pub reference_velocity_rad_s: Vec<f64>,
    /// Torque less inertia times the derivative of that velocity, less the known offset, N m.
    pub reference_friction_nm: Vec<f64>,
    /// Samples that each observer did not believe.
    pub rejected: [u32; 2],
    /// Stretches between gaps; the observers start anew in each.
    pub stretches: usize,
}

/// How far a signal lies from its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Root mean square of the difference.
    pub rms: f64,
    /// The same as a share of the reference's rms.
    pub relative: f64,
    /// Correlation coefficient.
    pub correlation: f64,
}

/// Distance of `a` from `reference`.
pub fn distance(a: &[f64], reference: &[f64]) -> Distance {
    let error = rms(a.iter().zip(reference).map(|(a, b)| a - b));
    Distance {
        rms: error,
        relative: error / rms(reference.iter().copied()),
        correlation: correlation(a, reference),
    }
}

/// Runs both observers over a log. `progress` is called with the share done.
///
/// # Errors
/// Log and axis file do not fit, or the observers' gains do not hold at the rate.
pub fn observe(
    log: &Log,
    axis: &AxisFile,
    believed: &Believed,
    options: &Options,
    mut progress: impl FnMut(f64),
) -> Result<Observed, InputError> {
    let log_rate_hz = 1.0 / log.median_step_s();
    let rate_hz = options
        .rate_hz
        .or(axis.observer.rate_hz)
        .unwrap_or(log_rate_hz);
    let step_s = 1.0 / rate_hz;
    let effort_kind = log.best_effort(axis)?.kind;
    let effort = log.effort_nm(axis)?;
    let position = log.position_rad(axis)?;
    let tick = believed.tick::<f64>(step_s)?;
    let path = match effort_kind {
        // A measured torque already is what reached the rotor.
        EffortKind::TorqueMeasured | EffortKind::Current => {
            TorquePath::new(0, 0.0, step_s).unwrap_or(tick.torque_path)
        }
        EffortKind::TorqueReference | EffortKind::Voltage => tick.torque_path,
    };
    let even = log.is_uniform() && (log_rate_hz / rate_hz - 1.0).abs() < 1e-6;
    let gaps = log.gaps();
    let mut out = Observed {
        resampling: resampling(log, log_rate_hz, rate_hz, even),
        rate_hz,
        time_s: Vec::new(),
        position_rad: Vec::new(),
        torque_nm: Vec::new(),
        velocity_rad_s: Vec::new(),
        difference_rad_s: Vec::new(),
        luenberger_z_rad: Vec::new(),
        time_free_z_rad: Vec::new(),
        luenberger_friction_nm: Vec::new(),
        time_free_friction_nm: Vec::new(),
        reference_velocity_rad_s: Vec::new(),
        reference_friction_nm: Vec::new(),
        rejected: [0, 0],
        stretches: 0,
    };
    let mut start = 0;
    for end in gaps.iter().map(|gap| gap.before + 1).chain([log.len()]) {
        let times = &log.time_s[start..end];
        let (torques, positions) = (&effort[start..end], &position[start..end]);
        start = end;
        let at: Vec<f64> = if even {
            times.to_vec()
        } else {
            let span = times[times.len() - 1] - times[0];
            let samples = samples(span + step_s, rate_hz)?;
            (0..samples).map(|k| times[0] + k as f64 * step_s).collect()
        };
        if at.len() < 2 || times.len() < 2 {
            continue;
        }
        let (torques, positions) = if even {
            (torques.to_vec(), positions.to_vec())
        } else {
            (
                means(times, torques, &at, step_s),
                interpolate(times, positions, &at),
            )
        };
        let stretch = Stretch {
            at_s: &at,
            torque_nm: &torques,
            position_rad: &positions,
        };
        out.extend(&tick, &path, &stretch, options.cutoff_hz);
        progress(end as f64 / log.len() as f64);
    }
    if out.stretches == 0 {
        return Err(InputError::new(
            &log.file,
            format!("no two samples stand {step_s} s apart without a gap between them"),
            "give a longer log, or a higher --rate-hz",
        ));
    }
    Ok(out)
}

fn resampling(log: &Log, log_rate_hz: f64, rate_hz: f64, even: bool) -> String {
    if even {
        return format!("none: the log is even at {log_rate_hz:.6} Hz, the observers' rate");
    }
    let jitter = if log.is_uniform() {
        String::new()
    } else {
        format!(", jitter {:.3} us rms", log.jitter_s() * 1e6)
    };
    format!(
        "from {log_rate_hz:.6} Hz{jitter} to {rate_hz:.6} Hz: position on straight lines between samples, torque as the \
         mean over each interval"
    )
}

/// Even samples without a gap.
#[derive(Clone, Copy)]
struct Stretch<'a> {
    at_s: &'a [f64],
    torque_nm: &'a [f64],
    position_rad: &'a [f64],
}

impl Observed {
    /// Runs the observers over a stretch, from rest.
    fn extend<C: Curve<f64> + Copy>(
        &mut self,
        tick: &Tick<f64, C>,
        path: &TorquePath<f64>,
        stretch: &Stretch<'_>,
        cutoff_hz: f64,
    ) {
        let Stretch {
            at_s,
            torque_nm,
            position_rad,
        } = *stretch;
        let (luenberger, time_free) = (&tick.luenberger, &tick.time_free());
        let settings = luenberger.settings();
        let friction = luenberger.friction();
        let (step_s, count) = (settings.sample_time_s, settings.rad_per_count);
        let rate_hz = 1.0 / step_s;
        let mut a = luenberger::State::default();
        let mut b = time_free::State::default();
        let mut path_state = TorquePathState::default();
        let mut z = 0.0;
        let mut counts = (position_rad[0] / count).round();
        for (k, (&t, &q)) in at_s.iter().zip(position_rad).enumerate() {
            let now = (q / count).round();
            let step = now - counts;
            counts = now;
            // The torque of the interval that ends at this sample.
            let torque = path.step(&mut path_state, torque_nm[k.saturating_sub(1)]);
            if k > 0 {
                // A step beyond i32 saturates, and is then rejected.
                luenberger.step(&mut a, step as i32, torque);
                time_free.step(&mut b, step as i32, a.estimate.velocity_rad_s);
            }
            let estimate = a.estimate;
            let v = estimate.velocity_rad_s;
            self.time_s.push(t);
            self.position_rad.push(now * count);
            self.torque_nm.push(torque);
            self.velocity_rad_s.push(v);
            self.difference_rad_s.push(step * count * rate_hz);
            self.luenberger_z_rad.push(estimate.z_rad);
            self.time_free_z_rad.push(b.z_rad);
            self.luenberger_friction_nm.push(
                friction.stiffness_nm_rad() * estimate.z_rad
                    + friction.damping_nm_s_rad() * (estimate.z_rad - z) * rate_hz
                    + friction.viscous_nm_s_rad() * v,
            );
            self.time_free_friction_nm
                .push(friction.stiffness_nm_rad() * b.z_rad + friction.viscous_nm_s_rad() * v);
            z = estimate.z_rad;
        }
        let smooth = zero_phase(position_rad, rate_hz, cutoff_hz);
        let velocity = derivative(&smooth, step_s);
        let acceleration = derivative(&velocity, step_s);
        // torque_nm[k] acts from k to k + 1: at the sample itself, the mean of the intervals on both sides.
        let at_sample: Vec<f64> = (0..torque_nm.len())
            .map(|k| 0.5 * (torque_nm[k.saturating_sub(1)] + torque_nm[k]))
            .collect();
        let torque = zero_phase(&at_sample, rate_hz, cutoff_hz);
        self.reference_friction_nm.extend(
            torque
                .iter()
                .zip(&acceleration)
                .map(|(u, a)| u + settings.offset_nm - settings.inertia_kg_m2 * a),
        );
        self.reference_velocity_rad_s.extend(velocity);
        self.rejected[0] += a.rejected;
        self.rejected[1] += b.rejected;
        self.stretches += 1;
    }
}
