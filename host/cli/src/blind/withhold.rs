//! `bristle blind withhold`: a term taken out of the model of a real axis, and what the diagnosis makes of it.

use super::answer::Answerer;
use super::answerer;
use crate::output::{self, Progress, short};
use bristle_gap::axis_file::{EffectEntry, FrictionModel};
use bristle_gap::report::Table;
use bristle_gap::{AxisFile, InputError, Log};
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Take a term out of an identified axis file, and see whether the diagnosis names it and how much of the gap it wins
/// back.
///
/// The term is an `[[effect]]` of the file, `friction.stribeck` where F_S is above F_C, or `friction.presliding` where the
/// model has bristles. Records after --held-out take no part in the diagnosis.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  bristle identify --axis axes/emps.toml emps_train.csv --out full.toml\n  bristle blind withhold \
                  --term friction.asymmetry --axis full.toml emps_train.csv --held-out emps_pulses.csv"
)]
pub struct Args {
    /// Term to take out.
    #[arg(long, value_name = "ID")]
    term: String,
    /// Identified axis file that has it.
    #[arg(long, value_name = "FILE")]
    axis: PathBuf,
    /// Records for the diagnosis.
    #[arg(required = true, value_name = "LOG")]
    train: Vec<PathBuf>,
    /// Records that take no part in it.
    #[arg(long, value_name = "LOG", num_args = 1..)]
    held_out: Vec<PathBuf>,
    /// Also write the result as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// What came of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Withheld {
    /// What was taken out.
    pub term: String,
    /// The verdict on the reduced file.
    pub verdict: Value,
    /// Candidates in their order.
    pub candidates: Vec<String>,
    /// The term is the first candidate.
    pub named_first: bool,
    /// On the records of the diagnosis: the gaps are the diagnosis's own, on folds that took no part in a fit.
    pub train: WonBack,
    /// On each other record: the gap that the full file leaves, the reduced one, and the reduced one with the first
    /// candidate in it. Inertia and friction are refitted to that record in all three; the candidate is not.
    pub held_out: Vec<(String, WonBack)>,
}

/// Gaps, rms, and the share of what the term makes that is won back.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WonBack {
    /// Of the full file.
    pub full: f64,
    /// Of the file without the term.
    pub reduced: f64,
    /// With the first candidate of the diagnosis in its place.
    pub closed: f64,
    /// (reduced - closed)/(reduced - full); `None` where the term made no gap.
    pub share: Option<f64>,
}

impl WonBack {
    fn new(full: f64, reduced: f64, closed: f64) -> Self {
        let share = (reduced > full).then(|| (reduced - closed) / (reduced - full));
        Self {
            full,
            reduced,
            closed,
            share,
        }
    }
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let axis = AxisFile::read(&args.axis)?;
    let read = |paths: &[PathBuf]| paths.iter().map(Log::read).collect::<Result<Vec<_>, _>>();
    let (train, held_out) = (read(&args.train)?, read(&args.held_out)?);
    let progress = Progress::new("withhold");
    let result = withhold(
        &axis,
        &args.axis,
        &args.term,
        &train,
        &held_out,
        &answerer::answer,
        |share| progress.set(share),
    )?;
    drop(progress);
    if !output::json_on_stdout(args.json.as_deref()) {
        output::print_table(&table(&result));
        let verdict = result.verdict.get("kind").and_then(Value::as_str);
        output::print(&format!(
            "{} is {} candidate{}; the verdict is {}\n",
            result.term,
            if result.named_first {
                "the first"
            } else {
                "NOT the first"
            },
            if result.named_first {
                String::new()
            } else {
                format!(": {}", result.candidates.join(", "))
            },
            verdict.unwrap_or("not given"),
        ));
    }
    output::write_json(args.json.as_deref(), &result)
}

/// Takes the term out, asks, and compares.
pub fn withhold(
    axis: &AxisFile,
    path: &Path,
    term: &str,
    train: &[Log],
    held_out: &[Log],
    answerer: &Answerer,
    progress: impl Fn(f64),
) -> Result<Withheld, InputError> {
    let reduced = without(axis, path, term)?;
    let steps = 2.0 + 3.0 * held_out.len() as f64;
    let full_answer = answerer(axis, train)?;
    progress(1.0 / steps);
    let answer = answerer(&reduced, train)?;
    progress(2.0 / steps);
    let candidates: Vec<&Value> = answer
        .pointer("/candidates")
        .and_then(Value::as_array)
        .into_iter()
        .flatten()
        .collect();
    let ids: Vec<String> = candidates
        .iter()
        .filter_map(|candidate| candidate.get("effect")?.as_str().map(str::to_owned))
        .collect();
    let mut found = reduced.clone();
    if let (Some(id), Some(first)) = (ids.first(), candidates.first()) {
        found.effects.push(entry(id, first));
    }
    let mut others = Vec::new();
    for (i, log) in held_out.iter().enumerate() {
        let mut gaps = [0.0; 3];
        for (j, file) in [axis, &reduced, &found].into_iter().enumerate() {
            gaps[j] = gap(&answerer(file, std::slice::from_ref(log))?, "before")?;
            progress((3.0 + 3.0 * i as f64 + j as f64) / steps);
        }
        others.push((
            log.file.display().to_string(),
            WonBack::new(gaps[0], gaps[1], gaps[2]),
        ));
    }
    Ok(Withheld {
        term: term.to_owned(),
        verdict: answer.get("verdict").cloned().unwrap_or_default(),
        named_first: ids.first().is_some_and(|id| id == term),
        candidates: ids,
        train: WonBack::new(
            gap(&full_answer, "before")?,
            gap(&answer, "before")?,
            candidates
                .first()
                .and_then(|first| first.get("gap_after")?.as_f64())
                .map_or_else(|| gap(&answer, "after"), Ok)?,
        ),
        held_out: others,
    })
}

fn entry(id: &str, candidate: &Value) -> EffectEntry {
    let parameters = candidate
        .get("parameters")
        .and_then(Value::as_object)
        .into_iter()
        .flatten();
    EffectEntry {
        id: id.to_owned(),
        parameters: parameters
            .filter_map(|(name, value)| Some((name.clone(), value.as_f64()?)))
            .collect(),
    }
}

fn gap(answer: &Value, which: &str) -> Result<f64, InputError> {
    answer
        .get("gap")
        .and_then(|gap| gap.get(which))
        .and_then(Value::as_f64)
        .ok_or_else(|| {
            InputError::new(
                "bristle diagnose",
                format!("its answer has no gap.{which}"),
                "run it by hand on the same files",
            )
        })
}

/// The file without a term.
fn without(axis: &AxisFile, path: &Path, term: &str) -> Result<AxisFile, InputError> {
    let mut reduced = axis.clone();
    let friction = &mut reduced.friction;
    let steeper = friction
        .stiction
        .zip(friction.coulomb)
        .is_some_and(|(stiction, coulomb)| stiction > coulomb);
    let bristles = matches!(
        friction.model,
        Some(
            FrictionModel::Dahl
                | FrictionModel::Lugre
                | FrictionModel::ElastoPlastic
                | FrictionModel::Bristle
        )
    );
    reduced.effects.retain(|effect| effect.id != term);
    if reduced.effects.len() < axis.effects.len() {
        return Ok(reduced);
    }
    match term {
        "friction.stribeck" if steeper => {
            friction.stiction = friction.coulomb;
            friction.stribeck_velocity = None;
            friction.stribeck_exponent = None;
        }
        "friction.presliding" if bristles => {
            friction.model = Some(if steeper {
                FrictionModel::Stribeck
            } else {
                FrictionModel::CoulombViscous
            });
            friction.stiffness = None;
            friction.damping = None;
            friction.breakaway_ratio = None;
            friction.dahl_exponent = None;
        }
        _ => {
            let mut has: Vec<&str> = axis
                .effects
                .iter()
                .map(|effect| effect.id.as_str())
                .collect();
            has.extend(steeper.then_some("friction.stribeck"));
            has.extend(bristles.then_some("friction.presliding"));
            return Err(InputError::new(
                path,
                format!("has no term {term} to take out"),
                if has.is_empty() {
                    "identify the axis with more effects first".to_owned()
                } else {
                    format!("it has {}", has.join(", "))
                },
            ));
        }
    }
    Ok(reduced)
}

fn table(result: &Withheld) -> Table {
    let header = [
        "record",
        "gap of the full file",
        "without the term",
        "with the first candidate",
        "won back",
    ];
    let row = |name: &str, won: &WonBack| {
        [
            name.to_owned(),
            short(won.full),
            short(won.reduced),
            short(won.closed),
            won.share
                .map_or("-".to_owned(), |share| format!("{share:.3}")),
        ]
    };
    let table = Table::new(&format!("{} withheld", result.term), &header)
        .row(&row("diagnosis", &result.train));
    result
        .held_out
        .iter()
        .fold(table, |table, (name, won)| table.row(&row(name, won)))
}
