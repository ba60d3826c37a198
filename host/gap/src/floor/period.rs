//! The period of a reference that repeats exactly, found from the reference alone.

use crate::signal::extent;
use realfft::RealFftPlanner;

/// Values count as equal within this part of the range: the rounding of a printed column.
const EQUAL_PART: f64 = 2e-6;
/// Shorter periods are no experiment.
const SHORTEST: usize = 20;

/// Length in samples of the shortest period of which at least one and a half are there.
pub fn period(reference: &[f64]) -> Option<usize> {
    let n = reference.len();
    let (low, high) = extent(reference);
    if n < 3 * SHORTEST || high <= low {
        return None;
    }
    let equal = EQUAL_PART * (high - low);
    let mean = reference.iter().sum::<f64>() / n as f64;
    let centred: Vec<f64> = reference.iter().map(|x| x - mean).collect();
    let products = correlation(&centred)?;
    let mut squares = vec![0.0; n + 1];
    for (k, x) in centred.iter().enumerate() {
        squares[k + 1] = squares[k] + x * x;
    }
    let total = squares[n];
    (SHORTEST..=n * 2 / 3).find(|&lag| {
        let (first, second) = (squares[n - lag], total - squares[lag]);
        // The mean square of what differs, cheaply; the transform rounds at 1e-15 or so of the total.
        let differs = first + second - 2.0 * products[lag];
        differs <= (1e-10 * total).max(2.0 * n as f64 * equal * equal)
            && first > 0.05 * total
            && same(reference, lag, equal)
            // Not merely standing still.
            && !same(reference, lag / 2, 100.0 * equal)
    })
}

fn same(x: &[f64], lag: usize, equal: f64) -> bool {
    x.iter().zip(&x[lag..]).all(|(a, b)| (a - b).abs() <= equal)
}

/// sum_k x_k x_(k + lag) for every lag.
fn correlation(x: &[f64]) -> Option<Vec<f64>> {
    let length = (2 * x.len()).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, inverse) = (
        planner.plan_fft_forward(length),
        planner.plan_fft_inverse(length),
    );
    let mut time = x.to_vec();
    time.resize(length, 0.0);
    let mut frequency = forward.make_output_vec();
    forward.process(&mut time, &mut frequency).ok()?;
    for value in &mut frequency {
        *value = value.norm_sqr().into();
    }
    inverse.process(&mut frequency, &mut time).ok()?;
    time.truncate(x.len());
    time.iter_mut().for_each(|value| *value /= length as f64);
    Some(time)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(k: usize) -> f64 {
        let x = (k % 700) as f64 / 700.0;
        (std::f64::consts::TAU * x).sin() + 0.3 * (3.0 * std::f64::consts::TAU * x + 1.0).cos()
    }

    #[test]
    fn finds_the_shortest_period() {
        let x: Vec<f64> = (0..2800).map(wave).collect();
        assert_eq!(period(&x), Some(700));
        // Three and some, and printed with six digits.
        let rounded: Vec<f64> = x[..2400].iter().map(|x| (x * 1e6).round() * 1e-6).collect();
        assert_eq!(period(&rounded), Some(700));
    }

    #[test]
    fn one_sample_off_is_no_repeat() {
        let mut x: Vec<f64> = (0..2800).map(wave).collect();
        x[1000] += 1e-3;
        assert_eq!(period(&x), None);
    }

    #[test]
    fn rest_ramps_and_single_periods_do_not_repeat() {
        assert_eq!(period(&[1.0; 1000]), None);
        let ramp: Vec<f64> = (0..100_000).map(f64::from).collect();
        assert_eq!(period(&ramp), None);
        let once: Vec<f64> = (0..1000).map(wave).collect();
        assert_eq!(period(&once), None);
        // Half a record of rest after a step.
        let step: Vec<f64> = (0..1000).map(|k| f64::from(k > 100)).collect();
        assert_eq!(period(&step), None);
    }
}
