//! `bristle plan`: which experiments to record, and what they will show.

use crate::output::{self, Progress, short};
use crate::setup::Noisy;
use bristle_gap::identify::joint::Estimate;
use bristle_gap::propose::{self, MOST_S, Proposal, Wish};
use bristle_gap::report::Table;
use bristle_gap::{AxisFile, Believed, InputError, Unit};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Propose experiments that show the parameters of an axis best for the time they take.
///
/// Each built-in experiment, in several sizes and lengths within the axis's travel, speed and torque, is played on the
/// virtual axis. What its log would say of each parameter is its information; experiments are added as long as there is
/// time, that one first which adds most for its seconds. The intervals are those that `bristle identify` is expected to
/// give, if the axis is as its file says: a rough file makes a rough plan, and a fitted one a better plan.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle plan --axis axis.toml --out plan.toml\n  bristle plan --axis axis.toml --minutes 1 \
                        --torque-noise-nm 0.002 --out plan.toml\n\nFrom plan to parameters:\n  bristle run plan.toml --axis \
                        axis.toml --out logs\n  bristle identify --axis axis.toml logs/*.csv --out fitted.toml"
)]
pub struct Args {
    /// Axis file: inertia, encoder, Coulomb friction and the limits in [drive]; the better it is, the better the plan.
    #[arg(long, value_name = "FILE")]
    axis: PathBuf,
    /// Plan to write, for `bristle run`.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Longest that all may take, rests and ways back included; at most 4.
    #[arg(long, default_value_t = MOST_S / 60.0, value_parser = minutes)]
    minutes: f64,
    #[command(flatten)]
    noisy: Noisy,
    /// Also write the proposal as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

fn minutes(text: &str) -> Result<f64, String> {
    let minutes = output::positive(text)?;
    if minutes * 60.0 > MOST_S {
        return Err(format!(
            "an axis warms up in more than {} minutes",
            MOST_S / 60.0
        ));
    }
    Ok(minutes)
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let file = AxisFile::read(&args.axis)?;
    let wish = Wish {
        most_s: 60.0 * args.minutes,
        noise: args.noisy.noise(),
        seed: args.noisy.seed,
    };
    let progress = Progress::new("plan");
    let proposal = propose::propose(&file, &args.axis, &wish, &|share| progress.set(share))?;
    drop(progress);
    output::notices(&proposal.assumed);
    let believed = Believed::new(&file, &args.axis)?;
    let quiet = output::json_on_stdout(args.json.as_deref());
    if !quiet {
        show(&proposal, &believed);
    }
    if let Some(path) = &args.out {
        proposal.plan.write(path, &believed)?;
        if !quiet {
            output::print(&format!("plan: {}\n", path.display()));
        }
    }
    output::write_json(args.json.as_deref(), &as_json(&proposal, &believed))
}

fn show(proposal: &Proposal, axis: &Believed) {
    output::print_words(&experiments(proposal, axis));
    output::print("\n");
    output::print_words(&parameters(proposal));
    output::print(&format!("\n{}\n", against_one(proposal)));
}

/// The plan, what is alike in one row.
fn experiments(proposal: &Proposal, axis: &Believed) -> Table {
    let steps = &proposal.plan.steps;
    let [tried, playable] = proposal.tried;
    let mut table = Table::new(
        &format!(
            "{} experiments, {:.1} s with rests and ways back; {playable} of {tried} tried ones stay within the limits",
            steps.len(),
            proposal.total_s
        ),
        &["experiment", "size", "times", "s each", "for"],
    );
    let alike = |a: usize, b: usize| {
        steps[a].experiment == steps[b].experiment && steps[a].bounds == steps[b].bounds
    };
    let mut first = 0;
    while first < steps.len() {
        let times = (first..steps.len())
            .take_while(|&k| alike(first, k))
            .count();
        let step = &steps[first];
        table = table.row(&[
            step.name().to_string(),
            step.size(axis),
            times.to_string(),
            short(step.seconds(axis).0),
            step.why.clone(),
        ]);
        first += times;
    }
    table
}

fn parameters(proposal: &Proposal) -> Table {
    let mut table = Table::new(
        &format!(
            "Expected with the {} model, intervals at 90 %",
            proposal.model.name()
        ),
        &["parameter", "value", "from", "to", "verdict", "why"],
    );
    let end = |end: Option<f64>| end.map_or("open".to_string(), short);
    for estimate in &proposal.expected {
        table = table.row(&[
            estimate.name.clone(),
            short(estimate.value),
            end(estimate.low),
            end(estimate.high),
            estimate.verdict.name().to_string(),
            estimate.advice.clone().unwrap_or_default(),
        ]);
    }
    for (name, why) in &proposal.hidden {
        let nothing = String::new();
        table = table.row(&[
            name.clone(),
            nothing.clone(),
            nothing.clone(),
            nothing,
            "not identifiable".to_string(),
            why.clone(),
        ]);
    }
    table
}

/// What the mix is worth.
fn against_one(proposal: &Proposal) -> String {
    let alone: Vec<String> = proposal
        .alone
        .iter()
        .map(|(named, nats)| format!("{} {nats:.1}", named.name()))
        .collect();
    format!(
        "information: {:.1} nats; of as much time with one experiment alone: {}",
        proposal.nats,
        alone.join(", ")
    )
}

fn as_json(proposal: &Proposal, axis: &Believed) -> Value {
    let steps = proposal.plan.steps.iter().map(|step| {
        let (seconds, rest_s) = step.seconds(axis);
        json!({
            "experiment": step.name(),
            "size": step.size(axis),
            "seconds": seconds,
            "rest_s": rest_s,
            "why": step.why,
        })
    });
    let expected = |estimate: &Estimate| {
        let value = json!({
            "value": estimate.value,
            "low": estimate.low,
            "high": estimate.high,
            "verdict": estimate.verdict.name(),
            "advice": estimate.advice,
        });
        (estimate.name.clone(), value)
    };
    let hidden = proposal.hidden.iter().map(|(name, why)| {
        let value = json!({
            "value": null, "low": null, "high": null, "verdict": "not identifiable", "advice": why,
        });
        (name.clone(), value)
    });
    json!({
        "schema": 1,
        "unit": match axis.unit { Unit::Rotary => "N m", Unit::Linear => "N" },
        "model": proposal.model.name(),
        "total_s": proposal.total_s,
        "experiments": steps.collect::<Vec<_>>(),
        "expected": proposal.expected.iter().map(expected).chain(hidden).collect::<serde_json::Map<_, _>>(),
        "information_nats": proposal.nats,
        "alone_nats": proposal.alone.iter().map(|(named, nats)| (named.name().to_string(), json!(nats)))
            .collect::<serde_json::Map<_, _>>(),
        "notes": proposal.assumed,
    })
}
