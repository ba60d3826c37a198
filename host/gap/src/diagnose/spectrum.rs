//! Which waves over angle or time the rest contains: a least-squares spectrum, Lomb 1976, Astrophys. Space Sci. 39.

use super::candidate::Background;
use crate::inverse::Record;
use crate::signal::fourier;
use bristle_plant::Unit;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Lines that are looked at more closely.
const LINES: usize = 8;
/// Most lines of a spectrum: a finer one only costs time.
const MOST_LINES: f64 = 4000.0;
/// Lines of a spectrum over time in the width of one.
pub(super) const PADDED: usize = 4;
/// Part of the power of a motion that is at one frequency where the axis is moved to and fro.
const SWINGS: f64 = 0.6;
/// A wave of which the kernel leaves less is not seen.
const LEAST_LEFT: f64 = 0.1;
/// Lines after which an angle is computed anew. Of so many slow ones the power is what the simulator's own parameters have not taken: they
/// take nearly all of a wave that is passed slowly, and hardly anything of faster ones.
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

/// Orders a turn or a metre in a weighted `rest`, most power first. `still` is its change at order zero: what the wave is multiplied by at each
/// node.
pub fn in_angle(
    background: &Background<'_>,
    rest: &DVector<f64>,
    still: &DVector<f64>,
    range: [f64; 2],
) -> Vec<f64> {
    let scale = background.scale;
    let step = match scale.unit {
        Unit::Rotary => 1.0,
        Unit::Linear => 0.3 / (scale.highest_rad - scale.lowest_rad).max(1e-9),
    };
    let counts: Vec<usize> = (0..background.nodes.len())
        .filter(|&i| background.weights[i] > 0.0)
        .collect();
    let points: Vec<(f64, f64, f64, f64)> = counts
        .iter()
        .map(|&i| {
            let node = &background.nodes[i];
            let record = &background.records[node.record];
            let stretch = &record.stretches[node.stretch];
            let advance = stretch.velocity_rad_s[node.sample] * record.step_s;
            (
                scale.unit.wave_rad(stretch.smooth_rad[node.sample]),
                scale.unit.wave_rad(advance) * record.kernel.length as f64,
                still[i],
                rest[i],
            )
        })
        .collect();
    let own = background.own_at(&counts);
    lines(&points, &own, range, step)
}

/// Frequencies in a weighted `rest`, most power first, with a phase of its own for each record; none at which an axis is moved to and fro: what is there at that
/// may be a function of where it is.
pub fn in_time(
    background: &Background<'_>,
    rest: &DVector<f64>,
    still: &DVector<f64>,
    range: [f64; 2],
) -> Vec<f64> {
    let of_record = |record: &Record| Even::new(record.node_s());
    let mut sets: Vec<Even> = background.records.iter().map(of_record).collect();
    let mut motions: Vec<Even> = background.records.iter().map(of_record).collect();
    for (i, node) in background.nodes.iter().enumerate() {
        let time_s = node.time_s(background.records);
        sets[node.record].add(time_s, still[i], rest[i]);
        motions[node.record].add(time_s, 1.0, node.velocity_rad_s(background.records));
    }
    let swings: Vec<[f64; 2]> = motions.iter().filter_map(Even::swings).collect();
    frequencies(&sets, range, &swings)
}

/// Nodes of a record, evenly in time: those that do not count are zero.
struct Even {
    spacing_s: f64,
    /// Squares of the multiplier.
    squares: Vec<f64>,
    /// Products of multiplier and rest.
    products: Vec<f64>,
}

impl Even {
    fn new(spacing_s: f64) -> Self {
        Self {
            spacing_s,
            squares: Vec::new(),
            products: Vec::new(),
        }
    }

    fn add(&mut self, time_s: f64, times: f64, rest: f64) {
        let place = (time_s / self.spacing_s).round() as usize;
        if place >= self.squares.len() {
            self.squares.resize(place + 1, 0.0);
            self.products.resize(place + 1, 0.0);
        }
        self.squares[place] += times * times;
        self.products[place] += times * rest;
    }

    fn duration_s(&self) -> f64 {
        self.squares.len() as f64 * self.spacing_s
    }

    /// Frequencies between which the products swing, where they hardly do anything else.
    fn swings(&self) -> Option<[f64; 2]> {
        let length = (PADDED * self.products.len()).next_power_of_two();
        let mut padded = self.products.clone();
        padded.resize(length, 0.0);
        let plan = fourier(length);
        let mut spectrum = plan.make_output_vec();
        plan.process(&mut padded, &mut spectrum).ok()?;
        let power: Vec<f64> = spectrum.iter().map(|line| line.norm_sqr()).collect();
        let highest = peaks(&power).next()?;
        let near = highest.saturating_sub(PADDED)..=(highest + PADDED).min(power.len() - 1);
        let per_line = 1.0 / (length as f64 * self.spacing_s);
        let [from, to] = [*near.start(), *near.end()].map(|line| line as f64 * per_line);
        let part = power[near].iter().sum::<f64>() / power.iter().sum::<f64>();
        (part > SWINGS).then_some([from, to])
    }

    /// Adds what a wave takes of the rest at each line from `first` on, where the nodes see it. The sums of a
    /// least-squares spectrum are values of two Fourier transforms: Press and Rybicki 1989, Astrophys. J. 338.
    fn add_power(&self, first: f64, step: f64, power: &mut [f64]) {
        let length = (PADDED * self.squares.len()).next_power_of_two();
        let plan = fourier(length);
        let transform = |values: &[f64]| {
            let mut padded = values.to_vec();
            padded.resize(length, 0.0);
            let mut spectrum = plan.make_output_vec();
            // It fails for other lengths than its own only.
            plan.process(&mut padded, &mut spectrum).map(|()| spectrum)
        };
        let (Ok(squares), Ok(products)) = (transform(&self.squares), transform(&self.products))
        else {
            return;
        };
        let per_bin = 1.0 / (length as f64 * self.spacing_s);
        for (i, power) in power.iter_mut().enumerate() {
            let bin = ((first + i as f64 * step) / per_bin).round() as usize;
            if bin > length / 2 {
                break;
            }
            let twice = match 2 * bin {
                twice if twice <= length / 2 => squares[twice],
                twice => squares[length - twice].conj(),
            };
            let whole = squares[0].re;
            let (aa, bb) = (0.5 * (whole + twice.re), 0.5 * (whole - twice.re));
            let (ar, br) = (products[bin].re, -products[bin].im);
            *power += solve(aa, -0.5 * twice.im, bb, ar, br).map_or(0.0, |(_, _, gain)| gain);
        }
    }
}

/// `swings` are frequencies between which there is none.
fn frequencies(sets: &[Even], [low, high]: [f64; 2], swings: &[[f64; 2]]) -> Vec<f64> {
    let longest_s = sets.iter().map(Even::duration_s).fold(1e-9, f64::max);
    let fastest = sets
        .iter()
        .map(|set| 0.5 / set.spacing_s)
        .fold(0.0, f64::max);
    let step = 1.0 / (PADDED as f64 * longest_s);
    let count = ((high.min(fastest) - low).max(0.0) / step) as usize + 1;
    let mut power = vec![0.0; count];
    for set in sets {
        set.add_power(low, step, &mut power);
    }
    for (i, power) in power.iter_mut().enumerate() {
        let hz = low + i as f64 * step;
        if swings.iter().any(|[from, to]| (*from..=*to).contains(&hz)) {
            *power = 0.0;
        }
    }
    peaks(&power).map(|i| low + i as f64 * step).collect()
}

/// Places of the highest lines, the highest first.
fn peaks(power: &[f64]) -> impl Iterator<Item = usize> {
    let count = power.len();
    let mut peaks: Vec<usize> = (0..count)
        .filter(|&i| {
            (i == 0 || power[i] >= power[i - 1]) && (i + 1 == count || power[i] >= power[i + 1])
        })
        .collect();
    peaks.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
    peaks.into_iter().take(LINES)
}

/// `set` holds angle, angle that a running mean spans, multiplier and rest at each node that counts; `own` has a column for each of those,
/// what the simulator's own parameters can do there.
fn lines(set: &[(f64, f64, f64, f64)], own: &DMatrix<f64>, range: [f64; 2], step: f64) -> Vec<f64> {
    let step = step.max((range[1] - range[0]) / MOST_LINES);
    let count = ((range[1] - range[0]) / step).floor() as usize + 1;
    let power: Vec<f64> = (0..count.div_ceil(TURNED))
        .into_par_iter()
        .flat_map_iter(|part| {
            let from = part * TURNED;
            let lines = TURNED.min(count - from);
            let own = (part == 0).then_some(own);
            power(set, own, range[0] + from as f64 * step, step, lines)
        })
        .collect();
    peaks(&power).map(|i| range[0] + i as f64 * step).collect()
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

/// What a wave takes of a set's rest beyond what `own` can do, for so many lines from `first` on.
fn power(
    set: &[(f64, f64, f64, f64)],
    own: Option<&DMatrix<f64>>,
    first: f64,
    step: f64,
    lines: usize,
) -> Vec<f64> {
    let parameters = own.map_or(0, DMatrix::nrows);
    let mut sums = vec![[0.0; 5]; lines];
    let mut taken = vec![[DVector::zeros(parameters), DVector::zeros(parameters)]; lines];
    let mut of_rest = DVector::zeros(parameters);
    for (part, points) in set.chunks(TOGETHER).enumerate() {
        let mut waves: Vec<(Turning, Turning)> = points
            .iter()
            .map(|&(angle, span, ..)| {
                (
                    Turning::new(first * angle, step * angle),
                    Turning::new(0.5 * first * span, 0.5 * step * span),
                )
            })
            .collect();
        let own = own.map(|own| own.columns(part * TOGETHER, points.len()));
        if let Some(own) = &own {
            for (&(.., rest), own) in points.iter().zip(own.column_iter()) {
                of_rest.axpy(rest, &own, 1.0);
            }
        }
        for (i, (sum, [by_sine, by_cosine])) in sums.iter_mut().zip(&mut taken).enumerate() {
            let line = first + i as f64 * step;
            for (at, ((wave, across), &(_, span, times, rest))) in
                waves.iter_mut().zip(points).enumerate()
            {
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
                if let Some(own) = &own {
                    by_sine.axpy(a, &own.column(at), 1.0);
                    by_cosine.axpy(b, &own.column(at), 1.0);
                }
                wave.turn();
                across.turn();
            }
        }
    }
    let of_line = |([aa, ab, bb, ar, br], [a, b]): ([f64; 5], [DVector<f64>; 2])| {
        let (aa, ab, bb) = (aa - a.norm_squared(), ab - a.dot(&b), bb - b.norm_squared());
        let taken = solve(aa, ab, bb, ar + a.dot(&of_rest), br + b.dot(&of_rest));
        taken.map_or(0.0, |(_, _, gain)| gain)
    };
    sums.into_iter().zip(taken).map(of_line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

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
        let found = lines(&set, &DMatrix::zeros(0, set.len()), [1.0, 200.0], 1.0);
        assert!((found[0] - 17.0).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn finds_a_slow_line_of_which_little_is_left() {
        // A third of a turn: a straight line takes nearly all of a wave of one a turn.
        let angle = |k: i32| 2.0 * f64::from(k) / 3000.0;
        let count = 3000;
        let own = DMatrix::from_fn(2, count, |i, k| {
            let x = 2.0 * k as f64 / count as f64 - 1.0;
            [1.0, 3.0_f64.sqrt() * x][i] / (count as f64).sqrt()
        });
        let wave = DVector::from_iterator(count, (0..count as i32).map(|k| angle(k).sin()));
        let rest = &wave - own.transpose() * (&own * &wave);
        // Beside it a faster one, of which all is left.
        let fast = 0.5 * rest.norm() / wave.norm();
        let set: Vec<(f64, f64, f64, f64)> = (0..count as i32)
            .map(|k| {
                let faster = fast * (40.0 * angle(k)).sin();
                (angle(k), 0.01, 1.0, -rest[k as usize] - faster)
            })
            .collect();
        let first = |own: &DMatrix<f64>| lines(&set, own, [1.0, 200.0], 1.0)[0];
        // A wave of two a turn is as good a curve there as one of one.
        assert!(first(&own) < 2.5, "{}", first(&own));
        // Of what is left of it a faster one takes more.
        assert!(first(&DMatrix::zeros(0, count)) > 2.5);
    }

    #[test]
    fn finds_a_slow_line_in_fast_records() {
        let mut sets = Vec::new();
        for (spacing_s, seconds, phase) in [(4e-4, 11.0, 0.4), (1e-3, 9.0, 2.0)] {
            let mut set = Even::new(spacing_s);
            for k in 0..(seconds / spacing_s) as usize {
                let time_s = k as f64 * spacing_s;
                // A multiplier that changes, and a rest beside the wave.
                let times = if time_s % 1.0 < 0.3 { 0.0 } else { 1.0 };
                let wave = (TAU * 0.8683 * time_s + phase).sin();
                set.add(time_s, times, times * wave + 0.5 * (0.3 * time_s).sin());
            }
            sets.push(set);
        }
        let found = frequencies(&sets, [0.17, 4000.0], &[]);
        // A quarter of the width of a line.
        assert!((found[0] - 0.8683).abs() < 0.25 / 11.0, "{found:?}");
    }

    #[test]
    fn an_axis_that_swings_hides_its_frequency() {
        let of = |value: fn(f64) -> f64| {
            let mut set = Even::new(1e-3);
            for k in 0..9000 {
                let time_s = 1e-3 * f64::from(k);
                set.add(time_s, 1.0, value(time_s));
            }
            set
        };
        let swing = |time_s: f64| (TAU * 0.7 * time_s).sin();
        let swings = of(swing).swings().unwrap();
        assert!(swings[0] < 0.7 && 0.7 < swings[1], "{swings:?}");
        // Of a faster motion beside it each has half of the power.
        let two = |time_s: f64| (TAU * 0.7 * time_s).sin() + (TAU * 5.0 * time_s).sin();
        assert!(of(two).swings().is_none());
        let both = of(|time_s| 2.0 * (TAU * 0.7 * time_s).sin() + (TAU * 3.0 * time_s).sin());
        let sets = [both];
        let first = |swings: &[[f64; 2]]| frequencies(&sets, [0.17, 100.0], swings)[0];
        // A quarter of the width of a line.
        assert!((first(&[]) - 0.7).abs() < 0.25 / 9.0);
        assert!((first(&[swings]) - 3.0).abs() < 0.25 / 9.0);
    }
}
