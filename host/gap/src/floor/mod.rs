//! The floor of a log: what does not repeat, and so cannot be explained by any model. A linear axis reads m for rad and
//! N for N m.
//!
//! In closed loop the effort reacts to whatever disturbs the axis, so its own non-repeating part is the floor. In open
//! loop the command repeats to the last digit and the motion does not: then it is that of the force balance, effort less
//! inertia times acceleration, behind a stated low-pass.

pub mod noise;
pub mod period;
pub mod repeats;
mod rest;

use crate::axis_file::AxisFile;
use crate::error::InputError;
use crate::hygiene::Hygiene;
use crate::log::{EffortKind, Log};
use crate::stretch::{Stretch, cutoff_hz, rad_per_count, stretches};
pub use noise::Noise;
pub use repeats::Repeats;

/// How the floor was got, the best way first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// From exact repeats of the reference.
    Repeats,
    /// From the effort at rest.
    Rest,
    /// From the encoder's count and the highest frequencies of the effort.
    Formula,
}

/// Of which signal the effort's part of the floor is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Signal {
    /// The effort as recorded.
    Effort,
    /// Effort less inertia times acceleration, both behind a zero-phase low-pass.
    ForceBalance {
        /// Of the low-pass, Hz.
        cutoff_hz: f64,
    },
}

/// The floor of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Floor {
    /// How it was got.
    pub method: Method,
    /// Of which signal `noise` is.
    pub signal: Signal,
    /// What does not repeat, without drift, N m.
    pub noise: Noise,
    /// Noise that the encoder adds to inertia times the second difference of positions, N m; none where `noise` holds it
    /// already or no count is known.
    pub encoder: Option<Noise>,
    /// The split, where the reference repeats.
    pub repeats: Option<Repeats>,
    /// s
    pub step_s: f64,
    /// How it was got, in one line with its numbers.
    pub text: String,
}

impl Floor {
    /// Rms of what a model of the inverse dynamics cannot explain, behind a filter of finite response on its residual.
    pub fn rms_through(&self, kernel: &[f64]) -> f64 {
        let encoder = self
            .encoder
            .as_ref()
            .map_or(0.0, |encoder| encoder.rms_through(kernel));
        self.noise.rms_through(kernel).hypot(encoder)
    }
}

/// Finds the floor of a log, without the samples that its hygiene leaves out.
///
/// # Errors
/// Log and axis file do not fit each other, or the log is too short for any of the ways.
pub fn floor(log: &Log, axis: &AxisFile, hygiene: &Hygiene) -> Result<Floor, InputError> {
    let stretches = stretches(log, axis)?;
    let usable = hygiene.usable(log.len());
    let count = rad_per_count(axis);
    let unit = axis.unit.effort();
    if let Some(found) = from_repeats(log, axis, &stretches, &usable) {
        return Ok(found);
    }
    let step_s = log.median_step_s();
    let inertia = axis.axis.inertia + axis.axis.load_inertia.unwrap_or(0.0);
    let encoder = count.map(|count| rest::encoder_noise(inertia, count, step_s));
    let made = |method, noise: Noise, how: String| {
        let text = format!("{how}: {:.3e} {unit} rms", noise.rms);
        Floor {
            method,
            signal: Signal::Effort,
            noise,
            encoder: encoder.clone(),
            repeats: None,
            step_s,
            text,
        }
    };
    if let Some((noise, at_rest_s, moving)) = rest::from_rest(&stretches, &usable, count) {
        let how = format!(
            "the reference does not repeat; noise of the effort over {at_rest_s:.3} s of rest, autoregressive of order {}, \
             {moving:.2} times as large in motion, and the encoder's count through the inertia",
            noise.autoregressive.coefficients.len()
        );
        return Ok(made(Method::Rest, noise, how));
    }
    match rest::high_frequencies(&stretches, &usable) {
        Some(noise) => {
            let how = "the reference does not repeat and no rest shows noise; highest frequencies of the effort, taken as \
                       white, and the encoder's count through the inertia";
            Ok(made(Method::Formula, noise, how.to_string()))
        }
        None => Err(InputError::new(
            &log.file,
            "fewer than 20 samples in a row can be used: there is no floor to be had",
            "record a longer log, or mend what its hygiene names",
        )),
    }
}

/// Slow drift of the effort, N m rms: what changes of it from period to period of a position's reference that repeats exactly. None where
/// none does: by a torque that repeats the axis comes to other places, where other friction is.
pub fn drift_nm(log: &Log, axis: &AxisFile, hygiene: &Hygiene) -> Option<f64> {
    log.position_ref.as_ref()?;
    let stretches = stretches(log, axis).ok()?;
    let usable = hygiene.usable(log.len());
    let found = from_repeats(log, axis, &stretches, &usable)?;
    Some(found.repeats?.drift_nm)
}

/// More than this part of the effort is no noise: something else than the reference drives the axis, and does not repeat.
const LARGEST_PART: f64 = 0.2;

fn from_repeats(
    log: &Log,
    axis: &AxisFile,
    stretches: &[Stretch],
    usable: &[bool],
) -> Option<Floor> {
    let longest = stretches.iter().max_by_key(|stretch| stretch.range.len())?;
    let closed_loop = log.position_ref.is_some();
    let reference = match &log.position_ref {
        Some(reference) => reference,
        None => &log.effort(EffortKind::TorqueReference)?.values,
    };
    let period = period::period(&reference[longest.range.clone()])?;
    let cutoff = cutoff_hz(
        std::slice::from_ref(longest),
        rad_per_count(axis).unwrap_or(0.0),
    );
    let motion = longest.motion(cutoff);
    let (signal, kind, name) = if closed_loop {
        (
            longest.effort_nm.clone(),
            Signal::Effort,
            "effort".to_string(),
        )
    } else {
        let inertia = axis.axis.inertia + axis.axis.load_inertia.unwrap_or(0.0);
        let balance = motion
            .effort_nm
            .iter()
            .zip(&motion.acceleration_rad_s2)
            .map(|(u, a)| u - inertia * a)
            .collect();
        let name = format!("effort less inertia, below {cutoff:.0} Hz,");
        (balance, Signal::ForceBalance { cutoff_hz: cutoff }, name)
    };
    let (repeats, noise) = repeats::split(
        &signal,
        &motion.velocity_rad_s,
        &usable[longest.range.clone()],
        period,
    )?;
    let repeatable = crate::signal::rms(repeats.mean_nm.iter().copied().filter(|u| u.is_finite()));
    if closed_loop && repeats.non_repeating_nm > LARGEST_PART * repeatable {
        return None;
    }
    let unit = axis.unit.effort();
    let text = format!(
        "the reference repeats every {period} samples, {:.2} times: the {name} leaves {:.3e} {unit} rms about its mean \
         over the periods, {:.3e} of it slow drift, {:.3e} noise",
        repeats.periods, repeats.non_repeating_nm, repeats.drift_nm, noise.rms
    );
    let encoder = match kind {
        Signal::ForceBalance { .. } => None,
        Signal::Effort => rad_per_count(axis).map(|count| {
            let inertia = axis.axis.inertia + axis.axis.load_inertia.unwrap_or(0.0);
            rest::encoder_noise(inertia, count, longest.step_s)
        }),
    };
    Some(Floor {
        method: Method::Repeats,
        signal: kind,
        noise,
        encoder,
        repeats: Some(repeats),
        step_s: longest.step_s,
        text,
    })
}
