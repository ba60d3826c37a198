//! Steps of the position that the axis did not make, and how large they are.

use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// Samples on either side that a step is measured against.
pub(super) const AROUND: usize = 5;
/// Part of what a step leaves that a hit leaves at most: noise of the encoder leaves both alike.
const HIT: f64 = 0.5;

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

/// What a group of samples whose speed changes too fast is.
#[derive(Debug, PartialEq)]
pub(super) enum Measured {
    /// A step of the position.
    Step(Jump),
    /// A change of the speed: the axis was hit.
    Hit,
    /// Too close to an end to tell.
    Nothing,
}

/// The step within a group of samples whose speed changes too fast: the size that a parabola of time about it needs to be
/// one on both sides; or where a change of speed fits better, that.
pub(super) fn measured(q: &[f64], group: &Range<usize>, allowed_rad: f64) -> Measured {
    let Some(first) = group.start.checked_sub(1) else {
        return Measured::Nothing;
    };
    if is_hit(q, group) {
        return Measured::Hit;
    }
    let near = first..(group.end + 1).min(q.len());
    let slope = slope_before(q, group.start);
    let step = |k: &usize| (q[*k] - q[k - 1] - slope).abs();
    let Some(sample) = (near.start + 1..near.end).max_by(|a, b| step(a).total_cmp(&step(b))) else {
        return Measured::Nothing;
    };
    // What the group holds besides is on neither side.
    let rows: Vec<usize> = (sample.saturating_sub(AROUND)..(sample + AROUND).min(q.len()))
        .filter(|k| *k <= group.start || *k + 1 >= group.end || [sample - 1, sample].contains(k))
        .collect();
    let Some((solved, _)) = fitted(q, &rows, sample, 1) else {
        return Measured::Nothing;
    };
    Measured::Step(Jump {
        sample,
        size_rad: solved[3],
        allowed_rad,
    })
}

/// Whether the motions on both sides of a group meet within it, where a step between them would leave far more.
fn is_hit(q: &[f64], group: &Range<usize>) -> bool {
    let behind = group.end - 1;
    let rows: Vec<usize> = (group.start.saturating_sub(AROUND)..(group.end + AROUND).min(q.len()))
        .filter(|k| *k <= group.start || *k >= behind)
        .collect();
    let (Some((_, of_step)), Some((both, of_hit))) =
        (fitted(q, &rows, behind, 1), fitted(q, &rows, behind, 2))
    else {
        return false;
    };
    // The sides meet where what is behind is beyond what is before by nothing.
    let meet = behind as f64 - AROUND as f64 * both[3] / both[4];
    of_hit < HIT * of_step && (group.start as f64 - 1.0..=group.end as f64).contains(&meet)
}

/// A parabola of time through some rows, and from a sample on a polynomial of so many terms beside it; and what they leave.
fn fitted(
    q: &[f64],
    rows: &[usize],
    sample: usize,
    terms_behind: usize,
) -> Option<(DVector<f64>, f64)> {
    let design = design(rows, sample, terms_behind);
    let values = DVector::from_fn(rows.len(), |row, _| q[rows[row]] - q[sample]);
    let solved = design.clone().svd(true, true).solve(&values, 1e-9).ok()?;
    let left = (design * &solved - values).norm();
    Some((solved, left))
}

/// What [`fitted`] is linear in, a row each of `rows`.
pub(super) fn design(rows: &[usize], sample: usize, terms_behind: usize) -> DMatrix<f64> {
    let of = |k: usize, column: usize| {
        let t = (k as f64 - sample as f64) / AROUND as f64;
        match column {
            0..3 => t.powi(column as i32),
            _ if k < sample => 0.0,
            _ => t.powi(column as i32 - 3),
        }
    };
    DMatrix::from_fn(rows.len(), 3 + terms_behind, |row, column| {
        of(rows[row], column)
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
            let Measured::Step(jump) = measured(&q, &(at - 1..at + 1), 0.01) else {
                panic!("no step");
            };
            assert_eq!(jump.sample, at);
            // A parabola is one on both sides.
            assert!((jump.size_rad + 0.02).abs() < 1e-12, "{jump:?}");
        }
        assert_eq!(measured(&[0.0, 1.0], &(0..2), 0.01), Measured::Nothing);
    }

    #[test]
    fn a_hit_is_no_step() {
        // From 10 rad/s back at 6 rad/s at 1 kHz, between two samples or over three, on whole counts.
        for (moment, lasts) in [(0.0201, 0.0), (0.0205, 0.0), (0.0209, 0.0), (0.0195, 0.002)] {
            let q: Vec<f64> = (0..40)
                .map(|k| k as f64 * 1e-3 - moment)
                .map(|t| match t {
                    t if t < 0.0 => 10.0 * t,
                    t if t < lasts => 0.0,
                    t => -6.0 * (t - lasts),
                })
                .map(|q| (q * 1e4).round() * 1e-4)
                .collect();
            assert_eq!(measured(&q, &(19..23), 0.001), Measured::Hit, "{moment}");
        }
    }
}
