//! Sampled signals: resampling, zero-phase filtering, derivatives, and how far two of them lie apart.

use crate::error::InputError;
use biquad::{Biquad, Coefficients, DirectForm2Transposed, Q_BUTTERWORTH_F64, ToHertz, Type};
use realfft::{RealFftPlanner, RealToComplex};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

/// Fourier transforms that were planned: a transform takes less time than its plan, and twins are as long as their records.
static PLANS: LazyLock<Mutex<RealFftPlanner<f64>>> =
    LazyLock::new(|| Mutex::new(RealFftPlanner::new()));

/// Most samples that a command holds in memory, some 2 GB of signals.
const MOST_SAMPLES: f64 = 2e7;

/// Number of samples in a time.
///
/// # Errors
/// More than 20 million of them, or none.
pub fn samples(seconds: f64, rate_hz: f64) -> Result<usize, InputError> {
    let samples = (seconds * rate_hz + 1e-9).floor();
    if (1.0..=MOST_SAMPLES).contains(&samples) {
        return Ok(samples as usize);
    }
    Err(InputError::new(
        format!("{seconds} s at {rate_hz} Hz"),
        if samples < 1.0 {
            "not one sample".to_string()
        } else {
            format!("{samples} samples, more than {MOST_SAMPLES}")
        },
        "choose another length or rate",
    ))
}

/// Root of the mean square; zero for nothing.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values
        .into_iter()
        .fold((0.0, 0_u64), |(sum, count), x| (sum + x * x, count + 1));
    if count == 0 {
        0.0
    } else {
        (sum / count as f64).sqrt()
    }
}

/// Root of the mean square of a Gaussian by the median of its `sizes`, which a few that are far off do not move; zero for nothing.
pub fn rms_by_median(sizes: &mut [f64]) -> f64 {
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    // Half of a normal distribution lies within 0.6745.
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745
}

/// Root mean square of what is left of a whole once an independent part of it is gone; zero where the part is larger.
pub fn rms_beside(whole: f64, part: f64) -> f64 {
    (whole * whole - part * part).max(0.0).sqrt()
}

/// Sum of squares, each value times its weight.
pub fn weighted_squares(values: &[f64], weights: &[f64]) -> f64 {
    let weighted = values.iter().zip(weights);
    weighted.map(|(x, w)| (x * w).powi(2)).sum()
}

/// The least and the greatest; nothing leaves the greatest below the least.
pub fn extent(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| {
            (low.min(x), high.max(x))
        })
}

/// Correlation coefficient of two signals; NaN where one of them does not vary.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (a - mean_a, b - mean_b);
        ab += a * b;
        aa += a * a;
        bb += b * b;
    }
    ab / (aa * bb).sqrt()
}

/// The discrete Fourier transform of so many real values.
pub fn fourier(length: usize) -> Arc<dyn RealToComplex<f64>> {
    // Planning does not panic; a plan that another thread left is whole.
    let mut plans = PLANS.lock().unwrap_or_else(PoisonError::into_inner);
    plans.plan_fft_forward(length)
}

/// Central difference, one-sided at both ends. `values` has two samples or more.
pub fn derivative(values: &[f64], step_s: f64) -> Vec<f64> {
    let last = values.len() - 1;
    (0..=last)
        .map(|i| {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
            (values[after] - values[before]) / ((after - before) as f64 * step_s)
        })
        .collect()
}

/// Second-order Butterworth low-pass run forward and backward: no phase, half the amplitude at the cut-off.
///
/// Each end is prolonged by its own mirror image through the end point, so that a ramp stays a ramp. The cut-off is kept
/// below 0.45 of the rate.
pub fn zero_phase(values: &[f64], rate_hz: f64, cutoff_hz: f64) -> Vec<f64> {
    let cutoff_hz = cutoff_hz.min(0.45 * rate_hz);
    let Ok(coefficients) = Coefficients::<f64>::from_params(
        Type::LowPass,
        rate_hz.hz(),
        cutoff_hz.hz(),
        Q_BUTTERWORTH_F64,
    ) else {
        return values.to_vec();
    };
    // The filter forgets e^-10 of its start in ten of its time constants.
    let reach = (10.0 * rate_hz / (std::f64::consts::TAU * cutoff_hz) * 2.0).ceil() as usize;
    let reach = reach.min(values.len().saturating_sub(1));
    let (Some(&first), Some(&last)) = (values.first(), values.last()) else {
        return Vec::new();
    };
    let mut long: Vec<f64> = (1..=reach)
        .rev()
        .map(|i| 2.0 * first - values[i])
        .chain(values.iter().copied())
        .chain((1..=reach).map(|i| 2.0 * last - values[values.len() - 1 - i]))
        .collect();
    let pass = |long: &mut Vec<f64>| {
        let start = long[0];
        let mut filter = DirectForm2Transposed::<f64>::new(coefficients);
        for x in long.iter_mut() {
            *x = filter.run(*x - start) + start;
        }
        long.reverse();
    };
    pass(&mut long);
    pass(&mut long);
    long[reach..reach + values.len()].to_vec()
}

/// Values at even times between samples, on the straight line from one to the next. `times_s` rises.
pub fn interpolate(times_s: &[f64], values: &[f64], at_s: &[f64]) -> Vec<f64> {
    let mut i = 0;
    at_s.iter()
        .map(|&t| {
            while i + 2 < times_s.len() && times_s[i + 1] <= t {
                i += 1;
            }
            let part = (t - times_s[i]) / (times_s[i + 1] - times_s[i]);
            values[i] + (values[i + 1] - values[i]) * part.clamp(0.0, 1.0)
        })
        .collect()
}

/// Means over even intervals of a value that holds from each sample to the next; the last one holds on.
pub fn means(times_s: &[f64], values: &[f64], at_s: &[f64], step_s: f64) -> Vec<f64> {
    let mut i = 0;
    at_s.iter()
        .map(|&start| {
            while i + 1 < times_s.len() && times_s[i + 1] <= start {
                i += 1;
            }
            let end = start + step_s;
            let (mut sum, mut from, mut j) = (0.0, start, i);
            while j + 1 < times_s.len() && times_s[j + 1] < end {
                sum += values[j] * (times_s[j + 1] - from);
                from = times_s[j + 1];
                j += 1;
            }
            (sum + values[j] * (end - from)) / step_s
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_ramps_and_takes_no_phase() {
        let ramp: Vec<f64> = (0..500).map(|i| 3.0 + 0.1 * f64::from(i)).collect();
        let filtered = zero_phase(&ramp, 1000.0, 50.0);
        for (a, b) in ramp.iter().zip(&filtered) {
            // e^-10 of the slope's 0.1 a sample over some 100 samples is forgotten.
            assert!((a - b).abs() < 1e-3, "{a} {b}");
        }
        let wave = |i: u32| (std::f64::consts::TAU * 5.0 * f64::from(i) * 1e-3).sin();
        let values: Vec<f64> = (0..2000).map(wave).collect();
        let filtered = zero_phase(&values, 1000.0, 50.0);
        let worst = (500..1500)
            .map(|i| (filtered[i] - values[i]).abs())
            .fold(0.0, f64::max);
        // Amplitude 1/(1 + (5/50)^4) = 1 - 1e-4.
        assert!(worst < 1.1e-4, "{worst:e}");
    }

    #[test]
    fn takes_half_at_the_cutoff() {
        let values: Vec<f64> = (0..4000)
            .map(|i| (std::f64::consts::TAU * 50.0 * f64::from(i) * 1e-3).sin())
            .collect();
        let filtered = zero_phase(&values, 1000.0, 50.0);
        let ratio =
            rms(filtered[1000..3000].iter().copied()) / rms(values[1000..3000].iter().copied());
        assert!((ratio - 0.5).abs() < 1e-3, "{ratio}");
    }

    #[test]
    fn derivative_of_a_parabola() {
        let values: Vec<f64> = (0..10).map(|i| f64::from(i * i) * 0.01).collect();
        let slope = derivative(&values, 0.1);
        for (i, slope) in slope.iter().enumerate().take(9).skip(1) {
            assert!((slope - 0.2 * i as f64).abs() < 1e-12);
        }
    }

    #[test]
    fn correlation_of_a_signal_and_its_opposite() {
        let a = [1.0, 2.0, 4.0, 3.0];
        let b = a.map(|x| 5.0 - 2.0 * x);
        assert!((correlation(&a, &b) + 1.0).abs() < 1e-12);
        assert!((correlation(&a, &a) - 1.0).abs() < 1e-12);
        assert!(correlation(&a, &[1.0; 4]).is_nan());
    }

    #[test]
    fn counts_samples_within_reason() {
        assert_eq!(samples(0.3, 1e4).unwrap(), 3000);
        assert!(samples(1e-9, 1e3).is_err());
        assert!(samples(1e9, 1e9).is_err());
        assert!(samples(1.0, f64::NAN).is_err());
    }

    #[test]
    fn resamples() {
        let times = [0.0, 1.0, 3.0];
        assert_eq!(
            interpolate(&times, &[0.0, 2.0, 6.0], &[0.5, 1.0, 2.0, 3.0]),
            [1.0, 2.0, 4.0, 6.0]
        );
        // 1 holds to t = 1, 5 to t = 3, then 7.
        assert_eq!(
            means(&times, &[1.0, 5.0, 7.0], &[0.0, 0.5, 2.5], 1.0),
            [1.0, 3.0, 6.0]
        );
    }
}
