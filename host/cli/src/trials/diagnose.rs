//! `bristle trials diagnose`: the diagnosis on axes whose effects are known.

use super::score::{self, Case, Expected};
use crate::output::{self, Progress};
use bristle_gap::diagnose::{Diagnosis, Options, catalogue, diagnose};
use bristle_gap::trial::{self, Trial, Wanted};
use bristle_gap::{Believed, InputError};
use bristle_plant::effect::Entry;
use rayon::prelude::*;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Diagnose virtual axes whose effects are known, and count.
///
/// Every trial is a rotary or linear axis with friction, encoder, noise, control and two to five experiments drawn by its
/// seed. `#` numbers in the table are seeds: --cases 1 --seed N --effect ID draws that trial again.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle trials diagnose --cases 62\n  bristle trials diagnose --effect \
                        actuator.cogging --share 1 --cases 20\n  bristle trials diagnose --kind clean --cases 50 \
                        --json clean.json\n  bristle trials diagnose --cases 310 --docs docs/diagnosis.md"
)]
pub struct Args {
    /// Trials in all; they go round the catalogue.
    #[arg(long, default_value_t = 62)]
    cases: usize,
    /// Seed of the first trial; the others follow on.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Gap that an effect makes, as a share of the floor (rms).
    #[arg(long, default_value_t = 4.0, value_parser = output::positive)]
    share: f64,
    /// Largest error of a parameter of the axis file, as a share of it; clean axes have none.
    #[arg(long, default_value_t = 0.1, value_parser = output::not_negative)]
    parameter_error: f64,
    /// Only this effect, or beside it a second one with --kind pairs.
    #[arg(long, value_name = "ID")]
    effect: Option<String>,
    /// What is on the axes.
    #[arg(long, value_enum, default_value_t = Kind::Effect)]
    kind: Kind,
    /// One trial after the other, so that the time of each is its own.
    #[arg(long)]
    timed: bool,
    /// Every case with its whole diagnosis as JSON, to a file or to standard output (-).
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// A Markdown file that takes the tables: between the marks of this kind and share, or at its end.
    #[arg(long, value_name = "FILE")]
    docs: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    /// One effect.
    Effect,
    /// No effect, and right parameters.
    Clean,
    /// No effect, and wrong parameters.
    Parameters,
    /// Two effects.
    Pairs,
    /// One effect, which the diagnosis does not know of.
    LeftOut,
}

impl Kind {
    fn expected(self) -> Expected {
        match self {
            Self::Effect | Self::Pairs => Expected::Effects,
            Self::Clean => Expected::None,
            Self::Parameters => Expected::Parameters,
            Self::LeftOut => Expected::Unknown,
        }
    }

    fn title(self, args: &Args) -> String {
        let gap = format!("gap {} times the floor", args.share);
        match self {
            Self::Effect => format!("One effect, {gap}"),
            Self::Clean => "No effect, right parameters".to_string(),
            Self::Parameters => format!(
                "No effect, parameters wrong by up to {} %",
                100.0 * args.parameter_error
            ),
            Self::Pairs => format!("Two effects, each with a {gap}"),
            Self::LeftOut => format!("An effect that the catalogue lacks, {gap}"),
        }
    }
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let ids = ids(args.effect.as_deref())?;
    let progress = Progress::new("trials");
    let done = AtomicUsize::new(0);
    let one = |k: usize| {
        let case = case(args, &ids, k);
        progress.set((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / args.cases as f64);
        case
    };
    let cases: Result<Vec<Case>, InputError> = if args.timed {
        (0..args.cases).map(one).collect()
    } else {
        (0..args.cases).into_par_iter().map(one).collect()
    };
    drop(progress);
    let cases = cases?;
    output::write_json(args.json.as_deref(), &cases)?;
    let tables = score::tables(&args.kind.title(args), &cases);
    if !output::json_on_stdout(args.json.as_deref()) {
        for table in &tables {
            output::print_words(table);
        }
    }
    match &args.docs {
        Some(path) => score::write_docs(
            path,
            &output::command_line(),
            &args.kind.title(args),
            &tables,
        ),
        None => Ok(()),
    }
}

fn ids(only: Option<&str>) -> Result<Vec<&'static str>, InputError> {
    let known: Vec<&'static str> = catalogue().iter().map(|entry| entry.id).collect();
    let Some(id) = only else {
        return Ok(known);
    };
    match known.iter().find(|known| **known == id) {
        Some(id) => Ok(vec![id]),
        None => Err(InputError::new(
            format!("--effect {id}"),
            "does not exist",
            format!("take one of {}", known.join(", ")),
        )),
    }
}

fn case(args: &Args, ids: &[&'static str], k: usize) -> Result<Case, InputError> {
    let seed = args.seed + k as u64;
    // The seed and not the place says which effect, so that a trial of a run can be drawn again alone.
    let turn = seed as usize;
    let first = ids[turn % ids.len()];
    let effects = match args.kind {
        Kind::Clean | Kind::Parameters => Vec::new(),
        Kind::Effect | Kind::LeftOut => vec![first],
        Kind::Pairs => {
            // A different partner on every way round the catalogue.
            let others: Vec<&'static str> = catalogue()
                .iter()
                .map(|entry| entry.id)
                .filter(|id| *id != first)
                .collect();
            vec![
                first,
                others[(7 * turn + turn / others.len()) % others.len()],
            ]
        }
    };
    let wanted = Wanted {
        effects,
        share: args.share,
        parameter_error: if args.kind == Kind::Clean {
            0.0
        } else {
            args.parameter_error
        },
    };
    let drawn = trial::draw(seed, &wanted)?;
    let left_out = (args.kind == Kind::LeftOut).then_some(first);
    let start = Instant::now();
    let diagnosis = drawn.as_ref().map(|trial| answer(trial, left_out));
    let seconds = start.elapsed().as_secs_f64();
    let alike = match (&drawn, &diagnosis) {
        (Some(trial), Some(Ok(said))) => alike(trial, &said.verdict.effects)?,
        _ => Vec::new(),
    };
    Ok(Case::new(
        seed,
        &wanted.effects,
        drawn.as_ref(),
        diagnosis,
        alike,
        seconds,
        args.kind.expected(),
    ))
}

/// What the diagnosis says. `left_out` is an effect that it may not accuse.
fn answer(trial: &Trial, left_out: Option<&str>) -> Result<Diagnosis, InputError> {
    let believed = Believed::new(&trial.axis, &trial.path)?;
    let mut options = Options::default();
    options.catalogue.retain(|entry| Some(entry.id) != left_out);
    let outcome = diagnose(&trial.logs, &trial.axis, &believed, &options, &|_| ())?;
    Ok(outcome.diagnosis)
}

/// Of what was named those that these experiments cannot tell from each effect that is there: only of these it is asked, since it does not
/// depend on what was said.
fn alike(trial: &Trial, said: &[String]) -> Result<Vec<Vec<&'static str>>, InputError> {
    let named = |entry: &&'static Entry| said.iter().any(|id| id == entry.id);
    let of = |(place, id): (usize, &&str)| {
        let mut alike = Vec::new();
        for entry in catalogue().into_iter().filter(named) {
            if entry.id != *id && trial.are_alike(place, entry)? {
                alike.push(entry.id);
            }
        }
        Ok(alike)
    };
    trial.effects.iter().enumerate().map(of).collect()
}
