//! `bristle commission` as its user meets it, on the virtual axis, alone and behind a link.

mod common;

use bristle_gap::AxisFile;
use common::Server;
use std::io::{ErrorKind, Write};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn axis_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes/bench.toml")
}

fn bristle(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bristle"));
    command
        .current_dir(folder)
        .args(words)
        .arg("--axis")
        .arg(axis_path());
    command
}

const COMMISSION: [&str; 5] = ["commission", "--torque-nm", "0.12", "--out", "axis.toml"];

fn commission(folder: &Path, words: &[&str]) -> Output {
    bristle(folder, &[&COMMISSION, words].concat())
        .output()
        .unwrap()
}

/// Runs a command whose user answers its question.
fn answered(folder: &Path, words: &[&str], answer: &str) -> Output {
    let mut child = bristle(folder, words)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(answer.as_bytes()).unwrap();
    drop(stdin);
    child.wait_with_output().unwrap()
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

/// Nobody who has not said yes sees a real axis move: the board is not even connected to.
#[test]
fn without_a_yes_nothing_is_armed() {
    let folder = tempfile::tempdir().unwrap();
    let board = TcpListener::bind("127.0.0.1:0").unwrap();
    board.set_nonblocking(true).unwrap();
    let to = format!("tcp:{}", board.local_addr().unwrap());
    let target = ["--on", "target", "--to", &to];
    for (command, question) in [
        (
            &COMMISSION[..],
            "up to 0.1200 N m, up to 18.85 rad either way",
        ),
        (
            &["compensate"],
            "within the firmware's torque limit, up to 2.000 rad either way",
        ),
    ] {
        for answer in ["n\n", "\n", ""] {
            let output = answered(folder.path(), &[command, &target].concat(), answer);
            let text = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{text}");
            assert!(text.contains(question), "{text}");
            assert!(text.contains("given up; nothing"), "{text}");
            assert!(output.stdout.is_empty(), "{output:?}");
            let asked = board.accept().unwrap_err();
            assert_eq!(asked.kind(), ErrorKind::WouldBlock);
        }
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn behind_a_link_a_yes_is_enough() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(&axis_path());
    let to = format!("tcp:{}", server.address);
    let target = ["--turns", "0", "--on", "target", "--to", &to];
    // More than the firmware gives: said before anything moves.
    let output = answered(folder.path(), &[&COMMISSION[..], &target].concat(), "y\n");
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(
        text.contains("--torque-nm 0.12: is more than the firmware's torque_limit_nm, 0.091; "),
        "{text}"
    );
    assert!(output.stdout.is_empty(), "{output:?}");
    let words = ["commission", "--torque-nm", "0.09", "--out", "axis.toml"];
    let output = answered(folder.path(), &[&words[..], &target].concat(), "y\n");
    assert!(output.status.success(), "{output:?}");
    let file = AxisFile::read(folder.path().join("axis.toml")).unwrap();
    let stiction = file.friction.stiction.unwrap();
    assert!((stiction / 0.026 - 1.0).abs() < 0.1, "{stiction}");
}
