//! The floor from exact repeats of the reference: what the mean over the periods leaves, split into slow drift and noise.
//!
//! Drift is what changes from period to period in offset, Coulomb and viscous friction, by least squares of each period's
//! departure from the mean on [1, sgn v, v]; the rest is noise.

use super::noise::Noise;
use nalgebra::{DMatrix, DVector};

/// Terms of the drift in each period.
const TERMS: usize = 3;
/// Parts of a period in which the first one is judged for its transient.
const PARTS: usize = 50;

/// What repeats, and what does not.
#[derive(Clone, Debug, PartialEq)]
pub struct Repeats {
    /// Samples of a period.
    pub period_samples: usize,
    /// Periods in the record.
    pub periods: f64,
    /// Samples at the start that belong to a transient and were left out.
    pub transient_samples: usize,
    /// Mean over the periods, one value a sample of it; NaN where fewer than two periods have one.
    pub mean_nm: Vec<f64>,
    /// Everything that does not repeat, rms over all samples used, with one degree of freedom a phase taken off.
    pub non_repeating_nm: f64,
    /// Of each period: change of offset, N m, of Coulomb friction, N m, and of viscous friction, N m s/rad.
    pub drift: Vec<[f64; TERMS]>,
    /// Rms of that drift, what noise alone would feign taken off.
    pub drift_nm: f64,
}

/// Splits a signal. `velocity` goes with it; samples that may not be used are false in `usable`. None where too few
/// samples repeat.
pub(super) fn split(
    signal: &[f64],
    velocity: &[f64],
    usable: &[bool],
    period: usize,
) -> Option<(Repeats, Noise)> {
    let all = usable.to_vec();
    let (mean, _) = means(signal, &all, period);
    let transient = transient(signal, &mean, &all, period);
    let mut used = all;
    used[..transient].fill(false);
    let (mean, repeats) = means(signal, &used, period);
    for (k, used) in used.iter_mut().enumerate() {
        *used &= repeats[k % period] >= 2;
    }
    let samples = used.iter().filter(|used| **used).count();
    let phases = repeats.iter().filter(|n| **n >= 2).count();
    if samples < 4 * PARTS || samples <= phases {
        return None;
    }
    let mut left: Vec<f64> = signal
        .iter()
        .enumerate()
        .map(|(k, x)| if used[k] { x - mean[k % period] } else { 0.0 })
        .collect();
    let squares = |left: &[f64]| -> f64 { left.iter().map(|x| x * x).sum() };
    let before = squares(&left);
    let freedom_of_mean = (samples - phases) as f64;
    let (mean_speed, _) = means(velocity, &used, period);
    let drift = take_drift_off(&mut left, &mean_speed, &used, period);
    let whole = signal.len().div_ceil(period);
    let freedom = freedom_of_mean - (TERMS * (whole - 1)) as f64;
    let pieces: Vec<&[f64]> = pieces(&left, &used);
    let noise = Noise::of(&pieces, freedom / samples as f64)?;
    // Each term of a period takes the noise's power at its own low frequency with it.
    let feigned = noise.long_run_variance().max(noise.rms.powi(2)) * (TERMS * (whole - 1)) as f64;
    let taken = before - squares(&left);
    let repeats = Repeats {
        period_samples: period,
        periods: signal.len() as f64 / period as f64,
        transient_samples: transient,
        mean_nm: mean,
        non_repeating_nm: (before / freedom_of_mean).sqrt(),
        drift,
        drift_nm: ((taken - feigned).max(0.0) / freedom_of_mean).sqrt(),
    };
    Some((repeats, noise))
}

/// Mean at each phase, and how many samples are in it.
fn means(signal: &[f64], used: &[bool], period: usize) -> (Vec<f64>, Vec<usize>) {
    let mut sums = vec![0.0; period];
    let mut counts = vec![0_usize; period];
    for (k, x) in signal.iter().enumerate() {
        if used[k] {
            sums[k % period] += x;
            counts[k % period] += 1;
        }
    }
    for (sum, count) in sums.iter_mut().zip(&counts) {
        *sum = if *count >= 2 {
            *sum / *count as f64
        } else {
            f64::NAN
        };
    }
    (sums, counts)
}

/// Length of the start of the first period that departs from the mean by more than three times what is usual: an axis
/// that comes from rest.
fn transient(signal: &[f64], mean: &[f64], used: &[bool], period: usize) -> usize {
    let part = (period / PARTS).max(1);
    // Without a third period there is nothing to say which of two is the odd one.
    if signal.len() < period * 5 / 2 {
        return 0;
    }
    let size = |start: usize| {
        let (mut sum, mut n) = (0.0, 0.0);
        for k in start..(start + part).min(signal.len()) {
            let off = signal[k] - mean[k % period];
            if used[k] && off.is_finite() {
                sum += off * off;
                n += 1.0;
            }
        }
        if n > 0.0 { sum / n } else { 0.0 }
    };
    let mut sizes: Vec<f64> = (period..signal.len() - part)
        .step_by(part)
        .map(size)
        .collect();
    let middle = sizes.len() / 2;
    let usual = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
    (0..PARTS)
        .map(|i| i * part)
        .find(|start| size(*start) <= 9.0 * usual)
        .unwrap_or(period)
}

/// Fits each period's drift and takes it off; gives what was fitted.
fn take_drift_off(
    left: &mut [f64],
    speed: &[f64],
    used: &[bool],
    period: usize,
) -> Vec<[f64; TERMS]> {
    let top = speed.iter().fold(
        0.0_f64,
        |m, v| if v.is_finite() { m.max(v.abs()) } else { m },
    );
    let terms = |k: usize| {
        let v = speed[k % period];
        // At a twentieth of the top speed Coulomb friction stands in full; below, its sign is noise.
        [
            1.0,
            (v / (0.05 * top).max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0),
            v,
        ]
    };
    let mut out = Vec::new();
    for start in (0..left.len()).step_by(period) {
        let range = start..(start + period).min(left.len());
        let rows: Vec<usize> = range.filter(|&k| used[k]).collect();
        let mut fitted = [0.0; TERMS];
        if rows.len() > 10 * TERMS {
            let mut xx = DMatrix::zeros(TERMS, TERMS);
            let mut xy = DVector::zeros(TERMS);
            for &k in &rows {
                let x = DVector::from_row_slice(&terms(k));
                xy += &x * left[k];
                xx += &x * x.transpose();
            }
            let scale =
                DVector::from_fn(TERMS, |i, _| 1.0 / xx[(i, i)].sqrt().max(f64::MIN_POSITIVE));
            let scaled = DMatrix::from_fn(TERMS, TERMS, |i, j| xx[(i, j)] * scale[i] * scale[j]);
            // A singular value below 1e-6 of the largest is a term that this motion does not show.
            if let Ok(solved) = scaled
                .svd(true, true)
                .solve(&xy.component_mul(&scale), 1e-6)
            {
                fitted = std::array::from_fn(|i| solved[i] * scale[i]);
            }
        }
        for k in rows {
            left[k] -= terms(k)
                .iter()
                .zip(&fitted)
                .map(|(x, b)| x * b)
                .sum::<f64>();
        }
        out.push(fitted);
    }
    out
}

/// Runs of used samples.
pub(super) fn pieces<'a>(values: &'a [f64], used: &[bool]) -> Vec<&'a [f64]> {
    let mut out = Vec::new();
    let mut start = 0;
    for k in 0..=values.len() {
        if k == values.len() || !used[k] {
            if k > start {
                out.push(&values[start..k]);
            }
            start = k + 1;
        }
    }
    out
}
