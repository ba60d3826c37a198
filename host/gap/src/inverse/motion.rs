//! Motion from a quantised position: velocity over windows that adapt to what the axis does, rad and rad/s.
//!
//! A wide window averages the encoder's noise, a narrow one follows a break-away. At each sample the widest window is
//! taken whose estimate does not contradict the narrower ones: intersection of confidence intervals, Goldenshluger and
//! Nemirovski 1997, Math. Methods Stat. 6; Katkovnik 1999, IEEE Trans. Signal Process. 47.

use crate::signal::{rms_by_median, zero_phase};

/// Longest half window, s.
const LONGEST_S: f64 = 0.016;
/// Width of an interval in standard deviations: 2 lets one sample in twenty narrow its window for nothing.
const WIDTH: f64 = 2.0;
/// Slopes of less difference are one, counts a sample: far above rounding, and a thousandth of a count over a long record.
const ALIKE: f64 = 1e-9;
/// An edge that is crossed so often without the next count being reached is trembled on: once there, back, and there again.
const FEWEST_CROSSINGS: usize = 3;
/// Below this frequency the smoothed position follows the measured one, above it the integral of velocity, Hz.
const FOLLOWS_HZ: f64 = 15.0;

/// A smoothed motion, one entry a sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Smoothed {
    /// rad
    pub position_rad: Vec<f64>,
    /// rad/s
    pub velocity_rad_s: Vec<f64>,
}

/// Standard deviation of what lies on a position: of quantisation, or of what its third difference shows if that is more.
pub fn position_noise_rad(position_rad: &[f64], rad_per_count: f64) -> f64 {
    let mut third: Vec<f64> = position_rad
        .windows(4)
        .map(|q| (q[3] - 3.0 * q[2] + 3.0 * q[1] - q[0]).abs())
        .collect();
    let quantisation = rad_per_count / 12.0_f64.sqrt();
    // A third difference of white noise has 1 + 9 + 9 + 1 = 20 times its variance.
    quantisation.max(rms_by_median(&mut third) / 20.0_f64.sqrt())
}

/// The shortest path along a position that is read in counts, each from its lower edge on: the true position lies between
/// a reading and the next count above. Half a count is taken off, so that the path lies about the readings. Where the
/// encoder trembles on an edge, the path rests.
pub fn shortest_path(reading_rad: &[f64], rad_per_count: f64) -> Vec<f64> {
    let half = 0.5 * rad_per_count;
    let alike = ALIKE * rad_per_count;
    let mut path = Vec::with_capacity(reading_rad.len());
    let Some(&first) = reading_rad.first() else {
        return path;
    };
    // From the last bend on, straight lines between two slopes pass all gates so far, each of which ends at one of them.
    let (mut bend, mut at) = (0, first);
    path.push(first);
    while bend + 1 < reading_rad.len() {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let (mut low_gate, mut high_gate) = (bend, bend);
        let mut next = None;
        for (k, reading) in reading_rad.iter().enumerate().skip(bend + 1) {
            let steps = (k - bend) as f64;
            let (to_low, to_high) = ((reading - half - at) / steps, (reading + half - at) / steps);
            if to_low > high {
                next = Some((high_gate, high));
                break;
            }
            if to_high < low {
                next = Some((low_gate, low));
                break;
            }
            // Of gates that are passed alike the last one: a trembling edge is one line.
            if to_low > low - alike {
                (low, low_gate) = (low.max(to_low), k);
            }
            if to_high < high + alike {
                (high, high_gate) = (high.min(to_high), k);
            }
        }
        // What is left is passed with as little motion as possible.
        let (gate, slope) = next.unwrap_or((reading_rad.len() - 1, 0.0_f64.max(low).min(high)));
        path.extend((1..=gate - bend).map(|steps| at + slope * steps as f64));
        at += slope * (gate - bend) as f64;
        bend = gate;
    }
    path
}

/// A position read in counts, at rest on the edge wherever it does no more than tremble on one: there a controller holds an
/// axis that moves by far less than a count, and a whole count to and fro would let bristles creep.
pub fn resting_on_edges(reading_rad: &[f64], rad_per_count: f64) -> Vec<f64> {
    let two_counts = (1.0 + 1e-3) * rad_per_count;
    let mut resting = reading_rad.to_vec();
    let mut start = 0;
    while start < reading_rad.len() {
        let [mut low, mut high] = [reading_rad[start]; 2];
        let mut end = start;
        while end < reading_rad.len() {
            let (lower, higher) = (low.min(reading_rad[end]), high.max(reading_rad[end]));
            if higher - lower > two_counts {
                break;
            }
            (low, high) = (lower, higher);
            end += 1;
        }
        let edge = 0.5 * (low + high);
        let crossings: Vec<usize> = (start + 1..end)
            .filter(|&k| (reading_rad[k - 1] < edge) != (reading_rad[k] < edge))
            .collect();
        if high - low > 0.5 * rad_per_count
            && crossings.len() >= FEWEST_CROSSINGS
            && let (Some(&first), Some(&last)) = (crossings.first(), crossings.last())
        {
            resting[first..last].fill(edge);
        }
        if end == reading_rad.len() {
            break;
        }
        // From the earliest sample on that lies within two counts of the one that does not.
        let next = reading_rad[end];
        let [mut low, mut high] = [next; 2];
        start = end;
        while high.max(reading_rad[start - 1]) - low.min(reading_rad[start - 1]) <= two_counts {
            start -= 1;
            (low, high) = (low.min(reading_rad[start]), high.max(reading_rad[start]));
        }
    }
    resting
}

/// Smooths a position sampled every `step_s`, whose noise is `noise_rad` rms. Between two samples the smoothed motion is
/// even: what the narrowest window says is how far the position itself went.
pub fn smooth(position_rad: &[f64], step_s: f64, noise_rad: f64) -> Smoothed {
    let samples = position_rad.len();
    if samples < 3 {
        return Smoothed {
            position_rad: position_rad.to_vec(),
            velocity_rad_s: vec![0.0; samples],
        };
    }
    let longest = ((LONGEST_S / step_s) as usize).clamp(2, samples / 2);
    let mut pairs = vec![1];
    while let Some(&last) = pairs.last()
        && last < longest
    {
        pairs.push((last + last.div_ceil(2)).min(longest));
    }
    let between: Vec<f64> = (1..samples)
        .map(|k| velocity(position_rad, k, &pairs, step_s, noise_rad))
        .collect();
    let velocity_rad_s: Vec<f64> = (0..samples)
        .map(|k| {
            let (before, after) = (k.saturating_sub(1), k.min(samples - 2));
            0.5 * (between[before] + between[after])
        })
        .collect();
    let mut integral = vec![0.0];
    let mut q = 0.0;
    for v in between {
        q += step_s * v;
        integral.push(q);
    }
    let apart: Vec<f64> = position_rad
        .iter()
        .zip(&integral)
        .map(|(q, i)| q - i)
        .collect();
    let slow = zero_phase(&apart, 1.0 / step_s, FOLLOWS_HZ);
    Smoothed {
        position_rad: integral.iter().zip(&slow).map(|(i, s)| i + s).collect(),
        velocity_rad_s,
    }
}

/// Slope of the parabola through the window about the middle between samples `k - 1` and `k` that the intervals agree on;
/// a window has so many pairs of samples.
fn velocity(q: &[f64], k: usize, pairs: &[usize], step_s: f64, noise_rad: f64) -> f64 {
    let room = k.min(q.len() - k);
    let (mut low, mut high, mut chosen) = (f64::NEG_INFINITY, f64::INFINITY, 0.0);
    for &pairs in pairs.iter().take_while(|&&pairs| pairs <= room) {
        let (mut sum, mut squares) = (0.0, 0.0);
        for pair in 0..pairs {
            let apart = pair as f64 + 0.5;
            sum += apart * (q[k + pair] - q[k - 1 - pair]);
            squares += apart * apart;
        }
        let slope = sum / (2.0 * squares * step_s);
        let spread = WIDTH * noise_rad / ((2.0 * squares).sqrt() * step_s);
        low = low.max(slope - spread);
        high = high.min(slope + spread);
        if low > high {
            break;
        }
        chosen = slope;
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::rms;

    const COUNT: f64 = std::f64::consts::TAU / 16384.0;

    fn quantised(true_rad: impl Fn(f64) -> f64, samples: usize, step_s: f64) -> Vec<f64> {
        (0..samples)
            .map(|k| (true_rad(k as f64 * step_s) / COUNT).floor() * COUNT)
            .collect()
    }

    #[test]
    fn beats_the_plain_difference_on_a_sine_and_follows_a_kink() {
        let step = 1e-3;
        let q = quantised(|t| (5.0 * t).sin(), 4000, step);
        let smoothed = smooth(&q, step, COUNT / 12.0_f64.sqrt());
        let error = |v: &[f64]| rms((50..3950).map(|k| v[k] - 5.0 * (5.0 * k as f64 * step).cos()));
        let plain = crate::signal::derivative(&q, step);
        // A half window of 16 samples alone has sqrt(2 sum j^2) = 55 against sqrt(2) of the central difference.
        assert!(error(&smoothed.velocity_rad_s) < 0.2 * error(&plain));
        // From rest to 2 rad/s at once: right again after 3 samples.
        let q = quantised(|t| 2.0 * (t - 1.0).max(0.0), 2000, step);
        let smoothed = smooth(&q, step, COUNT / 12.0_f64.sqrt());
        assert!(smoothed.velocity_rad_s[996].abs() < 0.02);
        assert!((smoothed.velocity_rad_s[1004] - 2.0).abs() < 0.1);
    }

    #[test]
    fn the_shortest_path_rests_on_a_trembling_edge_and_knows_an_even_speed() {
        let trembling: Vec<f64> = (0..500)
            .map(|k| COUNT * f64::from(u8::from(k % 7 < 3)))
            .collect();
        let path = shortest_path(&trembling, COUNT);
        assert!(
            path[3..]
                .iter()
                .all(|q| (q - 0.5 * COUNT).abs() < 1e-9 * COUNT)
        );
        // At an even speed the edges say where the axis is, to within what it goes in a sample: 0.013 of a count.
        let even = |t: f64| 12.7 * COUNT * t;
        let path = shortest_path(&quantised(even, 4000, 1e-3), COUNT);
        for (k, q) in path.iter().enumerate().take(3900).skip(100) {
            let error = q + 0.5 * COUNT - even(k as f64 * 1e-3);
            assert!(error.abs() < 0.015 * COUNT, "{k}: {}", error / COUNT);
        }
        assert!(shortest_path(&[], COUNT).is_empty());
    }

    #[test]
    fn what_trembles_on_an_edge_rests_there_and_what_moves_stays_as_it_was() {
        // A ramp of a count in 50 samples to the edge of 20 counts, trembling there, and on.
        let moves = |k: usize| (k as f64 / 50.0).floor();
        let trembles = |k: usize| 20.0 - f64::from(u8::from(k % 9 < 4));
        let reading: Vec<f64> = (0..1000)
            .map(moves)
            .chain((1000..2000).map(trembles))
            .chain((2000..3000).map(|k| moves(k - 1000)))
            .map(|counts| counts * COUNT)
            .collect();
        let resting = resting_on_edges(&reading, COUNT);
        assert!(resting[1010..1990].iter().all(|q| *q == 19.5 * COUNT));
        assert_eq!(resting[..1000], reading[..1000]);
        assert_eq!(resting[2000..], reading[2000..]);
        assert!(resting_on_edges(&[], COUNT).is_empty());
    }

    #[test]
    fn noise_of_a_moving_encoder_is_that_of_quantisation() {
        let q = quantised(|t| 3.0 * t + 0.3 * (7.0 * t).sin(), 5000, 1e-3);
        let noise = position_noise_rad(&q, COUNT);
        assert!(
            (noise / (COUNT / 12.0_f64.sqrt()) - 1.0).abs() < 0.3,
            "{noise}"
        );
    }
}
