//! Noise of a record as its quiet moments show it: noise is there all the time, and what a model lacks is not.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Noise of an effort is correlated over some 10 ms: the filters of its converter. What nodes so far apart have in common
/// is no longer noise, s.
const COLOUR_S: f64 = 0.02;
/// Blocks in which noise is looked at, s.
const BLOCK_S: f64 = 0.25;
/// Part of the blocks that are quiet.
const QUIET: f64 = 0.25;
/// Fewest blocks that say how large noise is.
const FEWEST_BLOCKS: usize = 8;

/// From second differences of nodes some 20 ms, and at least so many nodes, apart, in the quiet blocks of a record with so long from node
/// to node, N m rms. `members` are nodes by their place and what is left over there. Nothing where there are too few such blocks.
pub(super) fn quiet_noise(
    node_s: f64,
    members: &[(usize, f64)],
    least_apart: usize,
) -> Option<f64> {
    let [apart, block] = [COLOUR_S, BLOCK_S].map(|time| (time / node_s).round() as usize);
    let apart = apart.max(least_apart);
    let block = block.max(4 * apart);
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

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn noise_is_what_is_there_all_the_time() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let noise: Vec<f64> = (0..4000)
            .map(|_| StandardNormal.sample(&mut random))
            .collect();
        let seconds = |k: usize| k as f64 * 5e-3;
        // A wave of three times the noise, for a part of every two seconds.
        let shown = |k: usize, part: f64| {
            let lacks = if seconds(k) % 2.0 < 2.0 * part {
                3.0
            } else {
                0.0
            };
            // It is the same for 20 ms.
            noise[k / 4] + lacks * (120.0 * seconds(k)).sin()
        };
        for least_apart in [0, 3] {
            let of = |part: f64| {
                let members: Vec<(usize, f64)> = (0..4000).map(|k| (k, shown(k, part))).collect();
                quiet_noise(5e-3, &members, least_apart).unwrap()
            };
            // 80 blocks, each of which knows it to a third: their quartile to a twentieth, three times which is asked.
            assert!((of(0.0) - 1.0).abs() < 0.15, "{}", of(0.0));
            // The quartile of all is the median of the quiet half: 1.27 times as much.
            assert!((of(0.5) - 1.27).abs() < 0.2, "{}", of(0.5));
            assert!(of(1.0) > 2.0, "{}", of(1.0));
        }
        let few: Vec<(usize, f64)> = (0..300).map(|k| (k, shown(k, 0.0))).collect();
        assert_eq!(quiet_noise(5e-3, &few, 0), None);
    }
}
