//! `bristle identify` names what is wrong with a log before it fits, and says what it left out.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

/// A small servo motor; reading and fitting its logs takes a moment.
const AXIS: &str = "[axis]\ninertia_kg_m2 = 3.1e-4\ncounts_per_rev = 131072\n[friction]\ncoulomb_nm = 0.08\n\
    stiction_nm = 0.10\nstribeck_velocity_rad_s = 0.5\nstiffness_nm_rad = 30.0\ndamping_nm_s_rad = 0.05\n\
    viscous_nm_s_rad = 0.002\n[observer]\nrate_hz = 1000\nl1_1_s = 150\n";

fn bristle(folder: &Path, words: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bristle"))
        .args(words)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Rows of a simulated experiment: time, torque, its reference, position, and position reference where there is one.
fn rows(folder: &Path, experiment: &str) -> (String, Vec<Vec<f64>>) {
    let words = [
        "simulate",
        "--axis",
        "axis.toml",
        "--experiment",
        experiment,
    ];
    let more = [
        "--seconds",
        "6",
        "--torque-noise-nm",
        "0.001",
        "--out",
        "log.csv",
    ];
    let output = bristle(folder, &[&words[..], &more].concat());
    assert!(output.status.success(), "{output:?}");
    let text = std::fs::read_to_string(folder.join("log.csv")).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let number = |cell: &str| cell.parse().unwrap();
    let rows = rows.lines().map(|row| row.split(',').map(number).collect());
    (header.to_string(), rows.collect())
}

fn write(folder: &Path, header: &str, rows: &[Vec<f64>]) {
    let mut text = format!("{header}\n");
    for row in rows {
        let cells: Vec<String> = row.iter().map(|x| format!("{x:?}")).collect();
        text += &(cells.join(",") + "\n");
    }
    std::fs::write(folder.join("log.csv"), text).unwrap();
}

fn identify(folder: &Path) -> Output {
    let words = [
        "identify",
        "--axis",
        "axis.toml",
        "log.csv",
        "--model",
        "coulomb-viscous",
    ];
    bristle(
        folder,
        &[&words[..], &["--out", "fitted.toml", "--json", "-"]].concat(),
    )
}

/// What identification notes of a log that it fits.
fn notes(folder: &Path) -> String {
    let output = identify(folder);
    let errors = String::from_utf8_lossy(&output.stderr).to_string();
    assert!(output.status.success(), "{errors}");
    let result: Value = serde_json::from_slice(&output.stdout).unwrap();
    let notes: Vec<&str> = result["notes"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_str)
        .collect();
    for note in &notes {
        assert!(
            errors.contains(note),
            "{note} is not said on standard error"
        );
    }
    notes.join("\n")
}

/// Why identification refuses a log.
fn refusal(folder: &Path) -> String {
    let output = identify(folder);
    let errors = String::from_utf8_lossy(&output.stderr).to_string();
    assert_eq!(output.status.code(), Some(2), "{errors}");
    assert!(!folder.join("fitted.toml").exists());
    errors
}

#[test]
fn a_sound_log_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("axis.toml"), AXIS).unwrap();
    rows(folder, "sine");
    assert_eq!(notes(folder), "");
}

#[test]
fn gaps_and_jitter_are_named_with_what_was_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("axis.toml"), AXIS).unwrap();
    let (header, sound) = rows(folder, "sine");
    let mut gap = sound.clone();
    gap[1500..].iter_mut().for_each(|row| row[0] += 0.25);
    write(folder, &header, &gap);
    let said = notes(folder);
    assert!(
        said.contains("gap: 1 gap in time, 0.250000 s missing"),
        "{said}"
    );
    assert!(
        said.contains("left out of the fit: 1.4990 to 1.4990 s (gap)"),
        "{said}"
    );

    let mut jitter = sound;
    for (k, row) in jitter.iter_mut().enumerate() {
        // A tenth of the step, with a sign by a fixed pattern without a period that matters.
        row[0] += 1e-4 * if (k * k) % 7 < 3 { 1.0 } else { -1.0 };
    }
    write(folder, &header, &jitter);
    let said = notes(folder);
    assert!(said.contains("jitter: sampling times jitter"), "{said}");
}

#[test]
fn wrong_signs_are_refused_with_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("axis.toml"), AXIS).unwrap();
    let (header, sound) = rows(folder, "sine");
    assert!(
        header.starts_with("time_s,torque_nm,torque_ref_nm,position_rad"),
        "{header}"
    );
    for columns in [&[1, 2][..], &[3]] {
        let mut wrong = sound.clone();
        for row in &mut wrong {
            columns
                .iter()
                .for_each(|&column| row[column] = -row[column]);
        }
        write(folder, &header, &wrong);
        let said = refusal(folder);
        assert!(
            said.contains("wrong-sign: effort and motion have opposite signs"),
            "{said}"
        );
        assert!(said.contains("change the sign of that column"), "{said}");
    }
}

#[test]
fn counts_a_turn_that_are_off_by_a_factor_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("axis.toml"), AXIS).unwrap();
    let (header, mut rows) = rows(folder, "sine");
    let count = std::f64::consts::TAU / 131_072.0;
    for row in &mut rows {
        row[3] = (row[3] / count).round();
    }
    write(
        folder,
        &header.replace("position_rad", "position_counts"),
        &rows,
    );
    // Positions four times as large.
    let wrong = AXIS.replace("131072", "32768");
    std::fs::write(folder.join("axis.toml"), wrong).unwrap();
    let said = refusal(folder);
    assert!(
        said.contains("wrong-scale") && said.contains("check counts_per_rev (times 4)"),
        "{said}"
    );
}

#[test]
fn saturated_stretches_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // A speed loop that asks for more than the drive gives, for long against a sample.
    let fast = AXIS.replace(
        "rate_hz = 1000\nl1_1_s = 150",
        "rate_hz = 10000\nl1_1_s = 1000",
    );
    assert_ne!(fast, AXIS);
    let limited = fast + "[drive]\ntorque_limit_nm = 0.2\n";
    std::fs::write(folder.join("axis.toml"), limited).unwrap();
    rows(folder, "ladder");
    let said = notes(folder);
    assert!(
        said.contains("saturated: the effort stands at its limit of 0.2"),
        "{said}"
    );
    assert!(
        said.contains("left out of the fit: ") && said.contains(" s (saturated)"),
        "{said}"
    );
}
