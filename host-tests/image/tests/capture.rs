//! The image's raw stream through the decoder of `bristle capture`: a log that lacks nothing and equals the host.

mod common;
#[path = "common/reference.rs"]
mod reference;

use bristle_core::command::Command;
use bristle_core::experiment::Bounds;
use bristle_core::parameters::BENCH;
use bristle_gap::capture::{Capture, Layout, Sample, Summary};
use bristle_gap::log::Log;
use bristle_image::host::Session;
use reference::{SINE, bits, on_the_host};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// Ticks of the experiment.
const TICKS: u64 = 20_000;

/// A file of this test.
fn place(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Decodes a raw stream into a log.
fn capture(raw: &Path, log: &Path) -> Summary {
    let mut file = BufWriter::new(File::create(log).unwrap());
    let layout = Layout::FIRMWARE;
    layout.header(&mut file).unwrap();
    let mut capture = Capture::new(1e4);
    let bytes = std::fs::read(raw).unwrap();
    let mut row = |sample: &Sample| layout.row(&mut file, sample, None);
    // Pieces of no particular size, as a pipe gives them.
    for piece in bytes.chunks(4099) {
        capture.feed(piece, &mut row).unwrap();
    }
    capture.finish(&mut row).unwrap()
}

/// The values of a column that the log keeps as text.
fn column(log: &Log, name: &str) -> Vec<f32> {
    let column = log.unknown.iter().find(|column| column.name == name);
    let values = &column.unwrap().values;
    values.iter().map(|value| value.parse().unwrap()).collect()
}

#[test]
fn a_captured_run_lacks_nothing_and_equals_the_host() {
    let Some(image) = common::firmware() else {
        return;
    };
    let table = common::table(&image);
    let (raw, path) = (place("capture.bin"), place("capture.csv"));
    let mut session = Session::new(&image, &table).unwrap();
    session.raw = Some(Box::new(File::create(&raw).unwrap()));
    session.arm().unwrap();
    session
        .ask(&Command::Play(SINE, Bounds::open(u32::MAX)))
        .unwrap();
    session.run(TICKS).unwrap();

    let summary = capture(&raw, &path);
    let records = &session.heard.records;
    assert_eq!(summary.samples, records.len() as u64);
    assert_eq!((summary.lost, summary.gaps, summary.restarts), (0, 0, 0));
    assert_eq!((summary.damaged_frames, summary.odd_frames), (0, 0));
    assert_eq!((summary.other_bytes, summary.not_finite), (0, 0));
    assert!(summary.faults.is_empty());
    assert!(summary.report.is_some());

    let log = Log::read(&path).unwrap();
    assert_eq!((log.len(), log.gaps().len()), (records.len(), 0));
    let counts = &session.knobs.borrow().counts[..records.len()];
    let host = on_the_host(
        &BENCH,
        None,
        records,
        counts,
        &[(SINE, Bounds::open(u32::MAX))],
    );
    let z = column(&log, "z_time_free_rad");
    let z_luenberger = column(&log, "z_luenberger_rad");
    let velocity = log.velocity.as_ref().unwrap();
    let torque = &log.efforts[0].values;
    for (i, host) in host.iter().enumerate() {
        let read = [z_luenberger[i], z[i], velocity[i] as f32, torque[i] as f32];
        assert_eq!(read.map(f32::to_bits), bits(host), "row {i}");
        assert_eq!(log.position.values[i], f64::from(host.counts), "row {i}");
        assert_eq!(log.time_s[i], f64::from(host.tick) / 1e4, "row {i}");
    }
    println!(
        "{} samples captured, none lost; z, velocity, torque equal to the host's bit for bit",
        log.len()
    );
}

#[test]
fn what_a_stalled_host_misses_is_a_gap_in_the_log() {
    let Some(image) = common::firmware() else {
        return;
    };
    let table = common::table(&image);
    let (raw, path) = (place("stalled.bin"), place("stalled.csv"));
    let mut session = Session::new(&image, &table).unwrap();
    session.raw = Some(Box::new(File::create(&raw).unwrap()));
    session.run(6_000).unwrap();
    session.stalled = true;
    session.run(2_000).unwrap();
    session.stalled = false;
    session.run(1_000).unwrap();

    let summary = capture(&raw, &path);
    let continuity = session.heard.continuity;
    assert!(continuity.lost > 0, "the stall was too short");
    assert_eq!(
        (summary.samples, summary.lost),
        (continuity.received, continuity.lost)
    );
    let log = Log::read(&path).unwrap();
    let gaps = log.gaps();
    assert_eq!(gaps.len() as u64, summary.gaps);
    let missing: f64 = gaps.iter().map(|gap| gap.end_s - gap.start_s - 1e-4).sum();
    assert!((missing - continuity.lost as f64 * 1e-4).abs() < 1e-9);
}
