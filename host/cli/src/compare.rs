//! `bristle compare`: LuGre against the elasto-plastic model in the two experiments of the thesis.

use crate::output::{self, Progress, short};
use crate::setup::Setup;
use bristle_core::experiment::{Experiment, Player, Reference};
use bristle_gap::InputError;
use bristle_gap::axis_file::FrictionModel;
use bristle_gap::believed::Noise;
use bristle_gap::experiments::Named;
use bristle_gap::report::{Plot, Report, Table};
use bristle_gap::signal::{rms, samples};
use bristle_plant::Rig;
use serde::Serialize;
use std::path::PathBuf;

/// Compare LuGre with the elasto-plastic model: drift under a small oscillating torque, and velocity reversals in closed
/// loop.
///
/// First a torque pulse past break-away, rest, then an oscillation that stays below break-away: an axis that sticks
/// should stay where it is. Then a position sine in closed loop, with the loop of friction over position.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle compare\n  bristle compare --axis axis.toml --seconds 60 --report compare.html"
)]
pub struct Args {
    /// Axis file; the built-in bench axis where left out.
    #[arg(long, value_name = "FILE")]
    axis: Option<PathBuf>,
    /// Length of the oscillation over which drift is measured.
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = output::positive)]
    seconds: f64,
    /// Report to write.
    #[arg(long, value_name = "FILE", default_value = "compare.html")]
    report: PathBuf,
    /// Also write the figures as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

const MODELS: [FrictionModel; 2] = [FrictionModel::Lugre, FrictionModel::ElastoPlastic];

#[derive(Serialize)]
struct Row {
    model: &'static str,
    /// Drift in a minute over z_ss.
    drift_share_of_z_ss_per_minute: f64,
    tracking_error_rms_rad: f64,
    tracking_error_worst_rad: f64,
}

/// Signals of one model.
#[derive(Default)]
struct Run {
    time_s: Vec<f64>,
    position_rad: Vec<f64>,
    friction_nm: Vec<f64>,
    velocity_rad_s: Vec<f64>,
    reference_rad: Vec<f64>,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let setup = Setup::new(args.axis.as_ref())?;
    let z_ss = setup.believed.coulomb_nm / setup.believed.stiffness_nm_rad;
    let progress = Progress::new("compare");
    // Pulse, rest and one second of settling come before the drift is measured.
    let settle_s = pulse_ticks(&setup).0 as f64 / setup.believed.rate_hz + 1.0;
    let mut rows = Vec::new();
    let mut pulses = Vec::new();
    let mut reversals = Vec::new();
    for (i, model) in MODELS.into_iter().enumerate() {
        let pulse = play(
            &setup,
            model,
            Named::Pulse,
            settle_s + args.seconds,
            |share| {
                progress.set((i as f64 + 0.9 * share) / 2.0);
            },
        )?;
        let reversal = play(&setup, model, Named::Reversals, 4.0, |_| {})?;
        let errors = || {
            let pairs = reversal.position_rad.iter().zip(&reversal.reference_rad);
            // After the first half second, in which the loop catches up with a reference that starts at speed.
            pairs
                .skip((0.5 * setup.believed.rate_hz) as usize)
                .map(|(q, r)| q - r)
        };
        rows.push(Row {
            model: model.name(),
            drift_share_of_z_ss_per_minute: drift(&setup, &pulse, settle_s) * 60.0 / z_ss,
            tracking_error_rms_rad: rms(errors()),
            tracking_error_worst_rad: errors().map(f64::abs).fold(0.0, f64::max),
        });
        pulses.push(pulse);
        reversals.push(reversal);
    }
    drop(progress);
    let table = table(&rows, &setup);
    let quiet = output::json_on_stdout(args.json.as_deref());
    if !quiet {
        output::print_table(&table);
    }
    output::write_json(args.json.as_deref(), &rows)?;
    let report = report(&setup, table, &rows, &pulses, &reversals, z_ss);
    output::write_report(&args.report, &report, quiet)
}

fn play(
    setup: &Setup,
    model: FrictionModel,
    named: Named,
    seconds: f64,
    progress: impl Fn(f64),
) -> Result<Run, InputError> {
    let believed = &setup.believed;
    let step_s = setup.sample_time_s();
    let tick = believed.tick::<f32>(step_s)?;
    let axis = believed.axis(model, step_s, Noise::default(), 1)?;
    let mut rig = Rig::new(tick, axis, named.experiment(believed, believed.rate_hz));
    let ticks = samples(seconds, believed.rate_hz)?;
    // What the rig's own player asks for, before its rounding to single precision.
    let mut player = Player::<f64>::new(named.experiment(believed, believed.rate_hz), step_s);
    let mut run = Run::default();
    for k in 0..ticks {
        let truth = rig.advance().truth;
        if !truth.motion.position_rad.is_finite() {
            return Err(believed.diverged(truth.time_s));
        }
        run.time_s.push(truth.time_s);
        run.position_rad.push(truth.motion.position_rad);
        run.friction_nm.push(truth.friction_nm);
        run.velocity_rad_s.push(truth.motion.velocity_rad_s);
        run.reference_rad.push(match player.next_tick() {
            Reference::Position { position_rad, .. } => position_rad,
            _ => 0.0,
        });
        if k % 4096 == 0 {
            progress(k as f64 / ticks as f64);
        }
    }
    Ok(run)
}

/// Ticks before the oscillation of the pulse experiment, and of one oscillation.
fn pulse_ticks(setup: &Setup) -> (usize, usize) {
    let believed = &setup.believed;
    match Named::Pulse.experiment::<f64>(believed, believed.rate_hz) {
        Experiment::PulseThenOscillation {
            pulse_ticks,
            period_ticks,
            ..
        } => (2 * pulse_ticks as usize, period_ticks as usize),
        _ => (0, 1),
    }
}

/// Mean speed between the first and the last whole oscillation after settling, at the same phase of both.
fn drift(setup: &Setup, run: &Run, settle_s: f64) -> f64 {
    let (_, period) = pulse_ticks(setup);
    let first = (settle_s * setup.believed.rate_hz).round() as usize;
    let periods = run.position_rad.len().saturating_sub(first + 1) / period;
    let last = first + periods * period;
    if periods == 0 {
        return f64::NAN;
    }
    (run.position_rad[last] - run.position_rad[first]) / (run.time_s[last] - run.time_s[first])
}

fn table(rows: &[Row], setup: &Setup) -> Table {
    let unit = setup.believed.unit.position();
    let mut table = Table::new(
        &format!("{}: LuGre against elasto-plastic", setup.name),
        &[
            "model",
            "drift below break-away, % of z_ss a minute",
            &format!("tracking error, {unit} rms"),
            &format!("worst, {unit}"),
        ],
    );
    for row in rows {
        table = table.row(&[
            row.model.to_string(),
            short(100.0 * row.drift_share_of_z_ss_per_minute),
            short(row.tracking_error_rms_rad),
            short(row.tracking_error_worst_rad),
        ]);
    }
    table
}

fn report(
    setup: &Setup,
    table: Table,
    rows: &[Row],
    pulses: &[Run],
    reversals: &[Run],
    z_ss: f64,
) -> Report {
    let unit = setup.believed.unit;
    let (position, effort) = (unit.position(), unit.effort());
    // A reader looks at the drift itself: both from where the oscillation began, in steady deflections.
    let (begin, _) = pulse_ticks(setup);
    let from_begin = |run: &Run| -> Vec<f64> {
        let origin = run.position_rad[begin];
        run.position_rad[begin..]
            .iter()
            .map(|q| (q - origin) / z_ss)
            .collect()
    };
    let mut drift = Plot::over("time", "s", &pulses[0].time_s[begin..])
        .title("Position under an oscillation below break-away")
        .y("position from its start", "z_ss");
    let mut pulse = Plot::over("time", "s", &pulses[0].time_s[..2 * begin])
        .title("The pulse before it")
        .y("position", position);
    let mut error = Plot::over("time", "s", &reversals[0].time_s)
        .title("Tracking error through velocity reversals, closed loop")
        .y("error", position);
    let mut loops = Plot::xy("position", position)
        .title("Friction over position")
        .y("friction", effort);
    let mut speeds = Plot::xy("velocity", &format!("{position}/s"))
        .title("Friction over velocity")
        .y("friction", effort);
    for ((row, still), moving) in rows.iter().zip(pulses).zip(reversals) {
        drift = drift.line(row.model, &from_begin(still));
        pulse = pulse.line(row.model, &still.position_rad[..2 * begin]);
        let errors: Vec<f64> = moving
            .position_rad
            .iter()
            .zip(&moving.reference_rad)
            .map(|(q, r)| q - r)
            .collect();
        error = error.line(row.model, &errors);
        loops = loops.line(row.model, &moving.position_rad, &moving.friction_nm);
        speeds = speeds.line(row.model, &moving.velocity_rad_s, &moving.friction_nm);
    }
    Report::new("LuGre against elasto-plastic")
        .lead(&format!(
            "Below break-away LuGre drifts {} times its steady deflection a minute, the elasto-plastic model {}.",
            short(rows[0].drift_share_of_z_ss_per_minute),
            short(rows[1].drift_share_of_z_ss_per_minute),
        ))
        .table(table)
        .plot(drift)
        .plot(pulse)
        .plot(error)
        .plot(loops)
        .plot(speeds)
        .facts(&[
            ("command", &output::command_line()),
            ("version", env!("CARGO_PKG_VERSION")),
            ("axis", &setup.name),
        ])
}
