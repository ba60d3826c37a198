//! What the positions of a log say of its sensor by themselves: the grid they lie on, and noise that grows with speed.

/// Increments that may lie off the grid: without one, half of them would.
const OFF_GRID: f64 = 0.05;
/// An increment lies on the grid within this part of it.
const ON_GRID: f64 = 0.25;
/// Fewest increments that make a grid.
const FEWEST: usize = 50;
/// Increments beyond so many grid steps say little of the grid: rounding adds up.
const MOST_STEPS: f64 = 6.0;
/// Parts of the speeds that noise is measured in.
const PARTS: usize = 8;

/// The sensor as the positions show it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shown {
    /// Step that all positions lie on, rad; zero where there is none.
    pub grid_rad: f64,
    /// Noise of time stamps, s rms.
    pub jitter_s: f64,
}

/// Looks at positions sampled every `step_s`.
pub fn shown(position_rad: &[f64], step_s: f64) -> Shown {
    Shown {
        grid_rad: grid_rad(position_rad),
        jitter_s: jitter_s(position_rad, step_s),
    }
}

/// The smallest increment, if nearly all others are multiples of it: a coarse sensor behind a fine one rounds twice, so
/// that its increments are off its grid by a count of the fine one.
fn grid_rad(position_rad: &[f64]) -> f64 {
    let span = position_rad.iter().fold(0.0, |m: f64, q| m.max(q.abs()));
    let mut steps: Vec<f64> = position_rad
        .windows(2)
        .map(|q| (q[1] - q[0]).abs())
        .filter(|&step| step > 1e-12 * span)
        .collect();
    if steps.len() < FEWEST {
        return 0.0;
    }
    steps.sort_unstable_by(f64::total_cmp);
    // The smallest ones, up to one and a half of the very smallest, differ by no more than rounding.
    let least = steps[0];
    let small: Vec<f64> = steps
        .iter()
        .copied()
        .take_while(|&s| s < 1.5 * least)
        .collect();
    let guess = small.iter().sum::<f64>() / small.len() as f64;
    let near: Vec<f64> = steps
        .iter()
        .map(|s| s / guess)
        .filter(|&n| n < MOST_STEPS)
        .collect();
    let off = near
        .iter()
        .filter(|n| (*n - n.round()).abs() > ON_GRID)
        .count();
    if near.len() < FEWEST || off as f64 > OFF_GRID * near.len() as f64 {
        return 0.0;
    }
    let (sum, count) = steps
        .iter()
        .filter(|&s| s / guess < MOST_STEPS)
        .fold((0.0, 0.0), |(sum, count), s| {
            (sum + s, count + (s / guess).round())
        });
    sum / count
}

/// Slope of the third difference's square over the square of speed. The median in each part of the speeds leaves single
/// jerks out; noise that is there at every speed does not count.
fn jitter_s(position_rad: &[f64], step_s: f64) -> f64 {
    let mut samples: Vec<(f64, f64)> = position_rad
        .windows(4)
        .map(|q| {
            let speed = (q[3] - q[0]).abs() / (3.0 * step_s);
            (speed, (q[3] - 3.0 * q[2] + 3.0 * q[1] - q[0]).abs())
        })
        .collect();
    if samples.len() < PARTS * FEWEST {
        return 0.0;
    }
    samples.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let points: Vec<(f64, f64)> = samples
        .chunks(samples.len().div_ceil(PARTS))
        .map(|part| {
            let mut rest: Vec<f64> = part.iter().map(|x| x.1).collect();
            let middle = rest.len() / 2;
            let median = *rest.select_nth_unstable_by(middle, f64::total_cmp).1;
            let speed = part.iter().map(|x| x.0 * x.0).sum::<f64>() / part.len() as f64;
            (speed, (median / 0.6745).powi(2) / 20.0)
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
    // A straight line over the square of speed, or it is something else.
    let straight = xx > 0.0 && yy > 0.0 && xy > 0.0 && xy * xy > 0.8 * xx * yy;
    if straight { (xy / xx).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn position(k: usize) -> f64 {
        (0.002 * k as f64).sin() * 3.0
    }

    #[test]
    fn finds_the_grid_and_none_in_a_fine_encoder() {
        let coarse: Vec<f64> = (0..5000)
            .map(|k| (position(k) / 1e-3).floor() * 1e-3)
            .collect();
        assert!((shown(&coarse, 1e-3).grid_rad / 1e-3 - 1.0).abs() < 1e-6);
        let fine: Vec<f64> = (0..5000).map(position).collect();
        assert_eq!(shown(&fine, 1e-3).grid_rad, 0.0);
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
        let jitter = shown(&late, 1e-3).jitter_s;
        assert!((0.7e-4..1.4e-4).contains(&jitter), "{jitter:e}");
        let coarse: Vec<f64> = (0..20_000)
            .map(|k| (position(k) / 1e-3).floor() * 1e-3)
            .collect();
        assert!(shown(&coarse, 1e-3).jitter_s < 0.5e-4);
    }
}
