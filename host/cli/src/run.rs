//! `bristle run`: experiments on the virtual axis, on the emulated firmware or on the board, each into a log.

use crate::about;
use crate::on::{On, Place, only};
use crate::output::{self, Progress, short};
use crate::remote::{self, Remote};
use crate::setup::{Real, Setup};
use crate::source;
use bristle_core::experiment::End;
use bristle_core::supervisor::Fault;
use bristle_gap::capture::{About, Layout, Position};
use bristle_gap::experiments::Named;
use bristle_gap::plan::{Plan, Step};
use bristle_gap::report::Table;
use bristle_gap::run::{Bench, Done, Run, Virtual, Watch};
use bristle_gap::{Believed, InputError, Unit};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

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
    /// Log of an experiment: CSV, packed where the name ends in .gz, or MCAP where it ends in .mcap; folder for the logs
    /// of a plan.
    #[arg(long, value_name = "FILE|FOLDER")]
    out: PathBuf,
    #[command(flatten)]
    place: Place,
    /// Length of an experiment, where it is not a plan that says so.
    #[arg(long, value_name = "S", value_parser = output::positive)]
    seconds: Option<f64>,
    /// Pack the logs of a plan.
    #[arg(long)]
    gzip: bool,
    /// Write the logs of a plan as MCAP.
    #[arg(long, conflicts_with = "gzip")]
    mcap: bool,
    #[command(flatten)]
    real: Real,
    /// Also write the true torque, velocity, deflection and friction of the virtual axis.
    #[arg(long)]
    truth: bool,
    /// Also write the results as JSON; `-` for standard output. A plan leaves them in its folder as run.json.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
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
            "{:02}-{}.{}",
            number + 1,
            step.name(),
            match (args.mcap, args.gzip) {
                (true, _) => "mcap",
                (_, true) => "csv.gz",
                _ => "csv",
            }
        )),
    };
    let mut about = about::about(axis.rate_hz, axis.unit);
    about::axis(&mut about, &setup.file);
    args.place.describe(&mut about)?;
    let mut run = Run {
        axis,
        about,
        layout: Layout {
            position: Position::Counts,
            unit: axis.unit,
            truth: args.truth,
        },
    };
    let mut watch = Screen::new(&plan, axis);
    let played = on_bench(args, &setup, &real, &plan, &mut |bench, asked| {
        run.about.extend(asked);
        run.play(&plan, bench, &place, &mut watch)
    });
    let done = watch.finish();
    report(args, &setup, &plan, &done, named.is_none())?;
    played
}

/// Options that belong together.
fn consistent(args: &Args) -> Result<(), InputError> {
    if args.place.on != On::Virtual {
        only(args.real.is_given(), "--effect or noise", "virtual")?;
        only(args.truth, "--truth", "virtual")?;
    }
    args.place.consistent()
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
    play: &mut dyn FnMut(&mut dyn Bench, About) -> Result<(), InputError>,
) -> Result<(), InputError> {
    let axis = &setup.believed;
    let over =
        |to: &str, answers: Option<&str>, play: &mut dyn FnMut(&mut dyn Bench, About) -> _| {
            let mut bench = Remote::new(to, answers, axis)?;
            let asked = bench.parameters();
            let played: Result<(), InputError> = asked.and_then(|asked| play(&mut bench, asked));
            let ended = bench.finish();
            // Whatever went wrong before is what the user should hear of.
            played.and(ended)
        };
    match args.place.on {
        On::Virtual => {
            let mut bench = Virtual::new(axis, real, args.real.noise(), args.real.seed())?;
            play(&mut bench, About::new())
        }
        On::Image => {
            remote::check(axis)?;
            // Ways back come on top, and a machine that is slow.
            let seconds = 120 + 2 * plan.total_s(axis).ceil() as u64;
            let emulator = args.place.emulator(seconds)?;
            over(&emulator.address, None, play)
        }
        On::Target => over(args.place.to(), args.place.answers(), play),
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
        "on": args.place.on.name(),
        "seed": (args.place.on == On::Virtual).then_some(args.real.seed()),
        "effects": args.real.effect,
        "interrupted": source::interrupted(),
        "planned": plan.steps.len(),
        "experiments": experiments.collect::<Vec<_>>(),
    })
}
