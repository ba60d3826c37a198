//! Format and lint of every package, those for the microcontroller too.

use crate::{setup, sh};
use std::process::Command;

/// Packages that are workspaces of their own, and whether they are for the microcontroller or need the emulator's tools.
const APART: [(&str, Needs); 5] = [
    ("firmware", Needs::Target),
    ("host-tests/image/kernels", Needs::Target),
    ("host-tests/qemu", Needs::Target),
    ("host-tests/qemu/unit", Needs::Target),
    ("host-tests/image", Needs::Emulator),
];

#[derive(Clone, Copy)]
enum Needs {
    Target,
    Emulator,
}

/// Checks them all; false if one has something to mend.
pub fn run() -> bool {
    setup::run();
    let mut clean = sh("cargo", &["fmt", "--all", "--check"]);
    clean &= sh(
        "cargo",
        &[
            "clippy",
            "--workspace",
            "--all-targets",
            "--",
            "-D",
            "warnings",
        ],
    );
    for (folder, needs) in APART {
        let manifest = format!("{folder}/Cargo.toml");
        clean &= sh("cargo", &["fmt", "--manifest-path", &manifest, "--check"]);
        let can = match needs {
            Needs::Target => setup::target_installed(),
            Needs::Emulator => setup::emulator_builds(),
        };
        if can {
            // From the folder itself, whose configuration names the target.
            // In the profile that it is built in afterwards.
            let lint: &[&str] = match needs {
                Needs::Target => &["clippy", "--release", "--", "-D", "warnings"],
                Needs::Emulator => &["clippy", "--all-targets", "--", "-D", "warnings"],
            };
            eprintln!("+ cd {folder} && cargo {}", lint.join(" "));
            clean &= Command::new("cargo")
                .current_dir(folder)
                .args(lint)
                .status()
                .is_ok_and(|status| status.success());
        } else {
            eprintln!("SKIPPED: lint of {folder}: see what is MISSING above");
        }
    }
    clean
}
