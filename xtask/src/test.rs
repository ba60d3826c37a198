//! Every test there is.

use crate::{setup, sh};

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
    host && target
}
