//! Which waves over angle or time the rest contains: a least-squares spectrum, Lomb 1976, Astrophys. Space Sci. 39.

use super::candidate::Background;
use bristle_plant::Unit;
use nalgebra::DVector;
use rayon::prelude::*;

/// Lines that are looked at more closely.
const LINES: usize = 3;
/// Most lines of a spectrum: a finer one only costs time.
const MOST_LINES: f64 = 4000.0;

/// Coefficients of two columns that take most of a rest away, and how much of its square they take.
pub fn two_columns(
    a: &DVector<f64>,
    b: &DVector<f64>,
    rest: &DVector<f64>,
) -> Option<(f64, f64, f64)> {
    let (aa, ab, bb) = (a.norm_squared(), a.dot(b), b.norm_squared());
    let (ar, br) = (-a.dot(rest), -b.dot(rest));
    solve(aa, ab, bb, ar, br)
}

fn solve(aa: f64, ab: f64, bb: f64, ar: f64, br: f64) -> Option<(f64, f64, f64)> {
    let determinant = aa * bb - ab * ab;
    if determinant <= 1e-9 * aa * bb || aa <= 0.0 {
        return None;
    }
    let x = (bb * ar - ab * br) / determinant;
    let y = (aa * br - ab * ar) / determinant;
    Some((x, y, x * ar + y * br))
}

/// Orders a turn or a metre, most power first. `still` is the change of the weighted rest at order zero: what the wave
/// is multiplied by at each node.
pub fn in_angle(background: &Background<'_>, still: &DVector<f64>, range: [f64; 2]) -> Vec<f64> {
    let scale = background.scale;
    let step = match scale.unit {
        Unit::Rotary => 1.0,
        Unit::Linear => 0.3 / (scale.highest_rad - scale.lowest_rad).max(1e-9),
    };
    let points: Vec<(f64, f64, f64, f64)> = points(background, still, |background, i| {
        let node = &background.nodes[i];
        let record = &background.records[node.record];
        let stretch = &record.stretches[node.stretch];
        let advance = stretch.velocity_rad_s[node.sample] * record.step_s;
        (
            scale.unit.wave_rad(stretch.smooth_rad[node.sample]),
            scale.unit.wave_rad(advance) * record.kernel.length as f64,
        )
    });
    lines(&[points], range, step)
}

/// Frequencies, most power first, with a phase of its own for each record.
pub fn in_time(background: &Background<'_>, still: &DVector<f64>, range: [f64; 2]) -> Vec<f64> {
    let scale = background.scale;
    let step = 0.3 / scale.duration_s.max(1e-9);
    let tau = std::f64::consts::TAU;
    let all = points(background, still, |background, i| {
        let node = &background.nodes[i];
        let record = &background.records[node.record];
        let start_s = record.stretches[node.stretch].start_s;
        (
            tau * (start_s + node.sample as f64 * record.step_s),
            tau * record.step_s * record.kernel.length as f64,
        )
    });
    let mut split = vec![Vec::new(); background.records.len()];
    let kept = (0..background.nodes.len()).filter(|&i| background.weights[i] > 0.0);
    for (i, point) in kept.zip(all) {
        split[background.nodes[i].record].push(point);
    }
    lines(&split, range, step)
}

/// Angle, angle that a running mean spans, multiplier and rest at each node that counts.
fn points(
    background: &Background<'_>,
    still: &DVector<f64>,
    angle: impl Fn(&Background<'_>, usize) -> (f64, f64),
) -> Vec<(f64, f64, f64, f64)> {
    (0..background.nodes.len())
        .filter(|&i| background.weights[i] > 0.0)
        .map(|i| {
            let (at, span) = angle(background, i);
            let rest = background.fit.left_over[i] * background.weights[i];
            (at, span, still[i], rest)
        })
        .collect()
}

fn lines(sets: &[Vec<(f64, f64, f64, f64)>], range: [f64; 2], step: f64) -> Vec<f64> {
    let step = step.max((range[1] - range[0]) / MOST_LINES);
    let count = ((range[1] - range[0]) / step).floor() as usize + 1;
    let power: Vec<f64> = (0..count)
        .into_par_iter()
        .map(|i| {
            let line = range[0] + i as f64 * step;
            sets.iter().map(|set| power_of(set, line)).sum()
        })
        .collect();
    let mut peaks: Vec<usize> = (0..count)
        .filter(|&i| {
            (i == 0 || power[i] >= power[i - 1]) && (i + 1 == count || power[i] >= power[i + 1])
        })
        .collect();
    peaks.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
    peaks
        .into_iter()
        .take(LINES)
        .map(|i| range[0] + i as f64 * step)
        .collect()
}

fn power_of(set: &[(f64, f64, f64, f64)], line: f64) -> f64 {
    let (mut aa, mut ab, mut bb, mut ar, mut br) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for &(angle, span, times, rest) in set {
        let half = 0.5 * line * span;
        // The kernel's three running means each leave sin(x)/x of a wave.
        let left = if half.abs() < 1e-3 {
            1.0
        } else {
            (half.sin() / half).powi(3)
        };
        let (sine, cosine) = (line * angle).sin_cos();
        let (a, b) = (times * left * sine, times * left * cosine);
        aa += a * a;
        ab += a * b;
        bb += b * b;
        ar -= a * rest;
        br -= b * rest;
    }
    solve(aa, ab, bb, ar, br).map_or(0.0, |(_, _, gain)| gain)
}
