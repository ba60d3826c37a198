//! What the positions of a log say of its sensor by themselves: the grid they lie on, and noise that grows with speed.

use crate::signal::{correlation, extent, fourier};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// The grid is looked for on positions counted in halves of a count.
const BINS_PER_COUNT: f64 = 2.0;
/// Longest range of positions that a grid is looked for in, bins: 20 bits for four turns.
const MOST_BINS: usize = 1 << 23;
/// Longest part of it that is counted, bins: the fullest one.
const WINDOW: usize = 1 << 20;
/// Coarsest grid that is looked for, counts.
const COARSEST: f64 = 1000.0;
/// Fewest grid steps that make a grid.
const FEWEST_STEPS: f64 = 30.0;
/// Share of positions in step from which they are a grid: noise of a fifth of its step leaves 0.45.
const IN_STEP: f64 = 0.35;
/// The same for few positions: n of them are in step by chance, at one of many grids, to this over the root of n.
const BY_CHANCE: f64 = 6.0;
/// A bin counts at most so many times the mean of those that are not empty: where an axis rests says nothing of a grid.
const RESTS: f64 = 3.0;
/// Lines of the spectrum that are looked at.
const MOST_LINES: usize = 20;
/// Numbers of waves that are tried between two lines.
const BETWEEN: f64 = 20.0;
/// Steps of more counts than this are motion.
const STIRS: f64 = 0.75;
/// Parts of the speeds in each of which positions lie on a grid, and the share in step that says so: what is in step by
/// chance is a seventh of 50.
const SPEEDS: usize = 4;
const AT_ITS_SPEED: f64 = 0.25;
/// Samples over which a speed is taken.
const OVER: usize = 32;
/// The quarter of slower motion is slower than the quarter of faster motion by this factor, or it is all one speed.
const UNEVEN: f64 = 0.9;
/// Fewest samples in each part of the speeds.
const FEWEST: usize = 50;
/// Third difference, counts, that rounding alone makes throughout at half a count a sample: below a count it grows with
/// speed, too.
const ROUNDS_TO: f64 = 2.0;
/// Part of the third differences in which noise is measured, without single jerks.
const SMALLER: f64 = 0.75;
/// Mean square of that part of normal noise over all of its variance.
const OF_SMALLER: f64 = 0.3684;
/// Parts of the speeds that noise is measured in.
const PARTS: usize = 8;
/// So many of the fastest of them tell whether it is noise: third differences of white noise correlate with the next by -15/20, those of a motion that
/// alternates from sample to sample by -1, of a slow motion by +1. Of opened logs jitter was at -0.38 to -0.77, an axis that alternated at -0.97.
const FAST: usize = 2;
const WHITE: RangeInclusive<f64> = -0.9..=-0.2;
/// Third differences beyond so many times the usual are single jerks.
const JERKS: f64 = 3.0;

/// The sensor as the positions show it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// Grid that positions lie on, coarser than a count, rad: zero where there is none, nothing where they are too few, all
    /// of one speed, or in step with a grid for another reason.
    pub grid_rad: Option<f64>,
    /// Nats by which the grid is more probable than positions that lie anywhere.
    pub grid_nats: f64,
    /// Noise of time stamps, s rms; zero where none shows.
    pub jitter_s: f64,
    /// The most that the noise at the fastest motion allows, s rms.
    pub most_jitter_s: f64,
    /// Nats by which noise that grows with speed so is more probable than the same noise at every speed.
    pub jitter_nats: f64,
}

impl Shown {
    /// The grid, if there is one, rad; else zero.
    pub fn coarse_rad(&self) -> f64 {
        self.grid_rad.unwrap_or(0.0)
    }

    /// Position noise that the clock makes at a speed, in means of so many samples, rad rms.
    pub fn clock_noise_rad(&self, speed_rad_s: f64, averaged: usize) -> f64 {
        self.jitter_s * speed_rad_s / (averaged as f64).sqrt()
    }
}

/// Looks at positions sampled every `step_s` by an encoder of this count.
pub fn shown(position_rad: &[f64], step_s: f64, rad_per_count: f64) -> Shown {
    let grid_rad = grid_rad(position_rad, rad_per_count);
    shown_on(grid_rad, position_rad, step_s, rad_per_count)
}

/// The same of positions whose grid is known.
pub fn shown_on(
    grid_rad: Option<f64>,
    position_rad: &[f64],
    step_s: f64,
    rad_per_count: f64,
) -> Shown {
    let coarse_rad = grid_rad.unwrap_or(0.0);
    let count_rad = rad_per_count.max(coarse_rad);
    let grid_nats = if coarse_rad > 0.0 {
        // Of a von Mises distribution over an even one, for each step of the grid that was passed.
        let path: f64 = position_rad.windows(2).map(|q| (q[1] - q[0]).abs()).sum();
        path / coarse_rad * in_step_with(coarse_rad, position_rad.iter()).powi(2)
    } else {
        0.0
    };
    Shown {
        grid_rad,
        grid_nats,
        ..jitter(position_rad, step_s, count_rad)
    }
}

/// The grid that positions lie on, if it is coarser than a count: the longest wave that how often each position was seen
/// has in common with a comb. What is noise of a few counts on a coarse sensor blurs its teeth, and leaves them there.
pub fn grid_rad(position_rad: &[f64], rad_per_count: f64) -> Option<f64> {
    let (low, high) = extent(position_rad);
    let bin_rad = rad_per_count / BINS_PER_COUNT;
    let span = (high - low) / bin_rad;
    if !span.is_finite() || span >= MOST_BINS as f64 || span < FEWEST_STEPS {
        return None;
    }
    let moving = at_several_speeds(position_rad, rad_per_count)?;
    let length = (span as usize + 1).next_power_of_two().min(WINDOW);
    let length_rad = bin_rad * length as f64;
    let first = fullest(&moving, low, length_rad);
    let inside = |q: &&f64| (first..first + length_rad).contains(*q);
    let near: Vec<f64> = moving.iter().filter(inside).copied().collect();
    let mut seen = vec![0.0_f64; length];
    for q in position_rad.iter().filter(inside) {
        seen[((q - first) / bin_rad).round() as usize % length] += 1.0;
    }
    let filled = seen.iter().filter(|&&n| n > 0.0).count();
    let most = RESTS * seen.iter().sum::<f64>() / filled as f64;
    for n in &mut seen {
        *n = n.min(most);
    }
    let sum: f64 = seen.iter().sum();
    let plan = fourier(length);
    let mut spectrum = plan.make_output_vec();
    if plan.process(&mut seen, &mut spectrum).is_err() {
        return None;
    }
    // Waves a bin: from the coarsest grid, and enough of its steps, to one and a half counts.
    let slowest = (length as f64 / (COARSEST * BINS_PER_COUNT))
        .max(FEWEST_STEPS * length as f64 / span.min(length as f64))
        .ceil() as usize;
    let fastest = (length as f64 / (1.5 * BINS_PER_COUNT)) as usize;
    let share_2 = |k: usize| spectrum[k].norm_sqr() / (sum * sum);
    let in_step_2 = IN_STEP.powi(2).max(BY_CHANCE.powi(2) / filled as f64);
    let mut from = slowest;
    for _ in 0..MOST_LINES {
        let Some(mut top) = (from..fastest).find(|&k| share_2(k) > in_step_2) else {
            return (from == slowest).then_some(0.0);
        };
        while top + 1 < fastest && share_2(top + 1) > share_2(top) {
            top += 1;
        }
        let waves = most_in_step(top as f64, 1.0, length_rad, &near);
        let lengths = (high - low) / length_rad;
        let waves = most_in_step(
            lengths * waves,
            1.0 + lengths / BETWEEN,
            high - low,
            &moving,
        );
        let grid = (high - low) / waves;
        let part = moving.len().div_ceil(SPEEDS).max(FEWEST);
        let at_every_speed = moving
            .chunks(part)
            .all(|part| in_step_with(grid, part.iter()) > AT_ITS_SPEED);
        if at_every_speed {
            return Some(grid);
        }
        from = top + 2;
    }
    None
}

/// Positions that were passed in motion, by their speed, the slowest first; none where they are few, or were all passed at one
/// speed: sampled evenly, those make a grid of their own.
fn at_several_speeds(position_rad: &[f64], rad_per_count: f64) -> Option<Vec<f64>> {
    let mut moving: Vec<(f64, f64)> = position_rad
        .windows(OVER + 1)
        .map(|q| ((q[OVER] - q[0]).abs() / OVER as f64, q[OVER / 2]))
        .filter(|(step, _)| *step > STIRS * rad_per_count)
        .collect();
    if moving.len() < FEWEST {
        return None;
    }
    moving.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let quarter = moving.len() / 4;
    let one_speed = moving[quarter].0 > UNEVEN * moving[3 * quarter].0;
    (!one_speed).then(|| moving.into_iter().map(|(_, q)| q).collect())
}

/// Where the part of a range begins, of this length, that most positions lie in.
fn fullest(position_rad: &[f64], low_rad: f64, length_rad: f64) -> f64 {
    let half_rad = 0.5 * length_rad;
    let half = |q: &f64| ((q - low_rad) / half_rad) as usize;
    let mut halves = vec![0_usize; 2];
    for half in position_rad.iter().map(half) {
        if half >= halves.len() {
            halves.resize(half + 1, 0);
        }
        halves[half] += 1;
    }
    let both = halves.windows(2).map(|both| both[0] + both[1]);
    let fullest = both.enumerate().max_by_key(|(_, count)| *count);
    low_rad + half_rad * fullest.map_or(0, |(place, _)| place) as f64
}

/// Waves over a length with which positions are most in step, so far from a number of them at most.
fn most_in_step(waves: f64, reach: f64, length_rad: f64, position_rad: &[f64]) -> f64 {
    let steps = (reach * BETWEEN).ceil();
    let least = waves - steps / BETWEEN;
    let mut sums = vec![[0.0; 2]; 2 * steps as usize + 1];
    for q in position_rad {
        let angle = TAU * q / length_rad;
        let [(mut sine, mut cosine), (turns_sine, turns_cosine)] =
            [least, 1.0 / BETWEEN].map(|waves| (waves * angle).sin_cos());
        for [of_sines, of_cosines] in &mut sums {
            *of_sines += sine;
            *of_cosines += cosine;
            (sine, cosine) = (
                sine * turns_cosine + cosine * turns_sine,
                cosine * turns_cosine - sine * turns_sine,
            );
        }
    }
    let squares = sums
        .iter()
        .map(|[sine, cosine]| sine * sine + cosine * cosine);
    let best = squares.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    least + best.map_or(0.0, |(place, _)| place as f64 / BETWEEN)
}

/// How far positions are in step with a grid: one where all lie on it, the inverse root of their number by chance.
fn in_step_with<'a>(grid_rad: f64, position_rad: impl ExactSizeIterator<Item = &'a f64>) -> f64 {
    let count = position_rad.len() as f64;
    let (sine, cosine) = position_rad.fold((0.0, 0.0), |(sine, cosine), q| {
        let angle = TAU * q / grid_rad;
        (sine + angle.sin(), cosine + angle.cos())
    });
    f64::hypot(sine, cosine) / count
}

/// Slope of the third difference's square over the square of speed. Single jerks are left out in each part of the
/// speeds; noise that is there at every speed does not count, nor that of counts, which an axis at rest does not show.
/// Says nothing of the grid.
fn jitter(position_rad: &[f64], step_s: f64, rad_per_count: f64) -> Shown {
    // A third difference of white noise has 1 + 9 + 9 + 1 = 20 times its variance.
    let variance = |square: f64| square / OF_SMALLER / 20.0;
    let quantisation = variance((ROUNDS_TO * rad_per_count).powi(2));
    let thirds: Vec<(f64, f64)> = position_rad
        .windows(4)
        .map(|q| {
            let speed = (q[3] - q[0]).abs() / (3.0 * step_s);
            (speed, q[3] - 3.0 * q[2] + 3.0 * q[1] - q[0])
        })
        .collect();
    let mut samples: Vec<(f64, f64)> = thirds.iter().map(|x| (x.0, x.1.abs())).collect();
    if samples.len() < PARTS * FEWEST {
        return Shown {
            most_jitter_s: f64::INFINITY,
            ..Shown::default()
        };
    }
    let each = samples.len() as f64 / PARTS as f64;
    samples.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let of_smaller = |mut squares: Vec<f64>| {
        squares.sort_unstable_by(f64::total_cmp);
        squares.truncate((SMALLER * squares.len() as f64).ceil() as usize);
        squares.iter().sum::<f64>() / squares.len() as f64
    };
    let parts = || samples.chunks(samples.len().div_ceil(PARTS));
    let points: Vec<(f64, f64)> = parts()
        .map(|part| {
            let square = of_smaller(part.iter().map(|x| x.1 * x.1).collect());
            let speed = part.iter().map(|x| x.0 * x.0).sum::<f64>() / part.len() as f64;
            (speed, variance(square).max(quantisation))
        })
        .collect();
    let mean =
        |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (mut xy, mut xx, mut yy) = (0.0, 0.0, 0.0);
    for p in &points {
        xy += (p.0 - x) * (p.1 - y);
        xx += (p.0 - x).powi(2);
        yy += (p.1 - y).powi(2);
    }
    // Each beside its own speed: the fastest part of a log that mostly rests holds slow moments, too.
    let beside_speed =
        |&(speed, third): &(f64, f64)| variance(third * third).max(quantisation) / (speed * speed);
    let fastest = parts().next_back().into_iter().flatten();
    let none = Shown {
        most_jitter_s: of_smaller(fastest.map(beside_speed).collect()).sqrt(),
        ..Shown::default()
    };
    // A straight line over the square of speed, or it is something else.
    let straight = xx > 0.0 && yy > 0.0 && xy > 0.0 && xy * xy > 0.8 * xx * yy;
    let fast = samples[samples.len() * (PARTS - FAST) / PARTS].0;
    if !straight || !WHITE.contains(&with_the_next(&thirds, fast)) {
        return none;
    }
    let slope = xy / xx;
    let least = points.iter().fold(f64::INFINITY, |least, p| least.min(p.1));
    let misfit = |seen: f64, said: f64| said.ln() + seen / said;
    // Third differences share three of four positions with the next.
    let nats = points.iter().map(|&(speed, seen)| {
        let said = least + slope * speed;
        0.5 * each / 3.0 * (misfit(seen, y) - misfit(seen, said))
    });
    Shown {
        jitter_s: slope.sqrt(),
        jitter_nats: nats.filter(|nats| nats.is_finite()).sum(),
        ..none
    }
}

/// Correlation of third differences with the next ones where motion is as fast, without single jerks; of speeds and these, in their order.
fn with_the_next(thirds: &[(f64, f64)], fast_rad_s: f64) -> f64 {
    let fast = |&(speed, _): &(f64, f64)| speed >= fast_rad_s;
    let mut sizes: Vec<f64> = thirds
        .iter()
        .filter(|x| fast(x))
        .map(|x| x.1.abs())
        .collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let place = (SMALLER * sizes.len() as f64) as usize;
    let usual = sizes.get(place).copied().unwrap_or_default();
    let is_noise = |x: &(f64, f64)| fast(x) && x.1.abs() <= JERKS * usual;
    let both = thirds.windows(2).filter(|both| both.iter().all(is_noise));
    let (these, next): (Vec<f64>, Vec<f64>) = both.map(|both| (both[0].1, both[1].1)).unzip();
    correlation(&these, &next)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn position(k: usize) -> f64 {
        (0.002 * k as f64).sin() * 3.0
    }

    #[test]
    fn finds_the_grid_and_none_in_a_fine_encoder() {
        let count = 1e-4;
        // A rest at the end, which no grid makes.
        let moved = |k: usize| position(k.min(8000));
        let counted = |q: f64| (q / count).round() * count;
        let coarse = |grid: f64, noise: f64| -> Vec<f64> {
            (0..10_000)
                .map(|k| {
                    let blur = noise * (((k * 7919) % 1000) as f64 / 500.0 - 1.0);
                    counted((moved(k) / grid).floor() * grid + blur * count)
                })
                .collect()
        };
        for (grid, noise) in [(1e-3, 0.0), (4e-4, 0.5), (2e-4, 0.3), (3.3e-3, 2.0)] {
            let found = shown(&coarse(grid, noise), 1e-3, count).coarse_rad();
            // The resolution of a line over 60,000 counts.
            assert!((found / grid - 1.0).abs() < 1e-3, "{grid}: {found}");
        }
        // Over three windows: a grid that is right in one to a twentieth of a line is in step with all.
        let wide: Vec<f64> = (0..40_000)
            .map(|k| (40.0 * position(k) / 1e-2).floor() * 1e-2)
            .collect();
        assert!(240.0 / count * BINS_PER_COUNT > 3.0 * WINDOW as f64);
        let found = shown(&wide, 1e-3, count).coarse_rad();
        // A twentieth of a line over 24,000 steps.
        assert!((found / 1e-2 - 1.0).abs() < 3e-6, "{found}");
        let fine: Vec<f64> = (0..10_000).map(|k| counted(moved(k))).collect();
        assert_eq!(shown(&fine, 1e-3, count).grid_rad, Some(0.0));
        // One speed, whose steps are a grid of 4.3 counts.
        let one: Vec<f64> = (0..10_000).map(|k| counted(4.3e-4 * k as f64)).collect();
        assert_eq!(shown(&one, 1e-3, count).grid_rad, None);
        // To and fro at 10 rad/s for two thirds of the time: 0.01 rad apart.
        let mut at = 0.0;
        let even: Vec<f64> = (0..10_000)
            .map(|k| {
                let speed = (15.0 * (TAU * f64::from(k) / 1000.0).sin()).clamp(-10.0, 10.0);
                at += 1e-3 * speed;
                counted(at)
            })
            .collect();
        assert_eq!(shown(&even, 1e-3, count).coarse_rad(), 0.0);
    }

    #[test]
    fn finds_jitter_and_none_in_quantisation() {
        // A fixed sequence without a pattern: the golden ratio's multiples, made normal enough by a sum of three.
        let draw = |k: usize| {
            let part = |m: f64| (k as f64 * m).fract() - 0.5;
            2.0 * (part(0.618_033_988_7) + part(0.414_213_562_3) + part(0.732_050_807_5))
        };
        let late: Vec<f64> = (0..20_000)
            .map(|k| position(k) + 1e-4 * draw(k) * 6e0 * (0.002 * k as f64).cos())
            .collect();
        let jitter = shown(&late, 1e-3, 1e-6).jitter_s;
        assert!((0.7e-4..1.4e-4).contains(&jitter), "{jitter:e}");
        // Alternates from sample to sample by as much as jitter would move it.
        let alternates: Vec<f64> = (0..20_000)
            .map(|k| (k, if k % 2 == 0 { 1e-4 } else { -1e-4 }))
            .map(|(k, late)| position(k) + 6.0 * late * (0.002 * k as f64).cos())
            .collect();
        assert_eq!(shown(&alternates, 1e-3, 1e-6).jitter_s, 0.0);
        // A record that hardly moves shows nothing of it, and leaves room for more.
        let slow: Vec<f64> = (0..20_000)
            .map(|k| 1e-3 * (late[k] * 1e3).round() * 1e-3)
            .collect();
        let slow = shown(&slow, 1e-3, 1e-5);
        assert_eq!(slow.jitter_s, 0.0);
        assert!(slow.most_jitter_s > 2e-4, "{:e}", slow.most_jitter_s);
        let coarse: Vec<f64> = (0..20_000)
            .map(|k| (position(k) / 1e-3).floor() * 1e-3)
            .collect();
        assert!(shown(&coarse, 1e-3, 1e-3).jitter_s < 0.5e-4);
        // Rests half of the time, and moves by some counts a sample else.
        let rests: Vec<f64> = (0..20_000)
            .map(|k| (position(k % 10_000 / 5_000 * (k % 5_000)) / 1e-3).floor() * 1e-3)
            .collect();
        assert_eq!(shown(&rests, 1e-3, 1e-3).jitter_nats, 0.0);
        // Up to half a count a sample, as slow as on a coarse encoder read fast.
        let slow: Vec<f64> = (0..20_000)
            .map(|k| (0.001 * k as f64).sin() * 500.0)
            .map(|counts| counts.floor() * 1e-3)
            .collect();
        assert_eq!(shown(&slow, 1e-4, 1e-3).jitter_nats, 0.0);
    }
}
