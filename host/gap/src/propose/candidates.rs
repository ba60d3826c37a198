//! The experiments to choose from: the built-in ones in several sizes and lengths, within the axis's limits.

use crate::believed::Believed;
use crate::experiments::Named;
use crate::plan::{Plan, Step, travel_limit_rad};
use bristle_core::experiment::Experiment;
use std::path::Path;

/// Share of the travel limit that an experiment may use: with it there is room for it wherever the one before has left
/// the axis, see [`crate::run::way_back_s`].
pub const ROOM: f64 = 0.5;
/// References stay so far within the room, for what a loop overshoots.
const WITHIN: f64 = 0.9;
/// Lengths, as multiples of the usual one.
const LENGTHS: [u32; 2] = [1, 2];

/// Size and time of an experiment's signal, as multiples of those that `bristle run EXPERIMENT` has.
fn variants(named: Named) -> &'static [(f64, f64)] {
    match named {
        Named::Sine => &[(1.0, 1.0), (2.0, 1.0), (1.0, 0.25), (4.0, 0.25)],
        Named::Pulse => &[(1.0, 1.0), (1.6, 1.0)],
        Named::Reversals => &[(1.0, 1.0), (0.1, 1.0), (1.0, 0.5), (0.1, 0.25)],
        Named::Ladder => &[(1.0, 1.0), (4.0, 1.0), (0.25, 2.0)],
        Named::Prbs => &[(1.0, 1.0), (3.0, 1.0), (6.0, 1.0), (3.0, 0.3), (6.0, 0.3)],
        Named::DahlRamp => &[(1.0, 1.0), (0.4, 1.0), (4.0, 1.0), (1.0, 0.25)],
        Named::BreakAway => &[(1.0, 1.0), (0.87, 1.0), (1.0, 0.3)],
        Named::Multisine => &[(1.0, 1.0), (0.5, 1.0), (2.0, 1.0)],
        Named::Moves => &[(1.0, 1.0), (4.0, 1.0), (0.2, 1.0), (1.0, 0.4)],
    }
}

/// All that this axis can be asked for.
pub fn candidates(axis: &Believed) -> Vec<Step> {
    let mut all: Vec<Step> = Vec::new();
    for named in Named::ALL {
        for &variant in variants(named) {
            for times in LENGTHS {
                let mut step = Step::new(named, axis);
                step.experiment = sized(&step.experiment, variant, axis);
                step.bounds.ticks *= times;
                let admitted = Plan::new(vec![step.clone()])
                    .check(axis, Path::new(named.name()))
                    .is_ok();
                // Limits make variants alike.
                if admitted && !all.contains(&step) {
                    all.push(step);
                }
            }
        }
    }
    all
}

/// The same signal larger and slower, where travel and speed allow.
fn sized(
    experiment: &Experiment<f64>,
    (size, time): (f64, f64),
    axis: &Believed,
) -> Experiment<f64> {
    let room_rad = WITHIN * ROOM * travel_limit_rad(axis);
    let way = |rad: f64| (size * rad).min(room_rad);
    let ticks = |ticks: u32| (f64::from(ticks) * time).round().max(1.0) as u32;
    let mut sized = *experiment;
    match &mut sized {
        Experiment::Sine {
            amplitude_nm,
            period_ticks,
        }
        | Experiment::Multisine {
            amplitude_nm,
            period_ticks,
        } => {
            *amplitude_nm *= size;
            *period_ticks = ticks(*period_ticks);
        }
        // The pulse only has to break away; what follows it is to come near to that.
        Experiment::PulseThenOscillation { mean_nm, .. } => *mean_nm *= size,
        Experiment::Reversals {
            amplitude_rad,
            period_ticks,
        }
        | Experiment::DahlRamp {
            amplitude_rad,
            period_ticks,
        } => {
            *amplitude_rad = way(*amplitude_rad);
            *period_ticks = ticks(*period_ticks);
        }
        Experiment::SpeedLadder {
            top_rad_s,
            hold_ticks,
            ..
        } => {
            *top_rad_s = (size * *top_rad_s).min(WITHIN * axis.speed_limit_rad_s);
            let longest = room_rad / *top_rad_s * axis.rate_hz;
            *hold_ticks = ticks(*hold_ticks).min(longest.max(1.0) as u32);
        }
        Experiment::Prbs {
            amplitude_nm,
            clock_ticks,
        } => {
            *amplitude_nm *= size;
            *clock_ticks = ticks(*clock_ticks);
        }
        Experiment::RestAndBreakAway {
            peak_nm,
            ramp_ticks,
            ..
        } => {
            *peak_nm *= size;
            *ramp_ticks = ticks(*ramp_ticks);
        }
        Experiment::Moves {
            length_rad,
            move_ticks,
            ..
        } => {
            *length_rad = way(*length_rad);
            *move_ticks = ticks(*move_ticks);
        }
    }
    sized
}
