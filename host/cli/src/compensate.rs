//! `bristle compensate`: tracking error with and without friction compensation, with the friction parameters right and
//! off.

use crate::image::Emulator;
use crate::on::{self, On, Place, only};
use crate::output::{self, Progress, short};
use crate::remote::{self, Remote};
use crate::setup::{Real, Setup};
use crate::source;
use bristle_core::command::{Changes, parameter};
use bristle_core::experiment::{Bounds, Experiment, Player, Reference};
use bristle_core::feed_forward::FeedForward;
use bristle_gap::experiments::Named;
use bristle_gap::feed_forward;
use bristle_gap::report::Table;
use bristle_gap::run::{Bench, Virtual};
use bristle_gap::signal::rms;
use bristle_gap::{AxisFile, Believed, InputError};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Show what friction compensation gains, and whether it holds with wrong friction parameters.
///
/// The axis follows the position sine of the reversal experiment, then makes moves with rests between them: without
/// compensation and with it, and both again while the controller believes in friction parameters that are off. A limit
/// cycle is an axis that swings where its reference does not, and did not without compensation.
#[derive(clap::Args)]
#[command(
    after_help = "To use it, write the shares into the axis file:\n  [control]\n  friction_forward = 0.5\n  friction_feedback = \
                        0.5\n\nExamples:\n  bristle compensate\n  bristle compensate --axis axis.toml --off 20\n  bristle compensate --on image --axis axes/bench.toml\n  bristle \
                        compensate --on target --to tcp:localhost:9091 --answers tcp:localhost:9090 --axis axis.toml"
)]
pub struct Args {
    /// Axis file; the built-in bench axis where left out.
    #[arg(long, value_name = "FILE")]
    axis: Option<PathBuf>,
    /// Share of the friction along the reference that is fed forward.
    #[arg(long, value_name = "SHARE", default_value_t = 0.5, value_parser = output::not_negative)]
    forward: f64,
    /// Share of the observed friction that is taken off, at most 0.6; both together at most 1.
    #[arg(long, value_name = "SHARE", default_value_t = 0.5, value_parser = output::not_negative)]
    feedback: f64,
    /// By how much the friction parameters are off.
    #[arg(long, value_name = "PERCENT", default_value_t = 30.0, value_parser = output::positive)]
    off: f64,
    #[command(flatten)]
    place: Place,
    /// With --on target: does not ask whether the axis may move.
    #[arg(long)]
    yes: bool,
    /// Length of the reversal experiment.
    #[arg(long, value_name = "S", default_value_t = 4.5, value_parser = output::positive)]
    seconds: f64,
    /// Feed-forward table that `bristle diagnose --feed-forward` has written; adds a row with it.
    #[arg(long, value_name = "FILE")]
    feed_forward: Option<PathBuf>,
    #[command(flatten)]
    real: Real,
    /// Also write the figures as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// What a run changes in the firmware: the parameters of the friction that the controller believes in, then the shares that
/// are compensated.
const NAMES: [&str; 8] = [
    "coulomb_nm",
    "stiction_nm",
    "stribeck_velocity_rad_s",
    "stiffness_nm_rad",
    "damping_nm_s_rad",
    "viscous_nm_s_rad",
    "friction_forward",
    "friction_feedback",
];

/// What is off together: a name, and places in [`NAMES`].
const GROUPS: [(&str, &[usize]); 6] = [
    ("all friction parameters", &[0, 1, 2, 3, 4, 5]),
    ("Coulomb friction and stiction", &[0, 1]),
    ("Stribeck velocity", &[2]),
    ("stiffness", &[3]),
    ("damping", &[4]),
    ("viscous friction", &[5]),
];

/// Time after which the loop has caught up with a reference that starts at speed, s.
const CATCHES_UP_S: f64 = 0.5;
/// Moves and the rests after them, s.
const MOVE_S: f64 = 0.5;
const REST_S: f64 = 1.0;
/// Moves of a run: out and back.
const MOVES: usize = 2;
/// Counts by which an axis has to go back for a swing: one is the encoder's, another one the noise of a loop about its
/// edge.
const SWING_COUNTS: i64 = 3;

/// What the controller believes, in the order of [`NAMES`], and whether it adds the table.
struct Belief {
    what: String,
    friction: [f64; 6],
    table: bool,
}

/// Rms and largest tracking error, and changes of direction beyond those of the reference, in the reversals and in the
/// later half of the rests.
#[derive(Serialize)]
struct Figures {
    rms_error: f64,
    worst_error: f64,
    swings: usize,
}

#[derive(Serialize)]
struct Row {
    believed: String,
    table: bool,
    without: Figures,
    with: Figures,
    ratio: f64,
    limit_cycle: bool,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    args.place.consistent()?;
    if args.place.on != On::Virtual {
        only(args.real.is_given(), "--effect or noise", "virtual")?;
    }
    let setup = Setup::new(args.axis.as_ref())?;
    let axis = &setup.believed;
    let real = args.real.axis(axis)?;
    let table = table_of(args)?;
    let path = Path::new(&setup.name);
    let beliefs = beliefs(axis, args);
    let both = [[0.0; 2], [args.forward, args.feedback]];
    // All of them are checked before the first one plays.
    let believed = |belief: &Belief| both.map(|shares| belief.axis(&setup.file, path, shares));
    for one in beliefs.iter().flat_map(believed) {
        one?;
    }
    if args.place.on == On::Target
        && !args.yes
        && !on::may_move("within the firmware's torque limit", furthest(axis).into())
    {
        output::notices([&"given up; nothing has moved".to_owned()]);
        return Ok(());
    }
    source::catch_interrupts();
    let mut linked = linked(args, axis, beliefs.len())?;
    let rows = rows(
        args,
        &setup,
        &real,
        &beliefs,
        table.as_ref(),
        linked.as_mut().map(|its| &mut its.0),
    );
    let ended = linked.map_or(Ok(()), |(bench, before, _emulator)| leave(bench, &before));
    // Whatever went wrong before is what the user should hear of.
    let rows = rows.and_then(|rows| ended.map(|()| rows))?;
    if !output::json_on_stdout(args.json.as_deref()) {
        output::print_table(&show(&rows, &setup, args));
    }
    output::write_json(args.json.as_deref(), &rows)
}

fn rows(
    args: &Args,
    setup: &Setup,
    real: &Believed,
    beliefs: &[Belief],
    table: Option<&feed_forward::Table>,
    mut linked: Option<&mut Remote>,
) -> Result<Vec<Row>, InputError> {
    let (axis, path) = (&setup.believed, Path::new(&setup.name));
    let progress = Progress::new("compensate");
    let mut rows: Vec<Row> = Vec::new();
    for (i, belief) in beliefs.iter().enumerate() {
        progress.set(i as f64 / beliefs.len() as f64);
        let table = table.filter(|_| belief.table);
        let mut play = |shares| match &mut linked {
            Some(bench) => {
                bench.set(&belief.changes(shares))?;
                bench.use_table(table)?;
                figures(*bench, axis, args.seconds)
            }
            None => {
                let believed = belief.axis(&setup.file, path, shares)?;
                let (noise, seed) = (args.real.noise(), args.real.seed());
                let mut bench = Virtual::new(&believed, real, noise, seed)?;
                // As in the firmware, where they are parameters of their own.
                bench.limits_of(axis)?;
                if let Some(table) = table {
                    bench.use_table(in_single_precision(table)?);
                }
                figures(&mut bench, axis, args.seconds)
            }
        };
        let (without, with) = (play([0.0; 2])?, play([args.forward, args.feedback])?);
        rows.push(Row {
            believed: belief.what.clone(),
            table: belief.table,
            ratio: with.rms_error / without.rms_error,
            limit_cycle: with.swings > without.swings,
            without,
            with,
        });
    }
    Ok(rows)
}

/// Takes back what a run has changed, then the torque and the drive.
fn leave(mut bench: Remote, before: &Changes) -> Result<(), InputError> {
    let dropped = bench.use_table(None);
    let restored = bench.set(before);
    let ended = bench.finish();
    dropped.and(restored).and(ended)
}

/// The firmware behind a link, its friction parameters as they are, and the emulator that has to live as long.
type Linked = (Remote, Changes, Option<Emulator>);

fn linked(args: &Args, axis: &Believed, runs: usize) -> Result<Option<Linked>, InputError> {
    let seconds = (args.seconds + MOVES as f64 * (MOVE_S + REST_S) + 2.0) * 2.0;
    let (emulator, mut bench) = match args.place.on {
        On::Virtual => return Ok(None),
        On::Image => {
            remote::check(axis)?;
            let emulator = args
                .place
                .emulator(60 + (2.0 * seconds * runs as f64) as u64)?;
            let bench = Remote::new(&emulator.address, None, axis)?;
            (Some(emulator), bench)
        }
        On::Target => {
            let (to, answers) = (args.place.to(), args.place.answers());
            (None, Remote::new(to, answers, axis)?)
        }
    };
    let before = bench.get(&NAMES)?;
    Ok(Some((bench, before, emulator)))
}

/// The table, if there is one.
fn table_of(args: &Args) -> Result<Option<feed_forward::Table>, InputError> {
    let Some(path) = &args.feed_forward else {
        return Ok(None);
    };
    let table = feed_forward::Table::read(path)?;
    if table.dead_zone_nm > 0.0 {
        output::notices([&format!(
            "{}: its dead zone is left as it is; the controller adds the torques by position and direction",
            path.display()
        )]);
    }
    Ok(Some(table))
}

fn in_single_precision(table: &feed_forward::Table) -> Result<FeedForward<f32>, InputError> {
    table.for_control()?.cast().map_err(|error| {
        InputError::new(
            "feed-forward table",
            error.to_string(),
            "have `bristle diagnose --feed-forward` write it anew",
        )
    })
}

fn beliefs(axis: &Believed, args: &Args) -> Vec<Belief> {
    let right = [
        axis.coulomb_nm,
        axis.stiction_nm,
        axis.stribeck_velocity_rad_s,
        axis.stiffness_nm_rad,
        axis.damping_nm_s_rad,
        axis.viscous_nm_s_rad,
    ];
    let as_written = |table| Belief {
        what: "what the axis file says".to_owned(),
        friction: right,
        table,
    };
    let mut beliefs = vec![as_written(false)];
    if args.feed_forward.is_some() {
        beliefs.push(as_written(true));
    }
    for (name, places) in GROUPS {
        for percent in [args.off, -args.off] {
            let mut friction = right;
            for &place in places {
                friction[place] *= 1.0 + 0.01 * percent;
            }
            beliefs.push(Belief {
                what: format!("{name} {percent:+} %"),
                friction,
                table: false,
            });
        }
    }
    beliefs
}

impl Belief {
    /// The axis file with these numbers, and these shares of the friction compensated.
    fn axis(
        &self,
        file: &AxisFile,
        path: &Path,
        [forward, feedback]: [f64; 2],
    ) -> Result<Believed, InputError> {
        let mut file = file.clone();
        let friction = &mut file.friction;
        let fields = [
            &mut friction.coulomb,
            &mut friction.stiction,
            &mut friction.stribeck_velocity,
            &mut friction.stiffness,
            &mut friction.damping,
            &mut friction.viscous,
        ];
        for (field, value) in fields.into_iter().zip(self.friction) {
            *field = Some(value);
        }
        file.control.friction_forward = Some(forward);
        file.control.friction_feedback = Some(feedback);
        let believed = Believed::new(&file, path)?;
        believed.tick::<f32>(1.0 / believed.rate_hz)?;
        Ok(believed)
    }

    /// As the firmware takes them.
    fn changes(&self, shares: [f64; 2]) -> Changes {
        let mut changes = Changes::default();
        for (name, value) in NAMES.iter().zip(self.friction.iter().chain(&shares)) {
            if let Some(number) = parameter(name) {
                changes.add(number, *value as f32);
            }
        }
        changes
    }
}

/// How far the reversals go from where they begin, rad.
fn travel_rad(axis: &Believed) -> f32 {
    let reversals = Named::Reversals.experiment(axis, axis.rate_hz);
    reversals.needs(1.0 / axis.rate_hz as f32).travel_rad
}

/// Where it is ended, rad: an axis that goes twice as far as asked has lost its reference.
fn furthest(axis: &Believed) -> f32 {
    2.0 * travel_rad(axis)
}

fn figures(bench: &mut dyn Bench, axis: &Believed, seconds: f64) -> Result<Figures, InputError> {
    let ticks = |seconds: f64| (seconds * axis.rate_hz).round() as u32;
    let reversals = Named::Reversals.experiment(axis, axis.rate_hz);
    let (asked, went) = play(bench, axis, &reversals, ticks(seconds))?;
    let skip = (CATCHES_UP_S * axis.rate_hz) as usize;
    let errors = asked.iter().zip(&went).skip(skip);
    let errors = errors.map(|(asked, went)| (asked - *went as f64) * axis.rad_per_count());
    let errors: Vec<f64> = errors.collect();
    let asked: Vec<i64> = asked.iter().map(|counts| counts.round() as i64).collect();
    let later = |values: &[i64]| turns(values.get(skip..).unwrap_or_default());
    let mut swings = later(&went).saturating_sub(later(&asked));
    bench.rest(ticks(0.2), &|| !source::interrupted())?;
    let moves = Experiment::Moves {
        length_rad: travel_rad(axis),
        move_ticks: ticks(MOVE_S),
        pause_ticks: ticks(REST_S),
        pauses: 1,
    };
    let whole = ticks(MOVE_S) + ticks(REST_S);
    let (_, went) = play(bench, axis, &moves, whole * MOVES as u32)?;
    for one in went.chunks(whole as usize) {
        let later = (ticks(MOVE_S) + ticks(0.5 * REST_S)) as usize;
        swings += turns(one.get(later..).unwrap_or_default());
    }
    bench.rest(ticks(0.2), &|| !source::interrupted())?;
    Ok(Figures {
        rms_error: rms(errors.iter().copied()),
        worst_error: errors.iter().fold(0.0, |most, e| e.abs().max(most)),
        swings,
    })
}

/// What an experiment asks for and where the axis was, both in counts from its beginning, tick by tick.
fn play(
    bench: &mut dyn Bench,
    axis: &Believed,
    experiment: &Experiment<f32>,
    ticks: u32,
) -> Result<(Vec<f64>, Vec<i64>), InputError> {
    let mut player = Player::new(*experiment, 1.0 / axis.rate_hz as f32);
    let (mut asked, mut went) = (Vec::new(), Vec::new());
    let mut first = None;
    let bounds = Bounds {
        travel_rad: furthest(axis),
        ..Bounds::open(ticks)
    };
    let seen = bench.play(experiment, &bounds, &mut |sample, _| {
        let (begin_s, begin) = *first.get_or_insert((sample.time_s, sample.counts));
        let place = ((sample.time_s - begin_s) * axis.rate_hz).round() as usize;
        // A sample that was lost is where the one before was.
        while asked.len() <= place {
            let at_rad = match player.next_tick() {
                Reference::Position { position_rad, .. } => f64::from(position_rad),
                _ => f64::NAN,
            };
            asked.push(at_rad / axis.rad_per_count());
            went.push(sample.counts - begin);
        }
        Ok(!source::interrupted())
    })?;
    if seen.end != bristle_core::experiment::End::Finished {
        return Err(InputError::new(
            "compensate",
            format!(
                "the experiment did not play to its end: {}, {}",
                seen.end.text(),
                seen.fault.text()
            ),
            "raise the axis's limits, or give smaller shares",
        ));
    }
    Ok((asked, went))
}

/// Changes of direction by [`SWING_COUNTS`] and more.
fn turns(counts: &[i64]) -> usize {
    let Some(&first) = counts.first() else {
        return 0;
    };
    // The extremes since the last turn: what the axis would have to come back from.
    let (mut low, mut high, mut direction, mut turns) = (first, first, 0, 0);
    for &now in counts {
        (low, high) = (low.min(now), high.max(now));
        let up = now >= low + SWING_COUNTS;
        let down = now <= high - SWING_COUNTS;
        if up && direction != 1 {
            turns += usize::from(direction != 0);
            (direction, high) = (1, now);
        } else if down && direction != -1 {
            turns += usize::from(direction != 0);
            (direction, low) = (-1, now);
        }
    }
    turns
}

fn show(rows: &[Row], setup: &Setup, args: &Args) -> Table {
    let unit = setup.believed.unit.position();
    let caption = format!(
        "{}: tracking error in reversals without compensation and with it, {} of the friction along the reference and {} of \
         the observed one",
        setup.name, args.forward, args.feedback
    );
    let header = [
        "the controller believes",
        &format!("without, {unit} rms"),
        "with",
        "share left",
        &format!("worst without, {unit}"),
        "with",
        "swings without",
        "with",
        "limit cycle",
    ];
    rows.iter()
        .fold(Table::new(&caption, &header), |table, row| {
            let added = if row.table { ", with the table" } else { "" };
            table.row(&[
                format!("{}{added}", row.believed),
                short(row.without.rms_error),
                short(row.with.rms_error),
                short(row.ratio),
                short(row.without.worst_error),
                short(row.with.worst_error),
                row.without.swings.to_string(),
                row.with.swings.to_string(),
                if row.limit_cycle { "yes" } else { "no" }.to_owned(),
            ])
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn swings_are_counted_and_jitter_is_not() {
        assert_eq!(turns(&[]), 0);
        assert_eq!(turns(&[0, 1, 2, 1, 0, 1, 2]), 0);
        assert_eq!(turns(&[0, 5, 10, 8, 10, 9, 12]), 0);
        assert_eq!(turns(&[0, 5, 10, 7, 10, 7]), 3);
        assert_eq!(turns(&[0, -5, -10, -7, -10]), 2);
        // The first way counts from either extreme before it.
        assert_eq!(turns(&[0, 2, -1, 2, -1]), 2);
    }
}
