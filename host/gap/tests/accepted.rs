//! What the readers accept, and what they make of it.

use std::io::Write;
use std::path::Path;

use bristle_gap::axis_file::keys::KEYS;
use bristle_gap::axis_file::{FrictionModel, StribeckShape};
use bristle_gap::log::{EffortKind, Gap, PositionKind};
use bristle_gap::{AxisFile, Log, Unit};

fn log(text: &str) -> Log {
    Log::parse(text, "log.csv").unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_way_to_write_the_same_log() {
    let plain = log("time_s,torque_nm,position_rad\n0,1,2\n1,1.5,2\n");
    for text in [
        "\u{feff}time_s,torque_nm,position_rad\n0,1,2\n1,1.5,2\n",
        "time_s,torque_nm,position_rad\r\n0,1,2\r\n1,1.5,2\r\n",
        " time_s , torque_nm,position_rad \n0, 1 ,2\n1,+1.5e0,2.",
        "\"time_s\",\"torque_nm\",\"position_rad\"\n\"0\",1,2\n\n1,\"15e-1\",2\n\n",
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        std::fs::write(&path, text).unwrap();
        let mut again = Log::read(&path).unwrap_or_else(|error| panic!("{text:?}: {error}"));
        again.file.clone_from(&plain.file);
        assert_eq!(again, plain, "{text:?}");
    }
}

#[test]
fn gzip_in_several_members() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let mut bytes = Vec::new();
    for part in ["time_s,torque_nm,position_rad\n0,1,2\n", "1,1,2\n"] {
        let mut packed = flate2::write::GzEncoder::new(&mut bytes, flate2::Compression::fast());
        packed.write_all(part.as_bytes()).unwrap();
        packed.finish().unwrap();
    }
    std::fs::write(&path, bytes).unwrap();
    assert_eq!(Log::read(&path).unwrap().time_s, [0.0, 1.0]);
}

#[test]
fn the_best_effort() {
    let mut axis = AxisFile::new(Unit::Rotary, 1e-4);
    let reference = log("time_s,torque_ref_nm,current_a,position_rad\n0,1,2,0\n1,1,2,0\n");
    // Without the gain a current says nothing; with it, it is a measurement.
    assert_eq!(*reference.effort_nm(&axis).unwrap(), [1.0, 1.0]);
    axis.axis.torque_constant = Some(0.25);
    assert_eq!(*reference.effort_nm(&axis).unwrap(), [0.5, 0.5]);
    let measured =
        log("time_s,torque_ref_nm,torque_nm,current_a,position_rad\n0,1,3,2,0\n1,1,3,2,0\n");
    assert_eq!(
        measured.best_effort(&axis).unwrap().kind,
        EffortKind::TorqueMeasured
    );
    assert_eq!(measured.efforts.len(), 3);
}

#[test]
fn counts_become_radians_or_metres() {
    let counts = log("time_s,current_a,position_counts\n0,1,0\n1,1,4096\n");
    assert_eq!(counts.unit, None);
    let mut axis = AxisFile::new(Unit::Rotary, 1e-4);
    axis.axis.counts_per_turn = Some(16384.0);
    let quarter = std::f64::consts::FRAC_PI_2;
    assert_eq!(*counts.position_rad(&axis).unwrap(), [0.0, quarter]);
    axis.unit = Unit::Linear;
    assert_eq!(*counts.position_rad(&axis).unwrap(), [0.0, 0.25]);
    // Beside radians the counts are only kept.
    let both = log("time_s,torque_nm,position_counts,position_rad\n0,1,0,7\n1,1,4096,8\n");
    assert_eq!(both.position.kind, PositionKind::Rad);
    assert_eq!(both.unknown[0].name, "position_counts");
}

#[test]
fn unknown_columns_and_gaps_are_said_in_a_line_each() {
    let log = log(
        "time_s,torque_nm,position_rad,mode,velocity_rads\n0,1,2,a,1\n1,1,2,NaN,1\n2,1,2,,1\n5.5,1,2,d,1\n",
    );
    assert!(log.unknown[0].values.iter().eq(["a", "NaN", "", "d"]));
    assert_eq!(
        log.notices(),
        [
            "log.csv: ignored columns: mode, velocity_rads (not velocity_rad_s)",
            "log.csv: 1 gap in time, 3.500000 s in all, the first after 2 s",
        ]
    );
    let gap = Gap {
        before: 2,
        start_s: 2.0,
        end_s: 5.5,
    };
    assert_eq!(log.gaps(), [gap]);
    assert_eq!((log.median_step_s(), log.jitter_s()), (1.0, 0.0));
    assert!(!log.is_uniform());
}

#[test]
fn jitter_is_no_gap() {
    let log = log("time_s,torque_nm,position_rad\n0,1,2\n1.1,1,2\n2,1,2\n3,1,2\n");
    assert!(log.gaps().is_empty() && log.notices().is_empty());
    // Steps 1.1, 0.9, 1.0: root-mean-square deviation sqrt(0.02/3).
    assert!((log.jitter_s() - (0.02_f64 / 3.0).sqrt()).abs() < 1e-12);
    assert!(!log.is_uniform());
}

#[test]
fn every_key_of_an_axis_file() {
    for unit in [Unit::Rotary, Unit::Linear] {
        let mut text = String::new();
        for section in bristle_gap::axis_file::keys::SECTIONS {
            text += &format!("[{section}]\n");
            for key in KEYS.iter().filter(|key| key.section == section) {
                let value = match key.rotary {
                    "breakaway_ratio" => "0.5",
                    "encoder_sign" | "torque_sign" => "-1",
                    _ => "1_0",
                };
                text += &format!("{} = {value}\n", key.name(unit));
            }
        }
        let full = AxisFile::parse(&text, "axis.toml").unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((full.unit, full.axis.inertia), (unit, 10.0));
        assert_eq!(full.friction.rest_velocity, Some(10.0));
        assert_eq!(full.drive.delay_samples, Some(10));
        assert_eq!(
            full.to_toml()
                .lines()
                .filter(|line| line.contains('='))
                .count(),
            KEYS.len()
        );
    }
}

/// Both follow from the rotary name: one by its unit alone, the other by its word too.
#[test]
fn a_linear_limit_has_two_names() {
    for name in ["torque_limit_n", "force_limit_n"] {
        let text = format!("[axis]\nmass_kg = 1\n[drive]\n{name} = 3\n");
        let file = AxisFile::parse(&text, "axis.toml").unwrap();
        assert_eq!(file.drive.torque_limit, Some(3.0));
    }
}

#[test]
fn effects_keep_their_order() {
    let text =
        "[axis]\nmass_kg = 1\n[[effect]]\nid = \"b\"\nz = 1\na = 2.5\n[[effect]]\nid = \"a\"\n";
    let file = AxisFile::parse(text, "axis.toml").unwrap();
    assert_eq!(
        file.effects[0].parameters,
        [("z".to_owned(), 1.0), ("a".to_owned(), 2.5)]
    );
    assert_eq!(file.effects[0].parameter("a"), Some(2.5));
    assert_eq!(file.effects[1].id, "a");
}

/// The document lists every name that the reader knows.
#[test]
fn the_document_is_complete() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md");
    let text = std::fs::read_to_string(path).unwrap();
    let keys = KEYS.iter().flat_map(|key| [key.rotary, key.linear]);
    let models = FrictionModel::ALL.iter().map(|model| model.name());
    let shapes = StribeckShape::ALL.iter().map(|shape| shape.name());
    for name in keys.chain(models).chain(shapes) {
        assert!(
            text.contains(&format!("`{name}`")),
            "{name} is not in docs/formats.md"
        );
    }
}
