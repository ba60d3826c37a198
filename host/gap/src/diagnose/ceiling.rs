//! How much of a rest a smooth black box could explain at best: a function of where the axis is, how it moves, what drives it and how
//! long ago it turned, without any knowledge of what such a function should look like.
//!
//! Ridge regression on waves of random direction over one to three of these variables, Rahimi, Recht 2007, "Random features for
//! large-scale kernel machines", NIPS 20; judged on data that took no part.

use super::closed::{Closed, closed};
use super::fitted_noise::own_records;
use super::hypothesis::Hypothesis;
use super::regime::Node;
use super::ridge::Seen;
use super::tried::Search;
use crate::inverse::Record;
use crate::signal::{extent, rms, weighted_squares};
use bristle_plant::Unit;
use bristle_plant::effect::Scale;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use std::cell::LazyCell;
use std::f64::consts::TAU;

/// Waves of the black box, and most variables that one runs over.
const WAVES: (usize, usize) = (240, 3);
/// The same of what depends on one variable at a time while the axis slides.
const WAVES_OF_ONE: (usize, usize) = (240, 1);
/// Nodes while the axis slides that are taken as one: noise averages out in them, what depends on where an axis is and how it moves does not.
const AVERAGED: [usize; 2] = [2, 4];
/// Spread of the phase, rad, from one end of a variable to its middle.
const STEEP: [f64; 2] = [0.5, 6.0];
/// Waves a turn, or over the stroke of a linear axis.
const ORDERS: [f64; 2] = [1.0, 60.0];

/// The share of the gap of the refitted simulator that such a black box closes.
pub fn ceiling(search: &Search) -> Closed {
    closed(search, &left_over_of_all(search, &search.base.held_out))
}

/// Nats by which a black box does better than a rest as it is, on data that took no part.
pub(super) fn gains(search: &Search, rest_nm: &[f64]) -> f64 {
    let density = |rest_nm: &[f64]| search.noise.log_density(&search.nodes, rest_nm);
    density(&left_over_of_all(search, rest_nm)) - density(rest_nm)
}

/// Whether what a hypothesis leaves over while the axis slides, in each record alike, depends smoothly on one variable, on data that took no
/// part: by more than a share of its squares, and than a share of the gap of the refitted simulator. Of noise, however coloured, nothing
/// does; what the method leaves over may, where noise does not hide it, and then what it leaves of the hypothesis's own records does, too.
pub(super) fn depends_in_sliding(
    search: &Search,
    by: &Hypothesis,
    [of_rest, of_gap]: [f64; 2],
) -> bool {
    let (records, nodes, scale) = (&search.records, &search.nodes, &search.scale);
    let own = LazyCell::new(|| own_records(by, &search.judge(), scale));
    AVERAGED.into_iter().any(|averaged| {
        let rest = Averaged::new(nodes, &by.held_out, averaged);
        let spreads_nm = rest.spreads_nm(records.len());
        let all = rest.squares(&spreads_nm);
        let depends = rest.depends(records, scale, &spreads_nm);
        let gap = || Averaged::new(nodes, &search.base.held_out, averaged).squares(&spreads_nm);
        let of_own = || {
            own.as_ref().map_or(0.0, |own| {
                let rest = Averaged::new(&own.nodes, &own.left_over, averaged);
                rest.depends(&own.records, scale, &spreads_nm).max(0.0)
            })
        };
        depends > of_rest * all
            && depends > of_gap * of_gap * gap()
            && depends - of_own() > of_rest * all
    })
}

/// A rest while the axis slides, so many nodes in a row taken as one.
struct Averaged {
    /// Their middles.
    nodes: Vec<Node>,
    /// Mean over them, N m.
    rest_nm: Vec<f64>,
}

impl Averaged {
    fn new(nodes: &[Node], rest_nm: &[f64], averaged: usize) -> Self {
        let of = |node: &Node| {
            let slides = node.counts_in_sliding();
            (node.record, node.stretch, node.fold, slides)
        };
        let (mut middles, mut means) = (Vec::new(), Vec::new());
        let mut from = 0;
        for run in nodes.chunk_by(|one, next| of(one) == of(next)) {
            if run[0].counts_in_sliding() {
                let rest = &rest_nm[from..from + run.len()];
                for (nodes, rest) in run.chunks_exact(averaged).zip(rest.chunks_exact(averaged)) {
                    middles.push(nodes[averaged / 2]);
                    means.push(rest.iter().sum::<f64>() / averaged as f64);
                }
            }
            from += run.len();
        }
        Self {
            nodes: middles,
            rest_nm: means,
        }
    }

    /// Of each of so many records, N m rms.
    fn spreads_nm(&self, records: usize) -> Vec<f64> {
        let spread_nm = |place: usize| {
            let here = self.nodes.iter().zip(&self.rest_nm);
            let here = here.filter(|(node, _)| node.record == place);
            rms(here.map(|(_, r)| *r)).max(f64::MIN_POSITIVE)
        };
        (0..records).map(spread_nm).collect()
    }

    /// By which the rests of records of these spreads are alike.
    fn weights(&self, spreads_nm: &[f64]) -> Vec<f64> {
        let of = |node: &Node| 1.0 / spreads_nm[node.record];
        self.nodes.iter().map(of).collect()
    }

    fn squares(&self, spreads_nm: &[f64]) -> f64 {
        weighted_squares(&self.rest_nm, &self.weights(spreads_nm))
    }

    /// How many of these squares depend smoothly on one variable.
    fn depends(&self, records: &[Record], scale: &Scale, spreads_nm: &[f64]) -> f64 {
        let weights = self.weights(spreads_nm);
        let seen = Seen {
            nodes: &self.nodes,
            weights: &weights,
        };
        let left_over = left_over(&seen, records, scale, &self.rest_nm, WAVES_OF_ONE);
        self.squares(spreads_nm) - weighted_squares(&left_over, &weights)
    }
}

/// What a black box leaves over of a rest, N m; nodes that no one fits, and those at rest, as they are.
fn left_over_of_all(search: &Search, rest_nm: &[f64]) -> Vec<f64> {
    let seen = Seen {
        nodes: &search.nodes,
        weights: &search.weights,
    };
    left_over(&seen, &search.records, &search.scale, rest_nm, WAVES)
}

/// What so many waves over so many variables leave over of a rest at each node, N m.
fn left_over(
    seen: &Seen<'_>,
    records: &[Record],
    scale: &Scale,
    rest_nm: &[f64],
    waves: (usize, usize),
) -> Vec<f64> {
    let variables = Variables::new(records, scale, seen.nodes);
    let waves = drawn(variables.scaled.len(), scale.unit, waves);
    seen.left_over(rest_nm, waves.len(), |node, wave| {
        variables.wave(&waves[wave], node)
    })
}

/// A wave: its phase, that of each variable it runs over, and its order over position, if it does.
struct Wave {
    phase: f64,
    order: f64,
    slopes: Vec<(usize, f64)>,
}

/// So many waves, each over as many of these variables and position at most.
fn drawn(variables: usize, unit: Unit, (waves, together): (usize, usize)) -> Vec<Wave> {
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let part = |random: &mut ChaCha8Rng| -> f64 { StandardUniform.sample(random) };
    let of = |[low, high]: [f64; 2], part: f64| low * f64::powf(high / low, part);
    (0..waves)
        .map(|k| {
            let phase = TAU * part(&mut random);
            let mut chosen: Vec<usize> = Vec::new();
            while chosen.len() < 1 + k % together {
                let variable = (part(&mut random) * (variables + 1) as f64) as usize;
                if !chosen.contains(&variable) {
                    chosen.push(variable);
                }
            }
            let order = if chosen.contains(&variables) {
                let order = of(ORDERS, part(&mut random));
                if unit == Unit::Rotary {
                    order.round()
                } else {
                    order
                }
            } else {
                0.0
            };
            let steep = of(STEEP, part(&mut random));
            let slopes = chosen
                .into_iter()
                .filter(|&variable| variable < variables)
                .map(|variable| {
                    let normal: f64 = StandardNormal.sample(&mut random);
                    (variable, steep * normal)
                })
                .collect();
            Wave {
                phase,
                order,
                slopes,
            }
        })
        .collect()
}

/// What the rest may depend on, at each node.
struct Variables {
    /// Angle of a wave of order 1.
    angle: Vec<f64>,
    /// The others, from -1 to 1.
    scaled: Vec<Vec<f64>>,
}

impl Variables {
    fn new(records: &[Record], scale: &Scale, nodes: &[Node]) -> Self {
        let over = |value: &dyn Fn(&Node) -> f64| -> Vec<f64> { nodes.iter().map(value).collect() };
        let turned_s = turned(records, nodes);
        let position = over(&|node| node.position_rad(records));
        let velocity = over(&|node| node.velocity_rad_s(records));
        let acceleration = over(&|node| node.acceleration_rad_s2(records));
        let effort = over(&|node| node.effort_nm(records));
        let time = over(&|node| node.time_s(records));
        let since = turned_s
            .iter()
            .zip(&velocity)
            .map(|(since_s, v)| (since_s / 1e-3).max(1.0).ln().copysign(*v))
            .collect();
        let angle = match scale.unit {
            Unit::Rotary => position.clone(),
            Unit::Linear => position
                .iter()
                .map(|q| TAU * (q - scale.lowest_rad) / scale.stroke_rad().max(1e-9))
                .collect(),
        };
        Self {
            angle,
            scaled: vec![
                scaled(position),
                bent(velocity.clone()),
                scaled(velocity),
                bent(acceleration),
                scaled(effort),
                scaled(time),
                scaled(since),
            ],
        }
    }

    fn wave(&self, wave: &Wave, node: usize) -> f64 {
        let mut phase = wave.phase + wave.order * self.angle[node];
        for &(variable, slope) in &wave.slopes {
            phase += slope * self.scaled[variable][node];
        }
        phase.cos()
    }
}

/// Time since the axis last turned, or since the stretch began, s.
fn turned(records: &[Record], nodes: &[Node]) -> Vec<f64> {
    let mut since_s = Vec::with_capacity(nodes.len());
    let mut last: Option<(usize, usize, f64, usize)> = None;
    for node in nodes {
        let v = node.velocity_rad_s(records);
        let from = match last {
            Some((record, stretch, before, from))
                if (record, stretch) == (node.record, node.stretch) =>
            {
                if before * v < 0.0 {
                    node.sample
                } else {
                    from
                }
            }
            _ => 0,
        };
        last = Some((node.record, node.stretch, v, from));
        since_s.push((node.sample - from) as f64 * records[node.record].step_s);
    }
    since_s
}

/// From -1 to 1 over the range of values.
pub(super) fn scaled(values: Vec<f64>) -> Vec<f64> {
    let (low, high) = extent(&values);
    let half = (0.5 * (high - low)).max(f64::MIN_POSITIVE);
    let middle = 0.5 * (low + high);
    values.into_iter().map(|x| (x - middle) / half).collect()
}

/// The same, with what is small drawn apart.
fn bent(values: Vec<f64>) -> Vec<f64> {
    let rms = rms(values.iter().copied()).max(f64::MIN_POSITIVE);
    scaled(
        values
            .into_iter()
            .map(|x| (x / (0.05 * rms)).asinh())
            .collect(),
    )
}
