//! Every bad file of the contract, through the command: one line that names file and place, exit code 2, no output.

use std::path::Path;
use std::process::{Command, Output};

const AXIS: &str = "[axis]\ninertia_kg_m2 = 2.5e-5\n[friction]\ncoulomb_nm = 0.02\n";
const LOG: &str = "time_s,torque_nm,position_rad\n0.0,0.0,0.0\n0.001,0.01,0.0\n0.002,0.01,0.001\n";

fn bristle(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bristle"))
        .args(words)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// A folder that holds an axis file and a log.
fn folder(axis: &[u8], log: &[u8]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("axis.toml"), axis).unwrap();
    std::fs::write(folder.path().join("log.csv"), log).unwrap();
    folder
}

const SIMULATE: [&str; 7] = [
    "simulate",
    "--axis",
    "axis.toml",
    "--input",
    "log.csv",
    "--out",
    "out.csv",
];

/// A case's name, the file's bytes, and what the line must say.
type Case = (&'static str, &'static [u8], &'static str);

const LOGS: &[Case] = &[
    (
        "missing time",
        b"torque_nm,position_rad\n0,0\n0,0\n",
        "log.csv:1: missing column: time_s",
    ),
    (
        "missing effort",
        b"time_s,position_rad\n0,0\n1,0\n",
        "log.csv:1: missing column: an effort",
    ),
    (
        "missing position",
        b"time_s,torque_nm\n0,0\n1,0\n",
        "log.csv:1: missing column: a position",
    ),
    (
        "misspelt column",
        b"time_s,torque_Nm,position_rad\n0,0,0\n1,0,0\n",
        "did you mean torque_nm",
    ),
    (
        "nan",
        b"time_s,torque_nm,position_rad\n0,0,0\n1,NaN,0\n",
        "log.csv:3: column torque_nm:",
    ),
    (
        "infinity",
        b"time_s,torque_nm,position_rad\n0,0,0\n1,0,-inf\n",
        "log.csv:3: column position_rad:",
    ),
    (
        "word",
        b"time_s,torque_nm,position_rad\n0,0,0\n1,abc,0\n",
        "log.csv:3: column torque_nm:",
    ),
    (
        "empty cell",
        b"time_s,torque_nm,position_rad\n0,0,0\n1,,0\n",
        "log.csv:3: column torque_nm:",
    ),
    (
        "duplicate time",
        b"time_s,torque_nm,position_rad\n0,0,0\n0,0,0\n",
        "log.csv:3: column time_s:",
    ),
    (
        "backward time",
        b"time_s,torque_nm,position_rad\n1,0,0\n0,0,0\n",
        "log.csv:3: column time_s:",
    ),
    (
        "short row",
        b"time_s,torque_nm,position_rad\n0,0,0\n1,0\n",
        "log.csv:3: column position_rad:",
    ),
    (
        "long row",
        b"time_s,torque_nm,position_rad\n0,0,0\n1,0,0,0\n",
        "log.csv:3: column 4:",
    ),
    ("empty file", b"", "log.csv:1: the file is empty"),
    (
        "header only",
        b"time_s,torque_nm,position_rad\n",
        "log.csv:1: only a header",
    ),
    (
        "not text",
        b"time_s,torque_nm\xff\xfe\x00,position_rad\n",
        "log.csv:1:",
    ),
    ("truncated gzip", b"\x1f\x8b\x08\x00\x00", "log.csv:"),
    (
        "mixed units",
        b"time_s,force_n,position_rad\n0,0,0\n1,0,0\n",
        "log.csv:1: column",
    ),
];

const AXES: &[Case] = &[
    (
        "unknown key",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\ncoulom_nm = 0.1\n",
        "axis.toml:4:1: unknown key `coulom_nm`",
    ),
    (
        "no inertia",
        b"[friction]\ncoulomb_nm = 0.1\n",
        "inertia_kg_m2",
    ),
    (
        "wrong type",
        b"[axis]\ninertia_kg_m2 = \"heavy\"\n",
        "axis.toml:2:",
    ),
    (
        "negative",
        b"[axis]\ninertia_kg_m2 = -1.0\n",
        "axis.toml:2:",
    ),
    ("infinite", b"[axis]\ninertia_kg_m2 = inf\n", "axis.toml:2:"),
    ("not toml", b"[axis\n", "axis.toml:1:"),
    ("not text", b"\xff\xfe", "axis.toml:1:"),
    ("empty", b"", "axis.toml:"),
    (
        "no coulomb",
        b"[axis]\ninertia_kg_m2 = 1e-4\n",
        "coulomb_nm",
    ),
    (
        "unknown effect",
        b"[axis]\ninertia_kg_m2 = 1e-4\n[friction]\ncoulomb_nm = 0.1\n[[effect]]\nid = \"x.y\"\n",
        "effect x.y does not exist",
    ),
];

/// One line that says it, exit code 2, and no file but those given.
fn assert_refused(name: &str, folder: &Path, output: &Output, says: &str) {
    let text = String::from_utf8_lossy(&output.stderr);
    let errors: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with("note: "))
        .collect();
    assert_eq!(output.status.code(), Some(2), "{name}: {text}");
    assert_eq!(errors.len(), 1, "{name}: {text}");
    assert!(errors[0].contains(says), "{name}: {text}");
    assert!(output.stdout.is_empty(), "{name}");
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    files.sort();
    assert_eq!(files, ["axis.toml", "log.csv"], "{name}");
}

#[test]
fn bad_logs() {
    for (name, bytes, says) in LOGS {
        let folder = folder(AXIS.as_bytes(), bytes);
        let words = [
            "observe",
            "--axis",
            "axis.toml",
            "log.csv",
            "--out",
            "states.csv",
        ];
        let output = bristle(folder.path(), &words);
        assert_refused(name, folder.path(), &output, says);
        // An input of a simulation may lack the position; the rest is refused alike.
        if *name != "missing position" {
            let output = bristle(folder.path(), &SIMULATE);
            assert_refused(name, folder.path(), &output, "log.csv");
        }
    }
}

#[test]
fn bad_axis_files() {
    for (name, bytes, says) in AXES {
        let folder = folder(bytes, LOG.as_bytes());
        let output = bristle(folder.path(), &SIMULATE);
        assert_refused(name, folder.path(), &output, says);
    }
}

#[test]
fn bad_usage() {
    let folder = tempfile::tempdir().unwrap();
    let cases: &[&[&str]] = &[
        &[],
        &["bensh"],
        &["bench", "--seconds", "-1"],
        &["bench", "--seconds", "nan"],
        &["bench", "--seconds", "1e12"],
        &["compare", "--seconds", "1e12"],
        &["observe", "--axis", "axis.toml"],
        &["simulate", "--axis", "axis.toml", "--out", "out.csv"],
        &[
            "simulate",
            "--axis",
            "axis.toml",
            "--experiment",
            "dance",
            "--out",
            "out.csv",
        ],
        &["check", "--axis", "nowhere.toml"],
    ];
    for words in cases {
        let output = bristle(folder.path(), words);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        assert!(!output.stderr.is_empty(), "{words:?}");
    }
}

#[test]
fn bad_effects() {
    let folder = folder(AXIS.as_bytes(), LOG.as_bytes());
    let cases = [
        ("actuator.coging", "actuator.cogging"),
        ("actuator.cogging:amplitude", "has no value"),
        ("actuator.cogging:amplitude_nm=big", "is not a number"),
        ("actuator.cogging:amplitude_nm=inf", "not finite"),
        ("mechanics.offset:force_n=1", "torque_nm"),
    ];
    for (effect, says) in cases {
        let words = [&SIMULATE[..], &["--effect", effect]].concat();
        let output = bristle(folder.path(), &words);
        assert_refused(effect, folder.path(), &output, says);
    }
}

#[test]
fn an_output_that_cannot_be_written_leaves_the_old_one() {
    let folder = folder(AXIS.as_bytes(), LOG.as_bytes());
    let words = [
        "observe",
        "--axis",
        "axis.toml",
        "log.csv",
        "--out",
        "no/such/folder.csv",
    ];
    let output = bristle(folder.path(), &words);
    assert_refused(
        "no folder",
        folder.path(),
        &output,
        "folder.csv: cannot be written",
    );
}
