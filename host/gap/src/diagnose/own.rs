//! The method's own error.

use super::regime::{Node, Regime, members};
use super::white_noise::difference_noise;
use crate::signal::{rms, rms_beside};

/// The error in a record and regime.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Error {
    /// All of it, N m rms.
    pub rms_nm: f64,
    /// The part that differs from node to node as noise does, N m rms.
    pub white_nm: f64,
}

impl Error {
    /// The part that lasts for some nodes, or for few moments, N m rms.
    pub fn slow_nm(self) -> f64 {
        rms_beside(self.rms_nm, self.white_nm)
    }

    fn or_less(self, other: Self) -> Self {
        if other.rms_nm < self.rms_nm {
            other
        } else {
            self
        }
    }
}

/// What the method leaves over of an axis that is exactly the model and whose effort is measured exactly, by record and
/// regime: coarse positions and smoothing.
#[derive(Clone, Debug, Default)]
pub struct Own(Vec<[Error; 3]>);

impl Own {
    /// From so many records of such an axis.
    pub fn new(nodes: &[Node], left_over: &[f64], records: usize) -> Self {
        let of = |place: usize, regime: Regime| {
            let members = members(nodes, left_over, place, |of| of == regime);
            Error {
                rms_nm: rms(members.iter().map(|(_, r)| *r)),
                white_nm: difference_noise(&members),
            }
        };
        Self(
            (0..records)
                .map(|place| Regime::ALL.map(|regime| of(place, regime)))
                .collect(),
        )
    }

    /// The lower of both: what one model does not leave over of itself, the method does not have to.
    #[must_use]
    pub fn or_less(mut self, other: &Self) -> Self {
        for (groups, others) in self.0.iter_mut().zip(&other.0) {
            for (error, &other) in groups.iter_mut().zip(others) {
                *error = error.or_less(other);
            }
        }
        self
    }

    /// The one in the middle of three.
    #[must_use]
    pub fn middle(one: &Self, other: &Self, third: &Self) -> Self {
        let groups = one.0.iter().zip(&other.0).zip(&third.0);
        let middle = |mut of: [Error; 3]| {
            of.sort_by(|a, b| a.rms_nm.total_cmp(&b.rms_nm));
            of[1]
        };
        Self(
            groups
                .map(|((a, b), c)| [0, 1, 2].map(|at| middle([a[at], b[at], c[at]])))
                .collect(),
        )
    }

    /// None where nothing is known.
    pub(super) fn of(&self, record: usize, regime: Regime) -> Error {
        self.0
            .get(record)
            .map_or_else(Error::default, |groups| groups[regime as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_from_node_to_node_is_white() {
        let nodes: Vec<Node> = (0..400)
            .map(|sample| Node {
                record: 0,
                stretch: 0,
                sample,
                regime: Regime::Sliding,
                excluded: false,
                fold: 0,
            })
            .collect();
        let error = |of: fn(usize) -> f64| {
            let left_over: Vec<f64> = (0..nodes.len()).map(of).collect();
            Own::new(&nodes, &left_over, 1).of(0, Regime::Sliding)
        };
        let slow = error(|k| (0.01 * k as f64).sin());
        assert!(slow.white_nm < 0.02 * slow.rms_nm, "{slow:?}");
        assert!(slow.slow_nm() > 0.99 * slow.rms_nm, "{slow:?}");
        // A wave of five nodes differs by 1.18 of its rms between neighbours, 0.83 of what white noise does.
        let fast = error(|k| (1.2566 * k as f64 + 0.3).sin());
        assert!(
            (0.6..1.2).contains(&(fast.white_nm / fast.rms_nm)),
            "{fast:?}"
        );
    }

    #[test]
    fn the_middle_one_is_neither_the_least_nor_the_most() {
        let of = |rms: [f64; 3]| {
            Own(vec![rms.map(|rms_nm| Error {
                rms_nm,
                white_nm: 0.5 * rms_nm,
            })])
        };
        let [one, other, third] = [[1.0, 5.0, 2.0], [2.0, 4.0, 2.0], [3.0, 6.0, 1.0]].map(of);
        assert_eq!(Own::middle(&one, &other, &third).0, of([2.0, 5.0, 2.0]).0);
        assert_eq!(Own::middle(&third, &one, &other).0, of([2.0, 5.0, 2.0]).0);
        assert_eq!(one.or_less(&other).0, of([1.0, 4.0, 2.0]).0);
    }
}
