//! Even stretches of a log between its gaps, in SI, and their motion without a model: effort, velocity and acceleration,
//! all through the same zero-phase low-pass. A linear axis reads m for rad and N for N m.

use crate::axis_file::AxisFile;
use crate::error::InputError;
use crate::log::Log;
use crate::signal::{derivative, interpolate, means, zero_phase};
use std::ops::Range;

/// A stretch without gaps, even in time.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// Its samples in the log; where it was resampled, the same span of time.
    pub range: Range<usize>,
    /// Length of a sample, s.
    pub step_s: f64,
    /// Mean effort from each sample to the next, N m.
    pub effort_nm: Vec<f64>,
    /// Position as read, rad.
    pub position_rad: Vec<f64>,
}

/// What a stretch did, low-passed. The effort is centred on its sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// N m
    pub effort_nm: Vec<f64>,
    /// rad/s
    pub velocity_rad_s: Vec<f64>,
    /// rad/s^2
    pub acceleration_rad_s2: Vec<f64>,
}

/// The stretches of a log that have two samples or more, brought to even times where jitter asks for it.
///
/// # Errors
/// Log and axis file do not fit each other.
pub fn stretches(log: &Log, axis: &AxisFile) -> Result<Vec<Stretch>, InputError> {
    let effort = log.effort_nm(axis)?;
    let position = log.position_rad(axis)?;
    let step_s = log.median_step_s();
    let mut out = Vec::new();
    for range in log.stretches() {
        if range.len() < 2 {
            continue;
        }
        let times = &log.time_s[range.clone()];
        let (efforts, positions) = (&effort[range.clone()], &position[range.clone()]);
        let even = times
            .windows(2)
            .all(|pair| (pair[1] - pair[0] - step_s).abs() <= 0.01 * step_s);
        let (effort_nm, position_rad) = if even {
            (efforts.to_vec(), positions.to_vec())
        } else {
            // One sample for each one of the log, so that indices keep their meaning to within the jitter.
            let even_s = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
            let at: Vec<f64> = (0..times.len())
                .map(|k| times[0] + k as f64 * even_s)
                .collect();
            (
                means(times, efforts, &at, even_s),
                interpolate(times, positions, &at),
            )
        };
        out.push(Stretch {
            range,
            step_s,
            effort_nm,
            position_rad,
        });
    }
    Ok(out)
}

impl Stretch {
    /// Through a low-pass of `cutoff_hz` that takes no phase.
    pub fn motion(&self, cutoff_hz: f64) -> Motion {
        let rate_hz = 1.0 / self.step_s;
        let smooth = zero_phase(&self.position_rad, rate_hz, cutoff_hz);
        let velocity_rad_s = derivative(&smooth, self.step_s);
        let acceleration_rad_s2 = derivative(&velocity_rad_s, self.step_s);
        let centred: Vec<f64> = (0..self.effort_nm.len())
            .map(|k| 0.5 * (self.effort_nm[k.saturating_sub(1)] + self.effort_nm[k]))
            .collect();
        Motion {
            effort_nm: zero_phase(&centred, rate_hz, cutoff_hz),
            velocity_rad_s,
            acceleration_rad_s2,
        }
    }

    /// Noise of the position, rad rms, if it were white: from fourth differences, which hold little motion.
    pub fn position_noise_rad(&self) -> f64 {
        let sum: f64 = self
            .position_rad
            .windows(5)
            .map(|q| (q[0] - 4.0 * q[1] + 6.0 * q[2] - 4.0 * q[3] + q[4]).powi(2))
            .sum();
        // 1 + 16 + 36 + 16 + 1 = 70.
        (sum / (70.0 * self.position_rad.len().saturating_sub(4).max(1) as f64)).sqrt()
    }
}

/// Travel of one encoder count, rad, where the axis file says.
pub fn rad_per_count(axis: &AxisFile) -> Option<f64> {
    let turn = match axis.unit {
        bristle_plant::Unit::Rotary => std::f64::consts::TAU,
        bristle_plant::Unit::Linear => 1.0,
    };
    axis.axis.counts_per_turn.map(|counts| turn / counts)
}

/// The highest cut-off at which the noise of the acceleration stays below a tenth of it, Hz; the lowest one tried where
/// none does.
///
/// White position noise s through the low-pass gives an acceleration of variance
/// s^2 2 T (2 pi)^4 f_c^5 pi/(8 sqrt 2): the integral of f^4 times the fourth-order response squared.
pub fn cutoff_hz(stretches: &[Stretch], count_rad: f64) -> f64 {
    let Some(longest) = stretches.iter().max_by_key(|stretch| stretch.range.len()) else {
        return 1.0;
    };
    let rate_hz = 1.0 / longest.step_s;
    let noise_rad = longest.position_noise_rad().max(count_rad / 12_f64.sqrt());
    let lowest = 5.0_f64.max(10.0 * rate_hz / longest.range.len() as f64);
    let mut cutoff = 0.1 * rate_hz;
    loop {
        let acceleration = longest.motion(cutoff).acceleration_rad_s2;
        let seen = crate::signal::rms(acceleration).powi(2);
        let noise = noise_rad.powi(2)
            * 2.0
            * longest.step_s
            * std::f64::consts::TAU.powi(4)
            * cutoff.powi(5)
            * std::f64::consts::PI
            / (8.0 * std::f64::consts::SQRT_2);
        if noise <= 0.01 * seen || cutoff <= lowest {
            return cutoff.max(lowest.min(0.1 * rate_hz));
        }
        cutoff /= 1.5;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_of_the_acceleration_is_the_formula() {
        use rand_chacha::rand_core::{Rng, SeedableRng};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut uniform = || f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5;
        let step_s = 1e-3;
        let stretch = Stretch {
            range: 0..40_000,
            step_s,
            effort_nm: vec![0.0; 40_000],
            position_rad: (0..40_000).map(|_| uniform()).collect(),
        };
        // Uniform on one unit: 1/sqrt 12, to 1 % over 40 000 samples.
        let noise = stretch.position_noise_rad();
        assert!((noise * 12_f64.sqrt() - 1.0).abs() < 0.02, "{noise}");
        let fc: f64 = 20.0;
        let a = crate::signal::rms(stretch.motion(fc).acceleration_rad_s2);
        let formula =
            (2.0 * step_s * std::f64::consts::TAU.powi(4) * fc.powi(5) * 0.277_68 / 12.0).sqrt();
        // The bilinear transform and some thousand independent values of a: 5 %.
        assert!((a / formula - 1.0).abs() < 0.05, "{a} {formula}");
    }
}
