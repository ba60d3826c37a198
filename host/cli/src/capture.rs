//! `bristle capture`: the firmware's live stream into a log.

use crate::about;
use crate::output::{self, Progress, short};
use crate::source::{self, End, Source};
use bristle_gap::capture::{
    About, Capture, Layout, MOST_FAULTS, Position, Recorder, Sample, Summary,
};
use bristle_gap::report::Table;
use bristle_gap::{AxisFile, InputError, Unit};
use serde_json::{Value, json};
use std::io::Read;
use std::path::PathBuf;

/// Ticks a second of the firmware.
const RATE_HZ: f64 = 10_000.0;

/// Record the firmware's full-rate stream as a log: from a debug probe, an RTT server, a file or the emulator.
///
/// The stream is RTT up channel 1. Time is the number of the tick over the rate, so that samples that were lost leave a
/// gap in time. Ctrl-C ends the capture and keeps what came until then; so does a connection that breaks.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle capture --probe --out log.csv.gz --seconds 10\n  bristle capture --from \
                        tcp:localhost:9090 --out log.csv      OpenOCD: rtt server start 9090 1\n  bristle capture \
                        --from jlink:localhost:19021 --out log.csv\n  bristle capture --from trace.bin --axis \
                        axes/bench.toml --position rad --out log.csv\n  some-rtt-tool | bristle capture --from - --out \
                        log.csv"
)]
#[command(group = clap::ArgGroup::new("source").required(true).args(["from", "probe"]))]
pub struct Args {
    /// Raw bytes of up channel 1: a file, `-` for standard input, tcp:HOST:PORT or jlink:HOST:PORT.
    #[arg(long, value_name = "SOURCE")]
    from: Option<Source>,
    /// A debug probe, by VID:PID or VID:PID:SERIAL where several are there; needs the build feature `probe`.
    #[arg(long, value_name = "SELECTOR", num_args = 0..=1, default_missing_value = "")]
    probe: Option<String>,
    /// Chip behind the probe.
    #[arg(
        long,
        value_name = "NAME",
        default_value = "STM32G474RETx",
        requires = "probe"
    )]
    chip: String,
    /// Log to write: CSV, packed where the name ends in .gz, or MCAP where it ends in .mcap.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Axis file, for rate and counts per revolution.
    #[arg(long, value_name = "FILE")]
    axis: Option<PathBuf>,
    /// Ticks a second; that of the axis file's observer, or else 10,000, where left out.
    #[arg(long, value_name = "HZ", value_parser = output::positive)]
    rate_hz: Option<f64>,
    /// Counts of a revolution, for --position rad; those of the axis file where left out.
    #[arg(long, value_name = "COUNTS", value_parser = output::positive)]
    counts_per_rev: Option<f64>,
    /// The firmware's image, whose hash a log in MCAP has.
    #[arg(long, value_name = "FILE")]
    firmware: Option<PathBuf>,
    /// Position as encoder counts or in rad.
    #[arg(long, value_name = "UNIT", value_parser = ["counts", "rad"], default_value = "counts")]
    position: String,
    /// Ends after so much time of the stream; without it, at its end or at Ctrl-C.
    #[arg(long, value_name = "S", value_parser = output::positive)]
    seconds: Option<f64>,
    /// Also write the counts as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let axis = args.axis.as_ref().map(AxisFile::read).transpose()?;
    let (rate_hz, position) = scales(args, axis.as_ref())?;
    let layout = Layout {
        position,
        ..Layout::FIRMWARE
    };
    let mut about = about::about(rate_hz, layout.unit);
    if let Some(file) = &axis {
        about::axis(&mut about, file);
    }
    if let Some(path) = &args.firmware {
        about::firmware(&mut about, path)?;
    }
    // Before the connection is made: a log that cannot be written should not cost a run.
    let mut log = Recorder::create(&args.out, layout, &about)?;
    source::catch_interrupts();
    let (name, reader) = open(args)?;
    let capture = Capture::new(rate_hz).at_most(args.seconds.unwrap_or(f64::INFINITY));
    let (end, summary) = record(reader, capture, &mut log)?;
    check(&name, &summary, &end)?;
    log.commit(&result(&summary, &end))?;
    if let End::Broken(why) = &end {
        output::notices([&format!(
            "{name}: the stream broke: {why}; what came until then is kept"
        )]);
    }
    if !output::json_on_stdout(args.json.as_deref()) {
        show(&summary, &end);
        output::print(&format!("log: {}\n", args.out.display()));
    }
    output::write_json(args.json.as_deref(), &as_json(&summary, &end))
}

/// Rate and position from options and axis file.
fn scales(args: &Args, axis: Option<&AxisFile>) -> Result<(f64, Position), InputError> {
    if let (Some(file), Some(path)) = (axis, &args.axis)
        && file.unit == Unit::Linear
    {
        return Err(InputError::new(
            path,
            "is of a linear axis, and the firmware knows rotary ones",
            "give an axis file with inertia_kg_m2",
        ));
    }
    let of_axis = axis.and_then(|file| file.observer.rate_hz);
    let rate_hz = args.rate_hz.or(of_axis).unwrap_or(RATE_HZ);
    if args.position == "counts" {
        return Ok((rate_hz, Position::Counts));
    }
    let counts = args
        .counts_per_rev
        .or(axis.and_then(|file| file.axis.counts_per_turn));
    match counts {
        Some(counts_per_turn) => Ok((rate_hz, Position::Rad { counts_per_turn })),
        None => Err(InputError::new(
            "--position rad",
            "needs the counts of a revolution",
            "give --counts-per-rev, or an axis file with counts_per_rev",
        )),
    }
}

fn open(args: &Args) -> Result<(String, Box<dyn Read + Send>), InputError> {
    match (&args.from, &args.probe) {
        (Some(source), _) => Ok((source.name().to_owned(), source.open()?)),
        (None, selector) => {
            let selector = selector.as_deref().unwrap_or_default();
            Ok(("probe".to_owned(), open_probe(selector, &args.chip)?))
        }
    }
}

#[cfg(feature = "probe")]
use crate::probe::open as open_probe;

#[cfg(not(feature = "probe"))]
fn open_probe(_selector: &str, _chip: &str) -> Result<Box<dyn Read + Send>, InputError> {
    Err(InputError::new(
        "--probe",
        "this build has no support for debug probes",
        "install with `cargo install --path host/cli --features probe`, or use an RTT server and --from tcp:HOST:PORT",
    ))
}

/// Writes rows until the stream ends.
fn record(
    reader: Box<dyn Read + Send>,
    mut capture: Capture,
    log: &mut Recorder,
) -> Result<(End, Summary), InputError> {
    let progress = Progress::counting("capture");
    let mut row = |sample: &Sample| log.row(sample, None);
    let end = source::pump(reader, |bytes| {
        capture.feed(bytes, &mut row)?;
        let (samples, lost) = capture.counts();
        progress.say(&format!(
            "{samples} samples, {lost} lost, {:.1} s",
            capture.span_s()
        ));
        Ok::<bool, InputError>(!capture.is_done())
    })?;
    let summary = match end {
        End::Enough => capture.summary(),
        _ => capture.finish(&mut row)?,
    };
    Ok((end, summary))
}

/// What came of it, for a log that has room for it.
fn result(summary: &Summary, end: &End) -> About {
    let mut result: About = counts(summary)
        .into_iter()
        .map(|(name, count)| (name.to_owned(), count.to_string()))
        .collect();
    result.insert("lost".to_owned(), summary.lost.to_string());
    result.insert("ended".to_owned(), ended(end).to_owned());
    result
}

fn ended(end: &End) -> &'static str {
    match end {
        End::Finished => "to its end",
        End::Interrupted => "until interrupted",
        End::Enough => "as long as asked for",
        End::Broken(_) => "until it broke",
    }
}

/// Refuses what is no log.
fn check(name: &str, summary: &Summary, end: &End) -> Result<(), InputError> {
    if let Some(version) = summary.foreign_version {
        let own = bristle_core::status::PROTOCOL_VERSION;
        return Err(InputError::new(
            name,
            format!("the stream has form {version}, and this program knows {own}"),
            "use firmware and program of the same version",
        ));
    }
    let rows = summary.samples - summary.not_finite;
    if rows >= 2 {
        return Ok(());
    }
    let why = match end {
        End::Broken(why) => format!(", then it broke: {why}"),
        _ => String::new(),
    };
    let samples = match rows {
        0 => "no sample",
        _ => "one sample only",
    };
    Err(InputError::new(
        name,
        format!("{samples} in {} bytes{why}", summary.bytes),
        "give the raw bytes of RTT up channel 1 while the firmware runs",
    ))
}

fn show(summary: &Summary, end: &End) {
    let caption = format!(
        "{} s from {} s after boot at {} Hz, {}",
        short(summary.last_s - summary.first_s),
        short(summary.first_s),
        summary.rate_hz,
        ended(end),
    );
    let row = |table: Table, name: &str, value: String| table.row(&[name.to_owned(), value]);
    let mut table = Table::new(&caption, &["stream", "count"]);
    for (name, count) in counts(summary) {
        table = row(table, name, count.to_string());
    }
    output::print_table(&table);
    let mut table = Table::new("Output", &["limited by", "samples", "share"]);
    for limit in &summary.limits {
        let share = 100.0 * limit.samples as f64 / summary.samples.max(1) as f64;
        table = table.row(&[
            limit.text.to_owned(),
            limit.samples.to_string(),
            format!("{share:.1} %"),
        ]);
    }
    output::print_table(&table);
    for fault in &summary.faults {
        output::print(&format!(
            "fault {} at {} s (tick {}): {}\n",
            fault.number, fault.time_s, fault.tick, fault.text
        ));
    }
    if summary.faults_in_all > MOST_FAULTS as u64 {
        output::print(&format!("{} faults in all\n", summary.faults_in_all));
    }
    if let Some(last) = &summary.last {
        let text = |known: Option<&'static str>| known.unwrap_or("unknown");
        output::print(&format!(
            "at the end: {}, limited by: {}, {}\n",
            text(last.status.state().map(|state| state.text())),
            text(last.status.limit().map(|limit| limit.text())),
            text(last.status.fault().map(|fault| fault.text())),
        ));
    }
}

/// The stream's and the firmware's own counts.
fn counts(summary: &Summary) -> Vec<(&'static str, u64)> {
    let mut counts = vec![
        ("samples", summary.samples),
        ("samples lost, by their numbers", summary.lost),
        ("gaps", summary.gaps),
        ("restarts", u64::from(summary.restarts)),
        ("samples left out, not finite", summary.not_finite),
        ("frames with a bad CRC", u64::from(summary.damaged_frames)),
        ("frames of a wrong content", summary.odd_frames),
        ("bytes outside of frames", summary.other_bytes),
        ("faults", summary.faults_in_all),
    ];
    if let Some(report) = &summary.report {
        counts.extend(
            [
                ("firmware: samples lost, queue full", report.queue_overruns),
                ("firmware: frames dropped, link full", report.frames_dropped),
                ("firmware: most cycles to entry", report.latency_cycles[1]),
                ("firmware: most cycles of a tick", report.run_cycles[1]),
                ("firmware: parameter version", report.parameter_version),
            ]
            .map(|(name, count)| (name, u64::from(count))),
        );
    }
    counts
}

fn as_json(summary: &Summary, end: &End) -> Value {
    let faults = summary.faults.iter().map(|fault| {
        json!({"time_s": fault.time_s, "tick": fault.tick, "number": fault.number, "text": fault.text})
    });
    let limits = summary
        .limits
        .iter()
        .map(|limit| json!({"number": limit.number, "text": limit.text, "samples": limit.samples}));
    let last = summary.last.map(|last| {
        json!({
            "tick": last.tick,
            "state": last.status.state().map(|state| state.text()),
            "limit": last.status.limit().map(|limit| limit.text()),
            "fault": last.status.fault().map(|fault| fault.text()),
        })
    });
    let firmware = summary.report.map(|report| {
        json!({
            "queue_overruns": report.queue_overruns,
            "frames_dropped": report.frames_dropped,
            "log_frames_dropped": report.log_frames_dropped,
            "rejected": report.rejected,
            "requests_refused": report.requests_refused,
            "most_latency_cycles": report.latency_cycles[1],
            "most_run_cycles": report.run_cycles[1],
            "parameter_version": report.parameter_version,
        })
    });
    json!({
        "schema": 1,
        "end": match end {
            End::Finished => "finished",
            End::Interrupted => "interrupted",
            End::Enough => "enough",
            End::Broken(_) => "broken",
        },
        "rate_hz": summary.rate_hz,
        "first_s": summary.first_s,
        "last_s": summary.last_s,
        "bytes": summary.bytes,
        "samples": summary.samples,
        "lost": summary.lost,
        "gaps": summary.gaps,
        "restarts": summary.restarts,
        "not_finite": summary.not_finite,
        "damaged_frames": summary.damaged_frames,
        "odd_frames": summary.odd_frames,
        "other_bytes": summary.other_bytes,
        "faults": faults.collect::<Vec<_>>(),
        "faults_in_all": summary.faults_in_all,
        "limits": limits.collect::<Vec<_>>(),
        "last": last,
        "firmware": firmware,
    })
}
