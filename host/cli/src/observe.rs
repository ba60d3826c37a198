//! `bristle observe`: both observers over a recorded log.

use crate::output::{self, Progress, short};
use crate::setup::Setup;
use bristle_gap::observe::{self, Distance, Observed, Options, distance};
use bristle_gap::output::{Values, write_columns};
use bristle_gap::report::{Plot, Report, Table};
use bristle_gap::{InputError, Log, Unit};
use serde::Serialize;
use std::path::PathBuf;

/// Run both observers over a recorded log and compare them with its zero-phase derivative and force balance.
///
/// Velocity is held against the zero-phase filtered derivative of position, friction against effort less inertia times
/// acceleration. Neither reference can run in real time; they look ahead.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle observe --axis axes/emps.toml emps_train.csv --out states.csv\n  bristle \
                        observe --axis axis.toml log.csv.gz --out states.csv --report observe.html --rate-hz 10000"
)]
pub struct Args {
    /// Axis file.
    #[arg(long, value_name = "FILE")]
    axis: PathBuf,
    /// Log to read, CSV or MCAP.
    log: PathBuf,
    /// States to write, one row a sample.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Samples a second of the observers; that of the axis file, or else of the log, where left out.
    #[arg(long, value_name = "HZ", value_parser = output::positive)]
    rate_hz: Option<f64>,
    /// Cut-off of the zero-phase filter.
    #[arg(long, value_name = "HZ", default_value_t = 50.0, value_parser = output::positive)]
    cutoff_hz: f64,
    /// Also write a report with plots.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Also write the distances as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Row {
    signal: &'static str,
    against: &'static str,
    rms: f64,
    relative: f64,
    correlation: f64,
}

#[derive(Serialize)]
struct Summary {
    resampling: String,
    rate_hz: f64,
    samples: usize,
    stretches: usize,
    rejected: [u32; 2],
    rows: Vec<Row>,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let setup = Setup::new(Some(&args.axis))?;
    let log = Log::read(&args.log)?;
    output::notices(&log.notices());
    output::notices(&log.disagreement(&setup.file));
    let progress = Progress::new("observe");
    let options = Options {
        rate_hz: args.rate_hz,
        cutoff_hz: args.cutoff_hz,
    };
    let observed = observe::observe(&log, &setup.file, &setup.believed, &options, |share| {
        progress.set(share);
    })?;
    drop(progress);
    let unit = setup.believed.unit;
    let summary = summarise(&observed);
    let table = table(&summary, unit);
    write_states(args, &observed, unit)?;
    let quiet = output::json_on_stdout(args.json.as_deref());
    if !quiet {
        output::print(&format!("resampling: {}\n", observed.resampling));
        output::print_table(&table);
        output::print(&format!("states: {}\n", args.out.display()));
    }
    output::write_json(args.json.as_deref(), &summary)?;
    match &args.report {
        Some(path) => output::write_report(path, &report(args, &observed, table, &setup), quiet),
        None => Ok(()),
    }
}

fn summarise(observed: &Observed) -> Summary {
    const VELOCITY: &str = "zero-phase filtered derivative";
    const FRICTION: &str = "effort less inertia";
    let row = |signal, against, distance: Distance| Row {
        signal,
        against,
        rms: distance.rms,
        relative: distance.relative,
        correlation: distance.correlation,
    };
    let velocity = |signal| distance(signal, &observed.reference_velocity_rad_s);
    let friction = |signal| distance(signal, &observed.reference_friction_nm);
    Summary {
        resampling: observed.resampling.clone(),
        rate_hz: observed.rate_hz,
        samples: observed.time_s.len(),
        stretches: observed.stretches,
        rejected: observed.rejected,
        rows: vec![
            row(
                "velocity, plain difference",
                VELOCITY,
                velocity(&observed.difference_rad_s),
            ),
            row(
                "velocity, Luenberger-like",
                VELOCITY,
                velocity(&observed.velocity_rad_s),
            ),
            row(
                "friction, Luenberger-like",
                FRICTION,
                friction(&observed.luenberger_friction_nm),
            ),
            row(
                "friction, discrete time-free",
                FRICTION,
                friction(&observed.time_free_friction_nm),
            ),
        ],
    }
}

fn table(summary: &Summary, unit: Unit) -> Table {
    let caption = format!(
        "{} samples at {} Hz in {} stretch(es); rejected: {} Luenberger-like, {} time-free",
        summary.samples,
        summary.rate_hz,
        summary.stretches,
        summary.rejected[0],
        summary.rejected[1],
    );
    let mut table = Table::new(
        &caption,
        &["signal", "against", "rms", "relative", "correlation"],
    );
    for row in &summary.rows {
        let symbol = if row.signal.starts_with("velocity") {
            format!("{}/s", unit.position())
        } else {
            unit.effort().to_string()
        };
        table = table.row(&[
            row.signal.to_string(),
            row.against.to_string(),
            format!("{} {symbol}", short(row.rms)),
            format!("{} %", short(100.0 * row.relative)),
            format!("{:.5}", row.correlation),
        ]);
    }
    table
}

fn write_states(args: &Args, observed: &Observed, unit: Unit) -> Result<(), InputError> {
    let name = |what: &str, quantity: Quantity| format!("{what}_{}", quantity.suffix(unit));
    use Quantity::{Effort, Position, Velocity};
    let columns = [
        ("time_s".to_string(), &observed.time_s),
        (name("position", Position), &observed.position_rad),
        (name(effort_name(unit), Effort), &observed.torque_nm),
        (name("velocity", Velocity), &observed.velocity_rad_s),
        (
            name("velocity_reference", Velocity),
            &observed.reference_velocity_rad_s,
        ),
        (name("z_luenberger", Position), &observed.luenberger_z_rad),
        (name("z_time_free", Position), &observed.time_free_z_rad),
        (
            name("friction_luenberger", Effort),
            &observed.luenberger_friction_nm,
        ),
        (
            name("friction_time_free", Effort),
            &observed.time_free_friction_nm,
        ),
        (
            name("friction_reference", Effort),
            &observed.reference_friction_nm,
        ),
    ];
    let columns: Vec<(&str, Values<'_>)> = columns
        .iter()
        .map(|(name, values)| (name.as_str(), Values::Numbers(values)))
        .collect();
    write_columns(&args.out, &columns)
}

#[derive(Clone, Copy)]
enum Quantity {
    Position,
    Velocity,
    Effort,
}

impl Quantity {
    fn suffix(self, unit: Unit) -> &'static str {
        match (self, unit) {
            (Self::Position, Unit::Rotary) => "rad",
            (Self::Position, Unit::Linear) => "m",
            (Self::Velocity, Unit::Rotary) => "rad_s",
            (Self::Velocity, Unit::Linear) => "m_s",
            (Self::Effort, Unit::Rotary) => "nm",
            (Self::Effort, Unit::Linear) => "n",
        }
    }
}

fn effort_name(unit: Unit) -> &'static str {
    match unit {
        Unit::Rotary => "torque",
        Unit::Linear => "force",
    }
}

fn report(args: &Args, observed: &Observed, table: Table, setup: &Setup) -> Report {
    let unit = setup.believed.unit;
    let speed = format!("{}/s", unit.position());
    let over_time = |title: &str| Plot::over("time", "s", &observed.time_s).title(title);
    let friction = distance(
        &observed.luenberger_friction_nm,
        &observed.reference_friction_nm,
    );
    Report::new("Both observers on a record")
        .lead(&format!(
            "The Luenberger-like observer's friction follows effort less inertia with a correlation of {:.4}, {} {} rms \
             apart.",
            friction.correlation,
            short(friction.rms),
            unit.effort(),
        ))
        .table(table)
        .plot(
            over_time("Velocity")
                .y("velocity", &speed)
                .line("zero-phase derivative", &observed.reference_velocity_rad_s)
                .line("Luenberger-like", &observed.velocity_rad_s),
        )
        .plot(
            over_time("Friction")
                .y("friction", unit.effort())
                .line("effort less inertia", &observed.reference_friction_nm)
                .line("Luenberger-like", &observed.luenberger_friction_nm)
                .line("discrete time-free", &observed.time_free_friction_nm),
        )
        .plot(
            over_time("Bristle deflection z")
                .y("z", unit.position())
                .line("Luenberger-like", &observed.luenberger_z_rad)
                .line("discrete time-free", &observed.time_free_z_rad),
        )
        .plot(
            Plot::xy("velocity", &speed)
                .title("Friction over velocity")
                .y("friction", unit.effort())
                .line(
                    "effort less inertia",
                    &observed.reference_velocity_rad_s,
                    &observed.reference_friction_nm,
                )
                .line(
                    "Luenberger-like",
                    &observed.velocity_rad_s,
                    &observed.luenberger_friction_nm,
                ),
        )
        .facts(&[
            ("command", &output::command_line()),
            ("version", env!("CARGO_PKG_VERSION")),
            ("log", &args.log.display().to_string()),
            ("axis", &setup.name),
            ("resampling", &observed.resampling),
            ("cut-off of the references", &format!("{} Hz", args.cutoff_hz)),
        ])
}
