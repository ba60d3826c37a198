//! Third step: torque against position at one low speed, from reversal to reversal. Gives sigma0 and the level of friction
//! at that speed, F_S where the speed is far below v_s.
//!
//! Source: thesis (Aktas, ITU 2002) eqs. 2.30 and 2.31, du = sigma0 dq - (sigma0/F)(u - F_G)|dq|. The differences are
//! summed along each branch: what noise does to a torque is then not done twice to its neighbours, and the equation stays
//! linear in sigma0, sigma0/F and sigma0 F_G/F.

mod branches;
mod lines;

pub use branches::Branch;

use super::record::{grid, span};
use super::{Estimate, LEVEL, Parameter, Verdict};
use crate::axis_file::AxisFile;
use crate::error::InputError;
use crate::log::Log;
use crate::signal::rms;
use lines::{Curve, Lines};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// What the step found.
#[derive(Clone, Debug, PartialEq)]
pub struct DahlCurve {
    /// sigma0, F and F_G by total least squares.
    pub total: [f64; 3],
    /// The same by instrumental variables; the estimates come from it.
    pub instrumental: [f64; 3],
    /// sigma0, the slow level F and F_G.
    pub estimates: Vec<Estimate>,
    /// Rms of torque less that of the curve, as a share of F.
    pub misfit: f64,
    /// The branches that were used, for a plot.
    pub branches: Vec<Branch>,
    /// What the data cannot support, a line each.
    pub notes: Vec<String>,
}

/// Fewest rows of a branch.
const LEAST_ROWS: usize = 8;
/// Least z_ss in encoder counts: the two rows lost at a reversal are then less than a fifth of the curve.
const LEAST_Z_SS_COUNTS: f64 = 10.0;
/// Least length of the longest branch in z_ss: e^-4, 2 %, then remains of the way to the level.
const LEAST_TRAVEL: f64 = 4.0;
/// Largest misfit of a curve that is Dahl's, as a share of F.
const MOST_MISFIT: f64 = 0.05;
/// Largest spread of the torque about its course, as a share of F, that leaves the axis on its branch: each swing back is a small loop.
const MOST_SHAKING: f64 = 0.03;
/// Beginning of a branch in z_ss.
const EARLY: f64 = 0.25;
/// Parts that are left out in turn for the intervals.
const PARTS: usize = 16;

/// Identifies the curve.
///
/// # Errors
/// A log that cannot show it, with the reason: no slow reversals in both directions, too coarse an encoder, an axis that
/// never broke away.
pub fn identify(log: &Log, axis: &AxisFile) -> Result<DahlCurve, InputError> {
    let refuse = |message: String, remedy: &str| Err(InputError::new(&log.file, message, remedy));
    let torque = log.effort_nm(axis)?;
    let position = log.position_rad(axis)?;
    let count = grid(&position);
    if span(&position) < LEAST_ROWS as f64 * count || count == 0.0 {
        return refuse(
            format!(
                "the motion spans {:.0} encoder counts: too coarse to show a curve",
                span(&position) / count.max(f64::MIN_POSITIVE)
            ),
            "use a finer encoder, or the dahl-ramp experiment with a larger amplitude",
        );
    }
    let mut branches: Vec<Branch> = log
        .stretches()
        .into_iter()
        .flat_map(|range| {
            branches::branches(
                &log.time_s[range.clone()],
                &position[range.clone()],
                &torque[range],
                count,
            )
        })
        .collect();
    branches.retain(|branch| branch.position_rad.len() >= LEAST_ROWS);
    let forward = branches
        .iter()
        .filter(|branch| branch.direction > 0.0)
        .count();
    if forward == 0 || forward == branches.len() {
        return refuse(
            format!(
                "{forward} branches forward and {} backward of {LEAST_ROWS} encoder counts or more",
                branches.len() - forward
            ),
            "run the dahl-ramp experiment: a slow triangle of position, past break-away both ways",
        );
    }
    let lines = Lines::new(&branches, count);
    let (Some(total), Some(instrumental)) =
        (lines.total(None), lines.instrumental(&branches, None))
    else {
        return refuse(
            "torque does not bend towards a level: the axis never broke away, or the speed was not slow".to_string(),
            "run the dahl-ramp experiment with an amplitude of three times z_ss or more",
        );
    };
    let travel = branches
        .iter()
        .map(|branch| span(&branch.position_rad))
        .fold(0.0, f64::max);
    let share = travel * instrumental.stiffness / instrumental.level;
    if share < LEAST_TRAVEL {
        return refuse(
            format!(
                "the longest branch spans {share:.1} z_ss, fewer than {LEAST_TRAVEL}: the axis hardly broke away"
            ),
            "run the dahl-ramp experiment with an amplitude of three times z_ss or more",
        );
    }
    let z_ss_counts = instrumental.level / (instrumental.stiffness * count);
    if z_ss_counts < LEAST_Z_SS_COUNTS {
        return refuse(
            format!(
                "z_ss spans {z_ss_counts:.2} encoder counts, fewer than {LEAST_Z_SS_COUNTS}: too coarse to show the curve"
            ),
            "use a finer encoder",
        );
    }
    let misfit = misfit(&branches, &instrumental);
    let mut notes = Vec::new();
    if misfit > MOST_MISFIT {
        notes.push(format!(
            "torque lies {:.0} % of its level off a Dahl curve: an axis that is elastic up to break-away, a moving \
             Stribeck fall, or a speed that is not slow; take sigma0 from the presliding step",
            100.0 * misfit
        ));
    }
    let shakes = rms(branches.iter().map(|branch| branch.spread_nm)) / instrumental.level;
    let shaken = shakes > MOST_SHAKING;
    if shaken {
        notes.push(format!(
            "torque shakes by {:.0} % of its level about its course, and the bristles with it: lower the gain of the \
             speed loop, or use a finer encoder",
            100.0 * shakes
        ));
    }
    let doubt = misfit > MOST_MISFIT || shaken;
    let estimates = estimates(&lines, &branches, &instrumental, doubt, count);
    Ok(DahlCurve {
        total: total.numbers(),
        instrumental: instrumental.numbers(),
        estimates,
        misfit,
        branches,
        notes,
    })
}

/// Intervals by the jackknife over parts of the record, since rows within a branch are not independent, and wider by what
/// leaving out the beginnings of the branches changes: there the damping of the bristles still acts, which the equation
/// does not know.
fn estimates(
    lines: &Lines,
    branches: &[Branch],
    best: &Curve,
    doubt: bool,
    count: f64,
) -> Vec<Estimate> {
    let without: Vec<[f64; 3]> = (0..PARTS)
        .filter_map(|part| lines.instrumental(branches, Some((part, PARTS))))
        .map(|c| c.numbers())
        .collect();
    let n = without.len() as f64;
    let quantile = StudentsT::new(0.0, 1.0, (n - 1.0).max(1.0))
        .map_or(f64::INFINITY, |t| t.inverse_cdf(0.5 + 0.5 * LEVEL));
    let later: Vec<Branch> = branches
        .iter()
        .filter_map(|branch| branch.after(EARLY * best.level / best.stiffness))
        .collect();
    let later = Lines::new(&later, count)
        .instrumental(&later, None)
        .map(|curve| curve.numbers());
    let names = [
        Parameter::Stiffness,
        Parameter::SlowLevel,
        Parameter::Offset,
    ];
    names
        .into_iter()
        .enumerate()
        .map(|(i, parameter)| {
            let value = best.numbers()[i];
            let half = if without.len() == PARTS {
                let mean = without.iter().map(|w| w[i]).sum::<f64>() / n;
                let variance =
                    (n - 1.0) / n * without.iter().map(|w| (w[i] - mean).powi(2)).sum::<f64>();
                let early = later.map_or(f64::INFINITY, |later| (later[i] - value).abs());
                quantile * variance.sqrt() + early
            } else {
                f64::INFINITY
            };
            let scale = if parameter == Parameter::Offset {
                best.level
            } else {
                value
            };
            let advice = || {
                "repeat the dahl-ramp experiment with more triangles, or with a finer encoder"
                    .to_string()
            };
            let mut estimate = Estimate::judged(
                parameter,
                value,
                [value - half, value + half],
                scale,
                advice,
            );
            if doubt && parameter != Parameter::Offset {
                estimate.verdict = Verdict::NotIdentified;
                estimate.advice = Some(
                    "the curve is not Dahl's: run the presliding experiment (prbs)".to_string(),
                );
            }
            estimate
        })
        .collect()
}

/// Rms of what the curve leaves, each branch from its own first torque, as a share of the level.
fn misfit(branches: &[Branch], curve: &Curve) -> f64 {
    let left = branches.iter().flat_map(|branch| {
        let model = curve.along(branch.direction, &branch.position_rad, branch.torque_nm[0]);
        branch
            .torque_nm
            .iter()
            .zip(model)
            .map(|(u, m)| u - m)
            .collect::<Vec<_>>()
    });
    rms(left) / curve.level
}
