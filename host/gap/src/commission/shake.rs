//! A multisine past break-away: what of the effort is inertia, friction in motion and offset, and how late it acts.

use super::{Encoder, Played, Step, Weight, Wizard, counts};
use crate::axis_file::AxisFile;
use crate::commission::push::Pushed;
use crate::error::InputError;
use crate::hygiene::{Balance, Hygiene, Skew, inspect};
use crate::log::{Effort, EffortKind, Log, Position, PositionKind};
use crate::report::short;
use bristle_core::experiment::{End, Experiment};
use bristle_plant::drive::{Drive, DriveConfig};

/// What the motion showed.
pub(super) struct Moved {
    /// By hand, or by the inertia.
    pub counts_per_turn: f64,
    pub coulomb_nm: Option<f64>,
    pub viscous_nm_s_rad: Option<f64>,
    pub lag_s: Option<f64>,
}

/// Torque against what it takes to break away.
const STRONG: f64 = 4.0;
/// Time of the motion, and the shortest that says something, s.
const SECONDS: (f64, f64) = (4.0, 1.0);
/// Trials at a smaller torque where a bound ends it, and how much smaller.
const TRIALS: (usize, f64) = (6, 0.75);
/// Times that the lag is corrected at the most, and the part of itself at which it stands.
const SETTLES: (usize, f64) = (6, 0.02);
/// An inertia that is stated may be off by this part of itself.
const STATED: f64 = 0.25;

impl Wizard<'_> {
    pub(super) fn motion(
        &mut self,
        encoder: &Encoder,
        pushed: &Pushed,
    ) -> Result<Option<Moved>, InputError> {
        let Some(played) = self.shake(encoder, pushed)? else {
            return Ok(None);
        };
        let Some(log) = played else {
            let text = "the axis comes to the end of its travel or speed before it has moved for a second: neither \
                        inertia nor lag were looked for; allow more travel";
            self.find(Step::Motion, Weight::Doubtful, text.to_owned());
            return Ok(Some(self.unmoved(encoder)));
        };
        let mut file = self.file.clone();
        file.axis.counts_per_turn = Some(encoder.counts_per_turn);
        let (mut hygiene, mut lag_s) = self.settled(&log, &file)?;
        let inertia = |balance: &Balance| balance.inertia.map(|inertia| inertia.value);
        let whole = self.axis.whole_inertia_kg_m2();
        // Positions that are c times too large divide the inertia by c.
        let ratio = hygiene
            .balance
            .as_ref()
            .and_then(inertia)
            .map(|its| whole / its);
        let mut counts_per_turn = encoder.counts_per_turn;
        if !encoder.by_hand
            && let Some(factor) = ratio.and_then(|ratio| counts::misread(ratio, STATED))
        {
            counts_per_turn *= factor;
            file.axis.counts_per_turn = Some(counts_per_turn);
            (hygiene, lag_s) = self.settled(&log, &file)?;
            let text = format!(
                "the inertia is that of the axis file only if a turn has {counts_per_turn} counts and not {}: turn it by \
                 hand to be sure",
                encoder.counts_per_turn
            );
            self.find(Step::Motion, Weight::Changed, text);
        }
        let Some(balance) = hygiene.balance else {
            let text =
                "inertia and friction account for too little of the torque: neither was found";
            self.find(Step::Motion, Weight::Doubtful, text.to_owned());
            return Ok(Some(self.unmoved(encoder)));
        };
        self.judge_inertia(&balance, whole);
        let coulomb_nm = self.judge_friction(&balance, pushed);
        let lag_s = self.judge_lag(hygiene.skew.as_ref(), lag_s);
        Ok(Some(Moved {
            counts_per_turn,
            coulomb_nm,
            viscous_nm_s_rad: balance
                .viscous_nm_s_rad
                .map(|viscous| viscous.value)
                .filter(|&viscous| viscous > 0.0),
            lag_s,
        }))
    }

    fn unmoved(&self, encoder: &Encoder) -> Moved {
        Moved {
            counts_per_turn: encoder.counts_per_turn,
            coulomb_nm: None,
            viscous_nm_s_rad: None,
            lag_s: None,
        }
    }

    /// Moves it, at less torque where a bound says so. `Some(None)` where even the least was too much.
    fn shake(
        &mut self,
        encoder: &Encoder,
        pushed: &Pushed,
    ) -> Result<Option<Option<Log>>, InputError> {
        let rate_hz = self.axis.rate_hz;
        let needs = pushed.break_away_nm + pushed.offset_nm.abs();
        let mut amplitude = (STRONG * needs).min(self.axis.torque_limit_nm());
        let period_ticks =
            (rate_hz as u32).max(bristle_core::experiment::multisine::LEAST_PERIOD_TICKS);
        let mut kept: Option<Played> = None;
        for _ in 0..TRIALS.0 {
            let experiment = Experiment::Multisine {
                amplitude_nm: amplitude as f32,
                period_ticks,
            };
            let ticks = (SECONDS.0 * rate_hz) as u32;
            let played = self.play(
                &experiment,
                ticks,
                f64::INFINITY,
                encoder,
                pushed.torque_sign,
            )?;
            let Some(played) = played else {
                return Ok(None);
            };
            let whole = played.seen.end == End::Finished;
            let more = |kept: &Played| kept.time_s.len() < played.time_s.len();
            if kept.as_ref().is_none_or(more) {
                kept = Some(played);
            }
            amplitude *= TRIALS.1;
            if whole || amplitude < needs {
                break;
            }
        }
        let enough = |played: &Played| played.time_s.len() as f64 >= SECONDS.1 * rate_hz;
        Ok(Some(kept.filter(enough).map(|played| self.log(played))))
    }

    fn log(&self, played: Played) -> Log {
        Log::new(
            "axis",
            self.file.unit,
            played.time_s,
            vec![Effort {
                kind: EffortKind::TorqueReference,
                values: played.torque_nm,
            }],
            Position {
                kind: PositionKind::Counts,
                values: played.counts,
            },
        )
    }

    fn judge_inertia(&mut self, balance: &Balance, whole: f64) {
        let Some(inertia) = balance.inertia else {
            let text = "the motion shows no inertia".to_owned();
            return self.find(Step::Motion, Weight::Doubtful, text);
        };
        let ratio = inertia.value / whole;
        let shown = format!("inertia {} times that of the axis file", short(ratio));
        if ratio > 0.0 && ratio.ln().abs() < STATED {
            self.find(Step::Motion, Weight::Sound, shown);
        } else {
            let text = format!(
                "{shown}: see whether the file's has the load in it, and the unit of the torque; it is kept"
            );
            self.find(Step::Motion, Weight::Doubtful, text);
        }
    }

    /// Coulomb friction where it is plausible.
    fn judge_friction(&mut self, balance: &Balance, pushed: &Pushed) -> Option<f64> {
        let (_, _, effort) = self.words();
        let Some(coulomb) = balance.coulomb_nm else {
            let text = "the motion shows no friction of its own".to_owned();
            self.find(Step::Motion, Weight::Doubtful, text);
            return None;
        };
        let shown = format!(
            "friction in motion {} {effort} +- {}",
            short(coulomb.value),
            short(coulomb.standard_error)
        );
        // Friction falls once it moves; a fifth more is a balance that cannot be trusted.
        if coulomb.value <= 0.0 || coulomb.value > 1.2 * pushed.break_away_nm {
            let text = format!(
                "{shown}, and {} to break away: the two do not go together; it is left out",
                short(pushed.break_away_nm)
            );
            self.find(Step::Motion, Weight::Doubtful, text);
            return None;
        }
        let believed = self.file.friction.coulomb;
        let changed = believed.is_some_and(|believed| (coulomb.value / believed).ln().abs() > 0.3);
        let weight = if changed {
            Weight::Changed
        } else {
            Weight::Sound
        };
        self.find(Step::Motion, weight, shown);
        Some(coulomb.value)
    }

    /// The balance of a log, once its torque went through a lag so long that what is left is the output's delay; and that
    /// lag. A lag is no delay: it holds the fast sines back by less than the slow ones.
    fn settled(&self, log: &Log, file: &AxisFile) -> Result<(Hygiene, f64), InputError> {
        let sample_s = 1.0 / self.axis.rate_hz;
        let mut lag_s = 0.0_f64;
        let mut hygiene = inspect(log, file)?;
        for _ in 0..SETTLES.0 {
            let Some(left_s) = hygiene.skew.map(|skew| self.left_s(&skew)) else {
                break;
            };
            let next_s = (lag_s + left_s).max(0.0);
            if (next_s - lag_s).abs() <= SETTLES.1 * next_s.max(sample_s) {
                break;
            }
            lag_s = next_s;
            hygiene = inspect(&lagged(log, lag_s, sample_s), file)?;
        }
        Ok((hygiene, lag_s))
    }

    /// How much later than the output's delay the torque acts, s.
    fn left_s(&self, skew: &Skew) -> f64 {
        -skew.effort_late_s.value - self.axis.drive.delay_samples as f64 / self.axis.rate_hz
    }

    /// The drive's lag: how much later than its sample the torque acts, less the delay of the output.
    fn judge_lag(&mut self, skew: Option<&Skew>, lag_s: f64) -> Option<f64> {
        let Some(skew) = skew else {
            let text =
                "the motion does not show when the torque acts: the lag is as in the axis file";
            self.find(Step::Motion, Weight::Doubtful, text.to_owned());
            return None;
        };
        let deviation_s = skew.effort_late_s.standard_error;
        let delay_samples = self.axis.drive.delay_samples;
        let shown = format!(
            "a lag of {:.3} ms +- {:.3} behind the output's delay of {delay_samples} samples",
            1e3 * lag_s,
            1e3 * deviation_s,
        );
        let uncertain_s = (2.0 * deviation_s).max(0.5 / self.axis.rate_hz);
        let believed = self.file.drive.lag_s;
        if self.left_s(skew) < -uncertain_s {
            let text = format!(
                "the torque acts {:.3} ms earlier than the output's delay of {delay_samples} samples lets it: see \
                 delay_samples; the lag is as in the axis file",
                -1e3 * self.left_s(skew)
            );
            self.find(Step::Motion, Weight::Doubtful, text);
            None
        } else if (lag_s - believed.unwrap_or(0.0)).abs() <= uncertain_s {
            self.find(Step::Motion, Weight::Sound, format!("{shown}, as believed"));
            believed
        } else {
            let weight = match believed {
                Some(_) => Weight::Changed,
                None => Weight::Sound,
            };
            self.find(Step::Motion, weight, shown);
            Some(lag_s)
        }
    }
}

/// The log with its torque through a lag.
fn lagged(log: &Log, lag_s: f64, sample_s: f64) -> Log {
    let mut drive = Drive::new(DriveConfig {
        delay_samples: 0,
        lag_s,
        torque_limit_nm: None,
    });
    let keeps = drive.keeps(sample_s);
    let mut log = log.clone();
    for value in log.efforts.iter_mut().flat_map(|effort| &mut effort.values) {
        drive.accept(*value);
        *value = drive.advance(sample_s, keeps);
    }
    log
}
