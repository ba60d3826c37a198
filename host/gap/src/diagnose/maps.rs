//! Maps of the gap: against position, speed and time, as a spectrum over angle and one over time.
//!
//! Before and after a hypothesis, from the fits to all data. A spectrum over angle is by least squares at each order,
//! since the axis does not pass angles evenly (Lomb 1976, Astrophys. Space Sci. 39); one over time is a mean of
//! half-overlapping Hann windows (Welch 1967, IEEE Trans. Audio Electroacoust. 15).

use super::hypothesis::Hypothesis;
use super::tried::Search;
use crate::signal::fourier;
use bristle_plant::Unit;
use std::f64::consts::TAU;

/// Parts that a map is divided into.
const PARTS: usize = 48;
/// A part with fewer nodes than this says nothing.
const LEAST_NODES: usize = 8;
/// Orders of a spectrum over angle.
const ORDERS: usize = 240;
/// Nodes in a window of a spectrum over time.
const WINDOW: usize = 512;

/// The gap along one variable. A linear axis reads m for rad.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// Middles of the parts, or lines of a spectrum.
    pub at: Vec<f64>,
    /// Of the refitted simulator; mean and rms in a part, or amplitude of a line, N m.
    pub before: Vec<f64>,
    /// With the hypothesis.
    pub after: Vec<f64>,
    /// Means in a part, before and after; empty for a spectrum.
    pub mean: [Vec<f64>; 2],
}

/// All maps of the gap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Maps {
    /// Over position, rad.
    pub position: Map,
    /// Over speed, rad/s.
    pub speed: Map,
    /// Over time since the start of each log, s.
    pub time: Map,
    /// Over orders a turn, or waves a metre.
    pub order: Map,
    /// Over frequency, Hz.
    pub frequency: Map,
}

/// The maps, for one hypothesis.
pub fn maps(search: &Search, hypothesis: &Hypothesis) -> Maps {
    let rest = Rest {
        search,
        kept: (0..search.nodes.len())
            .filter(|&i| !search.nodes[i].excluded && search.weights[i] > 0.0)
            .collect(),
        before: &search.base.fit.left_over,
        after: &hypothesis.fit.left_over,
    };
    Maps {
        position: rest.over(|search, i| search.nodes[i].position_rad(&search.records)),
        speed: rest.over(|search, i| search.nodes[i].velocity_rad_s(&search.records)),
        time: rest.over(|search, i| search.nodes[i].time_s(&search.records)),
        order: rest.orders(),
        frequency: rest.frequencies(),
    }
}

struct Rest<'a> {
    search: &'a Search,
    kept: Vec<usize>,
    before: &'a [f64],
    after: &'a [f64],
}

impl Rest<'_> {
    fn over(&self, value: impl Fn(&Search, usize) -> f64) -> Map {
        let values: Vec<f64> = self.kept.iter().map(|&i| value(self.search, i)).collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut map = Map::default();
        if high <= low {
            return map;
        }
        let mut sums = vec![[0.0_f64; 5]; PARTS];
        for (&i, x) in self.kept.iter().zip(&values) {
            let part = ((x - low) / (high - low) * PARTS as f64) as usize;
            let sums = &mut sums[part.min(PARTS - 1)];
            let (before, after) = (self.before[i], self.after[i]);
            for (sum, x) in
                sums.iter_mut()
                    .zip([1.0, before, after, before * before, after * after])
            {
                *sum += x;
            }
        }
        for (part, [count, before, after, before_square, after_square]) in
            sums.into_iter().enumerate()
        {
            map.at
                .push(low + (high - low) * (part as f64 + 0.5) / PARTS as f64);
            let says = |x: f64| {
                if count < LEAST_NODES as f64 {
                    f64::NAN
                } else {
                    x
                }
            };
            map.before.push(says((before_square / count).sqrt()));
            map.after.push(says((after_square / count).sqrt()));
            map.mean[0].push(says(before / count));
            map.mean[1].push(says(after / count));
        }
        map
    }

    /// Amplitudes at whole orders a turn, or at multiples of one wave over a linear stroke.
    fn orders(&self) -> Map {
        let search = self.search;
        let unit = search.scale.unit;
        let step = match unit {
            Unit::Rotary => 1.0,
            Unit::Linear => 1.0 / search.scale.stroke_rad(),
        };
        let angles: Vec<f64> = self
            .kept
            .iter()
            .map(|&i| {
                let node = &search.nodes[i];
                let stretch = &search.records[node.record].stretches[node.stretch];
                unit.wave_rad(stretch.smooth_rad[node.sample])
            })
            .collect();
        let mut map = Map::default();
        for k in 1..=ORDERS {
            let order = step * k as f64;
            let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
            let mut right = [[0.0; 2]; 2];
            for (&i, angle) in self.kept.iter().zip(&angles) {
                let (a, b) = (order * angle).sin_cos();
                aa += a * a;
                ab += a * b;
                bb += b * b;
                for (right, rest) in right.iter_mut().zip([self.before[i], self.after[i]]) {
                    right[0] += a * rest;
                    right[1] += b * rest;
                }
            }
            let determinant = aa * bb - ab * ab;
            let amplitude = |[a, b]: [f64; 2]| {
                // Orders that the record does not pass a wave of are no amplitudes.
                if determinant > 0.01 * aa * bb {
                    ((bb * a - ab * b) / determinant).hypot((aa * b - ab * a) / determinant)
                } else {
                    f64::NAN
                }
            };
            map.at.push(order);
            map.before.push(amplitude(right[0]));
            map.after.push(amplitude(right[1]));
        }
        map
    }

    /// Amplitude density over frequency, N m per root Hz, as the mean over all records; excluded nodes count as zero.
    fn frequencies(&self) -> Map {
        let search = self.search;
        let Some(slowest) = search
            .records
            .iter()
            .max_by(|a, b| node_s(a).total_cmp(&node_s(b)))
        else {
            return Map::default();
        };
        let highest_hz = 0.5 / node_s(slowest);
        let lines = WINDOW / 2;
        let mut map = Map {
            at: (1..=lines)
                .map(|line| highest_hz * line as f64 / lines as f64)
                .collect(),
            ..Map::default()
        };
        let (mut before, mut after) = (vec![0.0; lines], vec![0.0; lines]);
        let mut windows = 0.0;
        let mut first = 0;
        for record in search.records.iter() {
            // Records of other rates come to the same lines with a window of another length.
            let window = (WINDOW as f64 * node_s(slowest) / node_s(record)).round() as usize;
            let transform = fourier(window);
            let (mut input, mut output) = (transform.make_input_vec(), transform.make_output_vec());
            for stretch in &record.stretches {
                let nodes = record.nodes_of(stretch);
                let mut start = 0;
                while start + window <= nodes {
                    for (rest, sums) in [(self.before, &mut before), (self.after, &mut after)] {
                        for (k, x) in input.iter_mut().enumerate() {
                            let i = first + start + k;
                            let hann = 0.5 - 0.5 * (TAU * k as f64 / window as f64).cos();
                            *x = if search.nodes[i].excluded {
                                0.0
                            } else {
                                hann * rest[i]
                            };
                        }
                        if transform.process(&mut input, &mut output).is_ok() {
                            // One-sided; a Hann window has 3/8 of the power.
                            let per = 2.0 * node_s(record) / (0.375 * window as f64);
                            for (sum, line) in sums.iter_mut().zip(&output[1..]) {
                                *sum += per * line.norm_sqr();
                            }
                        }
                    }
                    windows += 1.0;
                    start += window / 2;
                }
                first += nodes;
            }
        }
        if windows > 0.0 {
            let density = |sums: Vec<f64>| sums.into_iter().map(|x: f64| (x / windows).sqrt());
            map.before = density(before).collect();
            map.after = density(after).collect();
        } else {
            map.at.clear();
        }
        map
    }
}

/// Time from node to node, s.
fn node_s(record: &crate::inverse::Record) -> f64 {
    record.step_s * record.kernel.length as f64
}
