//! `bristle run`: experiments on the virtual axis, on the emulated firmware or on the board, each into a log.

use crate::image::Emulator;
use crate::output::{self, Progress, short};
use crate::remote::{self, Remote};
use crate::setup::{Real, Setup};
use crate::source;
use bristle_core::experiment::End;
use bristle_core::supervisor::Fault;
use bristle_gap::capture::{Layout, Position};
use bristle_gap::experiments::Named;
use bristle_gap::plan::{Plan, Step};
use bristle_gap::report::Table;
use bristle_gap::run::{Bench, Done, Run, Virtual, Watch};
use bristle_gap::{Believed, InputError, Unit};
use clap::ValueEnum;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Where `cargo` puts the emulator, from the root of the sources.
pub const EMULATOR: &str = "host-tests/image/target/release/emulate";
/// And the firmware.
pub const FIRMWARE: &str = "firmware/target/thumbv7em-none-eabihf/release/bristle-firmware";

/// Play an experiment, or a plan of several, and record a log of each.
///
/// The same signals, bounds and supervisor run on the virtual axis, in the emulated firmware and on the board, and the
/// logs have the same columns. An experiment ends when its time is over, or at the first bound that it passes: travel,
/// speed or torque. A fault ends the whole run. Ctrl-C takes the torque down by a ramp and keeps what was recorded.
#[derive(clap::Args)]
#[command(
    after_help = "Experiments, sized for the axis:\n  sine, pulse, reversals, ladder, prbs, dahl-ramp, break-away, \
                        multisine, moves\n\nA plan is a TOML file, see docs/formats.md:\n  [[experiment]]\n  kind = \
                        \"multisine\"\n  seconds = 10\n  most_travel_rad = 3\n\nExamples:\n  bristle run multisine \
                        --axis axes/bench.toml --out log.csv\n  bristle run plan.toml --axis axes/bench.toml --out \
                        logs --effect actuator.cogging:amplitude_nm=0.01,order_per_rev=24\n  bristle run moves --axis \
                        axes/bench.toml --on image --out log.csv\n  bristle run plan.toml --axis axis.toml --on target \
                        --to tcp:localhost:9091 --answers tcp:localhost:9090 --out logs"
)]
pub struct Args {
    /// Name of an experiment, or a plan file.
    #[arg(value_name = "EXPERIMENT|PLAN")]
    what: String,
    /// Axis file.
    #[arg(long, value_name = "FILE")]
    axis: PathBuf,
    /// Log of an experiment, packed where the name ends in .gz; folder for the logs of a plan.
    #[arg(long, value_name = "FILE|FOLDER")]
    out: PathBuf,
    /// On what.
    #[arg(long, value_enum, default_value_t = On::Virtual)]
    on: On,
    /// Length of an experiment, where it is not a plan that says so.
    #[arg(long, value_name = "S", value_parser = output::positive)]
    seconds: Option<f64>,
    /// Pack the logs of a plan.
    #[arg(long)]
    gzip: bool,
    #[command(flatten)]
    real: Real,
    /// Also write the true torque, velocity, deflection and friction of the virtual axis.
    #[arg(long)]
    truth: bool,
    /// With --on target: server of RTT down channel 0, tcp:HOST:PORT.
    #[arg(long, value_name = "SERVER", value_parser = source::tcp)]
    to: Option<String>,
    /// With --on target: server of RTT up channel 1, where that is another one.
    #[arg(long, value_name = "SERVER", value_parser = source::tcp)]
    answers: Option<String>,
    /// With --on image: the firmware's image.
    #[arg(long, value_name = "FILE", default_value = FIRMWARE)]
    firmware: PathBuf,
    /// With --on image: the emulator.
    #[arg(long, value_name = "FILE", default_value = EMULATOR)]
    emulator: PathBuf,
    /// Also write the results as JSON; `-` for standard output. A plan leaves them in its folder as run.json.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// On what experiments run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum On {
    /// The simulated axis of the axis file.
    Virtual,
    /// The firmware's image in the emulator, on the axis of axes/bench.toml.
    Image,
    /// The firmware on its board, through RTT servers.
    Target,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    consistent(args)?;
    let setup = Setup::new(Some(&args.axis))?;
    let axis = &setup.believed;
    let real = args.real.axis(axis)?;
    let named = Named::from_name(&args.what);
    let plan = match named {
        Some(named) => alone(named, args.seconds, axis)?,
        None => Plan::read(&args.what, axis).map_err(|error| no_plan(args, error))?,
    };
    if named.is_none() {
        if let Some(seconds) = args.seconds {
            return Err(InputError::new(
                format!("--seconds {seconds}"),
                "is for one experiment",
                "write `seconds = ...` in the plan",
            ));
        }
        folder(&args.out)?;
    }
    source::catch_interrupts();
    let place = |number: usize, step: &Step| match named {
        Some(_) => args.out.clone(),
        None => args.out.join(format!(
            "{:02}-{}.csv{}",
            number + 1,
            step.name(),
            if args.gzip { ".gz" } else { "" }
        )),
    };
    let run = Run {
        axis,
        layout: Layout {
            position: Position::Counts,
            unit: axis.unit,
            truth: args.truth,
        },
    };
    let mut watch = Screen::new(&plan, axis);
    let played = on_bench(args, &setup, &real, &plan, &mut |bench| {
        run.play(&plan, bench, &place, &mut watch)
    });
    let done = watch.finish();
    report(args, &setup, &plan, &done, named.is_none())?;
    played
}

/// Options that belong together.
fn consistent(args: &Args) -> Result<(), InputError> {
    let only = |given: bool, option: &str, on: &str| {
        if given {
            Err(InputError::new(
                option,
                format!("is for --on {on} only"),
                "leave it out",
            ))
        } else {
            Ok(())
        }
    };
    if args.on != On::Virtual {
        only(args.real.is_given(), "--effect or noise", "virtual")?;
        only(args.truth, "--truth", "virtual")?;
    }
    if args.on != On::Target {
        only(args.to.is_some(), "--to", "target")?;
        only(args.answers.is_some(), "--answers", "target")?;
    } else if args.to.is_none() {
        return Err(InputError::new(
            "--on target",
            "needs the server of the board's link",
            "give --to tcp:HOST:PORT, such as OpenOCD's `rtt server start 9091 0`",
        ));
    }
    Ok(())
}

fn alone(named: Named, seconds: Option<f64>, axis: &Believed) -> Result<Plan, InputError> {
    let mut step = Step::new(named, axis);
    if let Some(seconds) = seconds {
        let ticks = bristle_gap::signal::samples(seconds, axis.rate_hz)?;
        step.bounds.ticks = u32::try_from(ticks).unwrap_or(u32::MAX);
    }
    let mut plan = Plan::new(vec![step]);
    plan.most_s = f64::INFINITY;
    plan.check(axis, Path::new(named.name()))?;
    Ok(plan)
}

/// A word that is neither a name nor a file was meant as either.
fn no_plan(args: &Args, error: InputError) -> InputError {
    if Path::new(&args.what).exists() || args.what.contains(['.', '/']) {
        return error;
    }
    InputError::new(
        &args.what,
        "is no experiment, and there is no such file",
        format!(
            "give a plan file, or one of {}",
            Named::ALL.map(Named::name).join(", ")
        ),
    )
}

fn folder(path: &Path) -> Result<(), InputError> {
    std::fs::create_dir_all(path).map_err(|error| {
        InputError::new(
            path,
            format!("cannot be a folder: {}", source::plain(&error)),
            "name a folder for the logs of a plan",
        )
    })
}

fn on_bench(
    args: &Args,
    setup: &Setup,
    real: &Believed,
    plan: &Plan,
    play: &mut dyn FnMut(&mut dyn Bench) -> Result<(), InputError>,
) -> Result<(), InputError> {
    let axis = &setup.believed;
    let over = |to: &str, answers: Option<&str>, play: &mut dyn FnMut(&mut dyn Bench) -> _| {
        let mut bench = Remote::new(to, answers, axis)?;
        let played: Result<(), InputError> = play(&mut bench);
        let ended = bench.finish();
        // Whatever went wrong before is what the user should hear of.
        played.and(ended)
    };
    match args.on {
        On::Virtual => {
            let mut bench = Virtual::new(axis, real, args.real.noise(), args.real.seed())?;
            play(&mut bench)
        }
        On::Image => {
            remote::check(axis)?;
            // Ways back come on top, and a machine that is slow.
            let seconds = 120 + 2 * plan.total_s(axis).ceil() as u64;
            let emulator = Emulator::start(&args.emulator, &args.firmware, seconds)?;
            over(&emulator.address, None, play)
        }
        On::Target => {
            let to = args.to.as_deref().unwrap_or_default();
            over(to, args.answers.as_deref(), play)
        }
    }
}

/// A bar, and what is done.
struct Screen {
    bar: Progress,
    /// Ends of the experiments, s.
    ends_s: Vec<f64>,
    begins_s: Vec<f64>,
    done: Vec<Done>,
}

impl Screen {
    fn new(plan: &Plan, axis: &Believed) -> Self {
        let (mut begins_s, mut ends_s) = (Vec::new(), Vec::new());
        let mut time_s = 0.0;
        for step in &plan.steps {
            let (plays, rests) = step.seconds(axis);
            begins_s.push(time_s + rests);
            time_s += rests + plays;
            ends_s.push(time_s);
        }
        Self {
            bar: Progress::new("run"),
            ends_s,
            begins_s,
            done: Vec::new(),
        }
    }

    /// Takes the bar away.
    fn finish(self) -> Vec<Done> {
        self.done
    }
}

impl Watch for Screen {
    fn progress(&mut self, number: usize, step: &Step, share: f64) {
        let all = self.ends_s.len();
        let (begins, ends) = (self.begins_s[number], self.ends_s[number]);
        self.bar
            .say(&format!("{} of {all}, {}", number + 1, step.name()));
        self.bar
            .set((begins + share * (ends - begins)) / self.ends_s[all - 1]);
    }

    fn done(&mut self, done: Done) {
        self.done.push(done);
    }

    fn go_on(&self) -> bool {
        !source::interrupted()
    }
}

fn report(
    args: &Args,
    setup: &Setup,
    plan: &Plan,
    done: &[Done],
    is_plan: bool,
) -> Result<(), InputError> {
    let quiet = output::json_on_stdout(args.json.as_deref());
    if !quiet && !done.is_empty() {
        output::print_table(&table(done, plan, setup.believed.unit));
    }
    if source::interrupted() {
        let left = plan.steps.len() - done.len();
        output::notices([&format!(
            "interrupted; what was recorded is kept, {left} of {} experiments were not begun",
            plan.steps.len()
        )]);
    }
    let result = as_json(args, setup, plan, done);
    if is_plan {
        output::write_json(Some(&args.out.join("run.json")), &result)?;
    }
    output::write_json(args.json.as_deref(), &result)
}

fn table(done: &[Done], plan: &Plan, unit: Unit) -> Table {
    let (length, effort) = match unit {
        Unit::Rotary => ("rad", "N m"),
        Unit::Linear => ("m", "N"),
    };
    let header = [
        "experiment".to_owned(),
        "s".to_owned(),
        "lost".to_owned(),
        "ended by".to_owned(),
        format!("travel, {length}"),
        format!("speed, {length}/s"),
        format!("torque, {effort}"),
        "log".to_owned(),
    ];
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let caption = format!("{} of {} experiments", done.len(), plan.steps.len());
    done.iter()
        .fold(Table::new(&caption, &header), |table, done| {
            let end = match done.seen.end {
                End::Fault => done.seen.fault.text(),
                end => end.text(),
            };
            let log = done
                .log
                .as_ref()
                .map_or("too short for a log".to_owned(), |log| {
                    log.display().to_string()
                });
            table.row(&[
                done.name.to_owned(),
                short(done.played_s),
                done.seen.lost.to_string(),
                end.to_owned(),
                short(done.travel_rad),
                short(done.speed_rad_s),
                short(done.torque_nm),
                log,
            ])
        })
}

fn as_json(args: &Args, setup: &Setup, plan: &Plan, done: &[Done]) -> Value {
    let [travel, speed, torque] = match setup.believed.unit {
        Unit::Rotary => ["travel_rad", "speed_rad_s", "torque_nm"],
        Unit::Linear => ["travel_m", "speed_m_s", "force_n"],
    };
    let experiments = done.iter().map(|done| {
        let fault = (done.seen.fault != Fault::None).then(|| done.seen.fault.text());
        json!({
            "experiment": done.name,
            "log": done.log,
            "planned_s": done.planned_s,
            "played_s": done.played_s,
            "samples": done.seen.samples,
            "lost": done.seen.lost,
            "ended": done.seen.end.text(),
            "fault": fault,
            travel: done.travel_rad,
            speed: done.speed_rad_s,
            torque: done.torque_nm,
        })
    });
    json!({
        "schema": 1,
        "what": args.what,
        "axis": setup.name,
        "on": args.on.to_possible_value().map(|value| value.get_name().to_owned()),
        "seed": (args.on == On::Virtual).then_some(args.real.seed()),
        "effects": args.real.effect,
        "interrupted": source::interrupted(),
        "planned": plan.steps.len(),
        "experiments": experiments.collect::<Vec<_>>(),
    })
}
