//! `bristle check`: what encoder, sample rate and gains can show of an axis.

use crate::output::{self, short};
use crate::setup::Setup;
use bristle_core::design_check::{self, Design, Finding, Verdict};
use bristle_core::observer::Luenberger;
use bristle_gap::InputError;
use bristle_gap::report::Table;
use serde::Serialize;
use std::path::PathBuf;

/// Say what the encoder, the sample rate and the observer gains can show of an axis, before trusting a plot of z.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle check --axis axes/thesis-a.toml --torque-nm 0.035\n  bristle check --axis \
                        axis.toml --json -"
)]
pub struct Args {
    /// Axis file; the built-in bench axis where left out.
    #[arg(long, value_name = "FILE")]
    axis: Option<PathBuf>,
    /// Largest torque (force on a linear axis) of the experiment at hand; the drive's limit where left out.
    #[arg(long, value_name = "N m")]
    torque_nm: Option<f64>,
    /// Also write the findings as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Row {
    name: &'static str,
    value: f64,
    unit: String,
    verdict: &'static str,
    words: String,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let setup = Setup::new(args.axis.as_ref())?;
    // Over the sampled curve, as the controller holds it.
    let friction = setup.believed.tabulated::<f64>()?;
    let settings = setup.believed.observer_settings(setup.sample_time_s());
    let available_nm = args.torque_nm.or(setup.believed.drive.torque_limit_nm);
    let design = Design {
        settings,
        available_nm: available_nm.unwrap_or(f64::INFINITY),
    };
    let refused = Luenberger::new(friction, settings).err();
    let rows: Vec<Row> = design_check::check(&friction, &design)
        .iter()
        .filter(|finding| finding.value.is_finite())
        .map(|finding| row(finding, setup.believed.unit, refused.as_ref()))
        .collect();
    if !output::json_on_stdout(args.json.as_deref()) {
        let caption = format!(
            "{} at {} Hz: a count is {} {}",
            setup.name,
            setup.believed.rate_hz,
            short(setup.believed.rad_per_count()),
            setup.believed.unit.position(),
        );
        let mut table = Table::new(&caption, &["what", "value", "verdict", "in words"]);
        for row in &rows {
            table = table.row(&[
                row.name.to_string(),
                format!("{} {}", short(row.value), row.unit)
                    .trim_end()
                    .to_string(),
                row.verdict.to_string(),
                row.words.clone(),
            ]);
        }
        output::print_words(&table);
    }
    output::write_json(args.json.as_deref(), &rows)
}

fn row(
    finding: &Finding,
    unit: bristle_gap::Unit,
    refused: Option<&bristle_core::observer::luenberger::BuildError>,
) -> Row {
    let words = match refused {
        Some(error) if finding.name == "observer error dies out" => error.to_string(),
        _ => finding.words.to_string(),
    };
    Row {
        name: finding.name,
        value: finding.value,
        unit: finding
            .unit
            .replace("N m", unit.effort())
            .replace("rad", unit.position()),
        verdict: match finding.verdict {
            Verdict::Good => "good",
            Verdict::Mind => "mind",
            Verdict::Bad => "bad",
        },
        words,
    }
}
