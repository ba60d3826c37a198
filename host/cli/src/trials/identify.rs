//! `bristle trials identify`: identification on axes whose parameters are known.

use crate::output::{self, Progress, short};
use bristle_gap::identify::Verdict;
use bristle_gap::identify::joint::{self, BREAKAWAY_SCALE, IDENTIFIED, Options, Usable, Weighting};
use bristle_gap::inverse::{Own, Owner};
use bristle_gap::report::Table;
use bristle_gap::trial::{self, Trial, Wanted};
use bristle_gap::{AxisFile, InputError};
use rayon::prelude::*;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Identify virtual axes whose parameters are known, and count how often the intervals hold.
///
/// The friction model is that of the axis; every parameter of the axis file given to the identification is off.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle trials identify\n  bristle trials identify --cases 20 --seed 7 --json \
                        cases.json"
)]
pub struct Args {
    /// Trials in all.
    #[arg(long, default_value_t = 100)]
    cases: usize,
    /// Seed of the first trial; the others follow on.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Largest error of a parameter of the axis file.
    #[arg(long, default_value_t = 0.3, value_parser = output::not_negative)]
    parameter_error: f64,
    /// Every case as JSON, to a file or to standard output (-).
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Clone, Debug, Serialize)]
struct Case {
    seed: u64,
    model: &'static str,
    rate_hz: f64,
    experiments: Vec<&'static str>,
    seconds: f64,
    parameters: Vec<Found>,
}

#[derive(Clone, Debug, Serialize)]
struct Found {
    what: &'static str,
    truth: f64,
    value: f64,
    low: Option<f64>,
    high: Option<f64>,
    covered: bool,
    profiled: bool,
    verdict: &'static str,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let progress = Progress::new("trials");
    let done = AtomicUsize::new(0);
    let cases: Result<Vec<Option<Case>>, InputError> = (0..args.cases)
        .into_par_iter()
        .map(|k| {
            let case = case(args, args.seed + k as u64);
            progress.set((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / args.cases as f64);
            case
        })
        .collect();
    drop(progress);
    let cases: Vec<Case> = cases?.into_iter().flatten().collect();
    output::write_json(args.json.as_deref(), &cases)?;
    if !output::json_on_stdout(args.json.as_deref()) {
        output::print_table(&table(&cases));
    }
    Ok(())
}

fn case(args: &Args, seed: u64) -> Result<Option<Case>, InputError> {
    let wanted = Wanted {
        effects: Vec::new(),
        share: 1.0,
        parameter_error: args.parameter_error,
    };
    let Some(Trial {
        axis,
        truth,
        logs,
        experiments,
        path,
        ..
    }) = trial::draw(seed, &wanted)?
    else {
        return Ok(None);
    };
    let usable: Vec<Usable> = logs.into_iter().map(Usable::from).collect();
    let Some(kind) = truth.friction.model else {
        return Ok(None);
    };
    let options = Options {
        model: Some(kind),
        with: Vec::new(),
        weighting: Weighting::Noise,
    };
    let start = Instant::now();
    let identified = joint::identify(&usable, &axis, &path, &options, &|_| {})?;
    let parameters = identified
        .estimates
        .iter()
        .filter_map(|estimate| {
            let (what, truth) = true_value(estimate.owner, &truth)?;
            Some(Found {
                what,
                truth,
                value: estimate.value,
                low: estimate.low,
                high: estimate.high,
                covered: estimate.contains(truth),
                profiled: estimate.profiled,
                verdict: estimate.verdict.name(),
            })
        })
        .collect();
    Ok(Some(Case {
        seed,
        model: kind.name(),
        rate_hz: 1.0 / usable[0].log.median_step_s(),
        experiments,
        seconds: start.elapsed().as_secs_f64(),
        parameters,
    }))
}

/// Name and true value of a parameter; none for a nuisance.
fn true_value(owner: Owner, truth: &AxisFile) -> Option<(&'static str, f64)> {
    let friction = &truth.friction;
    let Owner::Own(own) = owner else {
        return Some(("offset", 0.0));
    };
    let (name, value) = match own {
        Own::Inertia => {
            let load = truth.axis.load_inertia.unwrap_or(0.0);
            ("inertia", Some(truth.axis.inertia + load))
        }
        Own::Coulomb => ("Coulomb friction", friction.coulomb),
        Own::Viscous => ("viscous friction", friction.viscous),
        Own::StictionExcess => ("stiction", friction.stiction),
        Own::StribeckVelocity => ("Stribeck velocity", friction.stribeck_velocity),
        Own::Stiffness => ("stiffness", friction.stiffness),
        Own::Damping => ("damping", friction.damping),
        Own::BreakawayRatio => ("break-away ratio", friction.breakaway_ratio),
        Own::DriveLag => ("drive lag", truth.drive.lag_s),
        Own::Skew => return None,
    };
    value.map(|value| (name, value))
}

impl Found {
    /// Off by more than what counts as identified, and said to be identified all the same.
    fn misleads(&self) -> bool {
        let scale = if self.what == "break-away ratio" {
            BREAKAWAY_SCALE
        } else {
            self.truth.abs()
        };
        scale > 0.0
            && (self.value - self.truth).abs() > IDENTIFIED * scale
            && self.verdict == Verdict::Identified.name()
    }
}

fn table(cases: &[Case]) -> Table {
    let seconds: Vec<f64> = cases.iter().map(|case| case.seconds).collect();
    let told = cases
        .iter()
        .filter(|case| !case.parameters.iter().any(Found::misleads))
        .count();
    let mut table = Table::new(
        &format!(
            "{} virtual axes, {} s of computing each (median); intervals at 90 %; all that is off by more than a fifth is \
             flagged on {told}",
            cases.len(),
            short(median(seconds))
        ),
        &[
            "parameter",
            "cases",
            "covered, %",
            "median error, %",
            "where identified, %",
            "identified",
            "weak",
            "not identifiable",
        ],
    );
    let mut names: Vec<&'static str> = Vec::new();
    for found in cases.iter().flat_map(|case| &case.parameters) {
        if !names.contains(&found.what) {
            names.push(found.what);
        }
    }
    for name in names {
        let all: Vec<&Found> = cases
            .iter()
            .flat_map(|case| &case.parameters)
            .filter(|found| found.what == name)
            .collect();
        let covered = all.iter().filter(|found| found.covered).count();
        let judged = |verdict: Verdict| {
            all.iter()
                .filter(move |found| found.verdict == verdict.name())
        };
        let error = |found: &&Found| {
            if found.truth == 0.0 {
                f64::NAN
            } else {
                100.0 * (found.value / found.truth - 1.0).abs()
            }
        };
        table = table.row(&[
            name.to_string(),
            all.len().to_string(),
            format!("{:.0}", 100.0 * covered as f64 / all.len() as f64),
            short(median(all.iter().map(error).collect())),
            short(median(judged(Verdict::Identified).map(error).collect())),
            judged(Verdict::Identified).count().to_string(),
            judged(Verdict::Weak).count().to_string(),
            judged(Verdict::NotIdentified).count().to_string(),
        ]);
    }
    table
}

fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
