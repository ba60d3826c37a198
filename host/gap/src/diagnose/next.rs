//! Which experiment would decide: each built-in one is simulated with the more probable hypothesis on the virtual axis,
//! and the other is fitted to what came out, from what the logs so far have shown. What is left over tells the two apart.
//!
//! T-optimality: Atkinson and Fedorov 1975, Biometrika 62.

use super::apply::axis_file;
use super::held_out::spreads;
use super::hypothesis::Hypothesis;
use super::verdict::{Kind, Verdict};
use super::{NextExperiment, Outcome};
use crate::axis_file::AxisFile;
use crate::believed::{Believed, Noise};
use crate::error::InputError;
use crate::experiments::Named;
use crate::inverse::{Model, Record, fit};
use crate::plan::{Plan, Step, travel_limit_rad};
use crate::signal::rms;
use crate::signal::weighted_squares;
use crate::simulate::{Input, simulate};
use rayon::prelude::*;
use std::path::Path;

/// Tied hypotheses that are told apart; more of them are told apart by the same experiments.
const TIED: usize = 3;
/// Probability of a verdict that needs no other experiment.
const SURE: f64 = 0.75;
/// Nats below which an experiment decides nothing.
const DECIDES: f64 = 3.0;
/// Records are no longer independent sample by sample: of the nodes that overlap in the kernel a third counts.
const INDEPENDENT: f64 = 1.0 / 3.0;

/// An experiment that would decide, and the plan that `bristle run` plays.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// For the diagnosis.
    pub said: NextExperiment,
    /// None where no built-in experiment decides.
    pub plan: Option<Plan>,
}

/// What to record next, where the verdict is unsure or the data do not suffice.
///
/// # Errors
/// The axis file refuses a fitted parameter.
pub fn next(outcome: &Outcome, axis: &AxisFile) -> Result<Option<Proposal>, InputError> {
    let tied = rivals(&outcome.verdict, &outcome.search.base);
    if tied.len() < 2 {
        return Ok(None);
    }
    let mut separations: Vec<(Named, f64)> = Named::ALL
        .par_iter()
        .filter_map(|&named| {
            let mut least = f64::INFINITY;
            for (i, true_one) in tied.iter().enumerate() {
                for other in &tied[i + 1..] {
                    // An experiment that cannot be played on this axis decides nothing.
                    least = least.min(separation(outcome, axis, named, true_one, other).ok()??);
                }
            }
            Some((named, least))
        })
        .collect();
    separations.sort_by(|a, b| b.1.total_cmp(&a.1));
    let names: Vec<String> = tied
        .iter()
        .map(|h| {
            if h.added.is_empty() {
                "the plain simulator".to_string()
            } else {
                h.ids().join(" + ")
            }
        })
        .collect();
    let names = names.join(" and ");
    let Some(&(named, nats)) = separations.first().filter(|(_, nats)| *nats >= DECIDES) else {
        return Ok(Some(Proposal {
            said: NextExperiment {
                why: format!(
                    "No built-in experiment tells {names} apart with these sensors: what they do to effort and motor \
                     position is the same."
                ),
                what:
                    "Record the load's position or a measured torque beside the motor's position."
                        .to_string(),
                experiment: None,
                separation_nats: separations.first().map(|(_, nats)| *nats),
            },
            plan: None,
        }));
    };
    // Simulated noise is nothing but the sensors' own: beyond this a figure says no more.
    let shown = if nats > 1000.0 {
        "over 1000".to_string()
    } else {
        format!("{nats:.0}")
    };
    let believed = Believed::new(axis, Path::new("axis file"))?;
    let mut step = Step::new(named, &believed);
    step.why = format!("tells {names} apart");
    let plan = Plan::new(vec![step]);
    Ok(Some(Proposal {
        said: NextExperiment {
            why: format!(
                "These logs leave it open between {names}. Simulated with the one, the experiment leaves {shown} nats to the other \
                 after all its parameters are fitted anew."
            ),
            what: format!(
                "Run `{}` for {} s: `bristle run {} --axis AXIS --out LOG`, and diagnose with its log beside these.",
                named.name(),
                named.seconds(),
                named.name()
            ),
            experiment: Some(named.name()),
            separation_nats: Some(nats),
        },
        plan: Some(plan),
    }))
}

/// Answers that a next experiment has to tell apart: those that tie, or what an unsure verdict says and the best of what it
/// does not; fewer than two where there is nothing to decide.
fn rivals<'a>(verdict: &'a Verdict, plain: &'a Hypothesis) -> Vec<&'a Hypothesis> {
    let named: Vec<&Hypothesis> = verdict
        .named
        .iter()
        .map(|&place| &verdict.ranked[place].0)
        .collect();
    let others = || {
        let mut others = verdict.ranked.iter().map(|(other, _)| other);
        others.find(|other| {
            other
                .ids()
                .iter()
                .any(|id| named.iter().all(|one| !one.ids().contains(id)))
        })
    };
    match verdict.kind {
        Kind::Ambiguous => named.into_iter().take(TIED).collect(),
        Kind::Insufficient => std::iter::once(plain).chain(others()).collect(),
        _ if verdict.probability > SURE => Vec::new(),
        Kind::Parameters => {
            let better = others().filter(|other| other.score > plain.score);
            std::iter::once(plain).chain(better).collect()
        }
        Kind::Effect | Kind::Effects => {
            let other = others();
            named.into_iter().chain(other).collect()
        }
        Kind::None | Kind::Unknown => Vec::new(),
    }
}

/// Nats by which an experiment on an axis with one hypothesis speaks against the other. None: the axis would leave its
/// limits in it.
fn separation(
    outcome: &Outcome,
    axis: &AxisFile,
    named: Named,
    true_one: &Hypothesis,
    other: &Hypothesis,
) -> Result<Option<f64>, InputError> {
    let path = Path::new("next experiment");
    let real_file = axis_file(axis, true_one);
    let real = Believed::new(&real_file, path)?;
    let plain = Believed::new(axis, path)?;
    Plan::new(vec![Step::new(named, &plain)]).check(&plain, path)?;
    let input = Input::Experiment(named, named.seconds());
    let simulated = simulate(&input, &real_file, &real, Noise::default(), 1, |_| ())?;
    let start = simulated.position_rad[0];
    let travel = simulated
        .position_rad
        .iter()
        .fold(0.0, |most: f64, q| most.max((q - start).abs()));
    let speed = simulated
        .velocity_rad_s
        .iter()
        .fold(0.0, |most: f64, v| most.max(v.abs()));
    if travel > travel_limit_rad(&plain) || speed > plain.speed_limit_rad_s {
        return Ok(None);
    }
    let rms_rad_s = rms(simulated.velocity_rad_s.iter().copied());
    let log = simulated.log(real.unit, path);
    let mut record = Record::new(&log, &real_file, &real, &[])?;
    let seen = &outcome.search.records;
    record.effort_noise_nm = seen.iter().fold(record.effort_noise_nm, |most, r| {
        most.max(r.effort_noise_nm)
    });
    let noise_nm = record.noise_nm(real.whole_inertia_kg_m2(), rms_rad_s);
    let records = [record];
    let weights = vec![INDEPENDENT.sqrt() / noise_nm; records[0].nodes()];
    let own = after(true_one);
    let rest = own.left_over(&records, &true_one.fit.at)?;
    let right = weighted_squares(&rest, &weights);
    let wrong = fit(&after(other), &records, &weights, other.fit.at.clone())?;
    Ok(Some(0.5 * (wrong.cost - right).max(0.0)))
}

/// A hypothesis with what the logs have shown of its parameters as the prior.
fn after(hypothesis: &Hypothesis) -> Model {
    let mut model = hypothesis.model.clone();
    let spreads = spreads(&model, &hypothesis.fit);
    for ((free, spread), at) in model.free.iter_mut().zip(spreads).zip(&hypothesis.fit.at) {
        free.center = *at;
        free.spread = free.spread.min(spread);
    }
    model
}
