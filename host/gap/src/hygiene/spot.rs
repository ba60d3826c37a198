//! Steps of the position that are no larger than effort could move the axis, but alike, and all at one place: a bad spot of
//! the disc or scale, at which the encoder loses counts.

use super::jump::{AROUND, Jump, design, slope_before};
use nalgebra::SVector;
use std::f64::consts::TAU;

/// Samples that tell a step.
const ROWS: usize = 2 * AROUND;
/// How many times what a parabola and a step leave of the motion, rms, a step is.
const STANDS_OUT: f64 = 8.0;
/// Fewest steps that are no chance.
const FEWEST: usize = 2;
/// Steps of one size differ from their median by this part of it at most: the axis goes on accelerating within them.
const ALIKE: f64 = 0.15;
/// And by so many counts: each of four positions about a step is rounded.
const ROUNDED: f64 = 2.0;

/// First sample behind each step that stands out, and how far it went: as in [`super::jump::measured`], at every sample, beside the
/// motion of an axis without friction, which goes so far for each N m in a sample.
pub(super) fn steps(q: &[f64], u: &[f64], rad_per_nm: f64) -> Vec<(usize, f64)> {
    let (mut free_rad, mut step_rad) = (0.0, 0.0);
    let beside = q.iter().zip(u).map(|(q, u)| {
        let beside = q - free_rad;
        free_rad += step_rad + 0.5 * u * rad_per_nm;
        step_rad += u * rad_per_nm;
        beside
    });
    let q: Vec<f64> = beside.collect();
    let rows: Vec<usize> = (0..ROWS).collect();
    let design = design(&rows, AROUND, 1)
        .fixed_view::<ROWS, 4>(0, 0)
        .into_owned();
    let solver = design
        .pseudo_inverse(1e-9)
        .expect("a tolerance that is positive");
    let size = |near: &[f64]| {
        let near = SVector::<f64, ROWS>::from_fn(|row, _| near[row] - near[AROUND]);
        let solved = solver * near;
        let left = (design * solved - near).norm() / ((ROWS - solved.len()) as f64).sqrt();
        let stands_out = solved[3].abs() > STANDS_OUT * left;
        if stands_out { solved[3] } else { 0.0 }
    };
    let sizes: Vec<f64> = q.windows(ROWS).map(size).collect();
    let largest = |place: &usize| {
        let near = place.saturating_sub(AROUND)..(place + AROUND).min(sizes.len());
        let size = sizes[*place].abs();
        size > 0.0 && sizes[near].iter().all(|other| other.abs() <= size)
    };
    (0..sizes.len())
        .filter(largest)
        .map(|place| (place + AROUND, sizes[place]))
        .collect()
}

/// The steps in order of time among which those are of one size that lie at one place; none where too few do, or others of that
/// size lie elsewhere.
pub(super) fn at_one_place(q: &[f64], steps: &[Jump], rotary: bool, count_rad: f64) -> Vec<Jump> {
    // What is missing behind each for one who goes upward.
    let lost = |jump: &Jump| -jump.size_rad * slope_before(q, jump.sample).signum();
    let mut sizes: Vec<f64> = steps.iter().map(lost).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let Some(&size_rad) = sizes.get(sizes.len() / 2) else {
        return Vec::new();
    };
    let within = ALIKE * size_rad.abs() + ROUNDED * count_rad;
    let alike = steps
        .iter()
        .filter(|jump| (lost(jump) - size_rad).abs() < within);
    let (mut missing, mut place): (f64, Option<[f64; 2]>) = (0.0, None);
    let mut found = Vec::new();
    for jump in alike {
        let size = size_rad.copysign(jump.size_rad);
        // Where the axis was on either side, had nothing been lost.
        let [before, behind] = [
            q[jump.sample - 1] - missing,
            q[jump.sample] - missing - size,
        ];
        missing += size;
        let [mut low, mut high] = [before.min(behind) - within, before.max(behind) + within];
        if let Some([least, most]) = place {
            let turns = if rotary {
                (0.5 * (low + high - least - most) / TAU).round()
            } else {
                0.0
            };
            low = least.max(low - turns * TAU);
            high = most.min(high - turns * TAU);
            if low > high {
                return Vec::new();
            }
        }
        place = Some([low, high]);
        found.push(Jump {
            size_rad: size,
            ..*jump
        });
    }
    if found.len() < FEWEST {
        found.clear();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT_RAD: f64 = 1e-4;

    /// Three turns forth and back at 500 Hz, and so much lost at these places, upward.
    fn losing(places: &[f64], lost_rad: f64) -> Vec<f64> {
        let at = |k: usize| 20.0 * (1.0 - (k as f64 * 2e-3).cos()) / 2.0;
        let mut lost = 0.0;
        let mut before = 0.0;
        let counted = (0..3000).map(|k| {
            let q = at(k);
            let passed = |place: &&f64| (before..q).contains(*place);
            lost += lost_rad * places.iter().filter(passed).count() as f64;
            before = q;
            ((q - lost) / COUNT_RAD).round() * COUNT_RAD
        });
        counted.collect()
    }

    fn found(q: &[f64]) -> Vec<Jump> {
        let beyond_counts = |(sample, size_rad): (usize, f64)| {
            (size_rad.abs() > 4.0 * COUNT_RAD).then_some(Jump {
                sample,
                size_rad,
                allowed_rad: 0.1,
            })
        };
        let still = vec![0.0; q.len()];
        let jumps: Vec<Jump> = steps(q, &still, 0.0)
            .into_iter()
            .filter_map(beyond_counts)
            .collect();
        at_one_place(q, &jumps, true, COUNT_RAD)
    }

    #[test]
    fn what_a_place_loses_each_turn_is_found() {
        let found = found(&losing(&[1.0, 1.0 + TAU, 1.0 + 2.0 * TAU], 0.01));
        assert_eq!(found.len(), 3);
        for jump in found {
            assert!(
                (jump.size_rad + 0.01).abs() < ROUNDED * COUNT_RAD,
                "{jump:?}"
            );
        }
    }

    #[test]
    fn steps_elsewhere_or_none_are_no_bad_spot() {
        assert_eq!(found(&losing(&[1.0, 4.0, 9.0], 0.01)), []);
        assert_eq!(found(&losing(&[1.0], 0.01)), []);
    }
}
