//! The method's own error.

use super::regime::{Node, Regime};

/// What the method leaves over of an axis that is exactly the model and whose effort is measured exactly, by record and
/// regime: coarse positions and smoothing, and what noise on the rotor does to bristles and loads that the motion does not show.
#[derive(Clone, Debug, Default)]
pub struct Own(Vec<[f64; 3]>);

impl Own {
    /// From records of such an axis, less the white noise that each of its nodes has, N m rms.
    pub fn new(nodes: &[Node], left_over: &[f64], white_nm: &[f64]) -> Self {
        let mut sums = vec![[(0.0, 0.0); 3]; white_nm.len()];
        for (node, r) in nodes.iter().zip(left_over).filter(|(n, _)| !n.excluded) {
            let (square, count) = &mut sums[node.record][node.regime as usize];
            *square += r * r;
            *count += 1.0;
        }
        let rms = |white_nm: f64, (square, count): (f64, f64)| {
            let square = square / f64::max(count, 1.0);
            (square - white_nm * white_nm).max(0.0).sqrt()
        };
        let groups = sums.into_iter().zip(white_nm);
        Self(
            groups
                .map(|(groups, &white_nm)| groups.map(|sums| rms(white_nm, sums)))
                .collect(),
        )
    }

    /// The lower of both: what one model does not leave over of itself, the method does not have to.
    #[must_use]
    pub fn or_less(mut self, other: &Self) -> Self {
        for (groups, others) in self.0.iter_mut().zip(&other.0) {
            for (rms, other) in groups.iter_mut().zip(others) {
                *rms = rms.min(*other);
            }
        }
        self
    }

    /// The one in the middle of three.
    #[must_use]
    pub fn middle(one: &Self, other: &Self, third: &Self) -> Self {
        let groups = one.0.iter().zip(&other.0).zip(&third.0);
        let middle = |a: f64, b: f64, c: f64| a.min(b).max(a.max(b).min(c));
        Self(
            groups
                .map(|((a, b), c)| [0, 1, 2].map(|at| middle(a[at], b[at], c[at])))
                .collect(),
        )
    }

    /// N m; none where nothing is known.
    pub(super) fn rms_nm(&self, record: usize, regime: Regime) -> f64 {
        self.0
            .get(record)
            .map_or(0.0, |groups| groups[regime as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_one_is_neither_the_least_nor_the_most() {
        let [one, other, third] =
            [[1.0, 5.0, 2.0], [2.0, 4.0, 2.0], [3.0, 6.0, 1.0]].map(|groups| Own(vec![groups]));
        assert_eq!(Own::middle(&one, &other, &third).0, [[2.0, 5.0, 2.0]]);
        assert_eq!(Own::middle(&third, &one, &other).0, [[2.0, 5.0, 2.0]]);
        assert_eq!(one.or_less(&other).0, [[1.0, 4.0, 2.0]]);
    }
}
