//! Setting up an axis, step by step: which way encoder and torque go, what a turn counts, what it takes to break away,
//! the offset, the drive's lag, and limits that follow from all that.
//!
//! Every step moves the axis only within what its user allows, gives up where the user says so, and judges what it
//! found: by the axis file, by the other steps, and by what is usual. A linear axis reads m for rad and N for N m.

mod counts;
mod limits;
mod push;
mod shake;

use crate::axis_file::{AxisFile, EffectEntry};
use crate::believed::Believed;
use crate::error::InputError;
use crate::run::{Bench, Seen};
use bristle_core::experiment::{Bounds, End, Experiment};
use bristle_plant::Unit;

/// What the axis may do meanwhile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Allowed {
    /// Largest torque, N m.
    pub torque_nm: f64,
    /// Furthest from where it stands, either way, rad.
    pub travel_rad: f64,
    /// Turns, or metres, by hand; zero for nobody.
    pub turns: f64,
}

/// A step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Turned by hand: direction of the encoder, and what a turn counts.
    Encoder,
    /// Slow ramps of torque until it moves: direction of the torque, break-away, offset.
    Torque,
    /// A multisine past break-away: inertia, friction in motion, lag of the drive.
    Motion,
    /// What follows from the other three.
    Limits,
}

impl Step {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Encoder => "encoder",
            Self::Torque => "torque",
            Self::Motion => "motion",
            Self::Limits => "limits",
        }
    }

    /// What it does, for who stands beside the axis.
    pub fn what(self) -> &'static str {
        match self {
            Self::Encoder => "turned by hand: direction and counts of the encoder",
            Self::Torque => "slow ramps of torque until it moves: direction, break-away, offset",
            Self::Motion => {
                "a multisine past break-away: inertia, friction in motion, lag of the drive"
            }
            Self::Limits => "limits that follow from what was found; nothing moves",
        }
    }
}

/// What a result means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// As believed, or plausible where nothing was.
    Sound,
    /// Other than the axis file says; the outcome has what was found.
    Changed,
    /// Not plausible, or not found: somebody should look.
    Doubtful,
}

impl Weight {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sound => "sound",
            Self::Changed => "changed",
            Self::Doubtful => "doubtful",
        }
    }
}

/// A result in words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Of which step.
    pub step: Step,
    /// What it means.
    pub weight: Weight,
    /// With its numbers.
    pub text: String,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The axis file with it.
    pub file: AxisFile,
    /// In words, step by step.
    pub findings: Vec<Finding>,
}

/// What the wizard tells its user, and hears from them.
pub trait Watch {
    /// A step begins.
    fn begin(&mut self, step: Step);
    /// A result.
    fn found(&mut self, finding: &Finding);
    /// Whether it may go on.
    fn go_on(&self) -> bool;
}

/// The file that the controller works with meanwhile: with the torque that is allowed as its limit, and with a guess of
/// friction where there is none.
pub fn begin_with(file: &AxisFile, allowed: &Allowed) -> AxisFile {
    let mut file = file.clone();
    let limit = file.drive.torque_limit.unwrap_or(f64::INFINITY);
    file.drive.torque_limit = Some(limit.min(allowed.torque_nm));
    if file.friction.coulomb.is_none_or(|coulomb| coulomb <= 0.0) {
        file.friction.coulomb = Some(0.1 * allowed.torque_nm);
    }
    file
}

/// Goes through all steps on a bench whose controller knows the axis as `axis`, which comes from [`begin_with`]. `None`
/// where `watch` gave up.
///
/// # Errors
/// The axis does not move, moves as no axis should, meets a fault, or the bench is lost.
pub fn commission(
    file: &AxisFile,
    axis: &Believed,
    allowed: &Allowed,
    bench: &mut dyn Bench,
    watch: &mut dyn Watch,
) -> Result<Option<Outcome>, InputError> {
    let mut wizard = Wizard {
        file,
        axis,
        allowed,
        bench,
        watch,
        findings: Vec::new(),
    };
    let mut out = file.clone();
    wizard.watch.begin(Step::Encoder);
    let Some(encoder) = wizard.encoder()? else {
        return Ok(None);
    };
    wizard.watch.begin(Step::Torque);
    let Some(pushed) = wizard.torque(&encoder)? else {
        return Ok(None);
    };
    wizard.watch.begin(Step::Motion);
    let Some(moved) = wizard.motion(&encoder, &pushed)? else {
        return Ok(None);
    };
    wizard.watch.begin(Step::Limits);
    let found = limits::Found {
        rad_per_count: axis.turn_rad() / moved.counts_per_turn,
        inertia_kg_m2: axis.whole_inertia_kg_m2(),
        break_away_nm: pushed.break_away_nm,
        offset_nm: pushed.offset_nm,
    };
    let limits = limits::safe(&found, file, allowed);
    limits::say(&limits, &found, file, |weight, text| {
        wizard.find(Step::Limits, weight, text);
    });
    let turned = |believed: Option<f64>, sign: f64| {
        let sign = sign * believed.unwrap_or(1.0);
        (sign < 0.0 || believed.is_some()).then_some(sign)
    };
    out.axis.counts_per_turn = Some(moved.counts_per_turn);
    out.axis.encoder_sign = turned(file.axis.encoder_sign, encoder.sign);
    out.drive.torque_sign = turned(file.drive.torque_sign, pushed.torque_sign);
    out.friction.stiction = Some(rounded(pushed.break_away_nm));
    // The level in motion lies at or below that of break-away, or the models refuse the file.
    let coulomb = moved.coulomb_nm.or(file.friction.coulomb);
    let coulomb = coulomb.unwrap_or(pushed.break_away_nm);
    out.friction.coulomb = Some(rounded(coulomb.min(pushed.break_away_nm)));
    out.friction.viscous = out.friction.viscous.or(moved.viscous_nm_s_rad.map(rounded));
    out.drive.lag_s = moved.lag_s.map(rounded).or(out.drive.lag_s);
    out.drive.torque_limit = Some(limits.torque_nm);
    out.drive.speed_limit = Some(rounded(limits.speed_rad_s));
    out.drive.travel_limit = Some(limits.travel_rad);
    set_offset(&mut out, pushed.offset_nm);
    let findings = wizard.findings;
    Ok(Some(Outcome {
        file: out,
        findings,
    }))
}

/// Four digits: more would claim to be known.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// One constant torque in place of all that the file has; none where it is zero.
fn set_offset(file: &mut AxisFile, offset_nm: f64) {
    file.effects
        .retain(|effect| effect.id != "mechanics.offset");
    if offset_nm != 0.0 {
        let name = match file.unit {
            Unit::Rotary => "torque_nm",
            Unit::Linear => "force_n",
        };
        file.effects.push(EffectEntry {
            id: "mechanics.offset".to_owned(),
            parameters: vec![(name.to_owned(), rounded(offset_nm))],
        });
    }
}

/// What the encoder is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Encoder {
    /// Against what the controller takes it for, 1 or -1.
    sign: f64,
    /// Counts of a turn or metre.
    counts_per_turn: f64,
    /// Somebody turned it; otherwise both are as believed.
    by_hand: bool,
}

/// The steps on their way.
struct Wizard<'a> {
    file: &'a AxisFile,
    axis: &'a Believed,
    allowed: &'a Allowed,
    bench: &'a mut dyn Bench,
    watch: &'a mut dyn Watch,
    findings: Vec<Finding>,
}

/// What an experiment left.
struct Played {
    seen: Seen,
    time_s: Vec<f64>,
    /// In the direction of the axis, once that is known.
    torque_nm: Vec<f64>,
    counts: Vec<f64>,
}

/// Pause before each motion, s.
const REST_S: f64 = 0.3;
/// Fewer counts by hand than this are none.
const FEW_COUNTS: i64 = 8;

impl Wizard<'_> {
    fn find(&mut self, step: Step, weight: Weight, text: String) {
        let finding = Finding { step, weight, text };
        self.watch.found(&finding);
        self.findings.push(finding);
    }

    /// Name of a turn, of a length and of an effort.
    fn words(&self) -> (&'static str, &'static str, &'static str) {
        match self.file.unit {
            Unit::Rotary => ("turn", "rad", "N m"),
            Unit::Linear => ("metre", "m", "N"),
        }
    }

    fn encoder(&mut self) -> Result<Option<Encoder>, InputError> {
        let (turn, ..) = self.words();
        let believed = self.axis.counts_per_turn;
        let turns = self.allowed.turns;
        let watch = &*self.watch;
        let counts = if turns > 0.0 {
            self.bench.turned_by_hand(turns, &|| watch.go_on())?
        } else {
            None
        };
        if !self.watch.go_on() {
            return Ok(None);
        }
        let Some(counts) = counts else {
            let text = format!(
                "nobody turned the axis by hand: the encoder's direction is taken as it comes, and {believed} counts a \
                 {turn} are only held against the inertia"
            );
            self.find(Step::Encoder, Weight::Doubtful, text);
            return Ok(Some(Encoder {
                sign: 1.0,
                counts_per_turn: believed,
                by_hand: false,
            }));
        };
        if counts.abs() < FEW_COUNTS {
            return Err(InputError::new(
                "encoder",
                format!(
                    "{counts} counts where the axis was to be turned by hand by {turns} {turn}s"
                ),
                "see that nothing blocks or brakes the axis, that it was turned, and that the encoder has power and both lines",
            ));
        }
        let sign = (counts as f64).signum();
        if sign < 0.0 {
            let text = "the encoder counts down as the axis moves forward: it is reversed; encoder_sign turns it round, \
                        or swap its A and B lines";
            self.find(Step::Encoder, Weight::Changed, text.to_owned());
        } else {
            let text = "it counts up as the axis moves forward".to_owned();
            self.find(Step::Encoder, Weight::Sound, text);
        }
        let measured = counts.unsigned_abs() as f64 / turns;
        let known = self.file.axis.counts_per_turn;
        let (counts_per_turn, weight, text) = counts::judge(measured, known, turns, turn);
        self.find(Step::Encoder, weight, text);
        Ok(Some(Encoder {
            sign,
            counts_per_turn,
            by_hand: true,
        }))
    }

    /// Rests, then plays an experiment within what is allowed and keeps its samples, torques by `torque_sign` and counts
    /// by the encoder's. `None` where the user gave up.
    fn play(
        &mut self,
        experiment: &Experiment<f32>,
        ticks: u32,
        travel_rad: f64,
        encoder: &Encoder,
        torque_sign: f64,
    ) -> Result<Option<Played>, InputError> {
        let axis = self.axis;
        // The controller measures travel and speed by the counts that it believes in.
        let scale = encoder.counts_per_turn / axis.counts_per_turn;
        let bounds = Bounds {
            travel_rad: (travel_rad.min(self.allowed.travel_rad) * scale) as f32,
            speed_rad_s: axis.speed_limit_rad_s as f32,
            torque_nm: axis.torque_limit_nm() as f32,
            ticks,
        };
        let watch = &*self.watch;
        let rests = (REST_S * axis.rate_hz) as u32;
        self.bench.rest(rests, &|| watch.go_on())?;
        if !watch.go_on() {
            return Ok(None);
        }
        let mut played = Played {
            seen: Seen::default(),
            time_s: Vec::new(),
            torque_nm: Vec::new(),
            counts: Vec::new(),
        };
        played.seen = self.bench.play(experiment, &bounds, &mut |sample, _| {
            played.time_s.push(sample.time_s);
            let torque_nm = f64::from(sample.record.torque_ref_nm);
            played.torque_nm.push(torque_sign * torque_nm);
            played.counts.push(encoder.sign * sample.counts as f64);
            Ok(watch.go_on())
        })?;
        if !watch.go_on() {
            return Ok(None);
        }
        if played.seen.end == End::Fault {
            return Err(InputError::new(
                "axis",
                format!("a fault: {}", played.seen.fault.text()),
                "mend its cause and begin again; nothing was written",
            ));
        }
        Ok(Some(played))
    }
}

#[cfg(test)]
mod tests;
