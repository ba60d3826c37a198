//! Sudden changes: where a moment or place of one may lie, and moving it to where it fits best before a fit: the slope of a jump says
//! nothing of where it is.

use super::candidate::{Background, Start, hard_range, size_before};
use super::regime::Node;
use super::starts::{SHAPES, SIZES, levels};
use crate::inverse::{Fit, Free, Model, Owner, Record, cost_at};
use bristle_plant::effect::{Entry, Kind, Parameter};
use nalgebra::DVector;
use rayon::prelude::*;

/// Moments from which something may be different for good.
const STARTS_OF_CHANGE: usize = 16;
/// A stop lies inside the travel by these parts of it: what it gives way by.
const INSIDE: [f64; 4] = [0.0004, 0.002, 0.015, 0.06];
/// Times that the distance from one that was tried is halved: to some 10 ms in a record of 20 s.
const HALVINGS: usize = 6;
/// Moments or places of a sudden change that are tried, so many nodes apart.
const MOMENTS: usize = 3;
const NODES_APART: f64 = 4.0;
/// Each at these parts of a node from it: a step of the position is seen through a test function of few nodes, in which one that is half a
/// node off is another shape.
const BESIDE_NODE: [f64; 4] = [-0.75, -0.25, 0.25, 0.75];

impl Background<'_> {
    /// Moves the moment or place of a sudden change to where it fits best, and tries there the shapes that were too many for the
    /// grid.
    pub(super) fn settle_sudden(&self, entry: &'static Entry, best: &mut Start, scales: bool) {
        let sudden = |(place, parameter): (usize, &Parameter)| {
            Some((place, self.between_moments(parameter.kind)?))
        };
        let sudden: Vec<(usize, f64)> = entry
            .parameters
            .iter()
            .enumerate()
            .filter_map(sudden)
            .collect();
        for &(place, reach) in &sudden {
            self.settle(entry, best, place, reach, scales);
            for (shape, parameter) in entry.parameters.iter().enumerate() {
                if parameter.kind == Kind::Shape {
                    let tried = levels((parameter.range)(self.scale), SHAPES);
                    self.take_better(entry, best, scales, tried.map(|x| (shape, x)).collect());
                    self.settle(entry, best, place, reach, scales);
                }
            }
        }
    }

    /// Adds to the best start what else of the effect has a moment or place of its own, where that does better.
    pub(super) fn add_sudden(&self, entry: &'static Entry, best: &mut Start, scales: bool) {
        for (moment, parameter) in entry.parameters.iter().enumerate() {
            let Some(size) = sudden(entry, moment).filter(|&size| best.values[size] == 0.0) else {
                continue;
            };
            let Some([so_far, rest]) = self.with_start(entry, best, scales) else {
                return;
            };
            let usual = (entry.parameters[size].range)(self.scale);
            let range = hard_range(usual);
            let places = self.moments(parameter.kind, &rest).unwrap_or_default();
            let added = places.into_par_iter().filter_map(|at| {
                let mut values = best.values.clone();
                values[moment] = at;
                values[size] = step_as_tried(usual);
                let change = self.beyond(&self.change(entry, &values, scales)?) - &so_far;
                values[size] *= -change.dot(&rest) / change.norm_squared();
                values[size] = values[size].clamp(range[0], range[1]);
                let gain = self.gain(entry, &values, scales);
                Some(Start {
                    gain,
                    ..Start::at(values)
                })
            });
            let added: Vec<Start> = added.collect();
            if take_best(best, added) {
                let reach = self.between_moments(parameter.kind).unwrap_or_default();
                self.settle(entry, best, moment, reach, scales);
            }
        }
    }

    /// Where a fit along `records` may go on from: an onset where it does better than where it came out, for no slope leads from one to
    /// the other. Nothing where none does.
    pub(super) fn onset_elsewhere(
        &self,
        records: &[Record],
        model: &Model,
        fit: &Fit,
    ) -> Option<Vec<f64>> {
        let added = model.effects.last()?;
        let is_onset = |free: &Free| {
            matches!(free.owner, Owner::Effect(place, i)
                if place + 1 == model.effects.len() && added.entry.parameters[i].kind == Kind::Onset)
        };
        let onset = model.free.iter().position(is_onset)?;
        let cost_of = |value: f64| {
            let mut at = fit.at.clone();
            at[onset] = model.free[onset].coordinate(value);
            Some((cost_at(model, records, self.weights, at.clone()).ok()?, at))
        };
        let mut best = (fit.cost, fit.at.clone());
        let mut tried = self.moments(Kind::Onset, &self.rest())?;
        let mut reach = self.between_moments(Kind::Onset)?;
        for _ in 0..=HALVINGS {
            let found = tried.into_par_iter().filter_map(cost_of);
            let found = found.min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some(found) = found.filter(|found| found.0 < best.0) {
                best = found;
            }
            let at = model.free[onset].value(best.1[onset]);
            tried = vec![at - reach, at + reach];
            reach *= 0.5;
        }
        (best.0 < fit.cost).then_some(best.1)
    }

    /// Takes the best of these values of single parameters, if it does better than what is there.
    fn take_better(
        &self,
        entry: &'static Entry,
        best: &mut Start,
        scales: bool,
        tried: Vec<(usize, f64)>,
    ) {
        let starts = tried.into_par_iter().filter_map(|(place, value)| {
            let mut values = best.values.clone();
            values[place] = value;
            self.scaled(entry, values, scales)
        });
        let found: Vec<Start> = starts.collect();
        take_best(best, found);
    }

    /// How far from one that was tried the moment or place of a sudden change may lie.
    fn between_moments(&self, kind: Kind) -> Option<f64> {
        let node_s = self
            .records
            .iter()
            .fold(0.0, |longest: f64, record| longest.max(record.node_s()));
        match kind {
            Kind::Onset => Some(0.5 * self.scale.duration_s / STARTS_OF_CHANGE as f64),
            Kind::Event => Some(node_s),
            Kind::Place => Some(node_s * self.scale.top_speed_rad_s),
            Kind::Stop => Some(0.02 * (self.scale.highest_rad - self.scale.lowest_rad)),
            _ => None,
        }
    }

    /// Moves the moment or place of a sudden change to where it fits best.
    fn settle(
        &self,
        entry: &'static Entry,
        best: &mut Start,
        moment: usize,
        mut reach: f64,
        scales: bool,
    ) {
        for _ in 0..HALVINGS {
            let beside = [-reach, reach].map(|by| (moment, best.values[moment] + by));
            self.take_better(entry, best, scales, beside.to_vec());
            reach *= 0.5;
        }
    }

    /// Where a sudden change may lie, for a parameter that is a moment or a place of one: where a weighted rest is largest.
    pub(super) fn moments(&self, kind: Kind, rest: &DVector<f64>) -> Option<Vec<f64>> {
        if kind == Kind::Onset {
            return Some(levels([0.0, self.scale.duration_s], STARTS_OF_CHANGE).collect());
        }
        if kind == Kind::Stop {
            let (low, high) = (self.scale.lowest_rad, self.scale.highest_rad);
            let inside = |part: &f64| [low + part * (high - low), high - part * (high - low)];
            return Some(INSIDE.iter().flat_map(inside).collect());
        }
        // Where a node is, and how far from it the next one.
        let of = |node: &Node| {
            let node_s = self.records[node.record].node_s();
            match kind {
                Kind::Event => Some((node.time_s(self.records), node_s)),
                Kind::Place => {
                    let at = self.scale.unit.place_rad(node.position_rad(self.records));
                    Some((at, node_s * node.velocity_rad_s(self.records).abs()))
                }
                _ => None,
            }
        };
        let mut largest: Vec<usize> = (0..self.nodes.len()).collect();
        largest.sort_by(|&a, &b| rest[b].abs().total_cmp(&rest[a].abs()));
        let mut found: Vec<(f64, f64)> = Vec::new();
        for i in largest.into_iter().take(10 * MOMENTS) {
            let (at, node) = of(&self.nodes[i])?;
            if found
                .iter()
                .all(|other| (other.0 - at).abs() > NODES_APART * node)
            {
                found.push((at, node));
            }
        }
        found.truncate(MOMENTS);
        let beside = |(at, node): (f64, f64)| BESIDE_NODE.map(|part| at + part * node);
        Some(found.into_iter().flat_map(beside).collect())
    }
}

/// Takes the best of these starts where it promises more; whether it does.
pub(super) fn take_best(best: &mut Start, others: Vec<Start>) -> bool {
    let other = others.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain));
    let Some(better) = other.filter(|other| other.gain > best.gain) else {
        return false;
    };
    *best = better;
    true
}

/// The size of a step as it is tried, in proportion to which any other is.
pub(super) fn step_as_tried(usual: [f64; 2]) -> f64 {
    levels(usual, SIZES).last().unwrap_or(usual[1])
}

/// Whether a size has a moment or place of its own: then it is a step of the position, in proportion to what it does.
pub(super) fn has_moment(entry: &Entry, size: usize) -> bool {
    (0..entry.parameters.len()).any(|i| sudden(entry, i) == Some(size))
}

/// The size whose moment or place of a sudden change a parameter is.
pub(super) fn sudden(entry: &Entry, parameter: usize) -> Option<usize> {
    let of_step = entry.parameters[parameter].kind.is_of_step();
    of_step.then(|| size_before(entry, parameter)).flatten()
}
