//! Which waves over angle or time the rest contains: a least-squares spectrum, Lomb 1976, Astrophys. Space Sci. 39.

use super::candidate::Background;
use bristle_plant::Unit;
use nalgebra::DVector;
use rayon::prelude::*;

/// Lines that are looked at more closely.
const LINES: usize = 3;
/// Most lines of a spectrum: a finer one only costs time.
const MOST_LINES: f64 = 4000.0;
/// A wave of which the kernel leaves less is not seen.
const LEAST_LEFT: f64 = 0.1;
/// Lines after which an angle is computed anew.
const TURNED: usize = 64;
/// Points whose waves are kept at hand at once.
const TOGETHER: usize = 256;

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
    let power: Vec<f64> = (0..count.div_ceil(TURNED))
        .into_par_iter()
        .flat_map_iter(|part| {
            let from = part * TURNED;
            let first = range[0] + from as f64 * step;
            let mut power = vec![0.0; TURNED.min(count - from)];
            for set in sets {
                add_power(set, first, step, &mut power);
            }
            power
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

/// An angle that grows by the same step from line to line: turning costs four products where a sine costs tens.
#[derive(Clone, Copy)]
struct Turning {
    sine: f64,
    cosine: f64,
    by_sine: f64,
    by_cosine: f64,
}

impl Turning {
    fn new(angle: f64, step: f64) -> Self {
        let (sine, cosine) = angle.sin_cos();
        let (by_sine, by_cosine) = step.sin_cos();
        Self {
            sine,
            cosine,
            by_sine,
            by_cosine,
        }
    }

    fn turn(&mut self) {
        let sine = self.sine * self.by_cosine + self.cosine * self.by_sine;
        self.cosine = self.cosine * self.by_cosine - self.sine * self.by_sine;
        self.sine = sine;
    }
}

/// Adds what a wave takes of a set's rest, for lines from `first` on.
fn add_power(set: &[(f64, f64, f64, f64)], first: f64, step: f64, power: &mut [f64]) {
    let mut sums = vec![[0.0; 5]; power.len()];
    for points in set.chunks(TOGETHER) {
        let mut waves: Vec<(Turning, Turning)> = points
            .iter()
            .map(|&(angle, span, ..)| {
                (
                    Turning::new(first * angle, step * angle),
                    Turning::new(0.5 * first * span, 0.5 * step * span),
                )
            })
            .collect();
        for (i, sum) in sums.iter_mut().enumerate() {
            let line = first + i as f64 * step;
            for ((wave, across), &(_, span, times, rest)) in waves.iter_mut().zip(points) {
                let half = 0.5 * line * span;
                // The kernel's three running means each leave sin(x)/x of a wave.
                let left = if half.abs() < 1e-3 {
                    1.0
                } else {
                    across.sine / half
                };
                let left = left * left * left;
                // A line near a multiple of the nodes' rate looks like a slow one, only that hardly anything of it is
                // left: it would explain the slow one by a huge amplitude.
                let times = if left.abs() < LEAST_LEFT {
                    0.0
                } else {
                    times * left
                };
                let (a, b) = (times * wave.sine, times * wave.cosine);
                sum[0] += a * a;
                sum[1] += a * b;
                sum[2] += b * b;
                sum[3] -= a * rest;
                sum[4] -= b * rest;
                wave.turn();
                across.turn();
            }
        }
    }
    for (power, [aa, ab, bb, ar, br]) in power.iter_mut().zip(sums) {
        *power += solve(aa, ab, bb, ar, br).map_or(0.0, |(_, _, gain)| gain);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_angle_is_the_angle() {
        let mut turning = Turning::new(0.3, 0.7);
        for i in 1..TURNED {
            turning.turn();
            let (sine, cosine) = (0.3 + 0.7 * i as f64).sin_cos();
            // Each turn rounds a few times by 1.1e-16.
            assert!((turning.sine - sine).abs() < 1e-13);
            assert!((turning.cosine - cosine).abs() < 1e-13);
        }
    }

    #[test]
    fn finds_the_line_of_a_wave() {
        let set: Vec<(f64, f64, f64, f64)> = (0..5000)
            .map(|k| {
                let angle = 20.0 * (f64::from(k) * 7e-4).sin();
                (angle, 0.01, 1.0, (17.0 * angle + 0.4).sin())
            })
            .collect();
        let found = lines(&[set], [1.0, 200.0], 1.0);
        assert!((found[0] - 17.0).abs() < 1e-9, "{found:?}");
    }
}
