//! Virtual axes by chance: an axis, its records, and what truly is in it, all from one seed.
//!
//! An effect's size is set by what it does to the records: the root mean square of what the axis without it leaves over
//! along them, beyond what it leaves over along records of the axis without it (the floor), as a share of that floor.
//! Samples at rest do not count, nor does what other values of the axis's own parameters would take away, to first order
//! about the true ones: a gain that looks like more friction and more inertia is no gap.

mod dice;
mod experiments;
mod plant;
mod record;
mod wanted_effect;

pub use plant::Plant;

use crate::axis_file::AxisFile;
use crate::believed::Believed;
use crate::error::InputError;
use crate::inverse::{Fit, Model, Record, fit_at, scale};
use crate::log::Log;
use bristle_plant::effect::{ALL, Entry};
use dice::Dice;
use experiments::Task;
use nalgebra::DVector;
use plant::Needs;
use std::path::PathBuf;
use wanted_effect::Draft;

/// What a trial shall contain.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// Ids of effects; none for a clean axis.
    pub effects: Vec<&'static str>,
    /// Gap that each effect makes, as a share of the floor.
    pub share: f64,
    /// Largest error of a parameter of the axis file, as a share of it.
    pub parameter_error: f64,
}

/// A virtual axis and its records.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Name for errors and reports.
    pub path: PathBuf,
    /// What the simulator believes.
    pub axis: AxisFile,
    /// What is there: the true parameters, and the effects with theirs.
    pub truth: AxisFile,
    /// Ids of the effects that are there and not believed.
    pub effects: Vec<&'static str>,
    /// Records.
    pub logs: Vec<Log>,
    /// Names of the experiments.
    pub experiments: Vec<&'static str>,
    /// What the true axis without the effects leaves over along its own records, N m rms.
    pub floor_nm: f64,
    /// What it leaves over beyond the floor along those with the effects, N m rms.
    pub gap_nm: f64,
}

/// Axes and sets of experiments that are tried before an effect counts as one that cannot be shown.
const DRAWS: u64 = 24;
/// Standard deviation of an own parameter, as a share of it; of what is taken away to first order, it changes nothing.
const OWN: f64 = 0.1;
/// Sizes that are tried on an axis.
const SIZES: usize = 9;
/// The share is met to within this part of itself.
const WITHIN: f64 = 0.12;

/// Draws a trial. None: no axis was found on which the effects reach the share with a usual size.
///
/// # Errors
/// An effect that does not exist.
pub fn draw(seed: u64, wanted: &Wanted) -> Result<Option<Trial>, InputError> {
    let path = PathBuf::from(record::plant_name(seed));
    let entries = wanted
        .effects
        .iter()
        .map(|id| {
            ALL.iter().find(|entry| entry.id == *id).ok_or_else(|| {
                InputError::new(
                    &path,
                    format!("effect {id} does not exist"),
                    "take one of the catalogue",
                )
            })
        })
        .collect::<Result<Vec<&'static Entry>, InputError>>()?;
    for round in 0..DRAWS {
        let mut dice = Dice::new(seed, round);
        let needs = needs(&mut dice, &wanted.effects);
        let plant = Plant::draw(&mut dice, needs);
        let tasks = experiments::draw(&mut dice, &plant);
        let attempt = Attempt {
            seed: dice.seed(),
            path: &path,
            plant: &plant,
            tasks: &tasks,
        };
        let Some((mut logs, clean)) = attempt.play(&plant.axis)? else {
            continue;
        };
        let floor_nm = rms(&clean.left_over_nm);
        let mut truth = plant.axis.clone();
        let mut gap_nm = 0.0;
        let mut met = true;
        for entry in &entries {
            let scale = scale(&clean.believed, &clean.records);
            let draft = Draft::draw(&mut dice, entry, &scale);
            let Some(level) = attempt.level(&draft, floor_nm, wanted.share)? else {
                met = false;
                break;
            };
            truth.effects.push(draft.at(level));
        }
        if !met {
            continue;
        }
        if !entries.is_empty() {
            let Some((with, seen)) = attempt.play(&truth)? else {
                continue;
            };
            logs = with;
            gap_nm = beyond(rms(&seen.left_over_nm), floor_nm);
        }
        let axis = plant.believed(&mut dice, wanted.parameter_error);
        return Ok(Some(Trial {
            path,
            axis,
            truth,
            effects: entries.iter().map(|entry| entry.id).collect(),
            logs,
            experiments: tasks.iter().map(|task| task.name).collect(),
            floor_nm,
            gap_nm,
        }));
    }
    Ok(None)
}

fn needs(dice: &mut Dice, effects: &[&str]) -> Needs {
    Needs {
        rigid: effects.contains(&"friction.presliding")
            || (effects.contains(&"friction.nonlocal") && dice.chance(0.5)),
        flat: effects.contains(&"friction.stribeck"),
        rotary: effects.contains(&"mechanics.unbalance"),
    }
}

/// An axis with its experiments.
struct Attempt<'a> {
    seed: u64,
    path: &'a PathBuf,
    plant: &'a Plant,
    tasks: &'a [Task],
}

/// What the axis without effects makes of records.
struct Seen {
    believed: Believed,
    records: Vec<Record>,
    left_over_nm: Vec<f64>,
}

impl Attempt<'_> {
    /// The records of an axis, and what the axis without effects leaves over along them. None: it cannot be run.
    fn play(&self, truth: &AxisFile) -> Result<Option<(Vec<Log>, Seen)>, InputError> {
        let real = Believed::new(truth, self.path)?;
        let mut logs = Vec::new();
        for (place, task) in self.tasks.iter().enumerate() {
            match record::record(self.plant, &real, task, place, self.seed)? {
                Some(log) => logs.push(log),
                None => return Ok(None),
            }
        }
        let believed = Believed::new(&self.plant.axis, self.path)?;
        let records = logs
            .iter()
            .map(|log| Record::new(log, &self.plant.axis, &believed, &[]))
            .collect::<Result<Vec<_>, InputError>>()?;
        let moves = records.iter().flat_map(|record| {
            let rest = record.rest_velocity_rad_s();
            record.stretches.iter().flat_map(move |stretch| {
                (0..record.nodes_of(stretch))
                    .map(move |node| stretch.velocity_rad_s[record.middle(node)].abs() > rest)
            })
        });
        let weights: Vec<f64> = moves.map(|moves| f64::from(u8::from(moves))).collect();
        let model = Model::base(&believed, &records, OWN)?;
        let fit = fit_at(&model, &records, &weights, model.start())?;
        let left_over_nm = beyond_own(&fit, &weights);
        let finite = !left_over_nm.is_empty() && left_over_nm.iter().all(|x| x.is_finite());
        Ok(finite.then_some((
            logs,
            Seen {
                believed,
                records,
                left_over_nm,
            },
        )))
    }

    /// The level at which an effect alone makes the gap that is wanted. None: no usual size does.
    fn level(&self, draft: &Draft, floor_nm: f64, share: f64) -> Result<Option<f64>, InputError> {
        let (least, most) = (draft.least(), draft.most());
        if least > most {
            return Ok(None);
        }
        // Brackets in the logarithm of the level, and of the share there.
        let (mut low, mut high): (Option<[f64; 2]>, Option<[f64; 2]>) = (None, None);
        let mut level = 1.0_f64.clamp(least, most);
        for _ in 0..SIZES {
            let mut truth = self.plant.axis.clone();
            truth.effects.push(draft.at(level));
            // An axis that cannot be run with it has too much of it.
            let reached = match self.play(&truth)? {
                Some((_, seen)) => beyond(rms(&seen.left_over_nm), floor_nm) / floor_nm,
                None => f64::INFINITY,
            };
            if (reached / share - 1.0).abs() < WITHIN {
                return Ok(Some(level));
            }
            if reached < share {
                if level >= most {
                    return Ok(None);
                }
                low = Some([level, reached.max(0.05)]);
            } else {
                if level <= least {
                    return Ok(None);
                }
                high = Some([level, reached]);
            }
            level = match (low, high) {
                (Some([l, a]), Some([h, b])) if b.is_finite() => {
                    let part = ((share / a).ln() / (b / a).ln()).clamp(0.1, 0.9);
                    l * (h / l).powf(part)
                }
                (Some([l, _]), Some([h, _])) => (l * h).sqrt(),
                (Some([l, a]), None) => (l * (share / a).clamp(1.1, 8.0)).min(most),
                (None, Some([h, b])) => (h * (share / b).clamp(0.05, 0.9)).max(least),
                (None, None) => level,
            };
        }
        Ok(None)
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The rest where weights are not zero, less what other values of the model's parameters would take away.
fn beyond_own(fit: &Fit, weights: &[f64]) -> Vec<f64> {
    let rest = DVector::from_iterator(
        weights.len(),
        fit.left_over.iter().zip(weights).map(|(x, w)| x * w),
    );
    let q = fit.jacobian.clone().qr().q();
    let beyond = &rest - &q * q.tr_mul(&rest);
    let kept = beyond.iter().zip(weights).filter(|(_, w)| **w > 0.0);
    kept.map(|(x, _)| *x).collect()
}

/// What has to be added to a floor, in squares, to make a whole.
fn beyond(whole: f64, floor: f64) -> f64 {
    (whole * whole - floor * floor).max(0.0).sqrt()
}

#[cfg(test)]
mod tests;
