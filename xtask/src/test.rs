//! Every test there is.

use crate::{firmware, setup, sh};
use std::path::PathBuf;
use std::process::Command;

/// Runs them all; false if one failed.
pub fn run() -> bool {
    setup::run();
    let host = sh("cargo", &["test", "--workspace"]);
    if !setup::target_installed() {
        eprintln!("SKIPPED: the firmware: {} is not installed", setup::TARGET);
        return host;
    }
    let built = firmware::check(&[]);
    let image = image();
    host && built && image
}

/// The firmware's image in the emulator, and what its pieces cost. What emulates is optimised as all tests are, which shares
/// its dependencies with them; what is emulated is built for release.
fn image() -> bool {
    if !setup::emulator_builds() {
        eprintln!("SKIPPED: image in the loop: cmake or libclang is missing");
        return true;
    }
    // One after the other and all of them, so that one failure does not hide the others.
    let tests = in_image(&["test", "--", "--nocapture"]);
    let counts = in_image(&["run", "--bin", "budgets", "--", "--check"]);
    let commands = in_image(&["build", "--bin", "emulate"]) && commands_on_image();
    tests && counts && commands
}

/// The commands that take `--on image`, one after the other: each runs the image in real time.
fn commands_on_image() -> bool {
    let folder = |otherwise: &str| {
        let target = std::env::var_os("CARGO_TARGET_DIR");
        target.map_or_else(|| firmware::root().join(otherwise), PathBuf::from)
    };
    let mut cargo = Command::new("cargo");
    cargo
        .args([
            "test",
            // As the tests before: one package alone has other features, and is built anew.
            "--workspace",
            "--test",
            "image",
            "--test",
            "scope",
        ])
        .args(["--", "on_the_image", "--nocapture", "--test-threads", "1"])
        .env(
            "BRISTLE_EMULATOR",
            folder("host-tests/image/target").join("debug/emulate"),
        )
        .env(
            "BRISTLE_FIRMWARE",
            firmware::image(&folder("firmware/target")),
        );
    eprintln!("+ {cargo:?}");
    cargo.status().is_ok_and(|status| status.success())
}

/// Counts the instructions of the control tick and its pieces, and writes them down.
pub fn budgets() -> bool {
    firmware::build(&[]) && in_image(&["run", "--bin", "budgets"])
}

/// Cargo on the crate of the image test, which is a workspace of its own.
fn in_image(arguments: &[&str]) -> bool {
    let fixed = ["--manifest-path", "host-tests/image/Cargo.toml"];
    sh(
        "cargo",
        &[&arguments[..1], &fixed, &arguments[1..]].concat(),
    )
}
