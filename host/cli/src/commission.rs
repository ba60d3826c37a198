//! `bristle commission`: the set-up wizard, from a first axis file to one that can be trusted.

use crate::on::{self, On, Place, only};
use crate::output::{self, short};
use crate::remote::{self, Remote};
use crate::source;
use bristle_gap::believed::Noise;
use bristle_gap::commission::{Allowed, Finding, Outcome, Step, Watch, begin_with, commission};
use bristle_gap::run::{Bench, Virtual};
use bristle_gap::{AxisFile, Believed, InputError, Unit};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Find out what an axis file has to say of signs, counts, break-away, offset, lag and limits, by moving the axis.
///
/// Four steps: the axis is turned by hand; slow ramps of torque until it moves, in both directions; a multisine past
/// break-away; limits that follow. Each step stays within the torque and travel that are allowed, is judged against the
/// axis file, the other steps and what is usual, and can be given up with Ctrl-C. The outcome is an axis file with the
/// findings as comments; what was not looked at stays as it was. Where the axis is stuck or meets a fault nothing is
/// written.
#[derive(clap::Args)]
#[command(
    after_help = "The first axis file needs the inertia and what is known:\n  [axis]\n  inertia_kg_m2 = 3.1e-4\n  \
                        counts_per_rev = 16384\n\nExamples:\n  bristle commission --axis axes/bench.toml --torque-nm \
                        0.12 --out axis.toml\n  bristle commission --axis axes/bench.toml --real faulty.toml \
                        --torque-nm 0.12 --out axis.toml\n  bristle commission --axis axes/bench.toml --on image \
                        --torque-nm 0.08 --turns 0 --out axis.toml\n  bristle commission --axis first.toml --on target \
                        --to tcp:localhost:9091 --answers tcp:localhost:9090 --torque-nm 0.05 --out axis.toml"
)]
pub struct Args {
    /// Axis file to begin with.
    #[arg(long, value_name = "FILE")]
    axis: PathBuf,
    /// Axis file to write.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Largest torque that the axis may be given (N on a linear axis).
    #[arg(long, value_name = "N m", value_parser = output::positive)]
    torque_nm: f64,
    /// Furthest that it may move from where it stands, either way (m on a linear axis); that of the axis file, or three
    /// turns or 0.1 m, where left out.
    #[arg(long, value_name = "rad", value_parser = output::positive)]
    travel_rad: Option<f64>,
    /// Turns by hand in the positive direction, from mark to mark (metres on a linear axis); 0 for nobody.
    #[arg(long, value_name = "TURNS", value_parser = output::not_negative)]
    turns: Option<f64>,
    #[command(flatten)]
    place: Place,
    /// With --on virtual: axis file of what the axis really is.
    #[arg(long, value_name = "FILE")]
    real: Option<PathBuf>,
    /// With --on target: does not ask whether the axis may move.
    #[arg(long)]
    yes: bool,
    /// Also write the findings as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    args.place.consistent()?;
    if args.place.on != On::Virtual {
        only(args.real.is_some(), "--real", "virtual")?;
    }
    let file = AxisFile::read(&args.axis)?;
    let allowed = allowed(args, &file);
    let axis = Believed::new(&begin_with(&file, &allowed), &args.axis)?;
    output::notices(&axis.assumed);
    if args.place.on == On::Target
        && !args.yes
        && !on::may_move(
            &format!("up to {} N m", short(allowed.torque_nm)),
            allowed.travel_rad,
        )
    {
        return given_up(args, &[]);
    }
    source::catch_interrupts();
    let mut screen = Screen::new(output::json_on_stdout(args.json.as_deref()));
    let outcome = on_bench(args, &axis, &mut |bench| {
        commission(&file, &axis, &allowed, bench, &mut screen)
    })?;
    let Some(outcome) = outcome else {
        return given_up(args, &screen.findings);
    };
    outcome.file.write_under(&head(&outcome), &args.out)?;
    if !screen.quiet {
        output::print(&format!("axis file: {}\n", args.out.display()));
    }
    output::write_json(
        args.json.as_deref(),
        &as_json(&outcome.findings, Some(&args.out)),
    )
}

fn given_up(args: &Args, findings: &[Finding]) -> Result<(), InputError> {
    output::notices([&"given up; nothing was written".to_owned()]);
    output::write_json(args.json.as_deref(), &as_json(findings, None))
}

fn allowed(args: &Args, file: &AxisFile) -> Allowed {
    let (travel, turns) = match file.unit {
        Unit::Rotary => (3.0 * std::f64::consts::TAU, 3.0),
        Unit::Linear => (0.1, 0.1),
    };
    Allowed {
        torque_nm: args.torque_nm,
        travel_rad: args
            .travel_rad
            .or(file.drive.travel_limit)
            .unwrap_or(travel),
        turns: args.turns.unwrap_or(turns),
    }
}

/// Goes through the steps on a bench.
type Steps<'a> = dyn FnMut(&mut dyn Bench) -> Result<Option<Outcome>, InputError> + 'a;

fn on_bench(
    args: &Args,
    axis: &Believed,
    go: &mut Steps<'_>,
) -> Result<Option<Outcome>, InputError> {
    let over = |to: &str, answers: Option<&str>, go: &mut Steps<'_>| {
        let mut bench = Remote::new(to, answers, axis)?;
        bench.by_hand = args.place.on == On::Target;
        let done = bench
            .gives(args.torque_nm)
            .and_then(|()| bench.without_break_away(|bench| go(bench)));
        let ended = bench.finish();
        // Whatever went wrong before is what the user should hear of.
        done.and_then(|outcome| ended.map(|()| outcome))
    };
    match args.place.on {
        On::Virtual => {
            let path = args.real.as_ref().unwrap_or(&args.axis);
            let real = Believed::new(&AxisFile::read(path)?, path)?;
            let bench = Virtual::new(axis, &real, Noise::default(), 1)?;
            go(&mut bench.without_break_away())
        }
        On::Image => {
            remote::check(axis)?;
            // Fourteen ramps and six motions at the most, and a machine that is slow.
            let emulator = args.place.emulator(180)?;
            over(&emulator.address, None, go)
        }
        On::Target => over(args.place.to(), args.place.answers(), go),
    }
}

/// Prints what is found as it is found.
struct Screen {
    quiet: bool,
    findings: Vec<Finding>,
}

impl Screen {
    fn new(quiet: bool) -> Self {
        Self {
            quiet,
            findings: Vec::new(),
        }
    }
}

impl Watch for Screen {
    fn begin(&mut self, step: Step) {
        if !self.quiet {
            output::print(&format!("{}: {}\n", step.name(), step.what()));
        }
    }

    fn found(&mut self, finding: &Finding) {
        if !self.quiet {
            let (weight, text) = (finding.weight.name(), &finding.text);
            output::print(&format!("  {weight:8}  {text}\n"));
        }
        self.findings.push(finding.clone());
    }

    fn go_on(&self) -> bool {
        !source::interrupted()
    }
}

/// Comments above the axis file: where its numbers come from.
fn head(outcome: &Outcome) -> Vec<String> {
    let mut head = vec![format!(
        "Written by {}, version {}.",
        output::command_line(),
        env!("CARGO_PKG_VERSION")
    )];
    head.extend(outcome.findings.iter().map(|finding| {
        let (step, weight, text) = (finding.step.name(), finding.weight.name(), &finding.text);
        format!("{step}, {weight}: {text}")
    }));
    head
}

fn as_json(findings: &[Finding], out: Option<&Path>) -> Value {
    let findings = findings.iter().map(|finding| {
        json!({"step": finding.step.name(), "weight": finding.weight.name(), "text": finding.text})
    });
    json!({
        "schema": 1,
        "axis": out,
        "findings": findings.collect::<Vec<_>>(),
    })
}
