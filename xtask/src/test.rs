//! Every test there is.

use crate::{firmware, setup, sh};
use std::path::PathBuf;
use std::process::Command;

/// Leaves out the image test, which cannot be built without cmake and libclang.
pub const WITHOUT_IMAGE: [&str; 2] = ["--exclude", "bristle-image"];

/// Runs them all; false if one failed.
pub fn run() -> bool {
    setup::run();
    let firmware = setup::target_installed();
    let built = if firmware {
        firmware::check(&[])
    } else {
        eprintln!("SKIPPED: the firmware: {} is not installed", setup::TARGET);
        true
    };
    let image = firmware && built && setup::emulator_builds();
    // All packages at once, so that what they share is built once; and all tests, so that one failure does not hide another.
    let mut host = vec!["test", "--workspace", "--no-fail-fast"];
    if !image {
        eprintln!("SKIPPED: image in the loop: the firmware, cmake or libclang is missing");
        host.extend(WITHOUT_IMAGE);
    }
    let host = sh("cargo", &host);
    let image = !image || {
        let counts = sh(&program("budgets"), &["--check"]);
        commands_on_image() && counts
    };
    built && host && image
}

/// A program that the tests of the image were built with.
fn program(name: &str) -> String {
    let path = target("target").join("debug").join(name);
    path.to_string_lossy().into_owned()
}

/// Where cargo puts what it builds.
fn target(otherwise: &str) -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR");
    target.map_or_else(|| firmware::root().join(otherwise), PathBuf::from)
}

/// The commands that take `--on image`, one after the other: each runs the image in real time.
fn commands_on_image() -> bool {
    let mut cargo = Command::new("cargo");
    cargo
        // As the tests before: one package alone has other features, and is built anew.
        .args(["test", "--workspace", "--test", "image", "--test", "scope"])
        .args(["--", "on_the_image", "--nocapture", "--test-threads", "1"])
        .env("BRISTLE_EMULATOR", program("emulate"))
        .env(
            "BRISTLE_FIRMWARE",
            firmware::image(&target("firmware/target")),
        );
    eprintln!("+ {cargo:?}");
    cargo.status().is_ok_and(|status| status.success())
}

/// Counts the instructions of the control tick and its pieces, and writes them down.
pub fn budgets() -> bool {
    firmware::build(&[])
        && sh(
            "cargo",
            &["run", "--package", "bristle-image", "--bin", "budgets"],
        )
}
