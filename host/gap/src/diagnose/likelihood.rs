//! How well a rest is explained: noise by record and regime, and the density that a rest has under it.

use super::regime::{Node, Regime};
use crate::inverse::Record;

/// The noise of a record in a regime.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Group {
    /// Nodes that count.
    pub nodes: usize,
    /// Independent ones among them.
    pub independent: f64,
    /// Noise that no model explains, N m rms: no more than what the fitted model leaves over.
    pub floor_nm: f64,
    /// What the encoder leaves open of the torque, N m rms: a rest below it speaks for nothing.
    pub open_nm: f64,
    /// Noise that a fit is weighted by, N m rms: what a model leaves over, at least the floor.
    pub spread_nm: f64,
}

/// Noise of all records in all regimes.
#[derive(Clone, Debug)]
pub struct Noise {
    groups: Vec<[Group; 3]>,
    discrepancy_nm: f64,
}

/// Every model errs: what is left below this part of the gap speaks for no effect. Kennedy and O'Hagan 2001, J. R. Stat.
/// Soc. B 63, call it the discrepancy.
const DISCREPANCY: f64 = 0.12;

/// Correlation is looked for up to this many nodes, some 0.3 s.
const LONGEST_LAG: usize = 12;

/// Error of a bristle deflection in counts: quantisation, which at rest does not average out.
const COUNT_ERROR: f64 = 0.3;

/// What the method leaves over of an axis that is exactly the model and whose effort is measured exactly, by record and
/// regime: coarse positions and smoothing.
#[derive(Clone, Debug, Default)]
pub struct Own(Vec<[f64; 3]>);

impl Own {
    /// From records of such an axis.
    pub fn new(records: &[Record], nodes: &[Node], left_over: &[f64]) -> Self {
        let mut sums = vec![[(0.0, 0.0); 3]; records.len()];
        for (node, r) in nodes.iter().zip(left_over).filter(|(n, _)| !n.excluded) {
            let (square, count) = &mut sums[node.record][node.regime as usize];
            *square += r * r;
            *count += 1.0;
        }
        let rms = |(square, count): (f64, f64)| (square / f64::max(count, 1.0)).sqrt();
        Self(sums.into_iter().map(|groups| groups.map(rms)).collect())
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

    fn rms_nm(&self, record: usize, regime: Regime) -> f64 {
        self.0
            .get(record)
            .map_or(0.0, |groups| groups[regime as usize])
    }
}

impl Noise {
    /// From what a fitted model leaves over. `stiffness_nm_rad` turns the encoder's error into torque in presliding.
    pub fn new(
        records: &[Record],
        nodes: &[Node],
        left_over: &[f64],
        inertia_kg_m2: f64,
        stiffness_nm_rad: f64,
        coulomb_nm: f64,
    ) -> Self {
        let open = |place: usize, regime, white_nm: f64| match regime {
            Regime::Sliding => white_nm,
            _ => white_nm.hypot(
                (COUNT_ERROR * records[place].rad_per_count * stiffness_nm_rad)
                    .min(0.5 * coulomb_nm),
            ),
        };
        Self::with_open(records, nodes, left_over, inertia_kg_m2, open)
    }

    /// The same where it is known what the model leaves over on records of its own.
    pub fn beside(
        records: &[Record],
        nodes: &[Node],
        left_over: &[f64],
        inertia_kg_m2: f64,
        own: &Own,
    ) -> Self {
        let open = |place, regime, white_nm: f64| white_nm.max(own.rms_nm(place, regime));
        Self::with_open(records, nodes, left_over, inertia_kg_m2, open)
    }

    /// `open` is told record, regime and white noise, and gives what is open of the torque.
    fn with_open(
        records: &[Record],
        nodes: &[Node],
        left_over: &[f64],
        inertia_kg_m2: f64,
        open: impl Fn(usize, Regime, f64) -> f64,
    ) -> Self {
        let mut groups = vec![[Group::default(); 3]; records.len()];
        for (place, record) in records.iter().enumerate() {
            for regime in Regime::ALL {
                let members: Vec<(usize, f64)> = nodes
                    .iter()
                    .zip(left_over)
                    .enumerate()
                    .filter(|(_, (node, _))| {
                        node.record == place && node.regime == regime && !node.excluded
                    })
                    .map(|(at, (_, &r))| (at, r))
                    .collect();
                let closed = record.noise_nm(inertia_kg_m2);
                let white = difference_noise(&members);
                let robust = robust_rms(&members);
                let open_nm = open(place, regime, closed.max(white));
                let floor_nm = open_nm.min(robust);
                groups[place][regime as usize] = Group {
                    nodes: members.len(),
                    independent: members.len() as f64 / correlation(&members, regime),
                    floor_nm,
                    open_nm,
                    spread_nm: robust.max(closed),
                };
            }
        }
        Self {
            groups,
            discrepancy_nm: 0.0,
        }
    }

    /// The same where a gap of this rms is to be explained.
    #[must_use]
    pub fn explaining(mut self, gap_nm: f64) -> Self {
        self.discrepancy_nm = DISCREPANCY * gap_nm;
        self
    }

    /// The noise about a node.
    pub fn group(&self, node: &Node) -> &Group {
        &self.groups[node.record][node.regime as usize]
    }

    /// Weight of each node in a fit: the inverse of its spread, less where neighbours say the same.
    pub fn weights(&self, nodes: &[Node]) -> Vec<f64> {
        nodes
            .iter()
            .map(|node| {
                let group = self.group(node);
                if node.excluded || group.nodes == 0 {
                    0.0
                } else {
                    (group.independent / group.nodes as f64).sqrt() / group.spread_nm
                }
            })
            .collect()
    }

    /// Logarithm of the density of a rest, but for a constant that all rests of the same nodes share. Each group's
    /// spread is its own best one above the floor, so that no one has to know how large a model's error is.
    pub fn log_density(&self, nodes: &[Node], left_over: &[f64]) -> f64 {
        let mut squares = vec![[0.0_f64; 3]; self.groups.len()];
        for (node, r) in nodes.iter().zip(left_over) {
            if !node.excluded {
                squares[node.record][node.regime as usize] += r * r;
            }
        }
        let mut sum = 0.0;
        for (groups, squares) in self.groups.iter().zip(&squares) {
            for (group, square) in groups.iter().zip(squares) {
                if group.nodes > 0 {
                    let open = group.open_nm * group.open_nm;
                    // Below what is open a rest is as good as it can be: less follows the method's own error.
                    let mean = (square / group.nodes as f64).max(open);
                    let spread = mean + self.discrepancy_nm.powi(2);
                    sum -= 0.5 * group.independent * (spread.ln() + mean / spread);
                }
            }
        }
        sum
    }

    /// What the encoder leaves open beyond the floor, over all nodes that count, N m rms: a coarse encoder in presliding.
    pub fn open_beyond_floor_nm(&self, nodes: &[Node]) -> f64 {
        let (mut square, mut count) = (0.0, 0.0);
        for node in nodes {
            if !node.excluded && node.regime != Regime::Rest {
                let group = self.group(node);
                square += group.open_nm.powi(2) - group.floor_nm.powi(2);
                count += 1.0;
            }
        }
        (square / f64::max(count, 1.0)).sqrt()
    }

    /// Floor and rms of a rest over all nodes that count.
    pub fn rms(&self, nodes: &[Node], left_over: &[f64]) -> (f64, f64) {
        let (mut floor, mut square, mut count) = (0.0, 0.0, 0.0);
        for (node, r) in nodes.iter().zip(left_over) {
            if !node.excluded && node.regime != Regime::Rest {
                floor += self.group(node).floor_nm.powi(2);
                square += r * r;
                count += 1.0;
            }
        }
        let count = f64::max(count, 1.0);
        ((floor / count).sqrt(), (square / count).sqrt())
    }
}

/// White noise of nodes that follow each other, from their differences; the median, so that single moments do not count.
fn difference_noise(members: &[(usize, f64)]) -> f64 {
    let mut differences: Vec<f64> = members
        .windows(2)
        .filter(|pair| pair[1].0 == pair[0].0 + 1)
        .map(|pair| (pair[1].1 - pair[0].1).abs())
        .collect();
    median(&mut differences) / 0.6745 / 2.0_f64.sqrt()
}

/// Root-mean-square without the largest hundredth.
fn robust_rms(members: &[(usize, f64)]) -> f64 {
    let mut squares: Vec<f64> = members.iter().map(|(_, r)| r * r).collect();
    squares.sort_unstable_by(f64::total_cmp);
    let kept = squares.len() - squares.len() / 100;
    if kept == 0 {
        return 0.0;
    }
    (squares[..kept].iter().sum::<f64>() / kept as f64).sqrt()
}

fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Nodes that say the same once: 1 + 2 sum of the correlations until the first that is not positive. At rest an error
/// of the deflection stays until the axis moves again: then all nodes of a rest say the same once.
fn correlation(members: &[(usize, f64)], regime: Regime) -> f64 {
    if regime == Regime::Rest {
        let rests = 1 + members
            .windows(2)
            .filter(|pair| pair[1].0 != pair[0].0 + 1)
            .count();
        return (members.len() as f64 / (3.0 * rests as f64)).max(1.0);
    }
    let square: f64 = members.iter().map(|(_, r)| r * r).sum();
    if square == 0.0 {
        return 1.0;
    }
    let mut factor = 1.0;
    for lag in 1..=LONGEST_LAG {
        let sum: f64 = members
            .windows(lag + 1)
            .filter(|pair| pair[lag].0 == pair[0].0 + lag)
            .map(|pair| pair[0].1 * pair[lag].1)
            .sum();
        let correlation = sum / square;
        if correlation <= 0.0 {
            break;
        }
        factor += 2.0 * correlation;
    }
    factor
}
