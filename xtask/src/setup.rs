//! What the tests need beyond the Rust toolchain. Nothing here is fatal: a test that lacks its tool says so and is
//! skipped.

use crate::{sh, there};
use std::process::Command;

/// Target of the microcontroller.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Installs what is missing, where that can be done.
pub fn run() {
    if !target_installed() && !sh("rustup", &["target", "add", TARGET]) {
        eprintln!("MISSING: the target {TARGET}; with rustup: rustup target add {TARGET}");
    }
    if !there("chromium") && !install("chromium") {
        eprintln!("MISSING: a browser for the test of reports; install the package chromium");
    }
}

/// Whether the target's core library is there.
pub fn target_installed() -> bool {
    let Ok(output) = Command::new("rustc")
        .args(["--print", "target-libdir", "--target", TARGET])
        .output()
    else {
        return false;
    };
    let folder = String::from_utf8_lossy(&output.stdout).trim().to_string();
    std::fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some())
}

/// Installs a package of the distribution, where its installer is there and this user may.
fn install(package: &str) -> bool {
    let arguments = ["install", "-y", "--no-install-recommends", package];
    there("apt-get")
        && (sh("apt-get", &arguments) || (sh("apt-get", &["update"]) && sh("apt-get", &arguments)))
}
