//! `bristle simulate`: the virtual axis under a recorded or built-in input.

use crate::output::{self, Progress};
use crate::setup::{Real, Setup};
use bristle_gap::experiments::Named;
use bristle_gap::output::{Values, write_columns};
use bristle_gap::simulate::{self, Input, Simulated};
use bristle_gap::{InputError, Log, Unit};
use std::path::PathBuf;

/// Simulate the axis of an axis file and write what its encoder and drive would have recorded.
///
/// The input is a CSV with time_s and an effort column, held from each sample to the next: a measured torque drives the
/// rotor as it is, a reference goes through the drive. With a position reference and no effort, the loop of [control]
/// closes.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle simulate --axis axes/bench.toml --experiment sine --seconds 5 --out \
                        log.csv\n  bristle simulate --axis axis.toml --input log.csv --out again.csv\n  bristle \
                        simulate --axis axis.toml --experiment reversals --seconds 4 --out log.csv --effect \
                        actuator.cogging:amplitude_nm=0.01,order_per_rev=24"
)]
pub struct Args {
    /// Axis file.
    #[arg(long, value_name = "FILE")]
    axis: PathBuf,
    /// What drives the axis: a log, CSV or MCAP, or a CSV with less in it.
    #[arg(
        long,
        value_name = "FILE",
        required_unless_present = "experiment",
        conflicts_with = "experiment"
    )]
    input: Option<PathBuf>,
    /// A built-in experiment instead, sized for the axis.
    #[arg(long, value_name = "NAME", value_parser = named())]
    experiment: Option<String>,
    /// Length of a built-in experiment.
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = output::positive)]
    seconds: f64,
    /// Log to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    real: Real,
    /// Also write the true velocity, deflection and friction, which no log of a real axis has.
    #[arg(long)]
    truth: bool,
}

fn named() -> clap::builder::PossibleValuesParser {
    Named::ALL.map(Named::name).into()
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let mut setup = Setup::new(Some(&args.axis))?;
    setup.believed = args.real.axis(&setup.believed)?;
    let log = args.input.as_ref().map(Log::read_input).transpose()?;
    let experiment = args.experiment.as_deref().and_then(Named::from_name);
    let input = match (&log, experiment) {
        (Some(log), _) => Input::Log(log),
        (None, experiment) => Input::Experiment(experiment.unwrap_or(Named::Sine), args.seconds),
    };
    if let Some(log) = &log {
        output::notices(&log.notices());
    }
    let progress = Progress::new("simulate");
    let simulated = simulate::simulate(
        &input,
        &setup.file,
        &setup.believed,
        args.real.noise(),
        args.real.seed(),
        |share| progress.set(share),
    )?;
    drop(progress);
    write(args, &simulated, setup.believed.unit)?;
    output::print(&format!(
        "{}\nlog: {}\n",
        simulated.timing,
        args.out.display()
    ));
    Ok(())
}

fn write(args: &Args, simulated: &Simulated, unit: Unit) -> Result<(), InputError> {
    let names = match unit {
        Unit::Rotary => [
            "torque_nm",
            "torque_ref_nm",
            "position_rad",
            "position_ref_rad",
            "velocity_rad_s",
            "z_rad",
            "friction_nm",
        ],
        Unit::Linear => [
            "force_n",
            "force_ref_n",
            "position_m",
            "position_ref_m",
            "velocity_m_s",
            "z_m",
            "friction_n",
        ],
    };
    let truth = |values| args.truth.then_some(values);
    let values = [
        Some(&simulated.torque_nm),
        simulated.torque_ref_nm.as_ref(),
        Some(&simulated.position_rad),
        simulated.position_ref_rad.as_ref(),
        truth(&simulated.velocity_rad_s),
        truth(&simulated.z_rad),
        truth(&simulated.friction_nm),
    ];
    let mut columns = vec![("time_s", Values::Numbers(&simulated.time_s))];
    for (name, values) in names.into_iter().zip(values) {
        if let Some(values) = values {
            columns.push((name, Values::Numbers(values)));
        }
    }
    write_columns(&args.out, &columns)
}
