//! What the axis does at each node of a record, and the blocks of time that are left out together.

use crate::inverse::Record;

/// What the axis does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Regime {
    /// Not moving: friction is whatever holds it, and the encoder tells nothing of it.
    Rest,
    /// Presliding, break-away or reversal: slower than bristles bend within 10 ms.
    Low,
    /// Sliding.
    Sliding,
}

impl Regime {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Rest, Self::Low, Self::Sliding];
    /// Those of motion.
    pub const MOVING: [Self; 2] = [Self::Low, Self::Sliding];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Low => "presliding, break-away and reversal",
            Self::Sliding => "sliding",
        }
    }
}

/// A node and where it belongs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Place of its record.
    pub record: usize,
    /// Place of its stretch in the record.
    pub stretch: usize,
    /// Place of its middle sample in the stretch.
    pub sample: usize,
    /// What the axis does there.
    pub regime: Regime,
    /// No one should fit it.
    pub excluded: bool,
    /// Part of the data that is left out together.
    pub fold: usize,
}

impl Node {
    /// Position at its middle, rad.
    pub fn position_rad(&self, records: &[Record]) -> f64 {
        records[self.record].stretches[self.stretch].smooth_rad[self.sample]
    }

    /// Velocity at its middle, rad/s.
    pub fn velocity_rad_s(&self, records: &[Record]) -> f64 {
        records[self.record].stretches[self.stretch].velocity_rad_s[self.sample]
    }

    /// Effort of the sample at its middle, N m.
    pub fn effort_nm(&self, records: &[Record]) -> f64 {
        records[self.record].stretches[self.stretch].effort_nm[self.sample]
    }

    /// Acceleration at its middle, rad/s^2: no node lies at an end of its stretch.
    pub fn acceleration_rad_s2(&self, records: &[Record]) -> f64 {
        let record = &records[self.record];
        let v = &record.stretches[self.stretch].velocity_rad_s;
        (v[self.sample + 1] - v[self.sample - 1]) / (2.0 * record.step_s)
    }

    /// Whether it counts, and the axis slides.
    pub(super) fn counts_in_sliding(&self) -> bool {
        !self.excluded && self.regime == Regime::Sliding
    }

    /// Time of its middle since the start of its log, s.
    pub fn time_s(&self, records: &[Record]) -> f64 {
        let record = &records[self.record];
        record.stretches[self.stretch].start_s + self.sample as f64 * record.step_s
    }
}

/// Places of the nodes of a record that count, in some regimes, and these values there.
pub(super) fn members(
    nodes: &[Node],
    values: &[f64],
    record: usize,
    of: impl Fn(Regime) -> bool,
) -> Vec<(usize, f64)> {
    let counts = |node: &Node| node.record == record && of(node.regime) && !node.excluded;
    let all = nodes.iter().zip(values).enumerate();
    all.filter(|(_, (node, _))| counts(node))
        .map(|(at, (_, &value))| (at, value))
        .collect()
}

/// Parts that the data are left out in.
pub const FOLDS: usize = 5;
/// Shortest stretch that is left out as a whole: far longer than anything but drift remembers, s.
const BLOCK_S: f64 = 0.5;
/// Blocks of a record, where it is long enough.
const BLOCKS: usize = 20;
/// At the start of a stretch nobody knows the bristles, s.
const SETTLES_S: f64 = 0.02;
/// Bristles bend by their whole deflection in this time at the speed below which the regime is low, s.
const BENDS_S: f64 = 0.01;

/// The nodes of all records, in the order of what is left over.
pub fn nodes(records: &[Record], z_ss_rad: f64) -> Vec<Node> {
    let mut nodes = Vec::new();
    for (place, record) in records.iter().enumerate() {
        let reach = record.kernel.reach() + 1;
        let width_s = (2 * reach + 1) as f64 * record.step_s;
        let rest = record.still_rad_s();
        let low = (z_ss_rad / BENDS_S).max(3.0 * record.rad_per_count / width_s);
        let whole_s: f64 = record
            .stretches
            .iter()
            .map(|stretch| stretch.effort_nm.len() as f64 * record.step_s)
            .sum();
        let block_s = (whole_s / BLOCKS as f64).max(BLOCK_S);
        for (at, stretch) in record.stretches.iter().enumerate() {
            let v = &stretch.velocity_rad_s;
            for node in 0..record.nodes_of(stretch) {
                let sample = record.middle(node);
                let around = sample.saturating_sub(reach)..(sample + reach + 1).min(v.len());
                let slowest = v[around.clone()]
                    .iter()
                    .fold(f64::INFINITY, |m, x| m.min(x.abs()));
                let fastest = v[around.clone()]
                    .iter()
                    .fold(0.0, |m: f64, x| m.max(x.abs()));
                let turns = v[around.clone()].windows(2).any(|v| v[0] * v[1] < 0.0);
                let regime = if fastest < rest {
                    Regime::Rest
                } else if slowest < low || turns {
                    Regime::Low
                } else {
                    Regime::Sliding
                };
                let time_s = sample as f64 * record.step_s;
                nodes.push(Node {
                    record: place,
                    stretch: at,
                    sample,
                    regime,
                    excluded: stretch.excluded[around].contains(&true) || time_s < SETTLES_S,
                    fold: ((stretch.start_s + time_s) / block_s) as usize % FOLDS,
                });
            }
        }
    }
    nodes
}
