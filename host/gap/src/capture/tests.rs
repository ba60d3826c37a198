//! Streams as they should not be.

use super::*;
use bristle_core::supervisor::State;
use bristle_core::trace::{MOST_SAMPLES, SAMPLE_BYTES, Status};
use bristle_core::wire::FrameWriter;
use proptest::prelude::*;
use std::convert::Infallible;

fn record(tick: u32) -> Record {
    Record {
        tick,
        counts: tick as i32 * 3,
        z_luenberger_rad: 1e-3,
        z_time_free_rad: 0.1 + tick as f32,
        velocity_rad_s: -0.3,
        torque_ref_nm: 0.035,
        status: Status::new(State::Armed, Limit::None, Fault::None, 0),
    }
}

fn frame(records: &[Record]) -> Vec<u8> {
    let mut buffer = [0; MOST_SAMPLES * SAMPLE_BYTES + OVERHEAD_BYTES];
    let mut frame = trace::begin(&mut buffer);
    records.iter().for_each(|r| trace::put(&mut frame, r));
    frame.finish(records.len() as u8).unwrap().to_vec()
}

/// Frames of ten samples each.
fn frames(ticks: std::ops::Range<u32>) -> Vec<Vec<u8>> {
    let records: Vec<Record> = ticks.map(record).collect();
    records.chunks(10).map(frame).collect()
}

fn decode(bytes: &[u8], piece: usize) -> (Vec<Sample>, Summary) {
    let mut capture = Capture::new(1e4);
    let mut samples = Vec::new();
    let mut take = |sample: &Sample| {
        samples.push(*sample);
        Ok::<(), Infallible>(())
    };
    for part in bytes.chunks(piece.max(1)) {
        capture.feed(part, &mut take).unwrap();
    }
    let summary = capture.finish(&mut take).unwrap();
    (samples, summary)
}

fn log_of(samples: &[Sample], position: Position) -> crate::Log {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let mut bytes = Vec::new();
    let layout = Layout {
        position,
        ..Layout::FIRMWARE
    };
    layout.header(&mut bytes).unwrap();
    for sample in samples {
        layout.row(&mut bytes, sample, None).unwrap();
    }
    std::fs::write(&path, bytes).unwrap();
    crate::Log::read(&path).unwrap()
}

#[test]
fn whole_stream_becomes_a_log() {
    let bytes = frames(100..200).concat();
    let (samples, summary) = decode(&bytes, 7);
    assert_eq!(
        (summary.samples, summary.lost, summary.other_bytes),
        (100, 0, 0)
    );
    let log = log_of(&samples, Position::Counts);
    assert_eq!((log.len(), log.gaps().len()), (100, 0));
    assert_eq!((log.time_s[0], log.position.values[0]), (0.01, 300.0));
    let z = log.unknown.iter().find(|c| c.name == "z_time_free_rad");
    let read: f32 = z.unwrap().values.iter().nth(5).unwrap().parse().unwrap();
    assert_eq!(read.to_bits(), record(105).z_time_free_rad.to_bits());
    let rad = log_of(
        &samples,
        Position::Rad {
            counts_per_turn: 300.0,
        },
    );
    assert_eq!(rad.position.values[0], std::f64::consts::TAU);
}

#[test]
fn a_lost_frame_is_a_gap_in_time() {
    let mut all = frames(0..100);
    all.remove(3);
    let (samples, summary) = decode(&all.concat(), 1000);
    assert_eq!((summary.samples, summary.lost, summary.gaps), (90, 10, 1));
    let gaps = log_of(&samples, Position::Counts).gaps();
    assert_eq!(
        (gaps.len(), gaps[0].start_s, gaps[0].end_s),
        (1, 0.0029, 0.004)
    );
}

#[test]
fn a_damaged_frame_is_counted_and_a_cut_one_is_not_damaged() {
    let mut bytes = frames(0..30).concat();
    bytes[350] ^= 1;
    let (_, summary) = decode(&bytes, 64);
    assert_eq!((summary.damaged_frames, summary.lost), (1, 10));
    assert_eq!(
        summary.other_bytes,
        (10 * SAMPLE_BYTES + OVERHEAD_BYTES) as u64
    );

    let bytes = frames(0..30).concat();
    let (_, summary) = decode(&bytes[..bytes.len() - 5], 64);
    assert_eq!((summary.samples, summary.damaged_frames), (20, 0));
    assert!(summary.other_bytes > 0);
}

#[test]
fn a_false_start_at_the_end_holds_nothing_back() {
    let mut bytes = vec![0x5a, 0xb1, 1, 30, 0, 4];
    bytes.extend(frames(0..20).concat());
    let (samples, summary) = decode(&bytes, 64);
    assert_eq!((samples.len(), summary.other_bytes), (20, 6));
}

#[test]
fn counter_and_number_wrap_and_restart() {
    let mut first = record(u32::MAX);
    first.counts = i32::MAX;
    let mut second = record(0);
    second.counts = i32::MIN + 4;
    let restarted = [record(7), record(8)];
    // From 0 to 7 is a loss of six; back to 7 is a restart.
    let bytes = [
        frame(&[first, second]),
        frame(&restarted),
        frame(&restarted),
    ]
    .concat();
    let (samples, summary) = decode(&bytes, 64);
    assert_eq!(samples[1].counts, i64::from(i32::MAX) + 5);
    assert!((samples[1].time_s - samples[0].time_s - 1e-4).abs() < 1e-9);
    assert_eq!((summary.lost, summary.restarts), (6, 1));
    assert!((samples[4].time_s - samples[3].time_s - 1.0).abs() < 1e-9);
    assert_eq!(samples[4].counts, 21);
}

#[test]
fn a_limit_in_time_ends_it_and_counts_what_was_taken() {
    let mut capture = Capture::new(1e4).at_most(0.0025);
    let mut samples = 0;
    let bytes = [vec![1, 2, 3], frames(7..100).concat()].concat();
    capture
        .feed(&bytes, |_| {
            samples += 1;
            Ok::<(), Infallible>(())
        })
        .unwrap();
    let summary = capture.summary();
    assert!(capture.is_done());
    assert_eq!((samples, summary.samples, summary.other_bytes), (25, 25, 3));
}

#[test]
fn faults_and_limits_are_told_once() {
    let mut records: Vec<Record> = (0..6).map(record).collect();
    for (i, fault) in [
        (2, Fault::Overspeed),
        (3, Fault::Overspeed),
        (5, Fault::DriveFault),
    ] {
        records[i].status = Status::new(State::Fault, Limit::Disarmed, fault, 0);
    }
    records[3].velocity_rad_s = f32::NAN;
    let (samples, summary) = decode(&frame(&records), 64);
    assert_eq!((samples.len(), summary.not_finite), (5, 1));
    let seen: Vec<_> = summary.faults.iter().map(|f| (f.tick, f.text)).collect();
    assert_eq!(
        seen,
        [(2, Fault::Overspeed.text()), (5, Fault::DriveFault.text())]
    );
    let limits: Vec<_> = summary.limits.iter().map(|l| (l.text, l.samples)).collect();
    assert_eq!(limits, [("nothing", 3), ("not armed", 3)]);
}

#[test]
fn another_version_is_not_guessed_at() {
    let mut buffer = [0; 64];
    let mut status = FrameWriter::new(&mut buffer, Kind::Status);
    status.u32(PROTOCOL_VERSION + 1);
    let bytes = [status.finish(1).unwrap(), &frame(&[record(1)])].concat();
    let (samples, summary) = decode(&bytes, 64);
    assert_eq!(
        (samples.len(), summary.foreign_version),
        (0, Some(PROTOCOL_VERSION + 1))
    );
}

/// What happens to a frame under way.
#[derive(Clone, Debug)]
enum Fate {
    Arrives,
    Lost,
    Damaged(usize),
    Cut(usize),
    Behind(Vec<u8>),
}

fn fate() -> impl Strategy<Value = Fate> {
    prop_oneof![
        4 => Just(Fate::Arrives),
        1 => Just(Fate::Lost),
        1 => (0_usize..290).prop_map(Fate::Damaged),
        1 => (0_usize..290).prop_map(Fate::Cut),
        1 => proptest::collection::vec(any::<u8>(), 1..40).prop_map(Fate::Behind),
    ]
}

proptest! {
    #[test]
    fn what_arrives_whole_is_kept_and_the_rest_is_missing_by_number(
        fates in proptest::collection::vec(fate(), 1..40), piece in 1_usize..700,
    ) {
        let mut bytes = Vec::new();
        let mut kept = Vec::new();
        for (i, fate) in fates.iter().enumerate() {
            let ticks = i as u32 * 10..i as u32 * 10 + 10;
            let mut one = frames(ticks.clone()).concat();
            match fate {
                Fate::Arrives => kept.extend(ticks),
                Fate::Lost => one.clear(),
                Fate::Damaged(at) => one[*at] ^= 0x10,
                Fate::Cut(at) => one.truncate(*at),
                Fate::Behind(rubbish) => {
                    bytes.extend(rubbish);
                    kept.extend(ticks);
                }
            }
            bytes.extend(one);
        }
        let (samples, summary) = decode(&bytes, piece);
        let got: Vec<u32> = samples.iter().map(|s| s.record.tick).collect();
        prop_assert_eq!(&got, &kept);
        let span = kept.last().map_or(0, |last| u64::from(last - kept[0]) + 1);
        prop_assert_eq!(summary.samples + summary.lost, span);
        for pair in samples.windows(2) {
            let ticks = f64::from(pair[1].record.tick - pair[0].record.tick);
            prop_assert!((pair[1].time_s - pair[0].time_s - ticks * 1e-4).abs() < 1e-9);
        }
    }

    #[test]
    fn no_bytes_make_it_panic(
        bytes in proptest::collection::vec(
            prop_oneof![Just(0x5a_u8), Just(0xb1), Just(1), Just(0), any::<u8>()], 0..3000),
        piece in 1_usize..400,
    ) {
        let (_, summary) = decode(&bytes, piece);
        prop_assert_eq!(summary.bytes, bytes.len() as u64);
    }

    #[test]
    fn any_samples_in_right_frames_make_rising_times(
        words in proptest::collection::vec(any::<[u32; 7]>(), 1..60), rate in 1e-3_f64..1e6,
    ) {
        let mut capture = Capture::new(rate);
        let mut times = Vec::new();
        let mut rows = Vec::new();
        for [tick, counts, a, b, v, u, status] in words {
            let record = Record {
                tick,
                counts: counts.cast_signed(),
                z_luenberger_rad: f32::from_bits(a),
                z_time_free_rad: f32::from_bits(b),
                velocity_rad_s: f32::from_bits(v),
                torque_ref_nm: f32::from_bits(u),
                status: Status(status),
            };
            capture.feed(&frame(&[record]), |sample| {
                times.push(sample.time_s);
                Layout::FIRMWARE.row(&mut rows, sample, None)
            }).unwrap();
        }
        prop_assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
        prop_assert!(String::from_utf8(rows).is_ok());
    }
}
