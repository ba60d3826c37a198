//! `bristle diagnose`: where simulation and measurement part, which effect causes it, how far the gap shrinks with it.

use crate::output::{self, Progress};
use crate::setup::Setup;
use bristle_gap::diagnose::{
    Context, Diagnosis, Options, Outcome, catalogue, diagnose, next, report, reproduced,
};
use bristle_gap::feed_forward::Table;
use bristle_gap::report::Table as Words;
use bristle_gap::{Believed, InputError, Log};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Say where the axis and its simulator part, which unmodelled effect causes it, and how far the gap shrinks with it.
///
/// The simulator's own parameters are refitted first, so that a wrong number never counts as an effect. Then every effect
/// of the catalogue is fitted jointly with them and judged on data that took no part. The answer may be that nothing is
/// missing, that several effects explain the data alike, or that none does.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle diagnose --axis axis.toml log.csv\n  bristle diagnose --axis axis.toml \
                        ladder.csv sine.csv moves.csv --json result.json --report result.html\n  bristle diagnose \
                        --axis axis.toml log.csv --without actuator.ripple --apply better.toml\n  bristle diagnose \
                        --axis axis.toml log.csv --plan-out next.toml --feed-forward table.toml"
)]
pub struct Args {
    /// Axis file: what the simulator believes.
    #[arg(long, value_name = "FILE")]
    axis: PathBuf,
    /// Logs of the axis, CSV or MCAP, best of several experiments.
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// An effect that is not to be accused; may be given several times.
    #[arg(long, value_name = "ID", value_parser = effect_id())]
    without: Vec<String>,
    /// Write the result as JSON to a file, or - for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write a report as HTML.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write the axis file with its parameters refitted and the named effects added.
    #[arg(long, value_name = "FILE")]
    apply: Option<PathBuf>,
    /// Write the plan of the next experiment for `bristle run`, where one would decide.
    #[arg(long, value_name = "FILE")]
    plan_out: Option<PathBuf>,
    /// Write a feed-forward table of the named effects, where a controller can cancel them.
    #[arg(long, value_name = "FILE")]
    feed_forward: Option<PathBuf>,
}

fn effect_id() -> clap::builder::PossibleValuesParser {
    catalogue()
        .iter()
        .map(|entry| entry.id)
        .collect::<Vec<_>>()
        .into()
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let setup = Setup::new(Some(&args.axis))?;
    let logs = args
        .logs
        .par_iter()
        .map(Log::read)
        .collect::<Result<Vec<_>, _>>()?;
    for log in &logs {
        output::notices(&log.notices());
        output::notices(&log.disagreement(&setup.file));
    }
    let options = Options {
        catalogue: catalogue()
            .into_iter()
            .filter(|entry| args.without.iter().all(|id| id != entry.id))
            .collect(),
    };
    let progress = Progress::new("diagnose");
    let mut outcome = diagnose(&logs, &setup.file, &setup.believed, &options, &|share| {
        progress.set(share);
    })?;
    outcome.diagnosis.reproduced = reproduced(&outcome)?;
    let proposal = next(&outcome, &setup.file)?;
    outcome.diagnosis.next_experiment = proposal.as_ref().map(|p| p.said.clone());
    drop(progress);
    let quiet = output::json_on_stdout(args.json.as_deref());
    if !quiet {
        show(&outcome.diagnosis);
    }
    output::write_json(args.json.as_deref(), &outcome.diagnosis)?;
    if let Some(path) = &args.report {
        let page = report(&outcome, &context(args, &setup, &logs));
        output::write_report(path, &page, quiet)?;
    }
    if let Some(path) = &args.apply {
        apply(args, &outcome, &setup, path)?;
    }
    let say = |what: String| {
        if !quiet {
            output::print(&what);
        }
    };
    if let Some(path) = &args.plan_out {
        match proposal.and_then(|proposal| proposal.plan) {
            Some(plan) => {
                plan.write(path, &setup.believed)?;
                say(format!("plan: {}\n", path.display()));
            }
            None => say(format!(
                "plan: none written to {}, no built-in experiment is needed or would decide\n",
                path.display()
            )),
        }
    }
    if let Some(path) = &args.feed_forward {
        feed_forward(args, &outcome, &setup, path, &say)?;
    }
    Ok(())
}

fn context(args: &Args, setup: &Setup, logs: &[Log]) -> Context {
    let fact = |name: &str, value: String| (name.to_string(), value);
    let mut facts = vec![
        fact("command", output::command_line()),
        fact("version", env!("CARGO_PKG_VERSION").to_string()),
        fact("axis", setup.name.clone()),
    ];
    facts.extend(
        args.logs
            .iter()
            .map(|path| fact("log", path.display().to_string())),
    );
    let notices = logs.iter().flat_map(Log::notices);
    Context {
        axis: setup.name.clone(),
        facts,
        hygiene: notices.chain(setup.believed.assumed.clone()).collect(),
    }
}

fn feed_forward(
    args: &Args,
    outcome: &Outcome,
    setup: &Setup,
    path: &Path,
    say: &dyn Fn(String),
) -> Result<(), InputError> {
    let applied = Believed::new(&outcome.applied(&setup.file).axis, &args.axis)?;
    let scale = &outcome.search.scale;
    match Table::new(&applied, [scale.lowest_rad, scale.highest_rad])? {
        Some(table) => {
            let head = [
                format!(
                    "Written by bristle {}: {}",
                    env!("CARGO_PKG_VERSION"),
                    output::command_line()
                ),
                format!("cancels {}", table.effects.join(", ")),
            ];
            table.write(&head, applied.unit, path)?;
            say(format!("feed-forward: {}\n", path.display()));
        }
        None => say(format!(
            "feed-forward: none written to {}, no named effect can be cancelled by position and direction\n",
            path.display()
        )),
    }
    Ok(())
}

fn apply(args: &Args, outcome: &Outcome, setup: &Setup, path: &Path) -> Result<(), InputError> {
    let applied = outcome.applied(&setup.file);
    let mut head = vec![
        format!(
            "Written by bristle {}: {}",
            env!("CARGO_PKG_VERSION"),
            output::command_line()
        ),
        format!("from {}", setup.name),
        outcome.diagnosis.sentence(),
    ];
    head.extend(applied.provenance);
    applied.axis.write_under(&head, path)?;
    if !output::json_on_stdout(args.json.as_deref()) {
        output::print(&format!("axis file: {}\n", path.display()));
    }
    Ok(())
}

/// What the named effects make of each view of the logs.
fn views(diagnosis: &Diagnosis) -> Words {
    let mut table = Words::new(
        "Error by view, log and regime (rms)",
        &[
            "view",
            "log",
            "regime",
            "effect",
            "refitted",
            "with effect",
            "closed",
            "",
        ],
    );
    for row in &diagnosis.reproduced {
        table = table.row(&[
            row.view.clone(),
            row.log.clone(),
            row.regime.to_string(),
            row.effect.clone(),
            format!("{} {}", output::short(row.before), row.unit),
            format!("{} {}", output::short(row.after), row.unit),
            format!("{:.2}", row.closed_fraction.value),
            if row.worse { "worse" } else { "" }.to_string(),
        ]);
    }
    table
}

fn show(diagnosis: &Diagnosis) {
    let gap = &diagnosis.gap;
    output::print(&format!("{}\n\n", diagnosis.sentence()));
    let drift = gap.drift.map_or(String::new(), |drift| {
        format!(", {} slow drift", output::short(drift))
    });
    output::print(&format!(
        "gap {} {} before, {} after, {} floor{drift} (rms, held out)\n\n",
        output::short(gap.before),
        gap.unit,
        output::short(gap.after),
        output::short(gap.floor)
    ));
    let mut table = Words::new(
        "Candidates",
        &["effect", "probability", "gap after", "closed", "parameters"],
    );
    for candidate in diagnosis.candidates.iter().take(8) {
        let parameters: Vec<String> = candidate
            .parameters
            .iter()
            .map(|(name, value)| format!("{name} {}", output::short(*value)))
            .collect();
        table = table.row(&[
            candidate.effect.clone(),
            format!("{:.3}", candidate.probability),
            output::short(candidate.gap_after),
            format!(
                "{:.2} ({:.2} to {:.2})",
                candidate.closed_fraction.value,
                candidate.closed_fraction.low,
                candidate.closed_fraction.high
            ),
            parameters.join(", "),
        ]);
    }
    output::print_words(&table);
    output::print("\n");
    if !diagnosis.reproduced.is_empty() {
        output::print_words(&views(diagnosis));
        output::print("\n");
    }
    if let Some(credit) = diagnosis.credit_sentence() {
        output::print(&format!("{credit}\n"));
    }
    // What is most concentrated along each axis says more than many parts of one.
    let mut axes = Vec::new();
    for region in diagnosis.concentrated() {
        if axes.len() < 6 && !axes.contains(&region.axis) {
            axes.push(region.axis);
            output::print(&format!(
                "where: {} (by chance {})\n",
                region.sentence(),
                region.chance()
            ));
        }
    }
    if axes.is_empty() {
        output::print("where: nowhere by more than chance\n");
    }
    for group in &diagnosis.confusable {
        output::print(&format!(
            "these data cannot tell apart: {}\n",
            group.join(" and ")
        ));
    }
    if let Some(next) = &diagnosis.next_experiment {
        output::print(&format!("next: {} {}\n", next.why, next.what));
    }
    output::notices(&diagnosis.notes);
}
