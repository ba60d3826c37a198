//! `bristle` on the firmware's image in the emulator, as its user runs it. `cargo xtask test` builds both and names them;
//! skipped, loudly, without.

#[path = "common/every.rs"]
mod every;
#[path = "common/on_image.rs"]
mod on_image;

use bristle_gap::experiments::Named;
use bristle_gap::{AxisFile, Log};
use every::plan;
use on_image::on_image;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn axis_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes/bench.toml")
}

fn bristle(folder: &Path, words: &[&str], more: &[String]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_bristle"))
        .current_dir(folder)
        .args(words)
        .args(more)
        .arg("--axis")
        .arg(axis_path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{words:?}: {output:?}");
    output
}

/// Of each column: its name, and whether it holds numbers or words.
fn format(path: &Path) -> Vec<(String, bool)> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',').map(str::to_owned);
    let words = lines.next().unwrap().split(',');
    names
        .zip(words.map(|word| word.parse::<f64>().is_err()))
        .collect()
}

#[test]
fn on_the_image_every_experiment_makes_a_log_as_on_the_virtual_axis() {
    let Some((_alone, image)) = on_image() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    std::fs::write(place.join("plan.toml"), plan()).unwrap();
    bristle(place, &["run", "plan.toml", "--out", "image"], &image);
    bristle(place, &["run", "plan.toml", "--out", "virtual"], &[]);
    for (n, kind) in (1..).zip(Named::ALL.map(Named::name)) {
        let [image, alone] =
            ["image", "virtual"].map(|on| place.join(format!("{on}/{n:02}-{kind}.csv")));
        assert_eq!(format(&image), format(&alone), "{kind}");
        let [image, alone] = [image, alone].map(|path| Log::read(path).unwrap());
        assert_eq!(image.len(), 15_000, "{kind}");
        assert!(image.gaps().is_empty(), "{kind}");
        // Those that begin without a jump, which the firmware's own slew limit would cut differently.
        if matches!(kind, "sine" | "break-away") {
            let torques = |log: &Log| log.efforts[0].values[..1000].to_vec();
            assert_eq!(torques(&image), torques(&alone), "{kind}");
        }
    }
    let logs = [
        "image/07-break-away.csv",
        "image/08-multisine.csv",
        "image/09-moves.csv",
    ];
    bristle(
        place,
        &[&["identify", "--out", "fitted.toml"], &logs[..]].concat(),
        &[],
    );
    bristle(
        place,
        &[&["diagnose", "--report", "diagnose.html"], &logs[1..]].concat(),
        &[],
    );
}

#[test]
fn on_the_image_commissioning_finds_the_axis() {
    let Some((_alone, image)) = on_image() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let words = [
        "commission",
        "--torque-nm",
        "0.08",
        "--turns",
        "0",
        "--out",
        "axis.toml",
    ];
    bristle(folder.path(), &words, &image);
    let [found, truth] =
        [folder.path().join("axis.toml"), axis_path()].map(|path| AxisFile::read(path).unwrap());
    assert_eq!(found.axis.counts_per_turn, truth.axis.counts_per_turn);
    assert_eq!(
        (found.axis.encoder_sign, found.drive.torque_sign),
        (None, None)
    );
    let ratio = found.friction.stiction.unwrap() / truth.friction.stiction.unwrap();
    assert!((ratio - 1.0).abs() < 0.1, "stiction {ratio}");
    let ratio = found.friction.coulomb.unwrap() / truth.friction.coulomb.unwrap();
    assert!((ratio - 1.0).abs() < 0.1, "Coulomb friction {ratio}");
}
