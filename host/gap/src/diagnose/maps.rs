//! Maps of the gap: against position, speed and time, as a spectrum over angle and one over time.
//!
//! Before and after a hypothesis, from the fits to all data. A spectrum over angle is by least squares at each order,
//! since the axis does not pass angles evenly (Lomb 1976, Astrophys. Space Sci. 39); one over time is the mean of windows.

use super::hypothesis::Hypothesis;
use super::tried::Search;
use super::waves::{Squares, over_orders};
use super::windows::Windows;

/// Parts that a map is divided into.
const PARTS: usize = 48;
/// A part with fewer nodes than this says nothing.
const LEAST_NODES: usize = 8;
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
        let Search {
            records,
            nodes,
            scale,
            ..
        } = self.search;
        let lines = over_orders(records, nodes, scale, &self.kept, |order, waves| {
            let squares = Squares::new(waves);
            let amplitude = |rest: &[f64]| {
                let mut right = [0.0; 2];
                for (&i, [sin, cos]) in self.kept.iter().zip(waves) {
                    right[0] += sin * rest[i];
                    right[1] += cos * rest[i];
                }
                squares.solve(right).map_or(f64::NAN, |[a, b]| a.hypot(b))
            };
            [order, amplitude(self.before), amplitude(self.after)]
        });
        let column = |k: usize| lines.iter().map(|line| line[k]).collect();
        Map {
            at: column(0),
            before: column(1),
            after: column(2),
            ..Map::default()
        }
    }

    /// Amplitude density over frequency, N m per root Hz, as the mean over all records; excluded nodes count as zero.
    fn frequencies(&self) -> Map {
        let search = self.search;
        let density = |rest: &[f64]| {
            let nodes = search.nodes.iter().zip(rest);
            let kept: Vec<f64> = nodes
                .map(|(node, r)| if node.excluded { 0.0 } else { *r })
                .collect();
            let windows = Windows::new(&search.records, &kept, WINDOW);
            let of = |line: usize| {
                let sum: f64 = windows.density.iter().map(|(_, lines)| lines[line]).sum();
                (sum / windows.density.len() as f64).sqrt()
            };
            let density: Vec<f64> = (0..windows.at_hz.len()).map(of).collect();
            (!windows.density.is_empty()).then_some((windows.at_hz, density))
        };
        match (density(self.before), density(self.after)) {
            (Some((at, before)), Some((_, after))) => Map {
                at,
                before,
                after,
                ..Map::default()
            },
            _ => Map::default(),
        }
    }
}
