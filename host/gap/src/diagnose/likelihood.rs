//! How well a rest is explained: noise by record and regime, and the density that a rest has under it.

use super::own::{Error, Own};
use super::regime::{Node, Regime, members};
use super::tone::toneless;
use super::white_noise::{BLOCK_S, coloured_noise, difference_noise};
use crate::inverse::Record;
use crate::signal::{rms, rms_beside, rms_by_median};

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
    /// Noise that a fit is weighted by, N m rms: what a model leaves over, at least the floor and a part of what is open.
    pub spread_nm: f64,
    /// What every model errs by, N m rms.
    discrepancy_nm: f64,
}

/// Noise of all records in all regimes.
#[derive(Clone, Debug)]
pub struct Noise {
    groups: Vec<[Group; 3]>,
}

/// Every model errs: what is left below this part of a group's gap speaks for no effect. Kennedy and O'Hagan 2001,
/// J. R. Stat. Soc. B 63, call it the discrepancy.
const DISCREPANCY: f64 = 0.12;

/// Independent nodes that tell how large a rest is to a sixth.
const TELLS: f64 = 20.0;
/// Correlation is looked for up to this many nodes, some 0.3 s.
const LONGEST_LAG: usize = 12;

/// Noise of an effort is correlated over some 10 ms: the filters of its converter. What nodes so far apart have in common
/// is no longer noise, s.
const COLOUR_S: f64 = 0.02;

/// A fit leaves at least this part of what is open: taking away the method's own error it would move parameters by it. A third
/// is what the true parameters of an opened case left where its fit took a tenth; with all of it presliding says little of a play.
const BELIEVED: f64 = 0.5;

/// Error of a bristle deflection in counts: quantisation, which at rest does not average out.
const COUNT_ERROR: f64 = 0.3;

/// A spread of so many times what is usual is that of a few moments: noise with tails as long as a Laplacian's has 1.4.
const HELD_BY_FEW: f64 = 3.0;

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
        let counts = |place: usize, regime| Error {
            rms_nm: match regime {
                Regime::Sliding => 0.0,
                _ => (COUNT_ERROR * records[place].rad_per_count * stiffness_nm_rad)
                    .min(0.5 * coulomb_nm),
            },
            white_nm: 0.0,
        };
        Self::with_method(records, nodes, left_over, inertia_kg_m2, None, counts)
    }

    /// The same where it is known what the model leaves over on records of its own. `holds_nm` is what the model itself
    /// leaves open of friction where the axis hardly moves: none with bristles, about half of it where friction is
    /// whatever holds.
    pub fn beside(
        records: &[Record],
        nodes: &[Node],
        left_over: &[f64],
        inertia_kg_m2: f64,
        holds_nm: f64,
        own: &Own,
    ) -> Self {
        let of_method = |place, regime| own.of(place, regime);
        let mut noise = Self::with_method(
            records,
            nodes,
            left_over,
            inertia_kg_m2,
            Some(holds_nm),
            of_method,
        );
        for group in noise.groups.iter_mut().flatten() {
            group.spread_nm = group.spread_nm.max(BELIEVED * group.open_nm);
        }
        noise
    }

    /// `of_method` gives what is open of the torque in a record and regime beside noise; `holds_nm` is none where that is not known
    /// well enough for what the fit leaves over to tell the noise.
    fn with_method(
        records: &[Record],
        nodes: &[Node],
        left_over: &[f64],
        inertia_kg_m2: f64,
        holds_nm: Option<f64>,
        of_method: impl Fn(usize, Regime) -> Error,
    ) -> Self {
        let calm = |regime| regime != Regime::Low;
        let toneless = toneless(records, nodes, left_over, |place| {
            members(nodes, left_over, place, calm)
        });
        let coloured: Vec<Option<f64>> = records
            .iter()
            .enumerate()
            .map(|(place, record)| {
                let node_s = record.node_s();
                let [apart, block] =
                    [COLOUR_S, BLOCK_S].map(|time| (time / node_s).round() as usize);
                let calm = members(nodes, &toneless, place, calm);
                coloured_noise(&calm, apart, block.max(4 * apart))
            })
            .collect();
        // A record without quiet moments has the noise of the others: the recorder is the same.
        let of_others = coloured.iter().flatten().copied().reduce(f64::min);
        let mut groups = vec![[Group::default(); 3]; records.len()];
        for (place, record) in records.iter().enumerate() {
            let coloured = coloured[place].or(of_others).unwrap_or(0.0);
            for regime in Regime::ALL {
                let here = |values: &[f64]| members(nodes, values, place, |of| of == regime);
                let members = here(left_over);
                let speeds = members
                    .iter()
                    .map(|&(at, _)| nodes[at].velocity_rad_s(records));
                let white = difference_noise(&here(&toneless)).max(coloured);
                let robust = robust_rms(&members);
                let closed = record.noise_nm(inertia_kg_m2, rms(speeds));
                let method = of_method(place, regime);
                // Differences of effort that a stiff control makes alternate are no noise: the fit does not leave them over.
                let noise_nm = if holds_nm.is_some() && members.len() as f64 > TELLS {
                    closed.min(rms_beside(robust, method.rms_nm))
                } else {
                    closed
                };
                let held_nm = match regime {
                    Regime::Sliding => 0.0,
                    _ => holds_nm.unwrap_or(0.0),
                };
                // The method's own white error is in the noise of encoder and rest already.
                let open_nm = noise_nm
                    .max(white)
                    .max(method.white_nm)
                    .hypot(method.slow_nm())
                    .max(held_nm);
                let floor_nm = open_nm.min(robust);
                groups[place][regime as usize] = Group {
                    nodes: members.len(),
                    independent: members.len() as f64 / correlation(&members, regime),
                    floor_nm,
                    open_nm,
                    spread_nm: robust.max(noise_nm).max(held_nm),
                    discrepancy_nm: 0.0,
                };
            }
        }
        Self { groups }
    }

    /// The same where this gap is to be explained, N m at each node.
    #[must_use]
    pub fn explaining(mut self, nodes: &[Node], gap_nm: &[f64]) -> Self {
        let squares = self.mean_squares(nodes, gap_nm);
        for (groups, squares) in self.groups.iter_mut().zip(squares) {
            for (group, square) in groups.iter_mut().zip(squares) {
                group.discrepancy_nm = DISCREPANCY * square.sqrt();
            }
        }
        self
    }

    /// The same where at least what the method leaves over of some model is open.
    #[must_use]
    pub fn at_least(mut self, own: &Own) -> Self {
        for (place, groups) in self.groups.iter_mut().enumerate() {
            for (group, regime) in groups.iter_mut().zip(Regime::ALL) {
                group.open_nm = group.open_nm.max(own.of(place, regime).rms_nm);
            }
        }
        self
    }

    /// Mean square of a rest by record and regime.
    fn mean_squares(&self, nodes: &[Node], left_over: &[f64]) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 3]; self.groups.len()];
        for (node, r) in nodes.iter().zip(left_over) {
            if !node.excluded {
                sums[node.record][node.regime as usize] += r * r;
            }
        }
        for (sums, groups) in sums.iter_mut().zip(&self.groups) {
            for (sum, group) in sums.iter_mut().zip(groups) {
                *sum /= group.nodes.max(1) as f64;
            }
        }
        sums
    }

    /// The records and regimes of motion, and the mean square of a rest in each.
    fn in_motion<'a>(
        &'a self,
        nodes: &[Node],
        left_over: &[f64],
    ) -> impl Iterator<Item = (&'a Group, f64)> + use<'a> {
        let squares = self.mean_squares(nodes, left_over);
        self.groups
            .iter()
            .zip(squares)
            .flat_map(|(groups, squares)| {
                Regime::MOVING.map(|at| (&groups[at as usize], squares[at as usize]))
            })
    }

    /// What a rest usually is about each node, N m rms.
    pub fn usual(&self, nodes: &[Node], left_over: &[f64]) -> Vec<f64> {
        let squares = self.mean_squares(nodes, left_over);
        let of = |node: &Node| squares[node.record][node.regime as usize].sqrt();
        nodes.iter().map(of).collect()
    }

    /// How many times what is open a rest is: the geometric mean over all that is independent and moves, so that no one
    /// regime decides by its size.
    pub fn times_open(&self, nodes: &[Node], left_over: &[f64]) -> f64 {
        self.times_open_in(nodes, left_over, &Regime::MOVING)
    }

    /// The same in some regimes.
    pub fn times_open_in(&self, nodes: &[Node], left_over: &[f64], regimes: &[Regime]) -> f64 {
        let (nats, independent) = self.beyond_open(nodes, left_over, regimes);
        (nats / f64::max(independent, 1.0)).exp()
    }

    /// Nats by which a rest speaks in some regimes for more than is open, by all that is independent there.
    pub fn nats_beyond_open(&self, nodes: &[Node], left_over: &[f64], regimes: &[Regime]) -> f64 {
        self.beyond_open(nodes, left_over, regimes).0
    }

    /// Logarithm of how many times what is open a rest is, summed over all that is independent in some regimes, and how much that is.
    fn beyond_open(&self, nodes: &[Node], left_over: &[f64], regimes: &[Regime]) -> (f64, f64) {
        let squares = self.mean_squares(nodes, left_over);
        let (mut nats, mut independent) = (0.0, 0.0);
        for (groups, squares) in self.groups.iter().zip(&squares) {
            for &regime in regimes {
                let (group, square) = (&groups[regime as usize], squares[regime as usize]);
                if group.nodes > 0 && group.open_nm > 0.0 {
                    let times = (square.sqrt() / group.open_nm).max(1.0);
                    nats += group.independent * times.ln();
                    independent += group.independent;
                }
            }
        }
        (nats, independent)
    }

    /// The same over some regimes as a ratio of root-mean-squares: it shows a rest that only few independent moments have.
    pub fn rms_times_open(&self, nodes: &[Node], left_over: &[f64], regimes: &[Regime]) -> f64 {
        let squares = self.mean_squares(nodes, left_over);
        let (mut rest, mut open) = (0.0, 0.0);
        for (groups, squares) in self.groups.iter().zip(&squares) {
            for &regime in regimes {
                let (group, square) = (&groups[regime as usize], squares[regime as usize]);
                rest += group.nodes as f64 * square;
                open += group.nodes as f64 * group.open_nm.powi(2);
            }
        }
        if open > 0.0 {
            (rest / open).sqrt().max(1.0)
        } else {
            1.0
        }
    }

    /// The same in the record and regime of motion where that is most, of those where it speaks by so many nats.
    pub fn most_times_open(&self, nodes: &[Node], left_over: &[f64], nats: f64) -> f64 {
        self.in_motion(nodes, left_over)
            .filter(|(group, _)| group.open_nm > 0.0)
            .map(|(group, square)| (group.independent, square.sqrt() / group.open_nm))
            .filter(|(independent, times)| independent * times.ln() > nats)
            .fold(1.0, |most, (_, times)| times.max(most))
    }

    /// Root mean square of the difference between two rests in motion, in times of what is open.
    pub fn apart(&self, nodes: &[Node], one: &[f64], other: &[f64]) -> f64 {
        let moving = |node: &Node| !node.excluded && node.regime != Regime::Rest;
        rms(nodes
            .iter()
            .zip(one.iter().zip(other))
            .filter(|(node, _)| moving(node))
            .map(|(node, (one, other))| (one - other) / self.group(node).open_nm))
    }

    /// Whether a rest is as large in every record and regime of motion, to a factor, where three or more of them are long enough to
    /// tell: then it does not depend on what the axis does.
    pub fn is_even(&self, nodes: &[Node], left_over: &[f64], factor: f64) -> bool {
        let told: Vec<f64> = self
            .in_motion(nodes, left_over)
            .filter(|(group, _)| group.independent > TELLS)
            .map(|(_, square)| square.sqrt())
            .collect();
        let most = told.iter().fold(0.0, |most: f64, rms| most.max(*rms));
        told.len() >= 3 && told.iter().all(|rms| most < factor * rms)
    }

    /// The noise about a node.
    pub fn group(&self, node: &Node) -> &Group {
        self.of(node.record, node.regime)
    }

    /// The noise of a record in a regime.
    pub(super) fn of(&self, record: usize, regime: Regime) -> &Group {
        &self.groups[record][regime as usize]
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

    /// The same by what is usual of this rest in the groups that a few moments hold as noise; none where there are no such groups.
    pub fn weights_of_most(&self, nodes: &[Node], left_over: &[f64]) -> Option<Vec<f64>> {
        let mut weights = self.weights(nodes);
        let mut any = false;
        for record in 0..self.groups.len() {
            for regime in Regime::ALL {
                let members = members(nodes, left_over, record, |of| of == regime);
                let mut sizes_nm: Vec<f64> = members.iter().map(|(_, r)| r.abs()).collect();
                let usual_nm = rms_by_median(&mut sizes_nm);
                let spread_nm = self.of(record, regime).spread_nm;
                if usual_nm > 0.0 && spread_nm > HELD_BY_FEW * usual_nm {
                    any = true;
                    for (at, _) in members {
                        weights[at] *= spread_nm / usual_nm;
                    }
                }
            }
        }
        any.then_some(weights)
    }

    /// Logarithm of the density of a rest while the axis moves, but for a constant that all rests of the same nodes share.
    /// At rest it says how far the bristles are bent, which the encoder tells too little of. Each group's
    /// spread is its own best one above the floor, so that no one has to know how large a model's error is.
    /// Below what is open a rest is as good as it can be: less follows the method's own error.
    pub fn log_density(&self, nodes: &[Node], left_over: &[f64]) -> f64 {
        self.log_density_above(nodes, left_over, |group| group.open_nm)
    }

    /// The same where a rest below what is open counts, too.
    pub fn log_density_of_all(&self, nodes: &[Node], left_over: &[f64]) -> f64 {
        self.log_density_above(nodes, left_over, |_| 0.0)
    }

    fn log_density_above(
        &self,
        nodes: &[Node],
        left_over: &[f64],
        least_nm: impl Fn(&Group) -> f64,
    ) -> f64 {
        let mut sum = 0.0;
        for (group, square) in self.in_motion(nodes, left_over) {
            // What ran away is nothing that a maximum would pass over.
            if square.is_nan() {
                return f64::NEG_INFINITY;
            }
            if group.nodes > 0 {
                let mean = square.max(least_nm(group).powi(2));
                let spread = mean + group.discrepancy_nm.powi(2);
                sum -= 0.5 * group.independent * (spread.ln() + mean / spread);
            }
        }
        sum
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_few_independent_moments_have_shows_in_the_rms() {
        let group = |nodes, independent| Group {
            nodes,
            independent,
            open_nm: 1.0,
            ..Group::default()
        };
        // 100 nodes in presliding, as independent as they are many, and 300 of sliding that say the same 60 times over.
        let noise = Noise {
            groups: vec![[Group::default(), group(100, 100.0), group(300, 5.0)]],
        };
        let nodes: Vec<Node> = (0..400)
            .map(|sample| Node {
                record: 0,
                stretch: 0,
                sample,
                regime: if sample < 100 {
                    Regime::Low
                } else {
                    Regime::Sliding
                },
                excluded: false,
                fold: 0,
            })
            .collect();
        let rest: Vec<f64> = nodes
            .iter()
            .map(|node| f64::from(3 * u8::from(node.regime == Regime::Sliding)))
            .collect();
        let near = |found: f64, exact: f64| assert!((found - exact).abs() < 1e-12, "{found}");
        near(noise.times_open(&nodes, &rest), 3_f64.powf(5.0 / 105.0));
        near(noise.rms_times_open(&nodes, &rest, &[Regime::Sliding]), 3.0);
        let both = noise.rms_times_open(&nodes, &rest, &Regime::MOVING);
        near(both, (2700.0_f64 / 400.0).sqrt());
        near(noise.rms_times_open(&nodes, &rest, &[Regime::Low]), 1.0);
        // What ran away is as unlikely as can be.
        let ran_away = noise.log_density(&nodes, &[f64::NAN; 400]);
        assert_eq!(ran_away, f64::NEG_INFINITY);
    }
}
