//! Slow ramps of torque until the axis breaks away, in both directions by turns.
//!
//! T+ and T- at break-away, with a constant torque c on the axis and as much friction either way, are F_S - c and
//! -F_S - c: half their difference is F_S, half their sum -c.

use super::{Encoder, Step, Weight, Wizard};
use crate::error::InputError;
use crate::report::short;
use bristle_core::experiment::{End, Experiment};
use bristle_plant::Unit;

/// What the ramps showed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pushed {
    /// Against what the controller takes it for, 1 or -1.
    pub torque_sign: f64,
    /// F_S, N m.
    pub break_away_nm: f64,
    /// Constant torque on the axis, N m; zero where the ramps show none.
    pub offset_nm: f64,
}

/// The first ramps go to this part of the torque that is allowed; each further one twice as high.
const FIRST: f64 = 1.0 / 32.0;
/// Time of a ramp, s.
const RAMP_S: f64 = 1.0;
/// Rest within the experiment before its ramp, s.
const DWELL_S: f64 = 0.1;
/// Ramps each way.
const RAMPS: usize = 3;
/// A ramp after the first goes to so much of what the first took.
const BEYOND: f64 = 1.5;
/// The axis has moved where it goes so far, and so many counts: beyond what bristles or a compliance give.
const MOVED: (f64, f64, f64) = (0.1, 1e-3, 24.0);
/// Break-away is where this part of the way is passed for good.
const BREAKS: f64 = 0.05;

/// A ramp that moved the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Push {
    /// As the controller put it out, N m.
    torque_nm: f64,
    /// Which way the axis went.
    way: f64,
}

impl Wizard<'_> {
    pub(super) fn torque(&mut self, encoder: &Encoder) -> Result<Option<Pushed>, InputError> {
        let (_, _, effort) = self.words();
        let most = self.axis.torque_limit_nm();
        let mut pushes: [Vec<Push>; 2] = [Vec::new(), Vec::new()];
        let mut share = FIRST;
        loop {
            for (pushes, direction) in pushes.iter_mut().zip([1.0, -1.0]) {
                if pushes.is_empty() {
                    match self.ramp(direction * share * most, encoder)? {
                        None => return Ok(None),
                        Some(pushed) => pushes.extend(pushed),
                    }
                }
            }
            if pushes.iter().all(|pushes| !pushes.is_empty()) || share >= 1.0 {
                break;
            }
            share = (2.0 * share).min(1.0);
        }
        self.moves(&pushes, most)?;
        for (pushes, direction) in pushes.iter_mut().zip([1.0, -1.0]) {
            let first = pushes[0].torque_nm.abs();
            while pushes.len() < RAMPS {
                let peak = direction * (BEYOND * first).min(most);
                match self.ramp(peak, encoder)? {
                    None => return Ok(None),
                    // Friction that grew meanwhile is seen in the spread of those that moved.
                    Some(None) => break,
                    Some(Some(push)) => pushes.push(push),
                }
            }
        }
        let torque_sign = pushes[0][0].way;
        self.say_sign(torque_sign, encoder);
        let [(forward, its), (backward, other)] = pushes.map(|pushes| mean(&pushes));
        let break_away_nm = 0.5 * (forward - backward);
        let offset_nm = -0.5 * torque_sign * (forward + backward);
        let spread = 0.5 * its.hypot(other);
        let text = format!(
            "breaks away at {} {effort} one way and {} the other, spread {}: stiction of {} {effort}",
            short(forward),
            short(backward),
            short(spread),
            short(break_away_nm)
        );
        let weight = self.weigh_break_away(break_away_nm, spread, most);
        self.find(Step::Torque, weight, text);
        let offset_nm = self.judge_offset(offset_nm, spread, break_away_nm);
        Ok(Some(Pushed {
            torque_sign,
            break_away_nm,
            offset_nm,
        }))
    }

    /// One ramp. `None` where the user gave up, `Some(None)` where the axis stayed.
    fn ramp(
        &mut self,
        peak_nm: f64,
        encoder: &Encoder,
    ) -> Result<Option<Option<Push>>, InputError> {
        let ticks = |seconds: f64| (seconds * self.axis.rate_hz) as u32;
        let (ramp_ticks, dwell_ticks) = (ticks(RAMP_S), ticks(DWELL_S));
        let experiment = Experiment::RestAndBreakAway {
            peak_nm: peak_nm as f32,
            ramp_ticks,
            dwell_ticks,
        };
        let (rotary, linear, counts) = MOVED;
        let length = match self.file.unit {
            Unit::Rotary => rotary,
            Unit::Linear => linear,
        };
        let rad_per_count = self.axis.turn_rad() / encoder.counts_per_turn;
        let travel_rad = length.max(counts * rad_per_count);
        let ticks = ramp_ticks + dwell_ticks;
        let Some(played) = self.play(&experiment, ticks, travel_rad, encoder, 1.0)? else {
            return Ok(None);
        };
        let (Some(&first), Some(&last)) = (played.counts.first(), played.counts.last()) else {
            return Ok(Some(None));
        };
        let way = last - first;
        // An axis that follows slowly is at the ramp's end before it has gone all the way.
        if played.seen.end == End::Finished && way.abs() * rad_per_count < 0.5 * travel_rad {
            return Ok(Some(None));
        }
        let near = |counts: &f64| (counts - first) * way.signum() <= BREAKS * way.abs();
        let breaks = played.counts.iter().rposition(near).unwrap_or(0);
        Ok(Some(Some(Push {
            torque_nm: played.torque_nm[breaks],
            way: way.signum(),
        })))
    }

    /// Whether the axis moves both ways, and the other way at the other torque.
    fn moves(&self, pushes: &[Vec<Push>; 2], most: f64) -> Result<(), InputError> {
        let (_, _, effort) = self.words();
        let most = short(most);
        let ways = pushes
            .each_ref()
            .map(|pushes| pushes.first().map(|push| push.way));
        let refused = |message: String, remedy: &str| Err(InputError::new("axis", message, remedy));
        match ways {
            [None, None] => refused(
                format!("is stuck: it did not move either way at up to {most} {effort}"),
                "see that no brake holds it, nothing blocks it and the drive gives torque; allow more torque only then",
            ),
            [None, Some(_)] | [Some(_), None] => refused(
                format!("moves at a torque of one sign only, up to {most} {effort}"),
                "move it away from its end stop; a weight that hangs on it may need more torque than is allowed",
            ),
            [Some(one), Some(other)] if one == other => refused(
                "goes the same way whichever way it is pushed".to_owned(),
                "see that both lines of the encoder are connected, and that no load is larger than friction",
            ),
            _ => Ok(()),
        }
    }

    fn say_sign(&mut self, torque_sign: f64, encoder: &Encoder) {
        let (weight, text) = match (torque_sign > 0.0, encoder.by_hand) {
            (true, true) => (Weight::Sound, "a positive torque moves it forward"),
            (true, false) => (
                Weight::Sound,
                "a positive torque moves it the way that the encoder counts up",
            ),
            (false, true) => (
                Weight::Changed,
                "a positive torque moves it backward: the torque is reversed; torque_sign turns it round, or the drive's \
                 own setting",
            ),
            (false, false) => (
                Weight::Changed,
                "a positive torque moves it the way that the encoder counts down: one of them is reversed, taken to be \
                 the torque; only turning the axis by hand tells which",
            ),
        };
        self.find(Step::Torque, weight, text.to_owned());
    }

    fn weigh_break_away(&self, found: f64, spread: f64, most: f64) -> Weight {
        // A spread of a fifth is no number; a ramp below a hundredth of the torque is a matter of the output's steps.
        if spread > 0.2 * found || found < 0.01 * most {
            return Weight::Doubtful;
        }
        match self.file.friction.stiction.or(self.file.friction.coulomb) {
            Some(believed) if (found / believed).ln().abs() > 0.3 => Weight::Changed,
            _ => Weight::Sound,
        }
    }

    /// The offset, or zero where it may be none.
    fn judge_offset(&mut self, offset: f64, spread: f64, break_away: f64) -> f64 {
        let (_, _, effort) = self.words();
        let believed = self.axis.offset_nm();
        let share = 100.0 * offset.abs() / break_away;
        // Twice the spread of ramps is chance, a twentieth of friction what its two directions may differ by anyway.
        let uncertain = (2.0 * spread).max(0.05 * break_away);
        let shown = format!(
            "a constant torque of {} {effort}, {share:.0} % of stiction",
            short(offset)
        );
        let (offset, weight, text) = if offset.abs() >= break_away {
            let text = format!("{shown}: it moves the axis without the drive");
            (offset, Weight::Doubtful, text)
        } else if (offset - believed).abs() <= uncertain {
            let text = match believed {
                0.0 => format!("no offset beyond {} {effort}", short(uncertain)),
                _ => format!("{shown}, as in the axis file"),
            };
            (believed, Weight::Sound, text)
        } else {
            let text = format!(
                "{shown}: an offset of the drive, a weight, or friction that differs by direction; it becomes the \
                 effect mechanics.offset"
            );
            (offset, Weight::Changed, text)
        };
        self.find(Step::Torque, weight, text);
        offset
    }
}

/// Mean torque, and its standard deviation.
fn mean(pushes: &[Push]) -> (f64, f64) {
    let n = pushes.len().max(1) as f64;
    let mean = pushes.iter().map(|push| push.torque_nm).sum::<f64>() / n;
    let squares = pushes.iter().map(|push| (push.torque_nm - mean).powi(2));
    (mean, (squares.sum::<f64>() / (n - 1.0).max(1.0)).sqrt())
}
