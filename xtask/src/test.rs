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
    let image = firmware && setup::emulator_builds();
    // All packages at once, so that what they share is built once; and all tests, so that one failure does not hide another.
    let test = || {
        let mut cargo = Command::new("cargo");
        cargo.args(["test", "--workspace", "--no-fail-fast"]);
        if !image {
            cargo.args(WITHOUT_IMAGE);
        }
        cargo
    };
    // The firmware is a chain of large packages, which keeps one core busy: the tests are built beside it.
    let built = std::thread::scope(|scope| {
        let built = scope.spawn(|| {
            if firmware {
                firmware::check(&[])
            } else {
                eprintln!("SKIPPED: the firmware: {} is not installed", setup::TARGET);
                true
            }
        });
        // What does not build is said once more where it is tested.
        let _ = test().arg("--no-run").status();
        built.join().expect("building does not panic")
    });
    let mut cargo = test();
    if image {
        // For the commands that take `--on image`.
        cargo.env("BRISTLE_EMULATOR", program("emulate"));
        cargo.env(
            "BRISTLE_FIRMWARE",
            firmware::image(&target("firmware/target")),
        );
    } else {
        eprintln!("SKIPPED: image in the loop: the target, cmake or libclang is missing");
    }
    eprintln!("+ {cargo:?}");
    let host = cargo.status().is_ok_and(|status| status.success());
    let counts = !image || sh(&program("budgets"), &["--check"]);
    built && host && counts
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

/// Counts the instructions of the control tick and its pieces, and writes them down.
pub fn budgets() -> bool {
    firmware::build(&[])
        && sh(
            "cargo",
            &["run", "--package", "bristle-image", "--bin", "budgets"],
        )
}
