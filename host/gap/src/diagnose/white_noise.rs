//! How large the noise in a rest is, from differences of nodes: what a model lacks changes more slowly, or not all the time.

use crate::signal::rms_by_median;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Blocks in which noise is looked at, s.
pub(super) const BLOCK_S: f64 = 0.25;
/// Part of the blocks that are quiet.
const QUIET: f64 = 0.25;
/// Fewest blocks that say how large noise is.
const FEWEST_BLOCKS: usize = 8;

/// White noise of nodes that follow each other, from their differences; the median, so that single moments do not count.
pub(super) fn difference_noise(members: &[(usize, f64)]) -> f64 {
    let mut differences: Vec<f64> = members
        .windows(2)
        .filter(|pair| pair[1].0 == pair[0].0 + 1)
        .map(|pair| (pair[1].1 - pair[0].1).abs())
        .collect();
    rms_by_median(&mut differences) / 2.0_f64.sqrt()
}

/// White noise of nodes so long apart that follow each other, as in quiet blocks; nothing where there are too few.
pub(super) fn quiet_noise(members: &[(usize, f64)], node_s: f64) -> Option<f64> {
    coloured_noise(members, 1, (BLOCK_S / node_s).round() as usize)
}

/// Noise that is correlated for a while, from second differences of nodes so many apart, in the quiet blocks of a record:
/// noise is there all the time, and what a model lacks is not. Nothing where there are too few such blocks.
pub(super) fn coloured_noise(members: &[(usize, f64)], apart: usize, block: usize) -> Option<f64> {
    if apart == 0 {
        return None;
    }
    let mut blocks: Vec<f64> = members
        .chunks(block)
        .filter_map(|members| {
            let (sum, count) = members
                .windows(2 * apart + 1)
                .filter(|three| three[2 * apart].0 == three[0].0 + 2 * apart)
                .map(|three| three[0].1 - 2.0 * three[apart].1 + three[2 * apart].1)
                .fold((0.0, 0), |(sum, count), d| (sum + d * d, count + 1));
            (2 * count > block).then(|| sum / count as f64 / 6.0 / quiet_one(count, apart))
        })
        .collect();
    if blocks.len() < FEWEST_BLOCKS {
        return None;
    }
    let quiet = (QUIET * blocks.len() as f64) as usize;
    let (_, square, _) = blocks.select_nth_unstable_by(quiet, f64::total_cmp);
    Some(square.sqrt())
}

/// What the mean of so many squares of second differences of normal noise is in a quiet block, as a share of its variance.
/// Those within `apart` nodes say the same, and the next ones share two of three values: their correlations of -2/3 and
/// 1/6 leave the freedom of 0.52 of them.
fn quiet_one(count: usize, apart: usize) -> f64 {
    let freedom = 0.52 * count as f64 / apart as f64;
    ChiSquared::new(freedom).map_or(1.0, |squares| squares.inverse_cdf(QUIET) / freedom)
}
