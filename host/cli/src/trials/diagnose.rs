//! `bristle trials diagnose`: the diagnosis on axes whose effects are known.

use crate::output::{self, Progress};
use bristle_gap::diagnose::{catalogue, search};
use bristle_gap::inverse::Record;
use bristle_gap::report::Table;
use bristle_gap::trial::{self, Trial, Wanted};
use bristle_gap::{Believed, InputError};
use rayon::prelude::*;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Diagnose virtual axes whose effects are known, and count.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle trials diagnose --cases 62\n  bristle trials diagnose --effect \
                        actuator.cogging --share 1 --cases 20\n  bristle trials diagnose --kind clean --cases 50 \
                        --json clean.json"
)]
pub struct Args {
    /// Trials in all; with `--kind effect` they go round the catalogue.
    #[arg(long, default_value_t = 62)]
    cases: usize,
    /// Seed of the first trial; the others follow on.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Gap that an effect makes, as a share of the noise floor (rms).
    #[arg(long, default_value_t = 4.0, value_parser = output::positive)]
    share: f64,
    /// Largest error of a parameter of the axis file.
    #[arg(long, default_value_t = 0.1, value_parser = output::not_negative)]
    parameter_error: f64,
    /// Only this effect.
    #[arg(long, value_name = "ID")]
    effect: Option<String>,
    /// What is on the axis.
    #[arg(long, value_enum, default_value_t = Kind::Effect)]
    kind: Kind,
    /// Every case as JSON, to a file or to standard output (-).
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    /// One effect.
    Effect,
    /// None, and right parameters.
    Clean,
    /// None, and wrong parameters.
    Parameters,
    /// Two effects.
    Pairs,
    /// One that the diagnosis does not know of.
    LeftOut,
}

/// What was there and what came out.
#[derive(Clone, Debug, Serialize)]
struct Case {
    seed: u64,
    truth: Vec<&'static str>,
    share: f64,
    model: String,
    rate_hz: f64,
    experiments: Vec<&'static str>,
    answer: Option<Answer>,
}

#[derive(Clone, Debug, Serialize)]
struct Answer {
    kind: String,
    effects: Vec<String>,
    probability: f64,
    /// Place of the truth among the candidates, from 1.
    place: Option<usize>,
    ranking: Vec<(String, f64)>,
    seconds: f64,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let known: Vec<&'static str> = catalogue().iter().map(|entry| entry.id).collect();
    let ids: Vec<&'static str> = match &args.effect {
        None => known,
        Some(id) => match known.iter().find(|known| *known == id) {
            Some(id) => vec![id],
            None => {
                return Err(InputError::new(
                    format!("--effect {id}"),
                    "does not exist",
                    format!("take one of {}", known.join(", ")),
                ));
            }
        },
    };
    let progress = Progress::new("trials");
    let done = AtomicUsize::new(0);
    let cases: Result<Vec<Case>, InputError> = (0..args.cases)
        .into_par_iter()
        .map(|k| {
            let case = case(args, &ids, k);
            progress.set((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / args.cases as f64);
            case
        })
        .collect();
    drop(progress);
    let cases = cases?;
    output::write_json(args.json.as_deref(), &cases)?;
    if !output::json_on_stdout(args.json.as_deref()) {
        output::print_words(&table(args, &cases));
    }
    Ok(())
}

fn case(args: &Args, ids: &[&'static str], k: usize) -> Result<Case, InputError> {
    let seed = args.seed + k as u64;
    let first = ids[k % ids.len()];
    let effects = match args.kind {
        Kind::Clean | Kind::Parameters => Vec::new(),
        Kind::Effect | Kind::LeftOut => vec![first],
        Kind::Pairs => {
            let all = catalogue();
            let second = all[(k * 7 + 3 + k / all.len()) % all.len()].id;
            if second == first {
                vec![first]
            } else {
                vec![first, second]
            }
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
    let mut case = Case {
        seed,
        truth: wanted.effects.clone(),
        share: 0.0,
        model: String::new(),
        rate_hz: 0.0,
        experiments: Vec::new(),
        answer: None,
    };
    if let Some(trial) = drawn {
        case.share = trial.gap_nm / trial.floor_nm;
        case.model = trial
            .axis
            .friction
            .model
            .map_or(String::new(), |model| model.name().to_string());
        case.rate_hz = 1.0 / trial.logs[0].median_step_s();
        case.experiments = trial.experiments.clone();
        let left_out = (args.kind == Kind::LeftOut).then_some(first);
        case.answer = Some(answer(&trial, left_out)?);
    }
    Ok(case)
}

/// What the diagnosis says. `left_out` is an effect that it may not accuse.
fn answer(trial: &Trial, left_out: Option<&str>) -> Result<Answer, InputError> {
    let start = Instant::now();
    let believed = Believed::new(&trial.axis, &trial.path)?;
    let records = trial
        .logs
        .iter()
        .map(|log| Record::new(log, &trial.axis, &believed, &[]))
        .collect::<Result<Vec<_>, _>>()?;
    let mut list = catalogue();
    list.retain(|entry| Some(entry.id) != left_out);
    let found = search(records, &believed, &list, &|_| ())?;
    let ranking: Vec<(String, f64)> = found
        .single
        .iter()
        .map(|one| (one.ids().join(" + "), one.score - found.base.score))
        .collect();
    let best = ranking.first().filter(|(_, gain)| *gain > LEAST_GAIN);
    let place = |id: &str| ranking.iter().position(|(one, _)| one == id).map(|i| i + 1);
    Ok(Answer {
        kind: if best.is_some() { "effect" } else { "none" }.to_string(),
        effects: best.map(|(id, _)| id.clone()).into_iter().collect(),
        probability: 1.0,
        place: trial.effects.first().and_then(|id| place(id)),
        ranking,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// Gain in held-out log density that an effect must bring.
const LEAST_GAIN: f64 = 10.0;

fn table(args: &Args, cases: &[Case]) -> Table {
    let mut names: Vec<String> = cases.iter().map(|case| case.truth.join(" + ")).collect();
    names.sort_unstable();
    names.dedup();
    let mut rows = Vec::new();
    let mut totals = [0; 5];
    for name in names {
        let of: Vec<&Case> = cases
            .iter()
            .filter(|case| case.truth.join(" + ") == name)
            .collect();
        let mut counts = [0; 5];
        let mut wrong: Vec<String> = Vec::new();
        for case in &of {
            counts[0] += 1;
            let Some(answer) = &case.answer else {
                counts[4] += 1;
                continue;
            };
            let said = answer.effects.join(" + ");
            if said == name {
                counts[1] += 1;
            } else if said.is_empty() {
                counts[3] += 1;
            } else {
                counts[2] += 1;
                let place = answer
                    .place
                    .map_or("-".to_string(), |place| place.to_string());
                wrong.push(format!("{said} (#{}, truth at {place})", case.seed));
            }
        }
        for (total, count) in totals.iter_mut().zip(counts) {
            *total += count;
        }
        rows.push(row(
            if name.is_empty() { "none" } else { &name },
            counts,
            &wrong,
        ));
    }
    rows.push(row("all", totals, &[]));
    let mut seconds: Vec<f64> = cases
        .iter()
        .filter_map(|case| case.answer.as_ref().map(|answer| answer.seconds))
        .collect();
    seconds.sort_by(f64::total_cmp);
    let median = seconds.get(seconds.len() / 2).copied().unwrap_or(0.0);
    Table {
        caption: format!(
            "Gap {} times the floor, seeds from {}; median {} s a case",
            args.share,
            args.seed,
            output::short(median)
        ),
        header: [
            "truth",
            "cases",
            "right",
            "wrong",
            "none",
            "not showable",
            "wrong as",
        ]
        .map(str::to_string)
        .to_vec(),
        rows,
    }
}

fn row(name: &str, counts: [usize; 5], wrong: &[String]) -> Vec<String> {
    let mut row = vec![name.to_string()];
    row.extend(counts.map(|count| count.to_string()));
    row.push(wrong.join("; "));
    row
}
