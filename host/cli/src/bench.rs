//! `bristle bench`: the control tick of `core` at its own rate on the virtual axis, both observers, no board.

use crate::output::{self, Progress, short};
use crate::setup::Setup;
use bristle_core::experiment::Experiment;
use bristle_core::observer::{ReducedOrder, reduced_order};
use bristle_gap::believed::Noise;
use bristle_gap::report::{Plot, Report, Table};
use bristle_gap::signal::{rms, samples};
use bristle_gap::{Believed, InputError};
use bristle_plant::Rig;
use serde::Serialize;
use std::path::PathBuf;

/// Run the control tick against the virtual axis: both observers on the thesis's sine of torque.
///
/// No board and no files are needed. The controller is the code of the microcontroller in single precision; the axis is
/// simulated in finer steps, its encoder quantised.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle bench\n  bristle bench --axis axis.toml --seconds 20 --report run.html\n  \
                        bristle bench --json - | jq .estimates"
)]
pub struct Args {
    /// Axis file; the built-in bench axis where left out.
    #[arg(long, value_name = "FILE")]
    axis: Option<PathBuf>,
    /// Length of the experiment.
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = output::positive)]
    seconds: f64,
    /// Peak of the sine; 0.035 N m on the built-in axis, 1.35 times stiction on another.
    #[arg(long, value_name = "N m", value_parser = output::positive)]
    torque_nm: Option<f64>,
    /// Period of the sine.
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = output::positive)]
    period_s: f64,
    /// Torque noise on the rotor, rms, as a share of Coulomb friction.
    #[arg(long, value_name = "SHARE", default_value_t = 0.01, value_parser = output::not_negative)]
    torque_noise: f64,
    /// Seed of the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Report to write.
    #[arg(long, value_name = "FILE", default_value = "report.html")]
    report: PathBuf,
    /// Also write the table as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Errors of one estimate against the truth of the simulation.
#[derive(Serialize)]
struct Estimate {
    name: &'static str,
    velocity_rms_rad_s: f64,
    velocity_worst_rad_s: f64,
    /// rms error of z over z_ss, while in presliding and while sliding.
    z_presliding_share: Option<f64>,
    z_sliding_share: Option<f64>,
}

#[derive(Serialize)]
struct Summary {
    axis: String,
    ticks: usize,
    rate_hz: f64,
    seed: u64,
    z_ss_counts: f64,
    presliding_share_of_time: f64,
    rejected_samples: u32,
    estimates: Vec<Estimate>,
}

/// Signals of a run, one value a tick.
#[derive(Default)]
struct Run {
    time_s: Vec<f64>,
    torque_nm: Vec<f64>,
    position_rad: Vec<f64>,
    friction_nm: Vec<f64>,
    velocity_rad_s: Vec<f64>,
    z_rad: Vec<f64>,
    difference_rad_s: Vec<f64>,
    linear_rad_s: Vec<f64>,
    luenberger_rad_s: Vec<f64>,
    luenberger_z_rad: Vec<f64>,
    time_free_z_rad: Vec<f64>,
    rejected: u32,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let setup = Setup::new(args.axis.as_ref())?;
    let believed = &setup.believed;
    let amplitude_nm = args.torque_nm.unwrap_or(match args.axis {
        None => 0.035,
        Some(_) => 1.35 * believed.stiction_nm,
    });
    let run = simulate(args, &setup, amplitude_nm)?;
    let summary = summarise(args, &setup, &run);
    let table = table(&summary, believed);
    let quiet = output::json_on_stdout(args.json.as_deref());
    if !quiet {
        output::print_table(&table);
    }
    let report = report(args, &setup, &run, &summary, table, amplitude_nm);
    output::write_json(args.json.as_deref(), &summary)?;
    output::write_report(&args.report, &report, quiet)
}

fn simulate(args: &Args, setup: &Setup, amplitude_nm: f64) -> Result<Run, InputError> {
    let believed = &setup.believed;
    let step_s = setup.sample_time_s();
    let tick = believed.tick::<f32>(step_s)?;
    let noise = Noise {
        torque_nm: args.torque_noise * believed.coulomb_nm,
        ..Noise::default()
    };
    let axis = believed.axis(believed.model, step_s, noise, args.seed)?;
    let experiment = Experiment::Sine {
        amplitude_nm: amplitude_nm as f32,
        period_ticks: (args.period_s * believed.rate_hz).round().max(1.0) as u32,
    };
    let system = reduced_order::System::rigid_axis(
        believed.whole_inertia_kg_m2() as f32,
        0.0,
        believed.viscous_nm_s_rad as f32,
    );
    // The same pole as the Luenberger-like observer's; if that one was built, so can this one.
    let linear = ReducedOrder::new(
        system,
        [believed.observer_settings(step_s).l1_1_s as f32],
        step_s as f32,
    )
    .ok();
    let mut linear_state = reduced_order::State::default();
    let count = believed.rad_per_count();
    let ticks = samples(args.seconds, believed.rate_hz)?;
    let mut rig = Rig::new(tick, axis, experiment);
    let progress = Progress::new("bench");
    let mut run = Run::default();
    let mut torque_nm = 0.0;
    for k in 0..ticks {
        let record = rig.advance();
        let (sample, truth) = (record.sample, record.truth);
        if !truth.motion.position_rad.is_finite() {
            return Err(believed.diverged(truth.time_s));
        }
        let travel = f64::from(sample.step_counts) * count;
        if let Some(linear) = &linear {
            linear.step(&mut linear_state, 0.0, travel as f32, torque_nm as f32);
        }
        torque_nm = f64::from(sample.torque_ref_nm);
        run.time_s.push(truth.time_s);
        run.torque_nm.push(torque_nm);
        run.position_rad.push(truth.motion.position_rad);
        run.friction_nm.push(truth.friction_nm);
        run.velocity_rad_s.push(truth.motion.velocity_rad_s);
        run.z_rad.push(truth.z_rad);
        run.difference_rad_s.push(travel / step_s);
        run.linear_rad_s.push(f64::from(linear_state.w[0]));
        run.luenberger_rad_s
            .push(f64::from(sample.luenberger.velocity_rad_s));
        run.luenberger_z_rad
            .push(f64::from(sample.luenberger.z_rad));
        run.time_free_z_rad.push(f64::from(sample.time_free_z_rad));
        if k % 4096 == 0 {
            progress.set(k as f64 / ticks as f64);
        }
    }
    let state = rig.state();
    run.rejected = state.encoder.rejected + state.luenberger.rejected + state.time_free.rejected;
    Ok(run)
}

/// Whether the bristles are short of steady deflection in the direction of motion.
fn presliding(setup: &Setup, run: &Run) -> Result<Vec<bool>, InputError> {
    let friction = setup.believed.elasto_plastic()?;
    Ok(run
        .z_rad
        .iter()
        .zip(&run.velocity_rad_s)
        .map(|(z, v)| z * v.signum() < 0.99 * friction.z_ss_rad(v.abs()))
        .collect())
}

fn summarise(args: &Args, setup: &Setup, run: &Run) -> Summary {
    let believed = &setup.believed;
    let z_ss = believed.coulomb_nm / believed.stiffness_nm_rad;
    let presliding = presliding(setup, run).unwrap_or_default();
    let z_share = |z: &[f64], wanted: bool| {
        let errors = z.iter().zip(&run.z_rad).zip(&presliding);
        let chosen = errors.filter(|(_, now)| **now == wanted);
        Some(rms(chosen.map(|((z, truth), _)| z - truth)) / z_ss)
    };
    let estimate = |name, velocity: &[f64], z: Option<&[f64]>| {
        let errors = || {
            velocity
                .iter()
                .zip(&run.velocity_rad_s)
                .map(|(v, truth)| v - truth)
        };
        Estimate {
            name,
            velocity_rms_rad_s: rms(errors()),
            velocity_worst_rad_s: errors().map(f64::abs).fold(0.0, f64::max),
            z_presliding_share: z.and_then(|z| z_share(z, true)),
            z_sliding_share: z.and_then(|z| z_share(z, false)),
        }
    };
    let in_presliding = presliding.iter().filter(|now| **now).count();
    Summary {
        axis: setup.name.clone(),
        ticks: run.time_s.len(),
        rate_hz: believed.rate_hz,
        seed: args.seed,
        z_ss_counts: z_ss / believed.rad_per_count(),
        presliding_share_of_time: in_presliding as f64 / run.time_s.len().max(1) as f64,
        rejected_samples: run.rejected,
        estimates: vec![
            estimate("plain difference", &run.difference_rad_s, None),
            estimate("linear reduced-order", &run.linear_rad_s, None),
            estimate(
                "Luenberger-like",
                &run.luenberger_rad_s,
                Some(&run.luenberger_z_rad),
            ),
            estimate(
                "discrete time-free",
                &run.difference_rad_s,
                Some(&run.time_free_z_rad),
            ),
        ],
    }
}

fn table(summary: &Summary, believed: &Believed) -> Table {
    let caption = format!(
        "{}: {} ticks at {} Hz, z_ss is {} counts, {:.0} % of the time in presliding",
        summary.axis,
        summary.ticks,
        summary.rate_hz,
        short(summary.z_ss_counts),
        100.0 * summary.presliding_share_of_time,
    );
    let unit = format!("{}/s", believed.unit.position());
    let mut table = Table::new(
        &caption,
        &[
            "observer",
            &format!("velocity error, {unit} rms"),
            &format!("worst, {unit}"),
            "z error in presliding, % of z_ss rms",
            "in sliding, %",
        ],
    );
    let percent = |share: Option<f64>| share.map_or("-".to_string(), |s| short(100.0 * s));
    for row in &summary.estimates {
        table = table.row(&[
            row.name.to_string(),
            short(row.velocity_rms_rad_s),
            short(row.velocity_worst_rad_s),
            percent(row.z_presliding_share),
            percent(row.z_sliding_share),
        ]);
    }
    table
}

fn report(
    args: &Args,
    setup: &Setup,
    run: &Run,
    summary: &Summary,
    table: Table,
    amplitude_nm: f64,
) -> Report {
    let unit = setup.believed.unit;
    let (position, effort) = (unit.position(), unit.effort());
    let speed = format!("{position}/s");
    let plain = summary.estimates[0].velocity_rms_rad_s;
    let luenberger = summary.estimates[2].velocity_rms_rad_s;
    let over_time = |title: &str| Plot::over("time", "s", &run.time_s).title(title);
    Report::new("Both observers on the virtual axis")
        .lead(&format!(
            "The Luenberger-like observer's velocity is off by {} {speed} rms, the plain difference's by {}: {:.1} times \
             as much.",
            short(luenberger),
            short(plain),
            plain / luenberger,
        ))
        .table(table)
        .paragraph(
            "The controller ran in single precision as on the microcontroller; the truth is the simulation's. The \
             time-free observer has no velocity of its own: its row shows the difference quotient, and its place on the \
             Stribeck curve comes from the Luenberger-like estimate. In presliding: bristles short of 99 % of z_ss in \
             the direction of motion.",
        )
        .plot(
            over_time("Velocity")
                .y("velocity", &speed)
                .line("plain difference", &run.difference_rad_s)
                .line("linear reduced-order", &run.linear_rad_s)
                .line("Luenberger-like", &run.luenberger_rad_s)
                .line("truth", &run.velocity_rad_s),
        )
        .plot(
            over_time("Bristle deflection z")
                .y("z", position)
                .line("truth", &run.z_rad)
                .line("Luenberger-like", &run.luenberger_z_rad)
                .line("discrete time-free", &run.time_free_z_rad),
        )
        .plot(
            over_time("Torque reference and friction")
                .y("torque", effort)
                .line("reference", &run.torque_nm)
                .line("friction", &run.friction_nm),
        )
        .plot(
            over_time("Position")
                .y("position", position)
                .line("truth", &run.position_rad),
        )
        .plot(
            Plot::xy("velocity", &speed)
                .title("z over velocity")
                .y("z", position)
                .line("truth", &run.velocity_rad_s, &run.z_rad)
                .line(
                    "Luenberger-like",
                    &run.luenberger_rad_s,
                    &run.luenberger_z_rad,
                ),
        )
        .plot(
            Plot::xy("velocity", &speed)
                .title("Friction over velocity")
                .y("friction", effort)
                .line("truth", &run.velocity_rad_s, &run.friction_nm),
        )
        .facts(&[
            ("command", &output::command_line()),
            ("version", env!("CARGO_PKG_VERSION")),
            ("axis", &setup.name),
            (
                "experiment",
                &format!("sine of {amplitude_nm} {effort}, {} s", args.period_s),
            ),
            ("seed", &args.seed.to_string()),
            ("rejected samples", &summary.rejected_samples.to_string()),
        ])
}
