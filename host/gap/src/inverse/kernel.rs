//! The test function that a record is seen through: three running means of `length` samples one after the other, then
//! every `length`-th value.
//!
//! With it the balance of torques is weighted and summed rather than differentiated, and the position's second difference
//! is summed too: noise of the position falls with the 2.5th power of the length. Effort that holds for a sample and
//! position at its edges meet exactly: the second difference of position is the mean acceleration of two samples.

use std::f64::consts::TAU;

/// A node of effort is a mean of two samples before the kernel.
pub const EFFORT: [f64; 2] = [0.5, 0.5];
/// A node of inertia is a second difference of positions.
pub const SECOND_DIFFERENCE: [f64; 3] = [1.0, -2.0, 1.0];

/// The kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernel {
    /// Samples of each running mean: odd, so that the kernel has a middle.
    pub length: usize,
}

impl Kernel {
    /// Samples on either side of a node that it takes in.
    pub fn reach(self) -> usize {
        3 * (self.length - 1) / 2
    }

    /// Root-mean-square of a mean of two samples' white noise of 1 after it.
    pub fn of_effort(self) -> f64 {
        norm(&self.weights(&EFFORT))
    }

    /// Root-mean-square of the second difference of white noise of 1 after it.
    pub fn of_second_difference(self) -> f64 {
        norm(&self.weights(&SECOND_DIFFERENCE))
    }

    /// Power of nodes at a frequency, in waves a node, where white noise of 1 has gone through this filter first; its mean
    /// over all frequencies is the square of the nodes.
    pub fn power(self, seed: &[f64], waves: f64) -> f64 {
        let weights = self.weights(seed);
        let apart = |nodes: usize| {
            let later = weights.iter().skip(nodes * self.length);
            later.zip(&weights).map(|(a, b)| a * b).sum::<f64>()
        };
        let cosines = (1..weights.len().div_ceil(self.length))
            .map(|nodes| (TAU * waves * nodes as f64).cos() * apart(nodes));
        apart(0) + 2.0 * cosines.sum::<f64>()
    }

    fn weights(self, seed: &[f64]) -> Vec<f64> {
        let mut weights = seed.to_vec();
        for _ in 0..3 {
            let mut next = vec![0.0; weights.len() + self.length - 1];
            for (i, w) in weights.iter().enumerate() {
                for x in &mut next[i..i + self.length] {
                    *x += w / self.length as f64;
                }
            }
            weights = next;
        }
        weights
    }

    /// Nodes of a stretch of so many samples.
    pub fn nodes(self, samples: usize) -> usize {
        let inside = samples.saturating_sub(2 * self.reach());
        inside.div_ceil(self.length)
    }

    /// The sample at the middle of a node.
    pub fn middle(self, node: usize) -> usize {
        self.reach() + node * self.length
    }

    /// Appends the nodes of `values` to `out`; `values` is used up.
    pub fn apply(self, values: &mut Vec<f64>, out: &mut Vec<f64>) {
        let nodes = self.nodes(values.len());
        if self.length > 1 {
            for _ in 0..3 {
                self.running_mean(values);
            }
        }
        out.extend((0..nodes).map(|node| values[node * self.length]));
    }

    fn running_mean(self, values: &mut Vec<f64>) {
        let length = self.length.min(values.len());
        let mut sum: f64 = values[..length].iter().sum();
        let per = 1.0 / length as f64;
        let last = values.len() - length;
        for k in 0..=last {
            let first = values[k];
            values[k] = sum * per;
            if k < last {
                sum += values[k + length] - first;
            }
        }
        values.truncate(last + 1);
    }
}

fn norm(weights: &[f64]) -> f64 {
    weights.iter().map(|w| w * w).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_a_parabola_but_for_its_own_width() {
        for length in [1, 3, 5] {
            let kernel = Kernel { length };
            let mut values: Vec<f64> = (0..200).map(|k| 2.0 + 0.5 * f64::from(k)).collect();
            let mut out = Vec::new();
            kernel.apply(&mut values, &mut out);
            assert_eq!(out.len(), kernel.nodes(200));
            for (node, value) in out.iter().enumerate() {
                let expected = 2.0 + 0.5 * kernel.middle(node) as f64;
                assert!(
                    (value - expected).abs() < 1e-9,
                    "{length} {node}: {value} {expected}"
                );
            }
        }
    }

    #[test]
    fn power_over_frequency_adds_up_to_the_square() {
        for length in [1, 3, 9] {
            let kernel = Kernel { length };
            for (seed, norm) in [
                (&EFFORT[..], kernel.of_effort()),
                (&SECOND_DIFFERENCE[..], kernel.of_second_difference()),
            ] {
                let power = |k| kernel.power(seed, f64::from(k) / 64.0);
                let mean = (0..64).map(power).sum::<f64>() / 64.0;
                assert!((mean / norm.powi(2) - 1.0).abs() < 1e-12, "{mean}");
            }
            // A constant force passes, a constant position does not.
            assert!((kernel.power(&EFFORT, 0.0) * length as f64 - 1.0).abs() < 0.1);
        }
        let single = Kernel { length: 1 };
        assert!(single.power(&SECOND_DIFFERENCE, 0.0).abs() < 1e-12);
        assert!((single.power(&SECOND_DIFFERENCE, 0.5) - 16.0).abs() < 1e-12);
    }

    #[test]
    fn noise_falls_with_the_length() {
        let kernel = |length| Kernel { length };
        // Without running means the norms are those of (1, -2, 1) and (1/2, 1/2).
        assert!((kernel(1).of_second_difference() - 6.0_f64.sqrt()).abs() < 1e-12);
        assert!((kernel(1).of_effort() - 0.5_f64.sqrt()).abs() < 1e-12);
        let ratio = kernel(27).of_second_difference() / kernel(9).of_second_difference();
        // The sums of squares differ from integrals by some 1/length.
        assert!((ratio.ln() / 3.0_f64.ln() + 2.5).abs() < 0.05, "{ratio}");
    }
}
