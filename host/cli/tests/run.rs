//! `bristle run` on the virtual axis, and over a link to `bristle serve`.

mod common;
#[path = "common/every.rs"]
mod every;

use bristle_gap::Log;
use bristle_gap::experiments::Named;
use common::Server;
use every::plan;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

fn axis_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes/bench.toml")
}

fn bristle(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bristle"));
    command
        .current_dir(folder)
        .arg("run")
        .args(words)
        .arg("--axis")
        .arg(axis_path());
    command
}

fn run(folder: &Path, words: &[&str]) -> Output {
    bristle(folder, words).output().unwrap()
}

fn header(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().next().unwrap().to_owned()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

const PLAN: &str = "[plan]\nrest_s = 0.1\n\
    [[experiment]]\nkind = \"prbs\"\nseconds = 0.5\n\
    [[experiment]]\nkind = \"sine\"\nseconds = 1\nmost_travel_rad = 0.3\n\
    [[experiment]]\nkind = \"moves\"\nmove_s = 0.2\nseconds = 0.5\n";

#[test]
fn a_plan_of_three_leaves_three_logs_and_their_results() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("plan.toml"), PLAN).unwrap();
    let output = run(folder.path(), &["plan.toml", "--out", "logs"]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        text.contains("3 of 3 experiments") && text.contains("travel bound"),
        "{text}"
    );
    let logs = folder.path().join("logs");
    let expected = ["01-prbs.csv", "02-sine.csv", "03-moves.csv", "run.json"];
    assert_eq!(names(&logs), expected);
    let json = std::fs::read(logs.join("run.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["planned"], 3);
    let first = header(&logs.join("01-prbs.csv"));
    for (i, (name, ended)) in [
        ("01-prbs.csv", "time is over"),
        ("02-sine.csv", "travel bound"),
        ("03-moves.csv", "time is over"),
    ]
    .into_iter()
    .enumerate()
    {
        let log = Log::read(logs.join(name)).unwrap();
        let result = &json["experiments"][i];
        assert_eq!(result["samples"], log.len(), "{result}");
        assert_eq!(result["ended"], ended);
        assert_eq!(header(&logs.join(name)), first);
    }
    // The log is what the other commands take.
    let observed = Command::new(env!("CARGO_BIN_EXE_bristle"))
        .current_dir(folder.path())
        .args([
            "observe",
            "logs/03-moves.csv",
            "--out",
            "states.csv",
            "--axis",
        ])
        .arg(axis_path())
        .output()
        .unwrap();
    assert!(observed.status.success(), "{observed:?}");
}

#[test]
fn bad_words_and_plans_are_one_line_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    std::fs::write(place.join("bad.toml"), "[[experiment]]\nkind = \"sinus\"\n").unwrap();
    std::fs::write(
        place.join("much.toml"),
        "[[experiment]]\nkind = \"sine\"\nmost_speed_rad_s = 1e6\n",
    )
    .unwrap();
    let before = names(place);
    for (words, expected) in [
        (
            &["bad.toml", "--out", "logs"][..],
            "bad.toml:2:8: unknown kind `sinus`; did you mean \"sine\"?",
        ),
        (
            &["much.toml", "--out", "logs"],
            "much.toml:3:20: most_speed_rad_s is 1000000.0, and the axis allows 314.0 rad/s; ",
        ),
        (
            &["nothing.toml", "--out", "logs"],
            "nothing.toml: there is no such file; ",
        ),
        (
            &["wobble", "--out", "log.csv"],
            "wobble: is no experiment, and there is no such file; ",
        ),
        (
            &["sine", "--out", "log.csv", "--on", "image", "--truth"],
            "--truth: is for --on virtual only; ",
        ),
        (
            &["sine", "--out", "log.csv", "--on", "target"],
            "--on target: needs the server of the board's link; ",
        ),
        (
            &[
                "sine",
                "--out",
                "log.csv",
                "--on",
                "image",
                "--emulator",
                "none",
            ],
            "none: there is no such file; ",
        ),
        (
            &["sine", "--out", "log.csv", "--effect", "no.such"],
            "effect no.such does not exist; ",
        ),
    ] {
        let output = run(place, words);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {text}");
        assert!(text.contains(expected), "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
        assert_eq!(names(place), before, "{words:?}");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_was_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let child = bristle(
        folder.path(),
        &["sine", "--out", "log.csv", "--seconds", "1500"],
    )
    .args(["--json", "-"])
    .stdout(Stdio::piped())
    .stderr(Stdio::piped())
    .spawn()
    .unwrap();
    // Once rows have gone to the temporary file.
    let begun = Instant::now();
    let grows = || {
        std::fs::read_dir(folder.path()).unwrap().any(|entry| {
            entry
                .unwrap()
                .metadata()
                .is_ok_and(|about| about.len() > 100_000)
        })
    };
    while !grows() {
        assert!(
            begun.elapsed() < Duration::from_secs(60),
            "no row in a minute"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    let killed = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["interrupted"], true);
    assert_eq!(json["experiments"][0]["ended"], "stopped");
    let log = Log::read(folder.path().join("log.csv")).unwrap();
    assert_eq!(json["experiments"][0]["samples"], log.len());
    assert_eq!(names(folder.path()), ["log.csv"]);
}

/// Runs over a link to the control interrupt on the axis of a file.
fn over_a_link(folder: &Path, words: &[&str], axis: &Path) -> Output {
    let server = Server::start(axis);
    bristle(folder, words)
        .args(["--on", "target", "--to", &format!("tcp:{}", server.address)])
        .output()
        .unwrap()
}

#[test]
fn over_a_link_the_log_is_that_of_the_virtual_axis() {
    let folder = tempfile::tempdir().unwrap();
    let (linked, alone) = ("linked.csv", "alone.csv");
    let output = over_a_link(
        folder.path(),
        &["sine", "--seconds", "1.5", "--out", linked],
        &axis_path(),
    );
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("time is over"), "{text}");
    let output = run(folder.path(), &["sine", "--seconds", "1.5", "--out", alone]);
    assert!(output.status.success(), "{output:?}");
    let [linked, alone] = [linked, alone].map(|name| folder.path().join(name));
    assert_eq!(header(&linked), header(&alone));
    let [linked, alone] = [linked, alone].map(|path| Log::read(path).unwrap());
    assert_eq!(linked.len(), 15_000);
    // In open loop from rest the axis does the same, count by count.
    assert_eq!(linked.position, alone.position);
    assert_eq!(linked.efforts, alone.efforts);
    assert!(linked.gaps().is_empty());
    // It has moved: 1.35 times stiction breaks away.
    assert!(linked.position.values.iter().any(|&counts| counts > 300.0));
}

#[test]
fn over_a_link_a_plan_runs_and_a_bound_ends_an_experiment() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("plan.toml"), PLAN).unwrap();
    let output = over_a_link(folder.path(), &["plan.toml", "--out", "logs"], &axis_path());
    assert!(output.status.success(), "{output:?}");
    let json = std::fs::read(folder.path().join("logs/run.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let ends: Vec<_> = (0..3).map(|i| &json["experiments"][i]["ended"]).collect();
    assert_eq!(ends, ["time is over", "travel bound", "time is over"]);
    assert_eq!(json["experiments"][0]["samples"], 5000);
    assert_eq!(json["experiments"][2]["samples"], 5000);
    assert_eq!(json["experiments"][2]["lost"], 0);
}

#[test]
fn over_a_link_what_does_not_fit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["sine", "--seconds", "1", "--out", "log.csv"];
    for (from, to, expected) in [
        (
            "[observer]",
            "[drive]\ntorque_limit_nm = 0.03\n[observer]",
            "start: refused: the experiment asks for more torque than its bound or the controller's limit; ",
        ),
        (
            "counts_per_rev = 16384",
            "counts_per_rev = 65536",
            "the firmware has 65536 counts a turn, and the axis file 16384; ",
        ),
    ] {
        let text = std::fs::read_to_string(axis_path()).unwrap();
        let served = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(&served, text.replacen(from, to, 1)).unwrap();
        let output = over_a_link(folder.path(), &words, served.path());
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(expected), "{text}");
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
fn over_a_link_every_experiment_makes_a_log_that_identify_and_diagnose_take() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("plan.toml"), plan()).unwrap();
    let output = over_a_link(
        folder.path(),
        &["plan.toml", "--out", "linked"],
        &axis_path(),
    );
    assert!(output.status.success(), "{output:?}");
    let output = run(folder.path(), &["plan.toml", "--out", "alone"]);
    assert!(output.status.success(), "{output:?}");
    let logs = |place: &str| {
        (1..)
            .zip(Named::ALL.map(Named::name))
            .map(|(n, kind)| format!("{place}/{n:02}-{kind}.csv"))
            .collect::<Vec<_>>()
    };
    for (linked, alone) in logs("linked").iter().zip(&logs("alone")) {
        let [linked, alone] = [linked, alone].map(|log| folder.path().join(log));
        assert_eq!(header(&linked), header(&alone));
        assert_eq!(
            Log::read(&linked).unwrap().len(),
            15_000,
            "{}",
            linked.display()
        );
    }
    for (command, out, logs) in [
        ("identify", "--out", &logs("linked")[6..]),
        ("diagnose", "--report", &logs("linked")[7..]),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_bristle"))
            .current_dir(folder.path())
            .args([command, out, "result", "--json", "result.json", "--axis"])
            .arg(axis_path())
            .args(logs)
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        let json = std::fs::read(folder.path().join("result.json")).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        assert_eq!(json["schema"], 1, "{command}");
    }
}

#[test]
fn csv_and_mcap_of_one_run_are_one_log_and_identify_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let results = ["log.csv", "log.mcap"].map(|name| {
        let words = [
            "multisine",
            "--seconds",
            "2",
            "--position-noise-rad",
            "1e-4",
        ];
        let output = run(folder.path(), &[&words[..], &["--out", name]].concat());
        assert!(output.status.success(), "{output:?}");
        let words = ["identify", name, "--out", "fitted.toml", "--json", "-"];
        let output = Command::new(env!("CARGO_BIN_EXE_bristle"))
            .current_dir(folder.path())
            .args(words)
            .args(["--model", "coulomb-viscous", "--axis"])
            .arg(axis_path())
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let log = Log::read(folder.path().join(name)).unwrap();
        (log, json)
    });
    let [(csv, by_csv), (mcap, by_mcap)] = results;
    assert_eq!(by_mcap["parameters"], by_csv["parameters"]);
    assert!(
        by_csv["parameters"]["coulomb_nm"]["value"]
            .as_f64()
            .unwrap()
            > 0.0
    );
    assert_eq!(mcap.about["lost"], "0");
    // Beside its name and what it says of itself, the same to the last digit.
    let mcap = Log {
        file: csv.file.clone(),
        about: csv.about.clone(),
        ..mcap
    };
    assert_eq!(mcap, csv);
    let notes = by_mcap["notes"].to_string();
    assert!(notes.contains("samples lost: 0"), "{notes}");
}
