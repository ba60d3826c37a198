//! An experiment on the virtual axis before it is played on a real one, and what its log would say of the parameters.

use super::candidates::ROOM;
use crate::axis_file::AxisFile;
use crate::believed::{Believed, Noise};
use crate::error::InputError;
use crate::identify::joint::{Data, Joint, Weighting};
use crate::inverse::{Free, Record};
use crate::log::{Effort, EffortKind, Log, Position, PositionKind};
use crate::plan::{Step, travel_limit_rad};
use crate::run::{Bench, Virtual};
use bristle_core::experiment::fields::in_single_precision;
use bristle_core::experiment::{Bounds, End};
use nalgebra::DMatrix;
use std::path::Path;

/// The axis that experiments are tried on.
pub struct Stage<'a> {
    /// The axis file, completed.
    pub file: &'a AxisFile,
    /// What follows from it.
    pub axis: &'a Believed,
    /// Its noise.
    pub noise: Noise,
    /// Seed of the noise.
    pub seed: u64,
    /// Name for errors.
    pub path: &'a Path,
}

/// What an experiment says.
pub struct Seen {
    /// Fisher information of the fitted coordinates, in their order; nuisances too.
    pub information: DMatrix<f64>,
    /// Where it leaves the axis, rad from where it began.
    pub moved_rad: f64,
    /// The parameters of the coordinates.
    pub free: Vec<Free>,
}

impl Stage<'_> {
    /// Plays an experiment and says what its log would show. None: it would pass a bound, need more than its room, or
    /// show nothing.
    ///
    /// # Errors
    /// The axis file holds a number that no model takes.
    pub fn see(&self, step: &Step) -> Result<Option<Seen>, InputError> {
        let Some((log, moved_rad)) = self.play(step)? else {
            return Ok(None);
        };
        let Ok(record) = self.prepared(&log) else {
            return Ok(None);
        };
        let (_, joint) = self.judge(vec![record])?;
        let jacobian = &joint.fit.jacobian;
        let information = jacobian.tr_mul(jacobian);
        let finite = information.iter().all(|x| x.is_finite());
        Ok(finite.then_some(Seen {
            information,
            moved_rad,
            free: joint.model.free,
        }))
    }

    /// The record that an experiment would leave; it was [seen](Self::see) to leave one.
    ///
    /// # Errors
    /// As [`Self::see`].
    pub fn record(&self, step: &Step) -> Result<Option<Record>, InputError> {
        self.play(step)?
            .map(|(log, _)| self.prepared(&log))
            .transpose()
    }

    /// A log of the axis as it is believed: its encoder is that of the axis file, whatever positions it has seen.
    fn prepared(&self, log: &Log) -> Result<Record, InputError> {
        let mut record = Record::new(log, self.file, self.axis, &[])?;
        record.rad_per_count = self.axis.rad_per_count();
        Ok(record)
    }

    /// What a fit to records of the axis would rest on, at its true parameters.
    ///
    /// # Errors
    /// As [`Self::see`].
    pub fn judge(&self, records: Vec<Record>) -> Result<(Data, Joint), InputError> {
        let mut data = Data::new(records, self.file, self.path, Weighting::Noise)?;
        let joint = Joint::expected(&mut data, self.axis)?;
        Ok((data, joint))
    }

    fn play(&self, step: &Step) -> Result<Option<(Log, f64)>, InputError> {
        let mut bench = Virtual::new(self.axis, self.axis, self.noise, self.seed)?;
        bench.rest(step.rest_ticks, &|| true)?;
        let bounds = Bounds {
            travel_rad: step.bounds.travel_rad as f32,
            speed_rad_s: step.bounds.speed_rad_s as f32,
            torque_nm: step.bounds.torque_nm as f32,
            ticks: step.bounds.ticks,
        };
        let room_rad = ROOM * travel_limit_rad(self.axis);
        let (mut time_s, mut torque_nm, mut counts) = (Vec::new(), Vec::new(), Vec::new());
        let played = bench.play(
            &in_single_precision(&step.experiment),
            &bounds,
            &mut |sample, _| {
                time_s.push(sample.time_s);
                torque_nm.push(f64::from(sample.record.torque_ref_nm));
                counts.push(sample.counts as f64);
                let moved = (sample.counts as f64 - counts[0]) * self.axis.rad_per_count();
                Ok(moved.abs() <= room_rad)
            },
        );
        let Ok(seen) = played else {
            return Ok(None);
        };
        if seen.end != End::Finished {
            return Ok(None);
        }
        let moved = counts.last().copied().unwrap_or_default() - counts[0];
        let log = Log::new(
            step.name(),
            self.axis.unit,
            time_s,
            vec![Effort {
                kind: EffortKind::TorqueReference,
                values: torque_nm,
            }],
            Position {
                kind: PositionKind::Counts,
                values: counts,
            },
        );
        Ok(Some((log, moved * self.axis.rad_per_count())))
    }
}
