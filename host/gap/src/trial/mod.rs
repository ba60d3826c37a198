//! Virtual axes by chance: an axis, its records, and what truly is in it, all from one seed.
//!
//! An effect's size is set by what it does to the records: the root mean square of what the axis without it leaves over
//! along them, beyond what it leaves over along records of the axis without it (the floor), as a share of that floor.
//! Samples at rest do not count, nor the first moments of a record, nor does what other values of the axis's own parameters take
//! away: a gain that looks like more friction and more inertia is no gap.

mod alike;
mod dice;
mod experiments;
mod plant;
mod record;
mod wanted_effect;

pub use plant::Plant;

use crate::axis_file::AxisFile;
use crate::believed::Believed;
use crate::diagnose::{DOUBT, Node, Regime, is_predicted, nodes};
use crate::error::InputError;
use crate::hygiene::{Finding, Severity, inspect};
use crate::inverse::{Model, Record, fit_alone, scale};
use crate::log::Log;
use crate::signal::{rms, rms_beside};
use bristle_plant::effect::{ALL, Entry};
use dice::Dice;
use experiments::Task;
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
    /// The records, beside the true axis without each effect and with all.
    told: Option<Told>,
}

/// What effects are told apart by.
#[derive(Clone, Debug)]
struct Told {
    seen: Seen,
    with: Believed,
    without: Vec<Believed>,
}

impl Trial {
    /// Whether these experiments cannot tell an effect from the one at a place among those that are there: what does not depend on
    /// any diagnosis.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub fn are_alike(&self, place: usize, other: &'static Entry) -> Result<bool, InputError> {
        let Some(Told {
            seen,
            with,
            without,
        }) = &self.told
        else {
            return Ok(false);
        };
        alike::alike(self.effects[place], other, &without[place], with, seen)
    }
}

/// Axes and sets of experiments that are tried before an effect counts as one that cannot be shown.
const DRAWS: u64 = 24;
/// Sizes that are tried on an axis.
const SIZES: usize = 9;
/// The share is met to within this part of itself.
const WITHIN: f64 = 0.12;

/// Draws a trial. None: no axis was found on which the effects reach the share with a usual size.
///
/// # Errors
/// An effect that does not exist.
pub fn draw(seed: u64, wanted: &Wanted) -> Result<Option<Trial>, InputError> {
    drawn_of(DRAWS, seed, wanted)
}

/// The same of so many axes and sets of experiments.
fn drawn_of(draws: u64, seed: u64, wanted: &Wanted) -> Result<Option<Trial>, InputError> {
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
    for round in 0..draws {
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
        let Some((mut logs, clean)) = attempt.play(&plant.axis, None)? else {
            continue;
        };
        let floor_nm = rms(clean.left_over_nm.iter().copied());
        let mut truth = plant.axis.clone();
        let mut gap_nm = 0.0;
        let mut told = None;
        let mut drawn = Vec::new();
        let mut met = true;
        for entry in &entries {
            let scale = scale(&clean.believed, &clean.records);
            let draft = Draft::draw(&mut dice, entry, &scale);
            let Some(level) = attempt.level(&draft, floor_nm, wanted.share)? else {
                met = false;
                break;
            };
            truth.effects.push(draft.at(level));
            drawn.push((*entry, draft.values(level)));
        }
        if !met {
            continue;
        }
        if !entries.is_empty() {
            let Some((with, seen)) = attempt.play(&truth, Some(floor_nm))? else {
                continue;
            };
            logs = with;
            gap_nm = rms_beside(rms(seen.left_over_nm.iter().copied()), floor_nm);
            let with = Believed::new(&truth, &path)?;
            // One is always there, and noise is no part of the rest.
            let several = entries.len() > 1 && entries.iter().all(|entry| is_predicted(entry));
            if several && !alike::all_show(&drawn, &with, &seen)? {
                continue;
            }
            let without = |place: usize| {
                let mut without = truth.clone();
                without.effects.remove(place);
                Believed::new(&without, &path)
            };
            told = Some(Told {
                with,
                without: (0..entries.len()).map(without).collect::<Result<_, _>>()?,
                seen,
            });
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
            told,
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
#[derive(Clone, Debug)]
struct Seen {
    believed: Believed,
    records: Vec<Record>,
    nodes: Vec<Node>,
    /// One over the floor where a node counts.
    weights: Vec<f64>,
    left_over_nm: Vec<f64>,
}

impl Attempt<'_> {
    /// The records of an axis, and what the axis without effects leaves over along them once it is refitted, beside a floor. None: it cannot be run.
    fn play(
        &self,
        truth: &AxisFile,
        floor_nm: Option<f64>,
    ) -> Result<Option<(Vec<Log>, Seen)>, InputError> {
        let real = Believed::new(truth, self.path)?;
        let mut logs = Vec::new();
        for (place, task) in self.tasks.iter().enumerate() {
            match record::record(self.plant, &real, task, place, self.seed)? {
                Some(log) if is_sound(&log, truth) => logs.push(log),
                _ => return Ok(None),
            }
        }
        let believed = Believed::new(&self.plant.axis, self.path)?;
        let records = logs
            .iter()
            .map(|log| Record::new(log, &self.plant.axis, &believed, &[]))
            .collect::<Result<Vec<_>, InputError>>()?;
        let nodes = nodes(&records, scale(&believed, &records).z_ss_rad);
        let counts = |node: &Node| !node.excluded && node.regime != Regime::Rest;
        let kept = |left_over: Vec<f64>| -> Vec<f64> {
            let kept = nodes.iter().zip(left_over);
            kept.filter(|(node, _)| counts(node))
                .map(|(_, r)| r)
                .collect()
        };
        let model = Model::base(&believed, &records, DOUBT)?;
        let start = model.start();
        let floor_nm = match floor_nm {
            Some(floor_nm) => floor_nm,
            None => rms(kept(model.left_over(&records, &start)?)),
        };
        let weight = |node: &Node| f64::from(u8::from(counts(node))) / floor_nm;
        let weights: Vec<f64> = nodes.iter().map(weight).collect();
        let fitted = fit_alone(&model, &records, &weights, start)?;
        let left_over_nm = kept(fitted.left_over);
        let finite = !left_over_nm.is_empty() && left_over_nm.iter().all(|x| x.is_finite());
        Ok(finite.then_some((
            logs,
            Seen {
                believed,
                records,
                nodes,
                weights,
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
            let reached = match self.play(&truth, Some(floor_nm))? {
                Some((_, seen)) => {
                    rms_beside(rms(seen.left_over_nm.iter().copied()), floor_nm) / floor_nm
                }
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

/// Whether a log is one that anyone would diagnose: an axis that stands still for most of it is repaired first.
fn is_sound(log: &Log, axis: &AxisFile) -> bool {
    let fatal = |finding: &Finding| finding.severity == Severity::Fatal;
    inspect(log, axis).is_ok_and(|hygiene| !hygiene.findings.iter().any(fatal))
}

#[cfg(test)]
mod tests;
