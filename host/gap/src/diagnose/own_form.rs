//! Another form of the same effect: a wave that is no sine, warmth that saturates.
//!
//! The catalogue has an effect that is a function of one variable as one such function. What it leaves over that depends on that
//! variable alone, as the effect does, is no other effect, where the catalogue has no other one that does: not of speed, which a Stribeck
//! curve and a drag are functions of, nor of effort.

use super::ceiling::scaled;
use super::hypothesis::Hypothesis;
use super::ridge::Seen;
use super::tried::Search;
use crate::signal::rms;
use bristle_plant::effect::Kind;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Waves of a curve over a variable.
const WAVES: usize = 4;
/// The same over a stroke, on which tight places are short.
const PLACES: usize = 24;
/// Phase of the longest of these from the middle of the variable to an end, rad.
const STEEP: f64 = 0.8;
/// Multiples of the wave of an effect that has one.
const HARMONICS: usize = 6;
/// Time constants of the power of friction whose heat the catalogue has with one, s.
const WARMS_S: [f64; 4] = [2.0, 5.0, 12.0, 30.0];

/// What is left over by another form of the only effect that a hypothesis adds, on data that took no part, N m at each node; none where the
/// effect is no function of one variable, or shares it with another.
pub(super) fn in_own_form(search: &Search, by: &Hypothesis) -> Option<Vec<f64>> {
    let curves = curves(search, by)?;
    let seen = Seen {
        nodes: &search.nodes,
        weights: &search.weights,
    };
    Some(seen.left_over(&by.held_out, curves.len(), |node, curve| {
        curves[curve][node]
    }))
}

/// The curves that another form is the sum of, at each node.
fn curves(search: &Search, by: &Hypothesis) -> Option<Vec<Vec<f64>>> {
    let Search { records, nodes, .. } = search;
    let [entry] = by.added[..] else {
        return None;
    };
    let velocity: Vec<f64> = nodes.iter().map(|n| n.velocity_rad_s(records)).collect();
    let direction: Vec<f64> = velocity.iter().map(|v| v.signum()).collect();
    let curves: Vec<Vec<f64>> = match entry.id {
        "friction.position" => {
            let position = scaled(nodes.iter().map(|n| n.position_rad(records)).collect());
            harmonics(search, by, &direction)?
                .into_iter()
                .chain(over(&position, &direction, PLACES))
                .collect()
        }
        "friction.thermal" => {
            let time = scaled(nodes.iter().map(|n| n.time_s(records)).collect());
            let viscous = to_one(&velocity);
            let heats = WARMS_S.map(|warms_s| scaled(heat(search, &velocity, warms_s)));
            heats
                .iter()
                .flat_map(|heat| over(heat, &direction, WAVES).chain(over(heat, &viscous, WAVES)))
                .chain(over(&time, &direction, WAVES))
                .collect()
        }
        "actuator.cogging" | "disturbance.periodic" => {
            harmonics(search, by, &vec![1.0; nodes.len()])?
        }
        "actuator.ripple" => {
            let effort: Vec<f64> = nodes.iter().map(|n| n.effort_nm(records)).collect();
            harmonics(search, by, &to_one(&effort))?
        }
        _ => return None,
    };
    Some(curves)
}

/// So many waves over a variable from -1 to 1, times a factor.
fn over<'a>(
    variable: &'a [f64],
    factor: &'a [f64],
    waves: usize,
) -> impl Iterator<Item = Vec<f64>> + 'a {
    (1..=waves).flat_map(move |wave| {
        let steep = STEEP * wave as f64;
        [0.0, FRAC_PI_2].map(|phase| {
            let at = variable.iter().zip(factor);
            at.map(|(x, factor)| factor * (phase + steep * x).cos())
                .collect()
        })
    })
}

/// The wave of the only effect that is added and its multiples, over position or time, times a factor.
fn harmonics(search: &Search, by: &Hypothesis, factor: &[f64]) -> Option<Vec<Vec<f64>>> {
    let angle = angle(search, by)?;
    let harmonic = |times: usize, phase: f64| {
        let at = angle.iter().zip(factor);
        at.map(|(angle, factor)| factor * (phase + times as f64 * angle).cos())
            .collect()
    };
    let curves =
        (1..=HARMONICS).flat_map(|times| [0.0, FRAC_PI_2].map(|phase| harmonic(times, phase)));
    Some(curves.collect())
}

/// Angle of that wave at each node, rad.
fn angle(search: &Search, by: &Hypothesis) -> Option<Vec<f64>> {
    let Search { records, nodes, .. } = search;
    let point = by.model.at(&by.fit.at);
    let parameters = by.added.last()?.parameters;
    let place = |kind: Kind| parameters.iter().position(|p| p.kind == kind);
    let phase = place(Kind::Phase)?;
    let on: Vec<Vec<f64>> = (0..records.len())
        .map(|record| point.effects_on(record).pop().map(|added| added.values))
        .collect::<Option<_>>()?;
    let order = place(Kind::Order);
    let frequency = place(Kind::Frequency);
    nodes
        .iter()
        .map(|node| {
            let values = &on[node.record];
            let wave = match (order, frequency) {
                (Some(order), _) => {
                    search.scale.unit.wave_rad(values[order]) * node.position_rad(records)
                }
                (_, frequency) => TAU * values[frequency?] * node.time_s(records),
            };
            Some(wave + values[phase])
        })
        .collect()
}

/// Speed through a first-order lag from the start of each record on: the power of Coulomb friction, in units of itself, that is still there as heat.
fn heat(search: &Search, velocity: &[f64], warms_s: f64) -> Vec<f64> {
    let (mut heat, mut last) = (0.0, None);
    let nodes = search.nodes.iter().zip(velocity);
    nodes
        .map(|(node, velocity)| {
            let time_s = node.time_s(&search.records);
            heat = match last {
                Some((record, last_s)) if record == node.record => {
                    let passed = -f64::exp_m1(-f64::max(time_s - last_s, 0.0) / warms_s);
                    heat + (velocity.abs() - heat) * passed
                }
                _ => 0.0,
            };
            last = Some((node.record, time_s));
            heat
        })
        .collect()
}

/// Values over their root-mean-square.
fn to_one(values: &[f64]) -> Vec<f64> {
    let rms = rms(values.iter().copied()).max(f64::MIN_POSITIVE);
    values.iter().map(|x| x / rms).collect()
}
