//! The floor where nothing repeats: the effort at rest, the highest frequencies of the effort, and the encoder's count
//! through inertia and second difference.

use super::noise::Noise;
use super::repeats::pieces;
use crate::signal::extent;
use crate::stretch::Stretch;

/// Shortest rest, s and samples.
const SHORTEST_S: f64 = 0.05;
const SHORTEST_SAMPLES: usize = 50;
/// Rms over that of white noise of the same highest frequencies, at most: a first-order noise of coefficient 0.98.
const MOST_COLOURED: f64 = 10.0;
/// Rest that is enough for a noise model, samples in all.
const ENOUGH_SAMPLES: usize = 500;

/// Noise of inertia times the second difference of positions that are rounded to counts, which is white where the axis
/// passes counts: variance of a rounding, 1/12, times the coefficients of the square of 1, -2, 1.
pub(super) fn encoder_noise(inertia: f64, count_rad: f64, step_s: f64) -> Noise {
    let size = (inertia * count_rad / (step_s * step_s)).powi(2) / 12.0;
    Noise::known(vec![6.0 * size, -4.0 * size, size])
}

/// Noise of the effort at rest, less its trend; as large as in motion where it is larger there. With it, the time at rest
/// and how much larger. None where the axis does not rest long enough or its effort is silent then.
pub(super) fn from_rest(
    stretches: &[Stretch],
    usable: &[bool],
    count_rad: Option<f64>,
) -> Option<(Noise, f64, f64)> {
    let mut rests: Vec<Vec<f64>> = Vec::new();
    let (mut moving, mut range_nm) = (Vec::new(), 0.0_f64);
    let step_s = stretches.first()?.step_s;
    let shortest = SHORTEST_SAMPLES.max((SHORTEST_S / step_s).ceil() as usize);
    for stretch in stretches {
        let q = &stretch.position_rad;
        let (low, high) = extent(q);
        // Without a count, a ten-thousandth of the travel.
        let band = 1.5 * count_rad.unwrap_or(1e-4 * (high - low));
        range_nm = stretch
            .effort_nm
            .iter()
            .fold(range_nm, |m, u| m.max(u.abs()));
        let mut still = vec![false; q.len()];
        for range in rests_of(q, band, shortest) {
            still[range].fill(true);
        }
        let ok = |k: usize| usable[stretch.range.start + k];
        let at_rest: Vec<bool> = (0..q.len()).map(|k| still[k] && ok(k)).collect();
        let in_motion: Vec<bool> = (0..q.len()).map(|k| !still[k] && ok(k)).collect();
        rests.extend(
            pieces(&stretch.effort_nm, &at_rest)
                .into_iter()
                .filter(|piece| piece.len() >= shortest)
                .map(without_trend),
        );
        moving.extend(pieces(&stretch.effort_nm, &in_motion));
    }
    let samples: usize = rests.iter().map(Vec::len).sum();
    if samples < ENOUGH_SAMPLES {
        return None;
    }
    let slices: Vec<&[f64]> = rests.iter().map(Vec::as_slice).collect();
    // Mean, slope and bend of each rest.
    let freedom = 1.0 - 3.0 * rests.len() as f64 / samples as f64;
    let mut noise = Noise::of(&slices, freedom)?;
    let rest_rms = fourth_difference_rms(&slices)?;
    // Rounding of a silent effort is no noise, and neither is a ramp or a loop that winds up.
    if noise.rms <= 1e-9 * range_nm || noise.rms > MOST_COLOURED * rest_rms {
        return None;
    }
    let larger = fourth_difference_rms(&moving).map_or(1.0, |moving| (moving / rest_rms).max(1.0));
    noise.scale(larger);
    Some((noise, samples as f64 * step_s, larger))
}

/// White noise of the effort, from its fourth differences, which hold little else.
pub(super) fn high_frequencies(stretches: &[Stretch], usable: &[bool]) -> Option<Noise> {
    let mut kept = Vec::new();
    for stretch in stretches {
        kept.extend(pieces(&stretch.effort_nm, &usable[stretch.range.clone()]));
    }
    let rms = fourth_difference_rms(&kept)?;
    Some(Noise::known(vec![rms * rms]))
}

/// Rms of white noise with these fourth differences: from their median, which single steps of a command do not move; from
/// their mean square where the column is so coarse that most are zero.
fn fourth_difference_rms(pieces: &[&[f64]]) -> Option<f64> {
    let mut sizes: Vec<f64> = pieces
        .iter()
        .flat_map(|piece| piece.windows(5))
        .map(|u| (u[0] - 4.0 * u[1] + 6.0 * u[2] - 4.0 * u[3] + u[4]).abs())
        .collect();
    if sizes.len() < 16 {
        return None;
    }
    let middle = sizes.len() / 2;
    let median = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
    // 1 + 16 + 36 + 16 + 1 = 70; half of a normal distribution lies within 0.6745.
    Some(if median > 0.0 {
        median / (0.6745 * 70_f64.sqrt())
    } else {
        crate::signal::rms(sizes) / 70_f64.sqrt()
    })
}

/// Longest runs within a band of position, of a length at least.
fn rests_of(q: &[f64], band: f64, shortest: usize) -> Vec<std::ops::Range<usize>> {
    let mut out = Vec::new();
    let (mut start, mut low, mut high) = (0, f64::INFINITY, f64::NEG_INFINITY);
    for k in 0..=q.len() {
        if k < q.len() {
            (low, high) = (low.min(q[k]), high.max(q[k]));
            if high - low <= band {
                continue;
            }
        }
        if k - start >= shortest {
            out.push(start..k);
        }
        start = k;
        if k < q.len() {
            (low, high) = (q[k], q[k]);
        }
    }
    out
}

/// Less its parabola of least squares: at rest an integrator still moves the effort.
fn without_trend(values: &[f64]) -> Vec<f64> {
    let n = values.len() as f64;
    let x = |k: usize| 2.0 * k as f64 / (n - 1.0) - 1.0;
    let terms = |k: usize| nalgebra::Vector3::new(1.0, x(k), x(k) * x(k));
    let (mut xx, mut xy) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
    for (k, value) in values.iter().enumerate() {
        xx += terms(k) * terms(k).transpose();
        xy += terms(k) * *value;
    }
    let fitted = xx
        .cholesky()
        .map_or(nalgebra::Vector3::zeros(), |xx| xx.solve(&xy));
    values
        .iter()
        .enumerate()
        .map(|(k, value)| value - terms(k).dot(&fitted))
        .collect()
}
