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
