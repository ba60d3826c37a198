//! Steps of the position that the axis did not make, and how large they are.

use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Samples on either side that a step is measured against.
const AROUND: usize = 5;

/// A step of the position faster than effort could move the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// The first sample behind it.
    pub sample: usize,
    /// How far it went, rad or m.
    pub size_rad: f64,
    /// How far effort and friction, taken three times and twice, could have moved the axis within a sample, rad or m.
    pub allowed_rad: f64,
}

/// The step within a group of samples whose speed changes too fast: the size that a parabola of time about it needs to be
/// one on both sides.
pub(super) fn measured(q: &[f64], group: &Range<usize>, allowed_rad: f64) -> Option<Jump> {
    let near = group.start.checked_sub(1)?..(group.end + 1).min(q.len());
    let slope = slope_before(q, group.start);
    let step = |k: &usize| (q[*k] - q[k - 1] - slope).abs();
    let sample = (near.start + 1..near.end).max_by(|a, b| step(a).total_cmp(&step(b)))?;
    // What the group holds besides is on neither side.
    let rows: Vec<usize> = (sample.saturating_sub(AROUND)..(sample + AROUND).min(q.len()))
        .filter(|k| *k <= group.start || *k + 1 >= group.end || [sample - 1, sample].contains(k))
        .collect();
    let unit = AROUND as f64;
    let of = |k: usize| {
        let t = (k as f64 - sample as f64) / unit;
        [1.0, t, t * t, f64::from(u8::from(k >= sample))]
    };
    let design = DMatrix::from_fn(rows.len(), 4, |row, column| of(rows[row])[column]);
    let values = DVector::from_fn(rows.len(), |row, _| q[rows[row]] - q[sample]);
    let solved = design.svd(true, true).solve(&values, 1e-9).ok()?;
    Some(Jump {
        sample,
        size_rad: solved[3],
        allowed_rad,
    })
}

/// Mean step of the ten samples up to `k`, before whatever happens there.
pub(super) fn slope_before(q: &[f64], k: usize) -> f64 {
    let last = k.saturating_sub(1);
    let from = last.saturating_sub(10);
    if last == from {
        return 0.0;
    }
    (q[last] - q[from]) / (last - from) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_measured_in_motion() {
        // 5 rad/s^2 and a turn of the motion near by, sampled at 1 kHz.
        let motion = |k: usize| {
            let t = k as f64 * 1e-3;
            2.5 * (t - 0.02) * (t - 0.02)
        };
        for at in [12, 21, 30] {
            let q: Vec<f64> = (0..40)
                .map(|k| motion(k) - if k < at { 0.0 } else { 0.02 })
                .collect();
            let jump = measured(&q, &(at - 1..at + 1), 0.01).unwrap();
            assert_eq!(jump.sample, at);
            // A parabola is one on both sides.
            assert!((jump.size_rad + 0.02).abs() < 1e-12, "{jump:?}");
        }
        assert!(measured(&[0.0, 1.0], &(0..2), 0.01).is_none());
    }
}
