//! The two real records of EMPS read cleanly. They belong to their authors, so the repository holds no copy: the
//! environment variable `BRISTLE_DATA` names the folder that holds `emps/`.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use bristle_gap::log::{EffortKind, PositionKind};
use bristle_gap::{AxisFile, Log, Unit};

fn record(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("BRISTLE_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let path = folder.join("emps").join(name);
    if path.is_file() {
        return Some(path);
    }
    // Past the macros, whose output a passing test swallows.
    let _ = writeln!(
        std::io::stderr(),
        "SKIPPED: {} is not there; set BRISTLE_DATA to the folder that holds emps/",
        path.display()
    );
    None
}

#[test]
fn real_records_read_and_write() {
    let axes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes");
    let axis = AxisFile::read(axes.join("emps.toml")).unwrap();
    for name in ["emps_train.csv", "emps_pulses.csv"] {
        let Some(path) = record(name) else { continue };
        let log = Log::read(&path).unwrap();
        assert_eq!(log.unit, Some(Unit::Linear));
        assert!((log.median_step_s() - 1e-3).abs() < 1e-12);
        assert!(log.is_uniform() && log.gaps().is_empty());
        assert!(log.notices().is_empty(), "{:?}", log.notices());
        assert_eq!(log.position.kind, PositionKind::M);
        assert_eq!(
            log.best_effort(&axis).unwrap().kind,
            EffortKind::TorqueMeasured
        );
        assert_eq!(log.effort_nm(&axis).unwrap().len(), log.len());
        // 24.84 s at 1 kHz, both ends included or not.
        assert!((24_840..=24_841).contains(&log.len()), "{}", log.len());

        let folder = tempfile::tempdir().unwrap();
        let copy = folder.path().join("copy.csv.gz");
        log.write(&copy).unwrap();
        let mut again = Log::read(&copy).unwrap();
        again.file.clone_from(&log.file);
        assert_eq!(again, log);
    }
}

#[test]
fn train_record_is_sound_and_its_floor_comes_from_repeats() {
    let axes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes");
    let axis = AxisFile::read(axes.join("emps.toml")).unwrap();
    let Some(path) = record("emps_train.csv") else {
        return;
    };
    let log = Log::read(&path).unwrap();
    let hygiene = bristle_gap::hygiene::inspect(&log, &axis).unwrap();
    assert!(hygiene.findings.is_empty(), "{:?}", hygiene.findings);
    let inertia = hygiene.balance.unwrap().inertia.unwrap().value;
    // Published: 95.11 kg by least squares in force; speeds below a twentieth of the top are left out here.
    assert!((inertia / 95.11 - 1.0).abs() < 0.02, "{inertia}");
    let floor = bristle_gap::floor::floor(&log, &axis, &hygiene).unwrap();
    println!(
        "{}\n{:?} {:?}",
        floor.text, floor.noise.interval, floor.noise.autoregressive
    );
    let repeats = floor.repeats.unwrap();
    assert_eq!(repeats.period_samples, 6240);
    // What the mean over four periods leaves is 0.329 N rms over all samples, 0.302 with the mean of each period taken off
    // as well. The mean holds a quarter of what does not repeat, so the force itself has more: 0.380.
    let force = log.effort_nm(&axis).unwrap();
    let phase = |k: usize| force.iter().skip(k % 6240).step_by(6240);
    let left = (0..force.len()).map(|k| force[k] - phase(k).sum::<f64>() / phase(k).count() as f64);
    let left = bristle_gap::signal::rms(left);
    assert!((0.328..0.330).contains(&left), "{left}");
    let freedom = 1.0 - 6240.0 / force.len() as f64;
    // The same sums in another order.
    let off = repeats.non_repeating_nm / (left / freedom.sqrt()) - 1.0;
    assert!(off.abs() < 1e-9, "{off} {}", floor.text);
}

#[test]
fn pulses_record_is_sound() {
    let axes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes");
    let axis = AxisFile::read(axes.join("emps.toml")).unwrap();
    let Some(path) = record("emps_pulses.csv") else {
        return;
    };
    let log = Log::read(&path).unwrap();
    let hygiene = bristle_gap::hygiene::inspect(&log, &axis).unwrap();
    assert!(
        hygiene.findings.is_empty(),
        "{:?} {:?}",
        hygiene.findings,
        hygiene.skew
    );
    let floor = bristle_gap::floor::floor(&log, &axis, &hygiene).unwrap();
    println!("{}", floor.text);
}
