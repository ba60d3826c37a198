//! Every test there is.

use crate::{firmware, setup, sh};

/// Runs them all; false if one failed.
pub fn run() -> bool {
    setup::run();
    let host = sh("cargo", &["test", "--workspace"]);
    let target = if setup::target_installed() {
        sh(
            "cargo",
            &[
                "build",
                "--package",
                "bristle-core",
                "--target",
                setup::TARGET,
            ],
        )
    } else {
        eprintln!(
            "SKIPPED: core for {}: the target is not installed",
            setup::TARGET
        );
        true
    };
    let image = image();
    host && target && image
}

/// The firmware's image in the emulator, and what its pieces cost.
fn image() -> bool {
    if !setup::emulator_builds() {
        eprintln!("SKIPPED: image in the loop: cmake or libclang is missing");
        return true;
    }
    if !setup::target_installed() {
        eprintln!("SKIPPED: image in the loop: the target is not installed");
        return true;
    }
    // One after the other and all of them, so that one failure does not hide the others.
    let built = firmware::check(&[]);
    let tests = in_image(&["test", "--", "--nocapture"]);
    let counts = in_image(&["run", "--bin", "budgets", "--", "--check"]);
    built && tests && counts
}

/// Counts the instructions of the control tick and its pieces, and writes them down.
pub fn budgets() -> bool {
    firmware::build(&[]) && in_image(&["run", "--bin", "budgets"])
}

/// Cargo on the crate of the image test, which is a workspace of its own.
fn in_image(arguments: &[&str]) -> bool {
    let fixed = [
        "--release",
        "--manifest-path",
        "host-tests/image/Cargo.toml",
    ];
    sh(
        "cargo",
        &[&arguments[..1], &fixed, &arguments[1..]].concat(),
    )
}
