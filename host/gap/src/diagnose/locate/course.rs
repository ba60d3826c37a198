//! The course of the motion at each node: which part of it, since when, after what rest, under what load.
//!
//! Bristles bend over z_ss from rest and over twice that from one side to the other. How far the axis has come since it
//! last stood or turned tells the parts of a motion apart; a linear axis reads m for rad.

use super::super::regime::{Node, Regime};
use crate::inverse::{Record, Stretch};
use bristle_plant::effect::Scale;

/// Stillness shorter than this between two directions is how a turn looks to an encoder, s.
const SHORTEST_REST_S: f64 = 0.02;
/// Travel in times of z_ss beyond full deflection at which a break-away is over: bristles that bend by the law of LuGre
/// lack exp(-3), a twentieth, after three times z_ss from rest.
const BREAKS_AWAY: f64 = 2.0;

/// Part of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Slower than a count in 0.1 s.
    Rest,
    /// Less than z_ss from a rest, or less than 2 z_ss from a turn before which the axis had not gone 2 z_ss.
    Presliding,
    /// Up to 2 z_ss beyond presliding or reversal.
    BreakAway,
    /// Less than 2 z_ss from a turn before which the axis had slid.
    Reversal,
    /// Farther from where it stood or turned, inertia taking no more than Coulomb friction.
    Sliding,
    /// As sliding, inertia taking more than Coulomb friction.
    HighAcceleration,
}

impl Part {
    /// All of them.
    pub(super) const ALL: [Self; 6] = [
        Self::Rest,
        Self::Presliding,
        Self::BreakAway,
        Self::Reversal,
        Self::Sliding,
        Self::HighAcceleration,
    ];

    /// In words.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Rest => "rest",
            Self::Presliding => "presliding",
            Self::BreakAway => "break-away",
            Self::Reversal => "reversal",
            Self::Sliding => "sliding",
            Self::HighAcceleration => "high acceleration",
        }
    }
}

/// The motion about a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    /// Part of the motion.
    pub(super) part: Part,
    /// Time since the axis last changed its direction, with a rest between or without, s; none before the first time.
    pub(super) since_reversal_s: Option<f64>,
    /// Length of the rest from which the motion began, s, zero for one that began at a turn; none at rest and where the
    /// log does not show its beginning.
    pub(super) dwell_s: Option<f64>,
    /// Absolute effort, N m.
    pub(super) load_nm: f64,
}

/// Where a motion began.
#[derive(Clone, Copy)]
struct Began {
    position_rad: f64,
    /// Zero at a turn.
    dwell_s: f64,
    /// It turned after it had slid.
    slid: bool,
}

/// What is known of the past at a sample.
#[derive(Clone, Copy, Default)]
struct Past {
    began: Option<Began>,
    reversed: Option<usize>,
}

/// The course at each node.
pub(super) fn course(records: &[Record], nodes: &[Node], scale: &Scale) -> Vec<Course> {
    let mut out = Vec::with_capacity(nodes.len());
    for record in records {
        // What is less than a count the encoder does not show.
        let bends_rad = scale.z_ss_rad.max(record.rad_per_count);
        let reach = record.kernel.reach() + 1;
        for stretch in &record.stretches {
            let past = past(record, stretch, bends_rad);
            for effort_nm in &stretch.effort_nodes_nm {
                let Some(node) = nodes.get(out.len()) else {
                    return out;
                };
                // What happens within the kernel is in the node.
                let past = past[(node.sample + reach).min(past.len() - 1)];
                let travel_rad = past
                    .began
                    .map(|began| (stretch.smooth_rad[node.sample] - began.position_rad).abs());
                let inertia_nm = scale.inertia_kg_m2 * node.acceleration_rad_s2(records).abs();
                let since = |sample| node.sample.saturating_sub(sample) as f64 * record.step_s;
                let rests = node.regime == Regime::Rest;
                out.push(Course {
                    part: match (past.began, travel_rad) {
                        _ if rests => Part::Rest,
                        (Some(began), Some(travel_rad))
                            if travel_rad < (began.bends() + BREAKS_AWAY) * bends_rad =>
                        {
                            if travel_rad >= began.bends() * bends_rad {
                                Part::BreakAway
                            } else if began.slid {
                                Part::Reversal
                            } else {
                                Part::Presliding
                            }
                        }
                        _ if inertia_nm > scale.coulomb_nm => Part::HighAcceleration,
                        _ => Part::Sliding,
                    },
                    since_reversal_s: past.reversed.map(since),
                    dwell_s: past.began.filter(|_| !rests).map(|began| began.dwell_s),
                    load_nm: effort_nm.abs(),
                });
            }
        }
    }
    out
}

impl Began {
    /// Travel until bristles are bent in full, in times of z_ss.
    fn bends(self) -> f64 {
        if self.dwell_s > 0.0 { 1.0 } else { 2.0 }
    }
}

/// The past at each sample of a stretch.
fn past(record: &Record, stretch: &Stretch, bends_rad: f64) -> Vec<Past> {
    let still_rad_s = record.still_rad_s();
    let position = &stretch.smooth_rad;
    let mut past = Past::default();
    let mut forward = None;
    let mut still_from = None;
    let mut out = Vec::with_capacity(position.len());
    for (k, &velocity) in stretch.velocity_rad_s.iter().enumerate() {
        if velocity.abs() < still_rad_s {
            still_from.get_or_insert(k);
            out.push(past);
            continue;
        }
        let from = still_from.take().unwrap_or(k);
        let still_s = (k - from) as f64 * record.step_s;
        let turns = forward.is_some_and(|forward| forward != (velocity > 0.0));
        if still_s >= SHORTEST_REST_S {
            past.began = Some(Began {
                position_rad: position[k],
                dwell_s: still_s,
                slid: false,
            });
        } else if turns {
            let position_rad = position[(from + k) / 2];
            let came_rad = past
                .began
                .map(|began| (position_rad - began.position_rad).abs());
            past.began = Some(Began {
                position_rad,
                dwell_s: 0.0,
                slid: came_rad.is_none_or(|came| came >= 2.0 * bends_rad),
            });
        }
        if turns {
            past.reversed = Some((from + k) / 2);
        }
        forward = Some(velocity > 0.0);
        out.push(past);
    }
    out
}
