//! `bristle tune`: gains of position and speed loop from the axis file.

use crate::output::{self, short};
use crate::setup::Setup;
use bristle_core::experiment::End;
use bristle_gap::report::Table;
use bristle_gap::tune::{Tried, Tuned, try_out, tune};
use bristle_gap::{InputError, Unit};
use serde_json::json;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Tune the position and speed loop for an axis file, with the margins that the gains leave, and try them out.
///
/// The speed loop is a PI on the inertia behind the drive's lag and the output's delay. Without --bandwidth-hz it gets as
/// fast as 60 degrees of phase allow, and as the encoder does: a count may not make a torque of more than a quarter of
/// Coulomb friction. The gains are tried on the virtual axis, with the moves of `bristle run moves`, as they are and
/// with half and twice the speed gain.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle tune --axis axes/bench.toml\n  bristle tune --axis axis.toml --bandwidth-hz 30 \
                        --out tuned.toml"
)]
pub struct Args {
    /// Axis file.
    #[arg(long, value_name = "FILE")]
    axis: PathBuf,
    /// Wanted crossover of the speed loop.
    #[arg(long, value_name = "HZ", value_parser = output::positive)]
    bandwidth_hz: Option<f64>,
    /// Write the axis file with the gains in [control].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Also write the result as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let setup = Setup::new(Some(&args.axis))?;
    let tuned = tune(&setup.believed, args.bandwidth_hz.map(|hz| TAU * hz));
    let mut tried = Vec::new();
    for factor in [0.5, 1.0, 2.0] {
        let file = tuned.times(factor).into_file(&setup.file);
        tried.push((factor, try_out(&file, Path::new(&setup.name))?));
    }
    if !output::json_on_stdout(args.json.as_deref()) {
        show(&tuned, &tried, setup.believed.unit);
    }
    if let Some(path) = &args.out {
        let head = format!(
            "Gains by {}, version {}: phase margins {} and {} degrees, gain margin {}.",
            output::command_line(),
            env!("CARGO_PKG_VERSION"),
            short(tuned.speed_phase_deg),
            short(tuned.position_phase_deg),
            short(tuned.speed_gain)
        );
        tuned.into_file(&setup.file).write_under(&[head], path)?;
        if !output::json_on_stdout(args.json.as_deref()) {
            output::print(&format!("axis file: {}\n", path.display()));
        }
    }
    let tried = tried.iter().map(|(factor, tried)| {
        json!({
            "times": factor,
            "end": tried.end.text(),
            "error_rms": tried.error_rad,
            "error_most": tried.most_rad,
            "torque_change_rms": tried.restless_nm,
        })
    });
    let result = json!({
        "schema": 1,
        "bandwidth_hz": tuned.bandwidth_rad_s / TAU,
        "limited_by": tuned.limited_by.name(),
        "position_gain_1_s": tuned.position_gain_1_s,
        "velocity_gain": tuned.velocity_gain_nm_s_rad,
        "velocity_integral_1_s": tuned.velocity_integral_1_s,
        "speed_phase_margin_deg": tuned.speed_phase_deg,
        "speed_gain_margin": tuned.speed_gain,
        "position_phase_margin_deg": tuned.position_phase_deg,
        "tried": tried.collect::<Vec<_>>(),
    });
    output::write_json(args.json.as_deref(), &result)
}

fn show(tuned: &Tuned, tried: &[(f64, Tried)], unit: Unit) {
    let (gain, length, effort) = match unit {
        Unit::Rotary => ("velocity_gain_nm_s_rad", "rad", "N m"),
        Unit::Linear => ("velocity_gain_n_s_m", "m", "N"),
    };
    let caption = format!(
        "Speed loop of {} Hz, {}",
        short(tuned.bandwidth_rad_s / TAU),
        tuned.limited_by.name()
    );
    let rows = [
        ("position_gain_1_s", tuned.position_gain_1_s),
        (gain, tuned.velocity_gain_nm_s_rad),
        ("velocity_integral_1_s", tuned.velocity_integral_1_s),
        (
            "phase margin of the speed loop, degrees",
            tuned.speed_phase_deg,
        ),
        ("gain margin of the speed loop", tuned.speed_gain),
        (
            "phase margin of the position loop, degrees",
            tuned.position_phase_deg,
        ),
    ];
    let table = rows.into_iter().fold(
        Table::new(&caption, &["", "value"]),
        |table, (name, value)| table.row(&[name.to_owned(), short(value)]),
    );
    output::print_table(&table);
    let header = [
        "speed gain times".to_owned(),
        "ended by".to_owned(),
        format!("error rms, {length}"),
        format!("largest, {length}"),
        format!("torque's change a tick, rms {effort}"),
    ];
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let table = tried.iter().fold(
        Table::new("Moves on the virtual axis", &header),
        |table, (factor, tried)| {
            table.row(&[
                short(*factor),
                tried.end.text().to_owned(),
                short(tried.error_rad),
                short(tried.most_rad),
                short(tried.restless_nm),
            ])
        },
    );
    output::print_table(&table);
    if tried.iter().any(|(_, tried)| tried.end != End::Finished) {
        output::notices([&"one of the runs met a bound: take a smaller --bandwidth-hz".to_owned()]);
    }
}
