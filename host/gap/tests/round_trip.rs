//! What is written reads back equal, and no bytes whatever make a reader panic.

use std::path::{Path, PathBuf};

use bristle_gap::axis_file::keys::{KEYS, Range};
use bristle_gap::axis_file::{EffectEntry, FrictionModel, StribeckShape};
use bristle_gap::log::{Effort, EffortKind, Position, PositionKind, Unknown};
use bristle_gap::{AxisFile, Log, Unit};
use proptest::prelude::*;

/// Every finite double, subnormal and negative zero too.
fn finite() -> impl Strategy<Value = f64> {
    any::<u64>()
        .prop_map(f64::from_bits)
        .prop_filter("finite", |value| value.is_finite())
}

prop_compose! {
    fn any_log()(rows in 2..30_usize)(
        times in proptest::collection::hash_set(-1_000_000_i32..1_000_000, rows),
        efforts in proptest::collection::vec(finite(), rows),
        counts in proptest::collection::vec(-1_i64 << 53..1 << 53, rows),
        positions in proptest::collection::vec(finite(), rows),
        cells in proptest::collection::vec("[ -~\n\"]*", rows),
        kind in 0..3,
        linear in any::<bool>(),
        step in 1e-9..1.0_f64,
    ) -> Log {
        let mut time_s: Vec<f64> = times.into_iter().map(|time| f64::from(time) * step).collect();
        time_s.sort_by(f64::total_cmp);
        let unit = if linear { Unit::Linear } else { Unit::Rotary };
        let position = match (kind, unit) {
            (0, _) => Position {
                kind: PositionKind::Counts,
                values: counts.into_iter().map(|count| count as f64).collect(),
            },
            (_, Unit::Rotary) => Position { kind: PositionKind::Rad, values: positions.clone() },
            (_, Unit::Linear) => Position { kind: PositionKind::M, values: positions.clone() },
        };
        let efforts = vec![
            Effort { kind: EffortKind::TorqueReference, values: efforts.clone() },
            Effort { kind: EffortKind::Current, values: efforts },
        ];
        Log {
            position_load: Some(positions.clone()),
            velocity: (kind == 1).then(|| positions.clone()),
            temperature_c: Some(positions),
            unknown: vec![Unknown { name: "a, note".to_owned(), values: cells.into_iter().collect() }],
            ..Log::new(PathBuf::new(), unit, time_s, efforts, position)
        }
    }
}

/// A value in the range of a key, made from any finite number.
fn fit(range: Range, value: f64) -> f64 {
    match range {
        Range::Any => value,
        Range::NotZero if value == 0.0 => 1.0,
        Range::NotZero => value,
        Range::Positive => value.abs().max(f64::MIN_POSITIVE),
        Range::Sign => 1.0_f64.copysign(value),
        Range::NotNegative => value.abs(),
        Range::Part => (value.abs() / f64::MAX) * 0.999,
        Range::Whole => (value.abs() / f64::MAX * 1000.0).floor(),
    }
}

prop_compose! {
    fn any_axis()(
        linear in any::<bool>(),
        // As many as there are keys.
        values in proptest::collection::vec(proptest::option::of(finite()), KEYS.len()),
        model in proptest::option::of(proptest::sample::select(FrictionModel::ALL)),
        shape in proptest::option::of(proptest::sample::select(StribeckShape::ALL)),
        effects in proptest::collection::vec(
            ("\\PC+|[a-z.]+", proptest::collection::btree_map("[a-zA-Z0-9_\" \u{7f}é\n]*", finite(), 0..4)),
            0..3,
        ),
    ) -> AxisFile {
        let unit = if linear { Unit::Linear } else { Unit::Rotary };
        // Made through text, as a user does: the fields' own ranges hold by construction.
        let mut text = String::new();
        for section in bristle_gap::axis_file::keys::SECTIONS {
            text += &format!("[{section}]\n");
            for (key, value) in KEYS.iter().zip(&values).filter(|(key, _)| key.section == section) {
                let inertia = key.rotary == "inertia_kg_m2";
                // Stiction has to be above Coulomb friction.
                let value = if key.rotary == "stiction_nm" { Some(f64::MAX) } else { *value };
                if let Some(value) = value.or(inertia.then_some(1.0)) {
                    text += &format!("{} = {:?}\n", key.name(unit), fit(key.range, value));
                }
            }
        }
        let mut file = AxisFile::parse(&text, "generated.toml").unwrap();
        file.friction.model = model;
        file.friction.stribeck_shape = shape;
        file.effects = effects
            .into_iter()
            .map(|(id, parameters)| EffectEntry {
                id: format!("x{id}"),
                parameters: parameters.into_iter().filter(|(name, _)| name != "id").collect(),
            })
            .collect();
        file
    }
}

proptest! {
    #[test]
    fn logs_read_back_equal(mut log in any_log(), packed: bool) {
        let folder = tempfile::tempdir().unwrap();
        log.file = folder.path().join(if packed { "log.csv.gz" } else { "log.csv" });
        log.write(&log.file).unwrap();
        let again = Log::read(&log.file).unwrap();
        prop_assert_eq!(&again, &log);
        // Equality lets -0.0 pass for 0.0.
        let bits = |log: &Log| -> Vec<u64> { log.efforts[0].values.iter().map(|x| x.to_bits()).collect() };
        prop_assert_eq!(bits(&again), bits(&log));
    }

    #[test]
    fn axis_files_read_back_equal(file in any_axis()) {
        let text = file.to_toml();
        let again = AxisFile::parse(&text, "again.toml").map_err(|error| TestCaseError::fail(format!("{error}\n{text}")))?;
        prop_assert_eq!(again, file);
    }

    #[test]
    fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400), gzip: bool) {
        read_both(&bytes, gzip);
    }

    #[test]
    fn no_near_miss_panics(
        text in "(\u{feff})?(time_s|torque_nm|position_rad|position_counts|force_n|[,;\"#\r\n]|[0-9.e+-]{1,5}|nan|inf|\\PC){0,40}"
    ) {
        read_both(text.as_bytes(), false);
    }

    #[test]
    fn no_near_axis_panics(
        text in "(\\[axis\\]\n|\\[\\[effect\\]\\]\n|inertia_kg_m2|mass_kg|id|friction|\\.| = |[\\[\\]{}\"'#,\r\n]|[0-9.e_+-]{1,5}|0x|nan|inf|\\PC){0,40}"
    ) {
        read_both(text.as_bytes(), false);
    }
}

/// Reads the bytes as both kinds of file; an error must be one line that names the file.
fn read_both(bytes: &[u8], gzip: bool) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("any");
    let mut all = if gzip {
        vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3]
    } else {
        Vec::new()
    };
    all.extend_from_slice(bytes);
    std::fs::write(&path, all).unwrap();
    let errors = [Log::read(&path).err(), AxisFile::read(&path).err()];
    for error in errors.into_iter().flatten() {
        let line = error.to_string();
        assert_eq!(line.lines().count(), 1, "{line}");
        assert!(line.starts_with(&path.display().to_string()), "{line}");
    }
}

#[test]
fn example_axes_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes");
    let mut seen = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let file = AxisFile::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(file.friction.model, Some(FrictionModel::ElastoPlastic));
        assert_eq!(AxisFile::parse(&file.to_toml(), &path).unwrap(), file);
        seen += 1;
    }
    assert_eq!(seen, 4);
}

/// A minute at 10 kHz.
#[test]
fn long_logs_read_fast() {
    let rows = 600_000;
    let wave =
        |period: f64| -> Vec<f64> { (0..rows).map(|i| (f64::from(i) / period).sin()).collect() };
    let folder = tempfile::tempdir().unwrap();
    let log = Log {
        position_ref: Some(wave(9e3)),
        ..Log::new(
            folder.path().join("long.csv"),
            Unit::Rotary,
            (0..rows).map(|i| f64::from(i) / 1e4).collect(),
            vec![Effort {
                kind: EffortKind::TorqueMeasured,
                values: wave(1e3),
            }],
            Position {
                kind: PositionKind::Rad,
                values: wave(7e3),
            },
        )
    };
    log.write(&log.file).unwrap();
    assert_eq!(Log::read(&log.file).unwrap(), log);
}
