//! The joint fit of one friction model: from a grid of starts over what has valleys (Stribeck velocity, bristle
//! deflection), weights by regime from what is left over, Levenberg-Marquardt from the best.

use super::start::{believed, shaped};
use crate::axis_file::{AxisFile, FrictionModel};
use crate::believed::Believed;
use crate::diagnose::{Background, Node, Noise, nodes};
use crate::error::InputError;
use crate::inverse::{self, Fit, Free, Model, Own, Owner, Point, Record, scale};
use crate::signal::{rms, weighted_squares};
use bristle_plant::Unit;
use bristle_plant::effect::{ALL, Entry, Scale};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::path::Path;

/// Standard deviation of a parameter about its start, in the logarithm: a factor of 20 either way. The logs lead; this
/// only keeps what they do not show within what is physical.
const DOUBT: f64 = 3.0;
/// Stribeck velocities to start from, as a share of the top speed.
const VELOCITIES: [f64; 4] = [0.003, 0.015, 0.06, 0.25];
/// (F_S - F_C)/F_C to start from.
const EXCESS: f64 = 0.3;
/// Bristle deflections to start from, rad or m.
const DEFLECTIONS: [[f64; 5]; 2] = [
    [1e-4, 5e-4, 2e-3, 8e-3, 3e-2],
    [1e-6, 4e-6, 1.5e-5, 6e-5, 2.5e-4],
];
/// Below so many counts a deflection cannot be seen: no start is smaller.
const LEAST_COUNTS: f64 = 2.5;
/// Starts that are fitted.
const FITTED: usize = 3;
/// Those of them that are fitted to the end, unless what the first leaves over is so many times less.
const FINISHED: usize = 2;
const HOPELESS: f64 = 10.0;

/// Break-away ratios from which a fit is tried again, with so many times the stiffness.
const VALLEYS: [(f64, f64); 3] = [(0.85, 0.5), (0.6, 0.7), (0.2, 1.5)];
/// A Stribeck velocity above this part of the top speed is viscous friction's.
const FASTEST_STRIBECK: f64 = 0.5;

/// How a fit weights its nodes, and when it takes an effort to act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighting {
    /// By the noise of each record in each regime; when the effort acts is fitted.
    Noise,
    /// All alike, each effort value taken at the instant of its sample: ordinary least squares, as published fits are.
    Equal,
}

/// How widely a fit is searched for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// From the best starts.
    Near,
    /// From the best of every other stiffness, too, since a fit does not cross from one to another, and from other break-away
    /// ratios.
    Wide,
}

/// A fitted model and all that its judgement takes.
#[derive(Clone)]
pub struct Joint {
    /// Which friction model.
    pub kind: FrictionModel,
    /// With what may move.
    pub model: Model,
    /// The fit.
    pub fit: Fit,
}

/// The prepared logs with nodes and weights that all models share.
pub struct Data {
    /// Prepared logs.
    pub records: Vec<Record>,
    /// Their nodes.
    pub nodes: Vec<Node>,
    /// Noise by record and regime.
    pub noise: Noise,
    /// Weight of each node.
    pub weights: Vec<f64>,
    /// Size of axis and records.
    pub scale: Scale,
    /// How nodes are weighted.
    pub weighting: Weighting,
    /// Bristle deflection by which the regimes are told apart.
    pub z_ss_rad: f64,
}

impl Data {
    /// Data whose weights are still those of the regression's rest.
    ///
    /// # Errors
    /// The friction model refuses the start.
    pub fn new(
        records: Vec<Record>,
        file: &AxisFile,
        path: &Path,
        weighting: Weighting,
    ) -> Result<Self, InputError> {
        let z_ss = DEFLECTIONS[usize::from(file.unit == Unit::Linear)][2];
        let coulomb = file.friction.coulomb.unwrap_or(0.0);
        let file = shaped(file, FrictionModel::CoulombViscous, 0.0, 1.0, z_ss);
        let believed = believed(&file, path)?;
        let scale = scale(&believed, &records);
        let nodes = nodes(&records, z_ss);
        let model = Model::base(&believed, &records, DOUBT)?;
        let left_over = model.left_over(&records, &model.start())?;
        let noise = Noise::new(
            &records,
            &nodes,
            &left_over,
            scale.inertia_kg_m2,
            0.0,
            coulomb,
        );
        let mut data = Self {
            weights: noise.weights(&nodes),
            noise,
            nodes,
            records,
            scale,
            weighting,
            z_ss_rad: z_ss,
        };
        data.even_out(&left_over);
        Ok(data)
    }

    /// The same with the weights that a fit's rest asks for.
    pub fn weigh(&mut self, joint: &Joint) {
        let point = joint.model.at(&joint.fit.at);
        let believed = point.believed();
        let stiffness = if joint.kind.has_bristles() {
            believed.stiffness_nm_rad
        } else {
            0.0
        };
        self.noise = Noise::new(
            &self.records,
            &self.nodes,
            &joint.fit.left_over,
            believed.whole_inertia_kg_m2(),
            stiffness,
            believed.coulomb_nm,
        );
        self.weights = self.noise.weights(&self.nodes);
        self.even_out(&joint.fit.left_over);
    }

    /// Gives every node the same weight, where that is asked for; its size is that of the rest.
    fn even_out(&mut self, left_over: &[f64]) {
        if self.weighting == Weighting::Noise {
            return;
        }
        let counts = |weight: f64| weight > 0.0;
        let used = || {
            self.weights
                .iter()
                .zip(left_over)
                .filter(|(w, _)| counts(**w))
        };
        let size = rms(used().map(|(_, r)| *r));
        let independent: f64 = self
            .nodes
            .iter()
            .zip(&self.weights)
            .filter(|(_, w)| counts(**w))
            .map(|(node, _)| {
                let group = self.noise.group(node);
                group.independent / group.nodes as f64
            })
            .sum();
        let share = independent / used().count().max(1) as f64;
        let weight = share.sqrt() / size.max(f64::MIN_POSITIVE);
        for w in &mut self.weights {
            *w = if counts(*w) { weight } else { 0.0 };
        }
    }
}

impl Joint {
    /// Fits a friction model, with the effects of `with` free, from what linear regression gave.
    ///
    /// # Errors
    /// The friction model refuses every start, or an effect does not exist.
    pub fn new(
        data: &Data,
        file: &AxisFile,
        path: &Path,
        kind: FrictionModel,
        with: &[&'static Entry],
        search: Search,
    ) -> Result<Self, InputError> {
        let models = starts(data, file, kind)
            .par_iter()
            .map(|file| {
                let model = suited(
                    Model::base(&believed(file, path)?, &data.records, DOUBT)?,
                    data,
                );
                let rest = model.left_over(&data.records, &model.start())?;
                Ok((weighted_squares(&rest, &data.weights), model))
            })
            .collect::<Result<Vec<_>, InputError>>()?;
        let starts = most_promising(models, search).into_iter();
        let starts = starts.map(|model| (model.start(), model)).collect();
        let (model, fit) = best_from(data, starts)?.ok_or_else(|| {
            InputError::new(
                path,
                "the model leaves all bounds wherever the fit starts",
                "check the inertia and the units of the logs",
            )
        })?;
        let mut best = Self { kind, model, fit };
        if search == Search::Wide {
            best = best.of_valleys(data)?;
        }
        for entry in with {
            best = best.with(data, entry)?;
        }
        Ok(best)
    }

    /// The best of the valleys of the break-away ratio: stiff bristles that creep from the start look much like softer ones
    /// that hold until break-away, and a fit does not cross from one to the other.
    fn of_valleys(self, data: &Data) -> Result<Self, InputError> {
        let place = |own: Own| {
            let of = |free: &Free| free.owner == Owner::Own(own);
            self.model.free.iter().position(of)
        };
        let (Some(ratio), Some(stiffness)) = (place(Own::BreakawayRatio), place(Own::Stiffness))
        else {
            return Ok(self);
        };
        let others = VALLEYS.iter().map(|(value, times)| {
            let mut at = self.fit.at.clone();
            at[ratio] = *value;
            at[stiffness] += times.ln();
            (at, self.model.clone())
        });
        let best = best_from(data, others.collect())?;
        Ok(match best.filter(|(_, fit)| fit.cost < self.fit.cost) {
            Some((_, fit)) => Self { fit, ..self },
            None => self,
        })
    }

    /// Fits again with the data's present weights, and from where another model's fit has taken the parameters of both.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub fn again_beside(&mut self, data: &Data, other: &Self) -> Result<(), InputError> {
        self.again(data)?;
        let mut at = self.fit.at.clone();
        for (x, free) in at.iter_mut().zip(&self.model.free) {
            let same = |one: &Free| one.owner == free.owner;
            if let Some(place) = other.model.free.iter().position(same) {
                *x = free.coordinate(other.model.free[place].value(other.fit.at[place]));
            }
        }
        let fit = inverse::fit(&self.model, &data.records, &data.weights, at)?;
        if fit.cost < self.fit.cost {
            self.fit = fit;
        }
        Ok(())
    }

    /// Fits again with the data's present weights.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub fn again(&mut self, data: &Data) -> Result<(), InputError> {
        self.fit = inverse::fit(
            &self.model,
            &data.records,
            &data.weights,
            self.fit.at.clone(),
        )?;
        Ok(())
    }

    /// What a fit to the data of an axis would rest on if it came out at the axis's true parameters. The data take the
    /// weights that it asks for.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub fn expected(data: &mut Data, truth: &Believed) -> Result<Self, InputError> {
        let model = suited(Model::base(truth, &data.records, DOUBT)?, data);
        let at = model.start();
        let fit = Fit {
            left_over: model.left_over(&data.records, &at)?,
            at: at.clone(),
            cost: 0.0,
            jacobian: DMatrix::zeros(0, 0),
        };
        let kind = truth.model;
        let mut joint = Self { kind, model, fit };
        data.weigh(&joint);
        joint.fit = inverse::fit_at(&joint.model, &data.records, &data.weights, at)?;
        Ok(joint)
    }

    /// Adds an effect from where it explains most.
    fn with(self, data: &Data, entry: &'static Entry) -> Result<Self, InputError> {
        if self
            .model
            .effects
            .iter()
            .any(|added| added.entry.id == entry.id)
        {
            return Ok(self);
        }
        let background = Background::new(
            &self.model,
            &data.records,
            &data.nodes,
            &data.scale,
            &data.weights,
            &self.fit,
        );
        let starts = background.starts(entry);
        let starts = &starts[..starts.len().min(FITTED)];
        Ok(match background.try_effect(entry, starts)? {
            Some((model, fit)) => Self {
                kind: self.kind,
                model,
                fit,
            },
            None => self,
        })
    }

    /// The model at its fit.
    pub fn point(&self) -> Point {
        self.model.at(&self.fit.at)
    }

    /// The axis at its fit, completed.
    pub fn believed(&self) -> Believed {
        self.point().believed().clone()
    }
}

/// The model without what it does not use. Effects that a fit starts with are there to be found, not believed: their sizes
/// may be anywhere in their range.
fn suited(mut model: Model, data: &Data) -> Model {
    let kind = model.believed.model;
    model
        .free
        .retain(|free| kind != FrictionModel::Dahl || free.owner != Owner::Own(Own::Viscous));
    for free in &mut model.free {
        match free.owner {
            Owner::Effect(..) => free.spread = free.range[1] - free.range[0],
            Owner::Own(Own::StribeckVelocity) => {
                let most = FASTEST_STRIBECK * data.scale.top_speed_rad_s;
                free.range[1] = free.range[1].min(most).max(free.start);
            }
            Owner::Own(Own::Skew) if data.weighting == Weighting::Equal => {
                let record = &data.records[0];
                let at_sample = -0.5 * record.step_s / record.averaged as f64;
                free.start = at_sample;
                free.center = at_sample;
                free.range = [at_sample; 2];
            }
            Owner::Own(Own::Skew) => {
                // A sample of the log, not of what it was averaged down to.
                let averaged = data.records.iter().map(|r| r.averaged).min().unwrap_or(1);
                let share = 1.0 / averaged as f64;
                free.spread *= share;
                free.range = free.range.map(|end| end * share);
            }
            Owner::Own(_) | Owner::OnRecord(..) => {}
        }
    }
    model
}

/// The best fit from any of these coordinates of models: all are fitted roughly, the most promising to the end.
fn best_from(
    data: &Data,
    starts: Vec<(Vec<f64>, Model)>,
) -> Result<Option<(Model, Fit)>, InputError> {
    let (records, weights) = (&data.records, &data.weights);
    let mut rough = starts
        .into_par_iter()
        .map(|(at, model)| Ok((inverse::fit_roughly(&model, records, weights, at)?, model)))
        .collect::<Result<Vec<_>, InputError>>()?;
    rough.sort_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
    rough.truncate(FINISHED);
    let least = rough.first().map_or(0.0, |(fit, _)| fit.cost);
    rough.retain(|(fit, _)| fit.cost <= HOPELESS * least);
    let finished = rough
        .into_par_iter()
        .map(|(fit, model)| Ok((inverse::fit(&model, records, weights, fit.at)?, model)))
        .collect::<Result<Vec<_>, InputError>>()?;
    let best = finished
        .into_iter()
        .min_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
    Ok(best.map(|(fit, model)| (model, fit)))
}

/// The starts that are fitted.
fn most_promising(mut starts: Vec<(f64, Model)>, search: Search) -> Vec<Model> {
    starts.retain(|(cost, _)| cost.is_finite());
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut starts = starts.into_iter().map(|(_, model)| model);
    let mut chosen: Vec<Model> = starts.by_ref().take(FITTED).collect();
    if search == Search::Wide {
        for model in starts {
            let stiffness = |model: &Model| model.believed.stiffness_nm_rad;
            if chosen.iter().all(|one| stiffness(one) != stiffness(&model)) {
                chosen.push(model);
            }
        }
    }
    chosen
}

/// Axis files to start from: the grid over what the model has, and what the axis file itself says.
fn starts(data: &Data, file: &AxisFile, kind: FrictionModel) -> Vec<AxisFile> {
    let falls = matches!(
        kind,
        FrictionModel::Stribeck | FrictionModel::Lugre | FrictionModel::ElastoPlastic
    );
    let least = data
        .records
        .iter()
        .fold(0.0, |least: f64, record| least.max(record.rad_per_count))
        * LEAST_COUNTS;
    let mut deflections: Vec<f64> = DEFLECTIONS[usize::from(file.unit == Unit::Linear)]
        .into_iter()
        .filter(|&z| z > least)
        .collect();
    if deflections.first().is_none_or(|&z| z > 2.0 * least) && least > 0.0 {
        deflections.push(least);
    }
    if !kind.has_bristles() {
        deflections.truncate(1);
    } else if let (Some(coulomb), Some(stiffness)) =
        (file.friction.coulomb, file.friction.stiffness)
    {
        deflections.push(coulomb / stiffness);
    }
    let velocities: &[f64] = if falls { &VELOCITIES } else { &VELOCITIES[..1] };
    let top = data.scale.top_speed_rad_s.max(f64::MIN_POSITIVE);
    deflections
        .iter()
        .flat_map(|&z| {
            velocities
                .iter()
                .map(move |share| shaped(file, kind, EXCESS, share * top, z))
        })
        .collect()
}

/// The effects of these ids.
///
/// # Errors
/// An id that does not exist.
pub fn entries(ids: &[String]) -> Result<Vec<&'static Entry>, InputError> {
    ids.iter()
        .map(|id| {
            ALL.iter().find(|entry| entry.id == id).ok_or_else(|| {
                let known: Vec<&str> = ALL.iter().map(|entry| entry.id).collect();
                InputError::new(
                    "--with",
                    format!("effect {id} does not exist"),
                    format!("use one of {}", known.join(", ")),
                )
            })
        })
        .collect()
}
