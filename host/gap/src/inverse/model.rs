//! The simulator's own parameters and those of effects as one vector that a fit may move.

use super::follow::{MakeSensors, Rubbing, Running, arriving, left_over};
use super::free::{Free, Own, Owner};
use super::load::Corrects;
use super::record::Record;
use crate::believed::Believed;
use crate::error::InputError;
use bristle_plant::drive::DriveConfig;
use bristle_plant::effect::{Coupling, Entry};
use rayon::prelude::*;
use std::iter::repeat;

/// Effect that stands for a constant torque on the axis.
pub const OFFSET: &str = "mechanics.offset";
/// Effects by which effort acts later than recorded, or a position is older: no log of effort and motor position tells them
/// apart, and along a measured motion they are one.
pub const DELAYS: [&str; 2] = ["actuator.delay", "sensor.delay"];

/// An effect in the model, with its values in the order of its parameters.
#[derive(Clone)]
pub struct Added {
    /// Which.
    pub entry: &'static Entry,
    /// Its values where they are not free.
    pub values: Vec<f64>,
}

/// An axis with parameters that may move.
#[derive(Clone)]
pub struct Model {
    /// What does not move stands here.
    pub believed: Believed,
    /// Effects that are believed, then those that are tried.
    pub effects: Vec<Added>,
    /// What may move.
    pub free: Vec<Free>,
    /// The effects change how much of the effort arrives, so that the rest is to be read in recorded effort. Otherwise an
    /// effect would explain everything by making torque small.
    pub scales_effort: bool,
    /// How much of each record's effort arrives, where they do and that is known.
    pub arrives: Option<Vec<f64>>,
    /// What corrects a load behind a spring.
    pub corrects: Option<Corrects>,
}

/// Change of effort from which its gain is taken.
const GAIN_STEP: f64 = 1e-3;
/// Least part of the effort that must arrive.
const LEAST_GAIN: f64 = 0.05;

/// The values of a model at one point.
#[derive(Clone)]
pub struct Point {
    believed: Believed,
    effects: Vec<Added>,
    on_records: Vec<(usize, usize, usize, f64)>,
    skew_s: f64,
    corrects: Option<Corrects>,
}

impl Model {
    /// Where a fit starts.
    pub fn start(&self) -> Vec<f64> {
        self.free
            .iter()
            .map(|free| free.coordinate(free.start))
            .collect()
    }

    /// Values by name at a point.
    pub fn values(&self, at: &[f64]) -> Vec<f64> {
        self.free
            .iter()
            .zip(at)
            .map(|(free, &x)| free.value(x))
            .collect()
    }

    /// Whether a parameter of an effect lies at the end of what is physical at a point.
    pub fn ends_at_limit(&self, at: &[f64]) -> bool {
        self.free.iter().zip(at).any(|(free, &x)| {
            let value = free.value(x);
            matches!(free.owner, Owner::Effect(..)) && free.range.contains(&value)
        })
    }

    /// The axis at a point.
    pub fn at(&self, at: &[f64]) -> Point {
        let mut point = Point {
            believed: self.believed.clone(),
            effects: self.effects.clone(),
            on_records: Vec::new(),
            skew_s: 0.0,
            corrects: self.corrects,
        };
        let mut excess = self.believed.stiction_nm / self.believed.coulomb_nm - 1.0;
        for (free, &x) in self.free.iter().zip(at) {
            let value = free.value(x);
            let believed = &mut point.believed;
            match free.owner {
                Owner::Effect(effect, parameter) => point.effects[effect].values[parameter] = value,
                Owner::OnRecord(effect, parameter, record) => {
                    point.on_records.push((effect, parameter, record, value));
                }
                Owner::Own(own) => match own {
                    Own::Inertia => {
                        let share = value / believed.whole_inertia_kg_m2();
                        believed.inertia_kg_m2 *= share;
                        if let Some(load) = &mut believed.load {
                            load.inertia_kg_m2 *= share;
                        }
                    }
                    Own::Coulomb => believed.coulomb_nm = value,
                    Own::Viscous => believed.viscous_nm_s_rad = value,
                    Own::StictionExcess => excess = value,
                    Own::StribeckVelocity => believed.set_stribeck_velocity(value),
                    Own::Stiffness => believed.stiffness_nm_rad = value,
                    Own::Damping => believed.damping_nm_s_rad = value,
                    Own::BreakawayRatio => believed.breakaway_ratio = value,
                    Own::DriveLag => believed.drive.lag_s = value,
                    Own::Skew => point.skew_s = value,
                },
            }
        }
        point.believed.stiction_nm = point.believed.coulomb_nm * (1.0 + excess);
        point
    }

    /// As many places as the friction along all records takes.
    pub fn places(records: &[Record]) -> Vec<f64> {
        vec![0.0; records.iter().map(Record::intervals).sum()]
    }

    /// What is left over of each record at a point, N m, node after node.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub fn left_over(&self, records: &[Record], at: &[f64]) -> Result<Vec<f64>, InputError> {
        self.left_over_rubbing(records, at, Rubbing::Anew)
    }

    /// The same, with the friction of the contact along the motion kept, or known from a point, perhaps of another model,
    /// with [the same contact](Self::leaves_contact).
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub fn left_over_rubbing(
        &self,
        records: &[Record],
        at: &[f64],
        mut rubbing: Rubbing<'_>,
    ) -> Result<Vec<f64>, InputError> {
        let point = self.at(at);
        let rubbings: Vec<Rubbing<'_>> = records
            .iter()
            .map(|record| rubbing.split_off(record.intervals()))
            .collect();
        let of_records = records
            .par_iter()
            .zip(rubbings)
            .enumerate()
            .map(|(place, (record, rubbing))| self.of_record(&point, record, place, rubbing))
            .collect::<Result<Vec<_>, InputError>>()?;
        Ok(of_records.concat())
    }

    fn of_record(
        &self,
        point: &Point,
        record: &Record,
        place: usize,
        rubbing: Rubbing<'_>,
    ) -> Result<Vec<f64>, InputError> {
        let (mut rest, arrives) = if !self.scales_effort {
            (point.rest(record, place, rubbing)?, 1.0)
        } else if let Some(arrives) = &self.arrives {
            (point.rest(record, place, rubbing)?, arrives[place])
        } else {
            let (rest, change) = point.rest_and_change(record, place, rubbing)?;
            let gain = gain(&change, &point.arrives(record, place)?);
            (rest, gain)
        };
        let lacks = record.lacks_nm.iter().copied().chain(repeat(0.0));
        for (rest, lacks) in rest.iter_mut().zip(lacks) {
            *rest = *rest / arrives + lacks;
        }
        Ok(rest)
    }

    /// Whether the contact's friction along a measured motion is the same whatever this parameter is.
    pub fn leaves_contact(&self, parameter: usize) -> bool {
        !matches!(self.free[parameter].owner, Owner::Own(own)
            if ![Own::Inertia, Own::DriveLag, Own::Skew].contains(&own))
    }

    /// Part of the effort of each record that arrives with the effects that are tried at a point, times what arrives without them.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub fn gains(&self, records: &[Record], at: &[f64]) -> Result<Vec<f64>, InputError> {
        let point = self.at(at);
        let gain_of = |(place, record)| {
            let (_, change) = point.rest_and_change(record, place, Rubbing::Anew)?;
            Ok(gain(&change, &point.arrives(record, place)?))
        };
        records.par_iter().enumerate().map(gain_of).collect()
    }
}

impl Point {
    /// The axis file's content at this point.
    pub fn believed(&self) -> &Believed {
        &self.believed
    }

    /// The effects at this point.
    pub fn effects(&self) -> &[Added] {
        &self.effects
    }

    /// The effects at this point as they are on a record.
    pub fn effects_on(&self, record: usize) -> Vec<Added> {
        let mut all = self.effects.clone();
        for &(effect, parameter, on, value) in &self.on_records {
            if on == record {
                all[effect].values[parameter] = value;
            }
        }
        all
    }

    /// How much later than recorded the effort acts, s.
    pub fn skew_s(&self) -> f64 {
        self.skew_s
    }

    /// What is left over of a record, N m.
    fn rest(
        &self,
        record: &Record,
        place: usize,
        rubbing: Rubbing<'_>,
    ) -> Result<Vec<f64>, InputError> {
        self.rest_of_times(record, place, 1.0, rubbing)
    }

    /// The same of so many times the effort.
    fn rest_of_times(
        &self,
        record: &Record,
        place: usize,
        times: f64,
        mut rubbing: Rubbing<'_>,
    ) -> Result<Vec<f64>, InputError> {
        let mut rest = Vec::with_capacity(record.nodes());
        for stretch in &record.stretches {
            let here = rubbing.split_off(stretch.effort_nm.len() - 1);
            let running = self.running(record, place, times)?;
            left_over(record, stretch, running, here, &mut rest);
        }
        Ok(rest)
    }

    /// What is left over of a record, and how that changes with [a little more effort](GAIN_STEP), N m.
    fn rest_and_change(
        &self,
        record: &Record,
        place: usize,
        rubbing: Rubbing<'_>,
    ) -> Result<(Vec<f64>, Vec<f64>), InputError> {
        let mut kept_nm = vec![0.0; record.intervals()];
        let mut rubbing = match rubbing {
            Rubbing::Anew => Rubbing::Kept(&mut kept_nm),
            given => given,
        };
        if self.corrects.is_some() {
            // A load that is corrected would take more effort for a twist, or another path.
            let open_loop = Self {
                corrects: None,
                ..self.clone()
            };
            let (_, change) = open_loop.rest_and_change(record, place, rubbing.again())?;
            return Ok((self.rest(record, place, rubbing.known())?, change));
        }
        let rest = self.rest(record, place, rubbing.again())?;
        let more = self.rest_of_times(record, place, 1.0 + GAIN_STEP, rubbing.known())?;
        let change = rest.iter().zip(&more).map(|(one, more)| more - one);
        let change = change.collect();
        Ok((rest, change))
    }

    /// What arrives of [a little more effort](GAIN_STEP) without effects that are tried, N m: all but where friction at rest
    /// holds against any effort.
    fn arrives(&self, record: &Record, place: usize) -> Result<Vec<f64>, InputError> {
        let believed = &self.believed;
        let holds = believed.contact(believed.model)?.holds_at_rest();
        if holds || believed.effects.iter().any(|effect| effect.id != OFFSET) {
            let mut without = self.clone();
            without.effects.truncate(believed.effects.len());
            without.corrects = None;
            without
                .on_records
                .retain(|(effect, ..)| *effect < without.effects.len());
            return Ok(without.rest_and_change(record, place, Rubbing::Anew)?.1);
        }
        let [one, more] = [1.0, 1.0 + GAIN_STEP].map(|times| {
            let mut efforts_nm = Vec::with_capacity(record.nodes());
            for stretch in &record.stretches {
                let skew_samples = self.skew_samples(record, self.skew_s);
                let drive = self.drive(record);
                arriving(record, stretch, drive, skew_samples, times, &mut efforts_nm);
            }
            efforts_nm
        });
        Ok(one
            .iter()
            .zip(&more)
            .map(|(one, more)| more - one)
            .collect())
    }

    /// The drive between a record's effort and the axis; its delay is [among what is later](Self::skew_samples).
    fn drive(&self, record: &Record) -> DriveConfig {
        let drive = record.drive(self.believed.drive);
        DriveConfig {
            delay_samples: 0,
            lag_s: drive.lag_s.max(record.lag_within_s(self.believed.drive)),
            ..drive
        }
    }

    /// Rms speed that noise on the rotor gives it on bristles that drift. White torque of density S, N^2 m^2 s, puts a power of S/(2 J) into an
    /// inertia J, whatever holds it, and a damping c takes c v^2 out: v^2 = S/(2 c J).
    fn shaken_rad_s(&self, record: &Record) -> f64 {
        let believed = &self.believed;
        let damping = believed.damping_nm_s_rad + believed.viscous_nm_s_rad;
        if !believed.model.drifts() || damping <= 0.0 {
            return 0.0;
        }
        let density = record.shakes_nm.powi(2) * record.step_s;
        (density / (2.0 * damping * believed.whole_inertia_kg_m2())).sqrt()
    }

    /// How much later than recorded the effort acts, samples: by so many seconds, and by what the drive takes.
    fn skew_samples(&self, record: &Record, later_s: f64) -> f64 {
        later_s / record.step_s + record.delay_samples(self.believed.drive)
    }

    fn running(&self, record: &Record, place: usize, times: f64) -> Result<Running, InputError> {
        let believed = &self.believed;
        let unit = believed.unit;
        let (mut offset_nm, mut delay_s) = (0.0, self.skew_s);
        let (mut effects, mut sensors) = (Vec::new(), Vec::new());
        for added in self.effects_on(place) {
            match added.entry.id {
                // A number rather than an effect that is asked at every sample: nearly every axis has one.
                OFFSET => offset_nm += added.values[0],
                id if DELAYS.contains(&id) => delay_s += added.values[0],
                id if id.starts_with("sensor.") => sensors.push(added),
                _ => effects.push((added.entry.build)(&added.values, unit)),
            }
        }
        let inertia_kg_m2 = believed.whole_inertia_kg_m2();
        Ok(Running {
            inertia_kg_m2,
            coupling: believed.load.map(|load| Coupling {
                load_share: load.inertia_kg_m2 / inertia_kg_m2,
                stiffness_nm_rad: load.stiffness_nm_rad,
                damping_nm_s_rad: load.damping_nm_s_rad,
                gap_rad: 0.0,
                friction_on_motor: false,
            }),
            contact: believed.contact(believed.model)?,
            stiffness_nm_rad: believed
                .model
                .has_bristles()
                .then_some(believed.stiffness_nm_rad),
            drive: self.drive(record),
            offset_nm,
            effects,
            sensors: (!sensors.is_empty()).then(|| {
                let make: MakeSensors = Box::new(move || {
                    sensors
                        .iter()
                        .map(|added| (added.entry.build)(&added.values, unit))
                        .collect()
                });
                make
            }),
            skew_samples: self.skew_samples(record, delay_s),
            times,
            shaken_rad_s: self.shaken_rad_s(record),
            corrects: self.corrects,
        })
    }
}

/// Part that effects let through of a change of effort, by least squares over a record: `change` with them, and what `arrives`
/// without them.
fn gain(change: &[f64], arrives: &[f64]) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for (with, without) in change.iter().zip(arrives) {
        product += with * without;
        square += without * without;
    }
    if square > 0.0 {
        f64::max(product / square, LEAST_GAIN)
    } else {
        1.0
    }
}
