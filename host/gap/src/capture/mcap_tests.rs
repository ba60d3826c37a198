//! MCAP files read back by the format's own library.

use super::*;
use bristle_core::supervisor::State;
use bristle_core::trace::{FLAG_EXPERIMENT, Status};
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
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
