//! A plan of experiments: which of them, how large and how often, so that the parameters of an axis are known best for
//! the time they take; and what they will be known to, before anything moves.
//!
//! Each candidate is played on the virtual axis. What the effort left over along its motion says of each parameter, with
//! the weights that identification gives it, is its Fisher information. Experiments are added one at a time, that one
//! first which raises the logarithm of the determinant most for its seconds: D-optimality for what is asked for, the
//! skew of the recorder being a nuisance.
//!
//! Sources: Fedorov 1972, Theory of Optimal Experiments (D-optimality, one point at a time); Silvey 1980, Optimal Design
//! (a subset of the parameters).

mod candidates;
mod rehearse;

use crate::axis_file::{AxisFile, EffectEntry, FrictionModel};
use crate::believed::{Believed, Noise};
use crate::error::InputError;
use crate::experiments::Named;
use crate::identify::joint::{Bias, Covariance, Estimate, MODELS, estimates};
use crate::inverse::{Free, OFFSET, Own, Owner, Record};
use crate::plan::{Plan, Step};
use crate::run::way_back_s;
use bristle_plant::Unit;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;
use rehearse::{Seen, Stage};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Longest plan, s.
pub const MOST_S: f64 = 240.0;
/// (F_S - F_C)/F_C where the file does not say: what a plan should find out must not be zero.
const EXCESS: f64 = 0.3;
/// What an experiment is for: parameters that it narrows by this part of the one that it narrows most.
const MATTERS: f64 = 0.4;
/// Most parameters named for an experiment.
const NAMED: usize = 3;

/// What is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Wish {
    /// Longest that all may take, rests and ways back included, s.
    pub most_s: f64,
    /// Noise that the axis is expected to have.
    pub noise: Noise,
    /// Its seed.
    pub seed: u64,
}

/// A plan and what it is expected to show.
pub struct Proposal {
    /// For `bristle run`.
    pub plan: Plan,
    /// How long it takes with rests and ways back, s.
    pub total_s: f64,
    /// Friction model whose parameters it is for.
    pub model: FrictionModel,
    /// Estimates as identification is expected to give them, about the axis file's values.
    pub expected: Vec<Estimate>,
    /// Parameters of the model that nothing can show on this axis, and why.
    pub hidden: Vec<(String, String)>,
    /// Nats of information beyond what was believed before.
    pub nats: f64,
    /// The same of each experiment alone, repeated for as long, the best of its sizes; the best experiment first.
    pub alone: Vec<(Named, f64)>,
    /// Experiments that were tried on the virtual axis, and those of them that it can play.
    pub tried: [usize; 2],
    /// What stands in for what the axis file does not say, a line each.
    pub assumed: Vec<String>,
}

/// Proposes a plan. `progress` is called with the share done.
///
/// # Errors
/// The axis file does not say enough, or no experiment can be played within its limits.
pub fn propose(
    given: &AxisFile,
    path: &Path,
    wish: &Wish,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Proposal, InputError> {
    let (file, mut assumed) = completed(given, path);
    let axis = Believed::new(&file, path)?;
    assumed.extend(axis.assumed.iter().cloned());
    let stage = Stage {
        file: &file,
        axis: &axis,
        noise: wish.noise,
        seed: wish.seed,
        path,
    };
    let tried = candidates::candidates(&axis);
    let done = AtomicUsize::new(0);
    let seen = tried
        .par_iter()
        .map(|step| {
            let seen = stage.see(step);
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(0.8 * done as f64 / tried.len() as f64);
            let (plays_s, rests_s) = step.seconds(&axis);
            Ok(seen?.map(|seen| Candidate {
                seconds: plays_s + rests_s,
                step: step.clone(),
                seen,
            }))
        })
        .collect::<Result<Vec<_>, InputError>>()?;
    let candidates: Vec<Candidate> = seen.into_iter().flatten().collect();
    let Some(first) = candidates.first() else {
        return Err(InputError::new(
            path,
            "no experiment can be played within the limits of [drive]",
            "raise travel_limit_rad, speed_limit_rad_s or torque_limit_nm (..._m, ..._m_s, force_limit_n)",
        ));
    };
    let free = &first.seen.free;
    let aim = Aim {
        prior: DMatrix::from_diagonal(&DVector::from_iterator(
            free.len(),
            (0..free.len()).map(|i| {
                let of = |candidate: &Candidate| candidate.seen.free[i].spread.powi(-2);
                candidates.iter().map(of).fold(f64::INFINITY, f64::min)
            }),
        )),
        nuisance: free
            .iter()
            .position(|free| free.owner == Owner::Own(Own::Skew)),
    };
    let mut chosen = aim.choose(&candidates, wish.most_s);
    if chosen.is_empty() {
        let least = candidates.iter().map(|c| c.seconds);
        let least = least.fold(f64::INFINITY, f64::min);
        return Err(InputError::new(
            format!("{} s", wish.most_s),
            format!("the shortest experiment takes {least:.1} s with its rest"),
            "allow more time",
        ));
    }
    let mut total_s = order(&mut chosen, &candidates, &axis);
    while total_s > wish.most_s && chosen.len() > 1 {
        // The last one chosen says least for its time.
        let last = (0..chosen.len()).max_by_key(|&i| chosen[i].turn);
        chosen.remove(last.unwrap_or(0));
        total_s = order(&mut chosen, &candidates, &axis);
    }
    progress(0.85);
    let expected = expected(&stage, &chosen, &candidates)?;
    progress(1.0);
    let whole = chosen.iter().fold(aim.prior.clone(), |sum, choice| {
        sum + &candidates[choice.place].seen.information
    });
    let before = aim.criterion(&aim.prior);
    let mut plan = Plan::new(
        chosen
            .iter()
            .map(|choice| Step {
                why: choice.why(free, axis.unit),
                ..candidates[choice.place].step.clone()
            })
            .collect(),
    );
    plan.most_s = wish.most_s;
    plan.check(&axis, path)?;
    Ok(Proposal {
        total_s,
        model: axis.model,
        expected,
        hidden: hidden(&axis, free.iter().map(|free| free.owner)),
        nats: aim.criterion(&whole) - before,
        alone: aim.alone(&candidates, total_s, before),
        tried: [tried.len(), candidates.len()],
        assumed,
        plan,
    })
}

/// The axis file with what a joint fit frees: an offset, and a fall from stiction.
fn completed(given: &AxisFile, path: &Path) -> (AxisFile, Vec<String>) {
    let mut file = given.clone();
    let mut assumed = Vec::new();
    let model = given.friction.model.filter(|model| MODELS.contains(model));
    if let (Some(model), None) = (given.friction.model, model) {
        assumed.push(format!(
            "{}: identify fits no {} model; the plan is for elasto-plastic",
            path.display(),
            model.name()
        ));
    }
    file.friction.model = Some(model.unwrap_or(FrictionModel::ElastoPlastic));
    let friction = &mut file.friction;
    if let Some(coulomb) = friction.coulomb
        && friction.stiction.is_none_or(|stiction| stiction <= coulomb)
    {
        friction.stiction = Some((1.0 + EXCESS) * coulomb);
        assumed.push(format!(
            "{}: no stiction above Coulomb friction, {} times it assumed",
            path.display(),
            1.0 + EXCESS
        ));
    }
    if !file.effects.iter().any(|effect| effect.id == OFFSET) {
        let name = match file.unit {
            Unit::Rotary => "torque_nm",
            Unit::Linear => "force_n",
        };
        file.effects.push(EffectEntry {
            id: OFFSET.to_string(),
            parameters: vec![(name.to_string(), 0.0)],
        });
    }
    (file, assumed)
}

/// An experiment that can be played.
struct Candidate {
    step: Step,
    seen: Seen,
    /// With its rest.
    seconds: f64,
}

/// An experiment that was chosen.
struct Choice {
    /// Among the candidates.
    place: usize,
    /// When it was chosen.
    turn: usize,
    /// Logarithm by which it narrowed each coordinate's interval then.
    narrowed: Vec<f64>,
}

impl Choice {
    /// What it is for, in words.
    fn why(&self, free: &[Free], unit: Unit) -> String {
        let asked = |i: &usize| free[*i].owner != Owner::Own(Own::Skew);
        let mut order: Vec<usize> = (0..free.len()).filter(asked).collect();
        order.sort_by(|&a, &b| self.narrowed[b].total_cmp(&self.narrowed[a]));
        let most = order.first().map_or(0.0, |&i| self.narrowed[i]);
        let words: Vec<String> = order
            .iter()
            .take(NAMED)
            .filter(|&&i| self.narrowed[i] >= MATTERS * most)
            .map(|&i| {
                let percent = 100.0 * (1.0 - (-self.narrowed[i]).exp());
                format!("{} by {percent:.0} %", shown(&free[i], unit))
            })
            .collect();
        format!("narrows {}", words.join(", "))
    }
}

/// A parameter's name as identification reports it.
fn shown(free: &Free, unit: Unit) -> String {
    match (free.owner, unit) {
        (Owner::Own(Own::StictionExcess), Unit::Rotary) => "stiction_nm".to_string(),
        (Owner::Own(Own::StictionExcess), Unit::Linear) => "stiction_n".to_string(),
        (Owner::Own(_), _) => free.name.clone(),
        _ => "offset".to_string(),
    }
}

/// What is to be large.
struct Aim {
    prior: DMatrix<f64>,
    nuisance: Option<usize>,
}

impl Aim {
    /// Logarithm of the determinant of the information on all but the nuisance, half of it: nats.
    fn criterion(&self, information: &DMatrix<f64>) -> f64 {
        let Some(cholesky) = Cholesky::new(information.clone()) else {
            return f64::NEG_INFINITY;
        };
        let whole: f64 = cholesky.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
        let alone = self
            .nuisance
            .map_or(0.0, |i| 0.5 * information[(i, i)].ln());
        whole - alone
    }

    /// Greedily, as long as one fits into the time that is left.
    fn choose(&self, candidates: &[Candidate], most_s: f64) -> Vec<Choice> {
        let mut whole = self.prior.clone();
        let mut left_s = most_s;
        let mut chosen = Vec::new();
        loop {
            let now = self.criterion(&whole);
            let best = candidates
                .iter()
                .enumerate()
                .filter(|(_, candidate)| candidate.seconds <= left_s)
                .map(|(place, candidate)| {
                    let then = self.criterion(&(&whole + &candidate.seen.information));
                    (place, (then - now) / candidate.seconds)
                })
                .max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((place, _)) = best else {
                return chosen;
            };
            let more = &whole + &candidates[place].seen.information;
            chosen.push(Choice {
                place,
                turn: chosen.len(),
                narrowed: variances(&whole)
                    .iter()
                    .zip(variances(&more).iter())
                    .map(|(before, after)| 0.5 * (before / after).ln())
                    .collect(),
            });
            whole = more;
            left_s -= candidates[place].seconds;
        }
    }

    /// Nats of each experiment alone in as much time.
    fn alone(&self, candidates: &[Candidate], total_s: f64, before: f64) -> Vec<(Named, f64)> {
        let mut alone: Vec<(Named, f64)> = Named::ALL
            .into_iter()
            .filter_map(|named| {
                candidates
                    .iter()
                    .filter(|candidate| Named::of(&candidate.step.experiment) == named)
                    .map(|candidate| {
                        let times = total_s / candidate.seconds;
                        let whole = &self.prior + &candidate.seen.information * times;
                        self.criterion(&whole) - before
                    })
                    .max_by(f64::total_cmp)
                    .map(|nats| (named, nats))
            })
            .collect();
        alone.sort_by(|a, b| b.1.total_cmp(&a.1));
        alone
    }
}

fn variances(information: &DMatrix<f64>) -> DVector<f64> {
    Cholesky::new(information.clone()).map_or_else(
        || DVector::from_element(information.nrows(), f64::INFINITY),
        |cholesky| cholesky.inverse().diagonal(),
    )
}

/// Puts what is alike together, in the order of its first choice, and says how long all takes.
fn order(chosen: &mut [Choice], candidates: &[Candidate], axis: &Believed) -> f64 {
    let first = |place: usize, chosen: &[Choice]| {
        let alike = chosen.iter().filter(|choice| choice.place == place);
        alike.map(|choice| choice.turn).min()
    };
    let firsts: Vec<_> = chosen
        .iter()
        .map(|choice| first(choice.place, chosen))
        .collect();
    let mut keys: Vec<_> = firsts
        .into_iter()
        .zip(chosen.iter().map(|choice| choice.turn))
        .collect();
    keys.sort_unstable();
    let rank = |turn: usize| keys.iter().position(|key| key.1 == turn);
    chosen.sort_by_key(|choice| rank(choice.turn));
    let (mut seconds, mut at_rad) = (0.0, 0.0);
    for choice in chosen.iter() {
        let candidate = &candidates[choice.place];
        if let Some(back_s) = way_back_s(axis, &candidate.step, at_rad) {
            seconds += back_s;
            at_rad = 0.0;
        }
        seconds += candidate.seconds;
        at_rad += candidate.seen.moved_rad;
    }
    seconds
}

/// What identification would say of the chosen experiments' logs, if it came out at the true parameters.
fn expected(
    stage: &Stage<'_>,
    chosen: &[Choice],
    candidates: &[Candidate],
) -> Result<Vec<Estimate>, InputError> {
    let mut places: Vec<usize> = chosen.iter().map(|choice| choice.place).collect();
    places.sort_unstable();
    places.dedup();
    let records = places
        .par_iter()
        .map(|&place| stage.record(&candidates[place].step))
        .collect::<Result<Vec<_>, InputError>>()?;
    let all: Vec<Record> = chosen
        .iter()
        .filter_map(|choice| {
            let at = places.binary_search(&choice.place).ok()?;
            records[at].clone()
        })
        .collect();
    let (data, joint) = stage.judge(all)?;
    let covariance = Covariance::new(&data, &joint).ok_or_else(|| {
        InputError::new(
            stage.path,
            "these experiments leave a parameter without any hold",
            "raise the limits of [drive]",
        )
    })?;
    let none = Bias::none(joint.model.free.len());
    let mut all = estimates(&data, &joint, &covariance, &none);
    all.retain(|estimate| estimate.owner != Owner::Own(Own::Skew));
    Ok(all)
}

/// What the model has and no experiment can show.
fn hidden(axis: &Believed, free: impl Iterator<Item = Owner>) -> Vec<(String, String)> {
    let free: Vec<Owner> = free.collect();
    if !axis.model.has_bristles() || free.contains(&Owner::Own(Own::Stiffness)) {
        return Vec::new();
    }
    let counts = axis.coulomb_nm / axis.stiffness_nm_rad / axis.rad_per_count();
    let why = format!(
        "no experiment: the bristles bend by {counts:.1} counts, and fewer than two say nothing; a finer encoder would show it"
    );
    let mut hidden = vec![Own::Stiffness, Own::Damping];
    if axis.model == FrictionModel::ElastoPlastic {
        hidden.push(Own::BreakawayRatio);
    }
    hidden
        .into_iter()
        .map(|own| (own.name(axis.unit).to_string(), why.clone()))
        .collect()
}
