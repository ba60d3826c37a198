//! `bristle diagnose` from logs to the files that follow from them, through the command.

use std::path::Path;
use std::process::Command;

const AXIS: &str = "[axis]\ninertia_kg_m2 = 1e-4\ncounts_per_rev = 65536\n[friction]\ncoulomb_nm = 0.02\n\
    stiffness_nm_rad = 20\ndamping_nm_s_rad = 0.02\nviscous_nm_s_rad = 0.001\n[drive]\nspeed_limit_rad_s = 40\n\
    [observer]\nrate_hz = 2000\n";

fn bristle(folder: &Path, words: &str) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_bristle"))
        .args(words.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{words}: {said}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn read_json(folder: &Path, file: &str) -> serde_json::Value {
    let text = std::fs::read_to_string(folder.join(file)).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn every_file_that_follows_is_written_and_can_be_used() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("axis.toml"), AXIS).unwrap();
    bristle(
        path,
        "simulate --axis axis.toml --experiment reversals --seconds 4 --torque-noise-nm 2e-4 --out log.csv --effect \
         actuator.cogging:amplitude_nm=0.005,order_per_rev=12",
    );
    let said = bristle(
        path,
        "diagnose --axis axis.toml log.csv --json d.json --report d.html --apply applied.toml --plan-out plan.toml \
         --feed-forward table.toml",
    );
    let json = read_json(path, "d.json");
    let views: Vec<&str> = json["reproduced"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["view"].as_str().unwrap())
        .collect();
    for view in [
        "effort one step ahead",
        "position over 0.2 s",
        "position in free run",
    ] {
        assert!(views.contains(&view), "{view} in {views:?}");
        assert!(said.contains(view), "{view} in {said}");
    }
    let regions = json["where"]["regions"].as_array().unwrap();
    assert!(!regions.is_empty());
    for region in regions {
        for field in ["share", "time_share", "significance"] {
            let value = region[field].as_f64().unwrap();
            assert!((0.0..=1.0).contains(&value), "{field} in {region}");
        }
    }
    // Four seconds are too few blocks for any of them.
    let nowhere = "where: nowhere by more than chance";
    assert!(said.contains(nowhere), "{said}");
    let page = std::fs::read_to_string(path.join("d.html")).unwrap();
    for piece in ["Budget of the gap", "than chance would give it"] {
        assert!(page.contains(piece), "{piece}");
    }
    bristle(
        path,
        "simulate --axis applied.toml --input log.csv --out again.csv",
    );
    // A plan and a table are there, or the command says why not.
    for (file, reason) in [
        ("plan.toml", "plan: none"),
        ("table.toml", "feed-forward: none"),
    ] {
        assert_eq!(
            path.join(file).exists(),
            !said.contains(reason),
            "{file}: {said}"
        );
    }
    if path.join("plan.toml").exists() {
        bristle(path, "run plan.toml --axis axis.toml --out logs");
    }
}

#[test]
fn a_soft_coupling_is_no_play() {
    // Of what the method leaves of a coupling of 84 Hz a play takes more, its load corrected by what the balance lacks.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let axis = "[axis]\ninertia_kg_m2 = 2e-4\ncounts_per_rev = 65536\n[friction]\nmodel = \"elasto-plastic\"\n\
        coulomb_nm = 0.05\nstiction_nm = 0.065\nstribeck_velocity_rad_s = 0.8\nstiffness_nm_rad = 30\n\
        damping_nm_s_rad = 0.05\nviscous_nm_s_rad = 0.002\nbreakaway_ratio = 0.7\n[observer]\nrate_hz = 1000\n";
    let of_seconds = [
        ("multisine", 12),
        ("sine", 12),
        ("ladder", 15),
        ("moves", 15),
    ];
    let plan: String = of_seconds
        .map(|(kind, seconds)| format!("[[experiment]]\nkind = \"{kind}\"\nseconds = {seconds}\n"))
        .concat();
    std::fs::write(path.join("axis.toml"), axis).unwrap();
    std::fs::write(path.join("plan.toml"), plan).unwrap();
    bristle(
        path,
        "run plan.toml --axis axis.toml --out logs --torque-noise-nm 5e-4 --effect \
         mechanics.compliance:compliance_rad_nm=0.08,load_share=0.5,damping_ratio=0.05,friction_on_motor=0",
    );
    bristle(
        path,
        "diagnose --axis axis.toml logs/01-multisine.csv logs/02-sine.csv logs/03-ladder.csv logs/04-moves.csv --json d.json",
    );
    let json = read_json(path, "d.json");
    assert_eq!(
        json["verdict"]["effects"],
        serde_json::json!(["mechanics.compliance"])
    );
}
