//! `bristle identify`: from logs to an axis file.

mod report;
mod result;
mod steps;

use crate::output::{self, Progress, short};
use bristle_gap::axis_file::FrictionModel;
use bristle_gap::hygiene;
use bristle_gap::identify::joint::{
    self, Errors, Identified, Options, Provenance, Usable, Weighting,
};
use bristle_gap::output::write_atomically;
use bristle_gap::report::Table;
use bristle_gap::{AxisFile, InputError, Log, Unit};
use rayon::prelude::*;
use result::Summary;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Identify an axis from logs: its parameters with an interval and a judgement each, as an axis file.
///
/// Any mix of logs serves; the axis file may hold the inertia alone, as a rough guess. Logs are inspected first: what is
/// wrong with them is named, and what cannot be used is left out. Intervals are at 90 %. A parameter that the logs do not
/// show is called not identifiable, with the experiment that would show it.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle identify --axis axis.toml ladder.csv sine.csv --out fitted.toml\n  bristle \
                        identify --axis axis.toml log.csv --out fitted.toml --model auto --report fit.html\n  bristle \
                        identify --axis axes/emps.toml emps_train.csv --held-out emps_pulses.csv --model \
                        elasto-plastic --with friction.asymmetry --out emps.toml\n  bristle identify --axis \
                        axes/emps.toml emps_train.csv --model coulomb-viscous --plain --out emps.toml"
)]
pub struct Args {
    /// Axis file: rotary or linear, encoder and gains; the inertia may be a guess.
    #[arg(long, value_name = "FILE")]
    axis: PathBuf,
    /// Logs of the axis, CSV or MCAP.
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,
    /// Axis file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Friction model, or auto to have them compared on held-out data; that of the axis file where left out, else auto.
    #[arg(long, value_name = "MODEL", value_parser = models())]
    model: Option<String>,
    /// An effect to identify beside the model, such as friction.asymmetry; may be given several times.
    #[arg(long, value_name = "ID")]
    with: Vec<String>,
    /// Ordinary least squares, as published fits are: all moments weigh alike, effort is taken at the instant of its sample.
    #[arg(long)]
    plain: bool,
    /// A log that takes no part in the fit, to check it; may be given several times.
    #[arg(long, value_name = "LOG")]
    held_out: Vec<PathBuf>,
    /// Also write the result as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Also write a report with plots.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
}

fn models() -> clap::builder::PossibleValuesParser {
    joint::MODELS
        .iter()
        .map(|model| model.name())
        .chain(["auto"])
        .collect::<Vec<_>>()
        .into()
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let axis = AxisFile::read(&args.axis)?;
    let with = joint::entries(&args.with)?;
    let mut notes = Vec::new();
    let usable = usable(&args.logs, &axis, &mut notes)?;
    let withheld = self::usable(&args.held_out, &axis, &mut notes)?;
    let quiet = output::json_on_stdout(args.json.as_deref());
    output::notices(&notes);
    let options = Options {
        model: match &args.model {
            Some(name) => FrictionModel::from_name(name),
            None => axis
                .friction
                .model
                .filter(|model| joint::MODELS.contains(model)),
        },
        with,
        weighting: if args.plain {
            Weighting::Equal
        } else {
            Weighting::Noise
        },
    };
    let progress = Progress::new("identify");
    let identified = joint::identify(&usable, &axis, &args.axis, &options, &|share| {
        progress.set(share);
    })?;
    let held_out = if withheld.is_empty() {
        Vec::new()
    } else {
        let believed = identified.joint.believed();
        let records = joint::records(&withheld, &axis, &believed)?;
        joint::errors(&identified.joint, &records)?
    };
    let steps = steps::all(&usable, &axis);
    drop(progress);

    let provenance = provenance(&usable)?;
    let text = joint::to_toml(&identified.file, &identified.estimates, &provenance);
    // A file that could not be read again is a fault of ours, found before it takes its name.
    AxisFile::parse(&text, &args.out)?;
    let summary = Summary::new(
        &identified,
        &held_out,
        &steps,
        &provenance,
        &notes,
        axis.unit,
    );
    if !quiet {
        show(&identified, &held_out, axis.unit);
    }
    if let Some(path) = &args.report {
        let report = report::report(
            &identified,
            &held_out,
            &steps,
            &provenance,
            &usable,
            &axis,
            &notes,
        );
        output::write_report(path, &report, quiet)?;
    }
    output::write_json(args.json.as_deref(), &summary)?;
    write_atomically(&args.out, |writer| writer.write_all(text.as_bytes()))?;
    if !quiet {
        output::print(&format!("axis file: {}\n", args.out.display()));
    }
    Ok(())
}

/// Reads and inspects logs. What a fit should not see is left out, and a log in which nothing moves beside others; a log
/// that would make it wrong is an error.
fn usable(
    paths: &[PathBuf],
    axis: &AxisFile,
    notes: &mut Vec<String>,
) -> Result<Vec<Usable>, InputError> {
    let logs = paths.par_iter().map(|path| {
        let log = Log::read(path)?;
        let inspected = hygiene::inspect(&log, axis)?;
        Ok((path, log, inspected))
    });
    let mut usable = Vec::new();
    let mut still = None;
    for (path, log, inspected) in logs.collect::<Result<Vec<_>, InputError>>()? {
        notes.extend(log.notices());
        notes.extend(log.disagreement(axis));
        let fatal = inspected
            .findings
            .iter()
            .find(|finding| finding.severity == hygiene::Severity::Fatal);
        if let Some(finding) = fatal {
            let error = finding.error(path);
            if finding.code != hygiene::Code::NeverMoved {
                return Err(error);
            }
            notes.push(format!("left out: {error}"));
            still.get_or_insert(error);
            continue;
        }
        notes.extend(
            inspected
                .findings
                .iter()
                .map(|finding| format!("{}: {finding}", path.display())),
        );
        notes.extend(left_out(path, &log, &inspected.excluded));
        usable.push(Usable {
            excluded: inspected
                .excluded
                .iter()
                .map(|excluded| excluded.samples.clone())
                .collect(),
            log,
        });
    }
    match still {
        Some(error) if usable.is_empty() => Err(error),
        _ => Ok(usable),
    }
}

/// Which stretches of a log no fit sees, and why.
fn left_out(path: &Path, log: &Log, excluded: &[hygiene::Excluded]) -> Option<String> {
    const SHOWN: usize = 5;
    let words: Vec<String> = excluded
        .iter()
        .take(SHOWN)
        .map(|excluded| {
            let last = excluded.samples.end.min(log.len()).saturating_sub(1);
            let (from_s, to_s) = (
                log.time_s[excluded.samples.start.min(last)],
                log.time_s[last],
            );
            format!("{from_s:.4} to {to_s:.4} s ({})", excluded.code.name())
        })
        .collect();
    let more = match excluded.len().saturating_sub(SHOWN) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let path = path.display();
    (!words.is_empty()).then(|| format!("{path}: left out of the fit: {}{more}", words.join(", ")))
}

fn provenance(usable: &[Usable]) -> Result<Provenance, InputError> {
    let logs = usable
        .iter()
        .map(|Usable { log, .. }| Ok((log.file.display().to_string(), sha256(&log.file)?)))
        .collect::<Result<Vec<_>, InputError>>()?;
    Ok(Provenance {
        command: output::command_line(),
        version: env!("CARGO_PKG_VERSION").to_string(),
        date: time::OffsetDateTime::now_utc().date().to_string(),
        logs,
    })
}

pub fn sha256(path: &Path) -> Result<String, InputError> {
    let bytes = std::fs::read(path).map_err(|error| {
        InputError::new(
            path,
            format!("cannot be read: {error}"),
            "name a file that can",
        )
    })?;
    Ok(Sha256::digest(&bytes)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect())
}

fn show(identified: &Identified, held_out: &[Errors], unit: Unit) {
    output::print(&format!("{}\n\n", sentence(identified)));
    output::print_words(&estimates(identified));
    output::print("\n");
    if !identified.compared.is_empty() {
        output::print_table(&compared(identified, unit));
        output::print("\n");
    }
    output::print_table(&errors(&identified.errors, held_out, unit));
}

/// The result in a sentence.
fn sentence(identified: &Identified) -> String {
    let of = |verdict| {
        let names: Vec<&str> = identified
            .estimates
            .iter()
            .filter(|estimate| estimate.verdict == verdict)
            .map(|estimate| estimate.name.as_str())
            .collect();
        names
    };
    use bristle_gap::identify::Verdict;
    let named = |what: &str, names: &[&str]| {
        if names.is_empty() {
            String::new()
        } else {
            format!(" {what}: {}.", names.join(", "))
        }
    };
    format!(
        "{} model: {} of {} parameters identified.{}{}",
        identified.joint.kind.name(),
        of(Verdict::Identified).len(),
        identified.estimates.len(),
        named("Weak", &of(Verdict::Weak)),
        named(
            "Not identifiable from these logs",
            &of(Verdict::NotIdentified)
        ),
    )
}

fn estimates(identified: &Identified) -> Table {
    let mut table = Table::new(
        "Parameters, intervals at 90 %",
        &[
            "parameter",
            "value",
            "from",
            "to",
            "verdict",
            "what would help",
        ],
    );
    let end = |end: Option<f64>| end.map_or("open".to_string(), short);
    for estimate in identified.estimates.iter().chain(&identified.timing) {
        let timing = estimate.name == "skew_s";
        table = table.row(&[
            if timing {
                "effort acts later than recorded by, s".to_string()
            } else {
                estimate.name.clone()
            },
            short(estimate.value),
            end(estimate.low),
            end(estimate.high),
            if timing {
                String::new()
            } else {
                estimate.verdict.name().to_string()
            },
            if timing {
                String::new()
            } else {
                estimate.advice.clone().unwrap_or_default()
            },
        ]);
    }
    table
}

fn compared(identified: &Identified, unit: Unit) -> Table {
    let mut table = Table::new(
        "Models on held-out data: logarithm of the density against the best, the simplest within its error is taken",
        &[
            "model",
            "score",
            "standard error",
            &format!("rest, {} rms", unit.effort()),
        ],
    );
    for model in &identified.compared {
        table = table.row(&[
            model.kind.name().to_string(),
            format!("{:.1}", model.score),
            format!("{:.1}", model.error),
            short(model.rms_nm),
        ]);
    }
    table
}

fn errors(own: &[Errors], held_out: &[Errors], unit: Unit) -> Table {
    let (effort, position) = (unit.effort(), unit.position());
    let mut table = Table::new(
        "Errors",
        &[
            "log",
            "",
            &format!("effort, {effort} rms"),
            "relative, %",
            &format!("position over {} s, {position} rms", joint::WINDOW_S),
            &format!("running freely, {position} rms"),
        ],
    );
    let rows = own
        .iter()
        .map(|errors| (errors, "fitted"))
        .chain(held_out.iter().map(|errors| (errors, "held out")));
    for (errors, role) in rows {
        table = table.row(&[
            errors.log.clone(),
            role.to_string(),
            short(errors.effort_nm),
            format!("{:.2}", 100.0 * errors.relative),
            errors.windowed_rad.map_or("-".to_string(), short),
            short(errors.free_rad),
        ]);
    }
    table
}
