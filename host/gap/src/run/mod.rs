//! Plays a plan, or one experiment, on an axis, and records a log of each experiment as it plays.
//!
//! The axis is a [`Bench`]: virtual, or the firmware behind a link. The logs have the columns of `bristle capture`, from
//! the first tick of an experiment to its last.

mod virtual_axis;

pub use virtual_axis::Virtual;

use crate::believed::Believed;
use crate::capture::{About, Layout, Recorder, Sample};
use crate::error::InputError;
use crate::plan::{Plan, Step, travel_limit_rad};
use bristle_core::experiment::fields::in_single_precision;
use bristle_core::experiment::{Bounds, End, Experiment};
use bristle_core::supervisor::Fault;
use bristle_core::trace::FLAG_EXPERIMENT;
use bristle_plant::axis::Truth;
use std::path::{Path, PathBuf};

/// Takes a sample of an experiment, and says whether it may go on.
pub type Take<'a> = dyn FnMut(&Sample, Option<&Truth>) -> Result<bool, InputError> + 'a;

/// Something that plays experiments.
pub trait Bench {
    /// Plays one to its end and gives every sample of it. It is stopped where `take` says so; what comes until then is
    /// given all the same.
    ///
    /// # Errors
    /// It does not begin, or the bench is lost on the way; the first of `take`.
    fn play(
        &mut self,
        experiment: &Experiment<f32>,
        bounds: &Bounds<f32>,
        take: &mut Take<'_>,
    ) -> Result<Seen, InputError>;

    /// Leaves the axis without torque for some ticks, as long as `go_on` says so.
    ///
    /// # Errors
    /// The bench is lost.
    fn rest(&mut self, ticks: u32, go_on: &dyn Fn() -> bool) -> Result<(), InputError>;

    /// Has somebody turn the axis without torque by so many turns, or move it by metres, in its positive direction, and
    /// gives the counts that the encoder made. `None` where nobody is there to do it.
    ///
    /// # Errors
    /// The bench is lost.
    fn turned_by_hand(
        &mut self,
        _turns: f64,
        _go_on: &dyn Fn() -> bool,
    ) -> Result<Option<i64>, InputError> {
        Ok(None)
    }

    /// Position of the encoder now, counts.
    fn counts(&self) -> i64;
}

/// An experiment as its samples show it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// Samples that came.
    pub samples: u64,
    /// Samples that did not, by the time between those that did.
    pub lost: u64,
    /// Why it ended.
    pub end: End,
    /// The fault that ended it.
    pub fault: Fault,
    first_s: f64,
    last_s: f64,
}

/// Where a sample stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// The experiment has not begun.
    Before,
    /// It plays.
    Plays,
    /// It has ended.
    Over,
}

impl Seen {
    /// Takes the next sample of a bench of so many ticks a second.
    pub fn sample(&mut self, sample: &Sample, rate_hz: f64) -> Phase {
        let status = sample.record.status;
        if status.flags() & FLAG_EXPERIMENT != 0 {
            if self.samples == 0 {
                self.first_s = sample.time_s;
            }
            self.samples += 1;
            self.last_s = sample.time_s;
            let ticks = ((self.last_s - self.first_s) * rate_hz).round() as u64 + 1;
            self.lost = ticks.saturating_sub(self.samples);
            return Phase::Plays;
        }
        if self.samples == 0 {
            return Phase::Before;
        }
        self.end = status.ended().unwrap_or_default();
        self.fault = status.fault().unwrap_or_default();
        Phase::Over
    }
}

/// An experiment that has been played.
#[derive(Clone, Debug, PartialEq)]
pub struct Done {
    /// Its name.
    pub name: &'static str,
    /// Its log; none of fewer than two samples.
    pub log: Option<PathBuf>,
    /// What its samples show.
    pub seen: Seen,
    /// Seconds it was to play.
    pub planned_s: f64,
    /// Seconds it played.
    pub played_s: f64,
    /// Furthest from where it began, rad.
    pub travel_rad: f64,
    /// Fastest by the observer, rad/s.
    pub speed_rad_s: f64,
    /// Largest torque put out, N m.
    pub torque_nm: f64,
}

impl Done {
    /// What came of it, for a log that has room for it.
    fn about(&self) -> About {
        let (seen, end) = (&self.seen, self.seen.end.text());
        About::from(
            [
                ("samples", seen.samples.to_string()),
                ("lost", seen.lost.to_string()),
                ("ended", end.to_owned()),
                ("fault", seen.fault.text().to_owned()),
            ]
            .map(|(name, value)| (name.to_owned(), value)),
        )
    }
}

/// What a run tells its user, and hears from them.
pub trait Watch {
    /// How far an experiment of the plan has come, from 0 to 1.
    fn progress(&mut self, number: usize, step: &Step, share: f64);
    /// An experiment has been played.
    fn done(&mut self, done: Done);
    /// Whether the run may go on.
    fn go_on(&self) -> bool;
}

/// A plan on its way.
pub struct Run<'a> {
    /// The axis as it is believed to be.
    pub axis: &'a Believed,
    /// Columns of the logs.
    pub layout: Layout,
    /// What goes into logs that have room for it.
    pub about: About,
}

/// Samples between two words of progress.
const TELL: u64 = 1000;

/// After a way back the axis rests for so long, s.
const SETTLES_S: f64 = 0.5;

/// Seconds of the way back to where the plan began, if an axis that has come `offset_rad` from there must go it before an
/// experiment: without it there would not be room.
pub fn way_back_s(axis: &Believed, step: &Step, offset_rad: f64) -> Option<f64> {
    let limit_rad = travel_limit_rad(axis);
    let needs = step.experiment.needs(1.0 / axis.rate_hz).travel_rad;
    // Half of the travel for what a torque makes of the axis.
    let far = offset_rad.abs() > (limit_rad - needs).min(0.5 * limit_rad);
    // A twentieth of the axis's speed at the fastest, which is twice the mean.
    far.then(|| (2.0 * offset_rad.abs() / (0.05 * axis.speed_limit_rad_s)).max(1.0) + SETTLES_S)
}

impl Run<'_> {
    /// Plays a plan. `place` names the log of an experiment. Ends at a fault, or where `watch` says so; what was recorded
    /// is kept.
    ///
    /// # Errors
    /// A fault of the axis, a log that cannot be written, or a bench that is lost.
    pub fn play(
        &self,
        plan: &Plan,
        bench: &mut dyn Bench,
        place: &dyn Fn(usize, &Step) -> PathBuf,
        watch: &mut dyn Watch,
    ) -> Result<(), InputError> {
        let origin = bench.counts();
        for (number, step) in plan.steps.iter().enumerate() {
            watch.progress(number, step, 0.0);
            bench.rest(step.rest_ticks, &|| watch.go_on())?;
            let offset_rad = self.bring_back(bench, step, origin, watch)?;
            if !watch.go_on() {
                return Ok(());
            }
            let path = place(number, step);
            let (done, played) = self.record(bench, (number, step), offset_rad, &path, watch)?;
            let (end, fault) = (done.seen.end, done.seen.fault);
            let name = done.name;
            watch.done(done);
            played?;
            if end == End::Fault {
                return Err(InputError::new(
                    path,
                    format!("the {name} was ended by a fault: {}", fault.text()),
                    "mend its cause; what was recorded until then is kept",
                ));
            }
        }
        Ok(())
    }

    /// Moves the axis back to where the plan began if it has come too far from there for the next experiment. Gives the
    /// distance that is left.
    fn bring_back(
        &self,
        bench: &mut dyn Bench,
        step: &Step,
        origin: i64,
        watch: &dyn Watch,
    ) -> Result<f64, InputError> {
        let axis = self.axis;
        let limit_rad = travel_limit_rad(axis);
        let offset_rad =
            |bench: &dyn Bench| (bench.counts() - origin) as f64 * axis.rad_per_count();
        let offset = offset_rad(bench);
        let Some(way_s) = way_back_s(axis, step, offset).filter(|_| watch.go_on()) else {
            return Ok(offset);
        };
        let ticks = |seconds: f64| (seconds * axis.rate_hz).round() as u32;
        let (moves, settles) = (ticks(way_s - SETTLES_S), ticks(SETTLES_S));
        let back = Experiment::Moves {
            length_rad: -offset as f32,
            move_ticks: moves,
            pause_ticks: settles,
            pauses: 1,
        };
        let bounds = Bounds {
            travel_rad: (1.5 * offset.abs()) as f32,
            speed_rad_s: axis.speed_limit_rad_s as f32,
            torque_nm: axis.torque_limit_nm() as f32,
            ticks: moves.saturating_add(settles),
        };
        let seen = bench.play(&back, &bounds, &mut |_, _| Ok(watch.go_on()))?;
        let left = offset_rad(bench);
        if seen.end == End::Stopped || (seen.end == End::Finished && left.abs() < 0.5 * limit_rad) {
            return Ok(left);
        }
        let why = match seen.end {
            End::Fault => seen.fault.text(),
            end => end.text(),
        };
        Err(InputError::new(
            step.name(),
            format!("the axis could not be brought back to where the plan began: {why}"),
            "see that it moves freely, and that the gains of [control] hold it",
        ))
    }

    /// Plays one into its log. What was recorded is kept where the bench is lost on the way.
    fn record(
        &self,
        bench: &mut dyn Bench,
        (number, step): (usize, &Step),
        offset_rad: f64,
        path: &Path,
        watch: &mut dyn Watch,
    ) -> Result<(Done, Result<(), InputError>), InputError> {
        let axis = self.axis;
        // The axis may go no further from the plan's beginning than its limit.
        let room_rad = travel_limit_rad(axis) - offset_rad.abs();
        let bounds = Bounds {
            travel_rad: step.bounds.travel_rad.min(room_rad) as f32,
            speed_rad_s: step.bounds.speed_rad_s as f32,
            torque_nm: step.bounds.torque_nm as f32,
            ticks: step.bounds.ticks,
        };
        let mut done = Done {
            name: step.name(),
            log: None,
            seen: Seen::default(),
            planned_s: step.seconds(axis).0,
            played_s: 0.0,
            travel_rad: 0.0,
            speed_rad_s: 0.0,
            torque_nm: 0.0,
        };
        let mut about = self.about.clone();
        about.insert("experiment".to_owned(), format!("{:?}", step.experiment));
        let mut file = Recorder::create(path, self.layout, &about)?;
        let mut first = None;
        let mut samples = 0;
        let mut writable = true;
        let experiment = in_single_precision(&step.experiment);
        let played = bench.play(&experiment, &bounds, &mut |sample, truth| {
            let record = &sample.record;
            if record.torque_ref_nm.is_finite() && record.velocity_rad_s.is_finite() {
                let written = file.row(sample, truth);
                writable = written.is_ok();
                written?;
                let travel = (sample.counts - *first.get_or_insert(sample.counts)) as f64;
                done.travel_rad = done.travel_rad.max(travel.abs() * axis.rad_per_count());
                done.speed_rad_s = done.speed_rad_s.max(f64::from(record.velocity_rad_s.abs()));
                done.torque_nm = done.torque_nm.max(f64::from(record.torque_ref_nm.abs()));
            }
            if samples % TELL == 0 {
                watch.progress(number, step, samples as f64 / f64::from(bounds.ticks));
            }
            samples += 1;
            Ok(watch.go_on())
        });
        done.seen = *played.as_ref().unwrap_or(&Seen {
            samples,
            ..Seen::default()
        });
        done.played_s = (done.seen.samples + done.seen.lost) as f64 / axis.rate_hz;
        if done.seen.samples >= 2 && writable {
            file.commit(&done.about())?;
            done.log = Some(path.to_path_buf());
        }
        Ok((done, played.map(|_| ())))
    }
}

#[cfg(test)]
mod tests;
