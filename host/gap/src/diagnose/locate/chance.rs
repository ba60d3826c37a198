//! Whether a part of the data holds more of the gap than chance would give it.
//!
//! Noise is correlated from node to node, so that blocks of time are what varies. What a part holds beyond its share is a
//! sum over blocks, and over the root of the sum of its squares it is a normal deviate at most where blocks are as likely
//! to add as to take: Efron 1969, J. Am. Stat. Assoc. 64. Squares of noise are skewed so that this errs on the safe side.
//! No random numbers are drawn.

use super::super::regime::Node;
use crate::inverse::Record;
use statrs::distribution::{ContinuousCDF, Normal};

/// Length of a block: ten times as long as noise remembers, and short enough for a dozen in a log of some seconds, s.
const BLOCK_S: f64 = 0.25;

/// The block that each node lies in, and how many there are.
pub(super) fn blocks(records: &[Record], nodes: &[Node]) -> (Vec<usize>, usize) {
    let mut at = Vec::with_capacity(nodes.len());
    let mut last = None;
    let mut count = 0;
    for node in nodes {
        let here = (node.record, (node.time_s(records) / BLOCK_S) as usize);
        if last != Some(here) {
            last = Some(here);
            count += 1;
        }
        at.push(count - 1);
    }
    (at, count)
}

/// Probability that chance gives a part as much as it holds; `beyond` is what it holds in each block beyond its share.
pub(super) fn of_excess(beyond: impl Iterator<Item = f64>) -> f64 {
    let (sum, square) = beyond.fold((0.0, 0.0), |(sum, square), x| (sum + x, square + x * x));
    if square > 0.0 {
        Normal::standard().sf(sum / f64::sqrt(square))
    } else {
        1.0
    }
}

/// Probability that chance gives a wave as much as it has; `products` are those of the gap with its sine and its cosine,
/// summed over each block. The statistic is that of two such deviates.
pub(super) fn of_wave(products: &[[f64; 2]]) -> f64 {
    let [mut a, mut b, mut aa, mut ab, mut bb] = [0.0; 5];
    for [x, y] in products {
        a += x;
        b += y;
        aa += x * x;
        ab += x * y;
        bb += y * y;
    }
    let determinant = aa * bb - ab * ab;
    if determinant > f64::EPSILON * aa * bb {
        (-0.5 * (bb * a * a - 2.0 * ab * a * b + aa * b * b) / determinant).exp()
    } else {
        1.0
    }
}

/// Corrects probabilities for how many there are: Holm 1979, Scand. J. Stat. 6.
pub(super) fn corrected(chances: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..chances.len()).collect();
    order.sort_by(|&i, &j| chances[i].total_cmp(&chances[j]));
    let mut out = vec![1.0; chances.len()];
    let mut least = 0.0;
    for (rank, at) in order.into_iter().enumerate() {
        least = f64::max(least, (chances.len() - rank) as f64 * chances[at]).min(1.0);
        out[at] = least;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrects_as_holm_does() {
        assert_eq!(
            corrected(&[0.01, 0.04, 0.03, 0.005]),
            [0.03, 0.06, 0.06, 0.02]
        );
        assert_eq!(corrected(&[0.9, 0.8]), [1.0, 1.0]);
    }

    #[test]
    fn few_blocks_prove_nothing() {
        // The deviate of n equal blocks is sqrt(n): 2 for four, whose upper tail is 0.0228.
        let four = of_excess([1.0; 4].into_iter().chain([0.0; 96]));
        assert!((four - 0.0228).abs() < 1e-4, "{four}");
        assert!(of_excess([1.0; 25].into_iter()) < 3e-7);
        assert_eq!(of_excess([0.0; 25].into_iter()), 1.0);
        assert!(of_excess([1.0, -1.0, 1.0, -1.0].into_iter()) == 0.5);
    }

    #[test]
    fn a_wave_is_told_by_blocks_that_agree() {
        let agree: Vec<[f64; 2]> = (0..40)
            .map(|k| [1.0 + 0.1 * f64::from(k % 3), 0.1 * f64::from(k % 5) - 0.2])
            .collect();
        assert!(of_wave(&agree) < 1e-6);
        let turned: Vec<[f64; 2]> = (0..40)
            .map(|k| (0.5 * std::f64::consts::PI * f64::from(k)).sin_cos().into())
            .collect();
        assert!(of_wave(&turned) > 0.9);
        assert_eq!(of_wave(&[]), 1.0);
    }
}
