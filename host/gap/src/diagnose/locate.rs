//! Where the gap lies: shares of what a hypothesis takes away, or of what is left, by regime, position, speed, time and
//! acceleration.

use super::hypothesis::Hypothesis;
use super::regime::{Node, Regime};
use super::tried::Search;
use crate::inverse::Record;
use crate::report::short;
use serde::Serialize;

/// A part of the data and its share of the gap's square.
#[derive(Clone, Debug, Serialize)]
pub struct Region {
    /// What the data were divided by.
    pub axis: &'static str,
    /// Which part of it.
    pub label: String,
    /// Share of the gap's square that lies there, 0 to 1.
    pub share: f64,
    /// Share of the time that is spent there, 0 to 1: equal shares mean nothing.
    pub time_share: f64,
}

/// Parts of position, speed, time and acceleration.
const PARTS: usize = 6;

/// The gap's shares, the most concentrated first.
pub fn regions(search: &Search, best: Option<&Hypothesis>) -> Vec<Region> {
    let gap: Vec<f64> = match best {
        Some(best) => search
            .base
            .fit
            .left_over
            .iter()
            .zip(&best.fit.left_over)
            .map(|(before, after)| before * before - after * after)
            .collect(),
        None => search.base.fit.left_over.iter().map(|r| r * r).collect(),
    };
    let mut regions = Vec::new();
    let counts: Vec<usize> = (0..search.nodes.len())
        .filter(|&i| !search.nodes[i].excluded)
        .collect();
    let whole: f64 = counts.iter().map(|&i| gap[i]).sum();
    if whole <= 0.0 || counts.is_empty() {
        return regions;
    }
    let mut add = |axis: &'static str, label: String, of: &dyn Fn(usize) -> bool| {
        let inside: Vec<usize> = counts.iter().copied().filter(|&i| of(i)).collect();
        if !inside.is_empty() {
            regions.push(Region {
                axis,
                label,
                share: (inside.iter().map(|&i| gap[i]).sum::<f64>() / whole).clamp(0.0, 1.0),
                time_share: inside.len() as f64 / counts.len() as f64,
            });
        }
    };
    for regime in Regime::ALL {
        add("regime", regime.name().to_string(), &|i| {
            search.nodes[i].regime == regime
        });
    }
    let (position, speed) = match search.scale.unit {
        bristle_plant::Unit::Rotary => ("rad", "rad/s"),
        bristle_plant::Unit::Linear => ("m", "m/s"),
    };
    for (axis, unit, value) in [
        (
            "position",
            position,
            Node::position_rad as fn(&Node, &[Record]) -> f64,
        ),
        ("speed", speed, Node::velocity_rad_s),
        ("time", "s", Node::time_s),
        ("acceleration", "of the largest", |node, records| {
            node.acceleration_rad_s2(records).abs()
        }),
    ] {
        let values: Vec<f64> = search
            .nodes
            .iter()
            .map(|node| value(node, &search.records))
            .collect();
        let low = counts
            .iter()
            .map(|&i| values[i])
            .fold(f64::INFINITY, f64::min);
        let high = counts
            .iter()
            .map(|&i| values[i])
            .fold(f64::NEG_INFINITY, f64::max);
        if high <= low {
            continue;
        }
        let edge = |part: usize| low + (high - low) * part as f64 / PARTS as f64;
        for part in 0..PARTS {
            let last = part + 1 == PARTS;
            add(
                axis,
                format!("{} to {} {unit}", short(edge(part)), short(edge(part + 1))),
                &|i| values[i] >= edge(part) && (last || values[i] < edge(part + 1)),
            );
        }
    }
    regions.sort_by(|a, b| (b.share - b.time_share).total_cmp(&(a.share - a.time_share)));
    regions.retain(|region| region.share > region.time_share);
    regions
}
