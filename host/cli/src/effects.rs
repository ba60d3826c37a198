//! `bristle effects`: what a plain model leaves out, by id.

use crate::output::{self, short};
use crate::setup::{BENCH_AXIS, Setup};
use bristle_gap::report::Table;
use bristle_gap::{AxisFile, Believed, InputError, Unit, scale};
use bristle_plant::effect::{ALL, Entry, Kind, Parameter, Scale};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The linear axis of the documentation.
const LINEAR_AXIS: &str = include_str!("../../../axes/emps.toml");

/// List the effects that an axis may have: id, equation, parameters and their usual ranges on an axis.
///
/// `bristle simulate --effect` and `[[effect]]` of an axis file take them. A parameter that is not given has its default; an
/// effect whose sizes are zero is not there.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle effects\n  bristle effects --axis axes/emps.toml\n  bristle effects --json -\n  \
                        bristle effects --markdown > docs/effects.md"
)]
pub struct Args {
    /// Axis file that the usual ranges are for; the built-in bench axis where left out.
    #[arg(long, value_name = "FILE")]
    axis: Option<PathBuf>,
    /// Also write the list as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print the page of the documentation instead.
    #[arg(long, conflicts_with_all = ["axis", "json"])]
    markdown: bool,
}

#[derive(Serialize)]
struct Listed {
    id: &'static str,
    block: &'static str,
    model: &'static str,
    parameters: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    name: &'static str,
    role: &'static str,
    default: f64,
    usual: [f64; 2],
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    if args.markdown {
        output::print(&markdown()?);
        return Ok(());
    }
    let setup = Setup::new(args.axis.as_ref())?;
    let scale = scale::without_record(&setup.believed);
    if !output::json_on_stdout(args.json.as_deref()) {
        let caption = format!("Usual ranges are for {} without a record.", setup.name);
        let mut table = Table::new(&caption, &["effect", "parameter", "role", "usual"]);
        for entry in ALL {
            table = table.row(&[entry.id, entry.model, "", ""]);
            for p in entry.parameters {
                table = table.row(&["", p.name(scale.unit), role(p.kind), &usual(p, &scale)]);
            }
        }
        output::print_words(&table);
    }
    let listed: Vec<Listed> = ALL.iter().map(|entry| list(entry, &scale)).collect();
    output::write_json(args.json.as_deref(), &listed)
}

fn list(entry: &Entry, scale: &Scale) -> Listed {
    let row = |p: &Parameter| Row {
        name: p.name(scale.unit),
        role: role(p.kind),
        default: p.default,
        usual: (p.range)(scale),
    };
    Listed {
        id: entry.id,
        block: entry.block(),
        model: entry.model,
        parameters: entry.parameters.iter().map(row).collect(),
    }
}

fn role(kind: Kind) -> &'static str {
    match kind {
        Kind::Size => "size",
        Kind::Limit => "limit",
        Kind::Order => "order",
        Kind::Phase => "phase",
        Kind::Detail => "detail",
        Kind::Frequency => "frequency",
        Kind::Onset => "onset",
        Kind::Event => "event",
        Kind::Place => "place",
        Kind::Stop => "stop",
        Kind::Zero => "zero",
        Kind::Shape => "shape",
        Kind::Form => "form",
        Kind::Side => "side",
        Kind::Seed => "seed",
    }
}

fn usual(parameter: &Parameter, scale: &Scale) -> String {
    let [low, high] = (parameter.range)(scale);
    if low == high {
        short(low)
    } else {
        format!("{} to {}", short(low), short(high))
    }
}

/// The page of the documentation, for the two example axes.
fn markdown() -> Result<String, InputError> {
    let of = |text: &str, name: &str| {
        let path = Path::new(name);
        let believed = Believed::new(&AxisFile::parse(text, path)?, path)?;
        Ok(scale::without_record(&believed))
    };
    let rotary = of(BENCH_AXIS, "axes/bench.toml")?;
    let linear = of(LINEAR_AXIS, "axes/emps.toml")?;
    let mut page = String::from(HEAD);
    for entry in ALL {
        let _ = write!(
            page,
            "\n### `{}`\n`{}`\n\n| rotary | usual | linear | usual | role | default |\n|---|---|---|---|---|---|\n",
            entry.id, entry.model
        );
        for p in entry.parameters {
            let _ = writeln!(
                page,
                "| `{}` | {} | `{}` | {} | {} | {} |",
                p.name(Unit::Rotary),
                usual(p, &rotary),
                p.name(Unit::Linear),
                usual(p, &linear),
                role(p.kind),
                short(p.default),
            );
        }
    }
    Ok(page)
}

const HEAD: &str = "# Effects

What a plain model leaves out, by id. `[[effect]]` of an axis file and `bristle simulate --effect` take them. This page is
printed by `bristle effects --markdown`; each effect stands with its source and the test of its signature in
`host/plant/src/effect/`, in one file.

In the equations q and v are position and velocity of the motor, or of the load for friction; u is the torque before the
effect, tau the torque on the rotor, F friction, F_C Coulomb friction, J the inertia, t the time since the start of the
record. Of a model with bristles an effect changes the level that they slide at; their stiffness stays.

| role | |
|---|---|
| size | at zero its part of the effect is not there |
| limit | a bound; zero for none |
| order | waves a turn, or a metre |
| phase, frequency | of a wave |
| onset | moment from which something is different |
| event, place | moment or place of a sudden change |
| stop | place near an end of the travel |
| zero | place where the effect is zero |
| shape | times, speeds, exponents |
| form | one of two forms: the lowest or the highest value |
| side | on which side of its place it is: the lowest or the highest value |
| seed | of random numbers |

Usual ranges are priors, not limits; they follow from the size of the axis, here `axes/bench.toml` and `axes/emps.toml`
without a record. `bristle effects --axis FILE` prints them for another axis.
";
