//! What a fit knows of its parameters: covariance under correlated and model errors, intervals, and their judgement.
//!
//! The covariance is the sandwich A^-1 S A^-1 with S summed over blocks of time, so that neither correlation within a
//! block nor a model error makes an interval too short (Huber 1967; Newey and West 1987). Where the cost is no parabola over
//! such an interval, its ends are those of the profile likelihood.

use super::covariance::{Covariance, is_curved};
use super::fit::{Data, Joint};
use super::twin::Bias;
use crate::identify::Verdict;
use crate::inverse::{self, Own, Owner};
use crate::signal::weighted_squares;
use rayon::prelude::*;

/// Half of a normal interval at [`LEVEL`](crate::identify::LEVEL), in standard deviations.
const NORMAL: f64 = 1.645;
/// Part of what was added up that an interval keeps: the larger of two spreads and doubts of bias together held on 93 % of 500
/// virtual axes in the mean of nine parameters (`bristle trials identify --seed 6600` to 7099), this part on 90 %.
const KEEPS: f64 = 0.85;
/// The cost at the end of a normal interval may be off a parabola by this share of itself.
const PARABOLA: f64 = 0.4;
/// Fits that look for the end of a profile.
const PROFILE_FITS: usize = 4;
/// Half an interval of a parameter that is as good as known, as a share of its scale.
pub const IDENTIFIED: f64 = 0.2;
/// The same of one that is known at all.
const WEAK: f64 = 1.0;
/// Scale of the break-away ratio, which goes from 0 to 1; that of most others is their value.
pub const BREAKAWAY_SCALE: f64 = 0.5;

/// A parameter with its interval at [`LEVEL`](crate::identify::LEVEL).
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Name as in the axis file; that of an effect follows the effect's id and a dot.
    pub name: String,
    /// Whose it is.
    pub owner: Owner,
    /// Best value. Where it is not identifiable it is one of many.
    pub value: f64,
    /// Ends of the interval; none where the logs set none.
    pub low: Option<f64>,
    /// See `low`.
    pub high: Option<f64>,
    /// The ends are those of the profile likelihood.
    pub profiled: bool,
    /// The judgement.
    pub verdict: Verdict,
    /// What would narrow the interval, where it is not identified.
    pub advice: Option<String>,
}

impl Estimate {
    /// Whether a value lies in the interval.
    pub fn contains(&self, value: f64) -> bool {
        self.low.is_none_or(|low| low <= value) && self.high.is_none_or(|high| value <= high)
    }
}

/// Correlation from which on two parameters are one.
const TIED: f64 = 0.95;

/// Estimates of all that was free.
pub fn estimates(
    data: &Data,
    joint: &Joint,
    covariance: &Covariance,
    bias: &Bias,
) -> Vec<Estimate> {
    let mut all: Vec<Estimate> = (0..joint.model.free.len())
        .into_par_iter()
        .map(|i| estimate(data, joint, covariance, bias, i))
        .collect();
    for i in 0..all.len() {
        if all[i].verdict == Verdict::Identified {
            continue;
        }
        let tied: Vec<&str> = (0..all.len())
            .filter(|&j| j != i && covariance.correlation(i, j).abs() > TIED)
            .map(|j| all[j].name.as_str())
            .collect();
        if !tied.is_empty() {
            let tied = tied.join(", ");
            let advice = all[i].advice.get_or_insert_default();
            *advice = format!("tied to {tied} in these logs; {advice}");
        }
    }
    all
}

fn estimate(
    data: &Data,
    joint: &Joint,
    covariance: &Covariance,
    bias: &Bias,
    i: usize,
) -> Estimate {
    let free = &joint.model.free[i];
    let at = joint.fit.at[i];
    let half = NORMAL * covariance.spread(i);
    let mut ends = [at - half, at + half];
    let profiled = is_curved(free.owner) && !is_parabola(data, joint, covariance, i, half);
    if profiled {
        ends = [-1.0, 1.0].map(|side| profile(data, joint, covariance, i, side));
        ends = [ends[0].min(at), ends[1].max(at)];
    }
    let reached = [0, 1].map(|side| {
        let end = free.coordinate(free.range[side]);
        (ends[side] - end).abs() < 1e-9
    });
    let at = at - bias.mean[i];
    // What twins scatter by counts where it is more than the rest of this record shows.
    let scatter = (bias.noise[i].powi(2) - covariance.spread(i).powi(2)).max(0.0);
    let doubt = NORMAL * (bias.spread[i].powi(2) + scatter).sqrt();
    let ends = [
        at - KEEPS * (joint.fit.at[i] - ends[0]).hypot(doubt),
        at + KEEPS * (ends[1] - joint.fit.at[i]).hypot(doubt),
    ];
    let bounds = [0, 1].map(|side| {
        let coordinate = ends[side];
        let end = free.coordinate(free.range[side]);
        let inside = if side == 0 {
            coordinate > end
        } else {
            coordinate < end
        };
        (inside && !reached[side]).then(|| free.value(coordinate))
    });
    let value = free.value(at);
    let mut name = free.name.clone();
    let (mut low, mut high) = (bounds[0], bounds[1]);
    let believed = joint.believed();
    let scale = match free.owner {
        Owner::Own(Own::BreakawayRatio) => BREAKAWAY_SCALE,
        Owner::Own(Own::Skew) => data.records[0].step_s,
        Owner::Own(Own::Viscous) => value
            .abs()
            .max(0.1 * believed.coulomb_nm / data.scale.top_speed_rad_s),
        Owner::Effect(effect, parameter) | Owner::OnRecord(effect, parameter, _) => {
            let entry = joint.model.effects[effect].entry;
            name = format!("{}.{name}", entry.id);
            let [least, most] = (entry.parameters[parameter].range)(&data.scale);
            value.abs().max(0.25 * (most - least).abs())
        }
        Owner::Own(_) => value.abs(),
    };
    let verdict = match (low, high) {
        (Some(low), Some(high)) if 0.5 * (high - low) <= IDENTIFIED * scale => Verdict::Identified,
        (Some(low), Some(high)) if 0.5 * (high - low) < WEAK * scale => Verdict::Weak,
        // Zero is an end that physics sets, not the logs: a small share from below is still bounded.
        (None, Some(high)) if matches!(free.owner, Owner::Own(Own::Viscous)) && high < scale => {
            Verdict::Weak
        }
        _ => Verdict::NotIdentified,
    };
    let mut value = value;
    if free.owner == Owner::Own(Own::StictionExcess) {
        // What moves is (F_S - F_C)/F_C; what is asked for is F_S.
        let coulomb_nm = believed.coulomb_nm;
        let level = |excess: f64| coulomb_nm * (1.0 + excess);
        value = coulomb_nm * (1.0 + value);
        low = Some(low.map_or(believed.coulomb_nm, level));
        high = high.map(level);
        name = if name == free.name {
            match joint.believed().unit {
                bristle_plant::Unit::Rotary => "stiction_nm",
                bristle_plant::Unit::Linear => "stiction_n",
            }
            .to_string()
        } else {
            name
        };
    }
    Estimate {
        advice: (verdict != Verdict::Identified).then(|| advice(free.owner, data, joint)),
        name,
        owner: free.owner,
        value,
        low,
        high,
        profiled,
        verdict,
    }
}

/// Which experiment shows a parameter.
fn advice(owner: Owner, data: &Data, joint: &Joint) -> String {
    let Owner::Own(own) = owner else {
        return "record moves over the whole travel at several speeds, both ways".to_string();
    };
    let believed = joint.believed();
    let count = data
        .records
        .iter()
        .fold(0.0, |most: f64, record| most.max(record.rad_per_count));
    let z_counts = believed.coulomb_nm / believed.stiffness_nm_rad / count;
    match own {
        Own::Inertia => "record `moves` or `multisine`: accelerations well above friction",
        Own::Coulomb => "record `ladder`: steady speeds both ways",
        Own::Viscous => "record `ladder` up to a higher speed",
        Own::StictionExcess | Own::StribeckVelocity => {
            "record `ladder` down to slower speeds, and `break-away`"
        }
        Own::Stiffness | Own::Damping | Own::BreakawayRatio if z_counts < 2.0 => {
            "no experiment: the bristles bend by less than two counts; a finer encoder would show it"
        }
        Own::Stiffness => "record `dahl-ramp` and `prbs`: motion below break-away",
        Own::Damping => "record `prbs`: fast motion below break-away",
        Own::BreakawayRatio => "record `dahl-ramp` and `pulse`: loads just below break-away",
        Own::DriveLag => "record `multisine` with the measured torque beside the reference",
        Own::Skew => "record effort and position at the same instant, and faster",
    }
    .to_string()
}

/// Sum of squares of the weighted rest alone.
fn misfit(data: &Data, joint: &Joint, at: &[f64]) -> f64 {
    match joint.model.left_over(&data.records, at) {
        Ok(rest) => weighted_squares(&rest, &data.weights),
        Err(_) => f64::INFINITY,
    }
}

/// Rise of the misfit that ends an interval: as on a parabola whose interval is that of the robust covariance.
fn rise(covariance: &Covariance, i: usize) -> f64 {
    NORMAL * NORMAL * (covariance.spread(i).powi(2) / covariance.plain[(i, i)])
}

/// Whether the misfit at both ends, the others moved along, is what a parabola has there.
fn is_parabola(data: &Data, joint: &Joint, covariance: &Covariance, i: usize, half: f64) -> bool {
    let free = &joint.model.free[i];
    let base = weighted_squares(&joint.fit.left_over, &data.weights);
    let expected = rise(covariance, i);
    [-half, half].into_iter().all(|shift| {
        let target = joint.fit.at[i] + shift;
        let inside = (free.coordinate(free.value(target)) - target).abs() < 1e-9;
        let along = covariance.plain.column(i) / covariance.plain[(i, i)];
        let at: Vec<f64> = joint
            .fit
            .at
            .iter()
            .zip(along.iter())
            .map(|(x, a)| x + a * shift)
            .collect();
        let rise = misfit(data, joint, &at) - base;
        inside && (rise / expected - 1.0).abs() < PARABOLA
    })
}

/// Coordinate at which the misfit, all others fitted anew, has risen enough; the end of the range where it never does.
fn profile(data: &Data, joint: &Joint, covariance: &Covariance, i: usize, side: f64) -> f64 {
    let free = &joint.model.free[i];
    let end = free.coordinate(free.range[usize::from(side > 0.0)]);
    let base = weighted_squares(&joint.fit.left_over, &data.weights);
    let wanted = rise(covariance, i);
    let centre = joint.fit.at[i];
    let mut at = joint.fit.at.clone();
    let mut risen = |coordinate: f64| -> f64 {
        let mut model = joint.model.clone();
        let held = model.free[i].value(coordinate);
        model.free[i].range = [held, held];
        model.free[i].center = coordinate;
        at[i] = coordinate;
        match inverse::fit_alone(&model, &data.records, &data.weights, at.clone()) {
            Ok(fit) => {
                at.clone_from(&fit.at);
                weighted_squares(&fit.left_over, &data.weights) - base
            }
            Err(_) => f64::INFINITY,
        }
    };
    // Between an inner point that has not risen enough and an outer one that has, on the root of the rise.
    let (mut inner, mut inner_root) = (centre, 0.0);
    let mut outer: Option<(f64, f64)> = None;
    let goal = wanted.sqrt();
    let mut next = centre + side * NORMAL * covariance.spread(i).min(1.0);
    for _ in 0..PROFILE_FITS {
        next = if side > 0.0 {
            next.min(end)
        } else {
            next.max(end)
        };
        let root = risen(next).max(0.0).sqrt();
        if (root / goal - 1.0).abs() < 0.05 {
            return next;
        }
        if root < goal {
            if next == end {
                return end;
            }
            (inner, inner_root) = (next, root);
        } else {
            outer = Some((next, root));
        }
        next = match outer {
            Some((outer, root)) => {
                inner
                    + (outer - inner) * ((goal - inner_root) / (root - inner_root)).clamp(0.1, 0.9)
            }
            None => {
                let gone = (inner - centre).abs();
                let factor = (goal / inner_root.max(1e-3)).clamp(1.5, 4.0);
                centre + side * gone * factor
            }
        };
    }
    outer.map_or(end, |(outer, root)| {
        inner + (outer - inner) * ((goal - inner_root) / (root - inner_root)).clamp(0.0, 1.0)
    })
}
