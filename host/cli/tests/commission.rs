//! `bristle commission` as its user meets it, on the virtual axis.

use bristle_gap::AxisFile;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn axis_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes/bench.toml")
}

fn commission(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bristle"))
        .current_dir(folder)
        .args(["commission", "--torque-nm", "0.12", "--out", "axis.toml"])
        .args(words)
        .arg("--axis")
        .arg(axis_path())
        .output()
        .unwrap()
}

/// The bench axis with keys put into its sections.
fn faulty(folder: &Path, changes: &[(&str, &str)]) {
    let mut text = std::fs::read_to_string(axis_path()).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    std::fs::write(folder.join("faulty.toml"), text).unwrap();
}

#[test]
fn a_faulty_axis_gets_a_file_that_says_so() {
    let folder = tempfile::tempdir().unwrap();
    faulty(
        folder.path(),
        &[("[friction]", "encoder_sign = -1\n[friction]")],
    );
    let output = commission(folder.path(), &["--real", "faulty.toml"]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("changed   the encoder counts down"), "{text}");
    let path = folder.path().join("axis.toml");
    let file = AxisFile::read(&path).unwrap();
    assert_eq!(file.axis.encoder_sign, Some(-1.0));
    let written = std::fs::read_to_string(path).unwrap();
    assert!(
        written.starts_with("# Written by bristle commission"),
        "{written}"
    );
    assert!(
        written.contains("# encoder, changed: the encoder counts down"),
        "{written}"
    );
}

#[test]
fn a_stuck_axis_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let heavy = [
        ("coulomb_nm = 0.020", "coulomb_nm = 10"),
        ("stiction_nm = 0.026", "stiction_nm = 10"),
        ("stiffness_nm_rad = 10.53", "stiffness_nm_rad = 2e3"),
    ];
    faulty(folder.path(), &heavy);
    let output = commission(folder.path(), &["--real", "faulty.toml", "--turns", "0"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(
        text.contains("axis: is stuck: it did not move either way at up to 0.12"),
        "{text}"
    );
    assert!(!folder.path().join("axis.toml").exists());
}

#[test]
fn what_belongs_to_another_place_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = commission(folder.path(), &["--on", "image", "--real", "faulty.toml"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(
        text.starts_with("--real: is for --on virtual only; "),
        "{text}"
    );
}
