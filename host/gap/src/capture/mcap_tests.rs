//! MCAP files read back by the format's own library.

use super::*;
use crate::Log;
use bristle_core::supervisor::State;
use bristle_core::trace::{FLAG_EXPERIMENT, Status};
use bristle_plant::Unit;
use bristle_plant::axis::Truth;
use serde_json::Value;

fn sample(tick: u32) -> Sample {
    let fault = if tick < 6000 {
        Fault::None
    } else {
        Fault::DriveFault
    };
    Sample {
        time_s: f64::from(tick) * 1e-4,
        counts: -i64::from(tick),
        record: Record {
            tick,
            counts: -(tick as i32),
            z_luenberger_rad: if tick == 7 { f32::NAN } else { 0.1 },
            z_time_free_rad: -2e-9,
            velocity_rad_s: tick as f32 / 3.0,
            torque_ref_nm: 0.035,
            status: Status::new(State::Armed, Limit::None, fault, FLAG_EXPERIMENT),
        },
    }
}

/// Enough samples for several chunks; 20 of them are missing.
fn samples() -> impl Iterator<Item = Sample> {
    (0..10_000)
        .filter(|tick| !(500..520).contains(tick))
        .map(sample)
}

fn about(name: &str, value: &str) -> About {
    About::from([(name.to_owned(), value.to_owned())])
}

fn file(layout: Layout) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let mut log = Recorder::create(&path, layout, &about("firmware_sha256", "ab12")).unwrap();
    for sample in samples() {
        log.row(&sample, None).unwrap();
    }
    assert!(!path.exists());
    log.commit(&about("samples lost, by their numbers", "20"))
        .unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn every_sample_comes_back() {
    let bytes = file(Layout::FIRMWARE);
    let mut expected = samples();
    let mut changes = Vec::new();
    for message in ::mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let value: Value = serde_json::from_slice(&message.data).unwrap();
        assert_eq!(message.channel.message_encoding, "json");
        if message.channel.topic == "/status" {
            changes.push((message.log_time, value));
            continue;
        }
        let sample = expected.next().unwrap();
        assert_eq!(message.log_time, u64::from(sample.record.tick) * 100_000);
        assert_eq!(value["tick"], sample.record.tick);
        assert_eq!(value["position_counts"], sample.counts);
        // The shortest digits of single precision read back equal.
        let velocity = value["velocity_rad_s"].as_f64().unwrap() as f32;
        assert_eq!(velocity, sample.record.velocity_rad_s);
        assert_eq!(value["z_time_free_rad"].as_f64(), Some(-2e-9));
        assert_eq!(value["z_luenberger_rad"].is_null(), sample.record.tick == 7);
        assert_eq!(
            (&value["state"], &value["experiment"]),
            (&2.into(), &1.into())
        );
    }
    assert!(expected.next().is_none());
    let faults: Vec<_> = changes
        .iter()
        .map(|(ns, value)| (*ns, &value["fault"]))
        .collect();
    let (none, drive) = ("no fault".into(), "drive reports a fault".into());
    assert_eq!(faults, [(0, &none), (600_000_000, &drive)]);
}

#[test]
fn the_summary_has_counts_schema_and_what_is_known_of_the_log() {
    let bytes = file(Layout::FIRMWARE);
    let summary = ::mcap::Summary::read(&bytes).unwrap().unwrap();
    let counted = summary.stats.as_ref().unwrap();
    assert_eq!(counted.message_count, 10_000 - 20 + 2);
    assert!(counted.chunk_count > 1);
    let [about, result] = ["capture", "result"].map(|name| {
        let indexes = &summary.metadata_indexes;
        let index = indexes.iter().find(|index| index.name == name).unwrap();
        ::mcap::read::metadata(&bytes, index).unwrap().metadata
    });
    assert_eq!(about["firmware_sha256"], "ab12");
    assert_eq!(result["samples lost, by their numbers"], "20");
    // The schema names what the messages hold, no more and no less.
    let axis = summary
        .channels
        .values()
        .find(|channel| channel.topic == "/axis")
        .unwrap();
    let schema = axis.schema.as_ref().unwrap();
    assert_eq!(schema.encoding, "jsonschema");
    let schema: Value = serde_json::from_slice(&schema.data).unwrap();
    let named: Vec<&String> = schema["properties"].as_object().unwrap().keys().collect();
    let mut names = Layout::FIRMWARE.names();
    names.sort_unstable();
    assert_eq!(named, names);
}

#[test]
fn a_log_that_is_given_up_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let mut log = Recorder::create(&path, Layout::FIRMWARE, &About::new()).unwrap();
    log.row(&sample(0), None).unwrap();
    drop(log);
    let twice = folder.path().join("log.mcap.gz");
    let refused = Recorder::create(twice, Layout::FIRMWARE, &About::new()).err();
    assert!(refused.unwrap().message.contains("packed inside"));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn csv_and_mcap_are_the_same_log() {
    let folder = tempfile::tempdir().unwrap();
    let rad = Position::Rad {
        counts_per_turn: 16384.0,
    };
    for (layout, unit) in [
        (Layout::FIRMWARE, Unit::Rotary),
        (
            Layout {
                position: rad,
                unit: Unit::Linear,
                truth: true,
            },
            Unit::Linear,
        ),
    ] {
        let [csv, mcap] = ["log.csv.gz", "log.mcap"].map(|name| {
            let path = folder.path().join(name);
            let mut log = Recorder::create(&path, layout, &about("started", "now")).unwrap();
            for sample in samples() {
                log.row(&sample, Some(&Truth::default())).unwrap();
            }
            log.commit(&about("lost", "20")).unwrap();
            Log::read(path).unwrap()
        });
        assert_eq!((csv.len(), csv.unit), (9980, Some(unit)));
        assert_eq!(
            mcap.about,
            About::from(
                [("started", "now"), ("lost", "20")].map(|(a, b)| (a.to_owned(), b.to_owned()))
            )
        );
        assert!(
            mcap.notices()
                .last()
                .unwrap()
                .ends_with("log.mcap: recorded now, samples lost: 20")
        );
        // Beside the name and what only MCAP has room for, all of it: words, NaN and digits too.
        let mcap = Log {
            file: csv.file.clone(),
            about: About::new(),
            ..mcap
        };
        assert_eq!(mcap, csv);
    }
}

/// A file with one topic and these messages.
fn with(topic: &str, encoding: &str, messages: &[&str]) -> Vec<u8> {
    let mut writer = ::mcap::Writer::new(std::io::Cursor::new(Vec::new())).unwrap();
    let channel = writer
        .add_channel(0, topic, encoding, &About::new())
        .unwrap();
    for message in messages {
        let header = ::mcap::records::MessageHeader {
            channel_id: channel,
            sequence: 0,
            log_time: 0,
            publish_time: 0,
        };
        writer
            .write_to_known_channel(&header, message.as_bytes())
            .unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

#[test]
fn what_is_wrong_with_a_file_is_said_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let first = r#"{"time_s":0,"torque_nm":1,"position_rad":2}"#;
    let of_axis = |second: &str| with("/axis", "json", &[first, second]);
    let whole = of_axis(r#"{"position_rad":2,"time_s":1,"torque_nm":1}"#);
    std::fs::write(&path, &whole).unwrap();
    assert_eq!(Log::read(&path).unwrap().time_s, [0.0, 1.0]);
    let mut damaged = file(Layout::FIRMWARE);
    damaged[5000] ^= 1;
    let again = "copy or record the file again";
    let ours = "give a log of `bristle capture` or `run`, or write one as CSV";
    for (bytes, expected) in [
        (with("/pose", "cdr", &["x"]), format!("has no topic /axis, but `/pose`; {ours}")),
        (with("/axis", "cdr", &["x"]), format!("/axis is encoded as `cdr`, not as json; {ours}")),
        (with("/axis", "json", &[first]), "1 messages of /axis; a log needs at least two".into()),
        (
            with("/axis", "json", &[r#"{"time_s":0,"torque_nm":1}"#]),
            "message 1 of /axis: missing column: a position (position_rad, position_m or position_counts); the header \
             has `time_s`, `torque_nm`"
                .into(),
        ),
        (
            of_axis(r#"{"time_s":1,"torque_nm":null,"position_rad":2}"#),
            "column torque_nm: message 2 of /axis: is not a number (NaN); delete the row; a gap in time is allowed".into(),
        ),
        (
            of_axis(r#"{"time_s":0,"torque_nm":1,"position_rad":2}"#),
            "column time_s: message 2 of /axis: time `0` stands twice in a row; delete the duplicate row, or print time \
             with more digits"
                .into(),
        ),
        (
            of_axis(r#"{"time_s":1,"torque_nm":1}"#),
            format!("column position_rad: message 2 of /axis: has no value, where the first one has; {ours}"),
        ),
        (
            with("/axis", "json", &[r#"{"time_s":0,"time_s":1,"torque_nm":1,"position_rad":2}"#]),
            format!("message 1 of /axis: `time_s` stands twice or is no name; {ours}"),
        ),
        (whole[..whole.len() / 2].to_vec(), format!("the MCAP data end too early; {again}")),
        (damaged, "the MCAP data are damaged".into()),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let line = Log::read(&path).unwrap_err().to_string();
        let expected = format!("{}: {expected}", path.display());
        assert!(line.starts_with(&expected), "{line}\n{expected}");
        assert_eq!(line.lines().count(), 1);
    }
    std::fs::write(&path, of_axis("7")).unwrap();
    let line = Log::read(&path).unwrap_err().to_string();
    assert!(
        line.contains(
            "message 2 of /axis: is no JSON object of numbers (invalid type: integer `7`"
        ),
        "{line}"
    );
}

#[test]
fn no_damage_makes_the_reader_panic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let whole = with(
        "/axis",
        "json",
        &[r#"{"time_s":0,"torque_nm":1,"position_rad":2}"#; 3],
    );
    for at in 0..whole.len() {
        for change in [0xff, 0x80, 1] {
            let mut bytes = whole.clone();
            bytes[at] ^= change;
            std::fs::write(&path, &bytes).unwrap();
            // Samples that all have the same time are refused whatever else is read.
            let line = Log::read(&path).unwrap_err().to_string();
            assert_eq!(line.lines().count(), 1, "{line}");
        }
        std::fs::write(&path, &whole[..at]).unwrap();
        assert!(Log::read(&path).is_err());
    }
}
