//! Format and lint of every package, those for the microcontroller too.

use crate::test::WITHOUT_IMAGE;
use crate::{setup, sh};
use std::process::Command;

/// Packages that are workspaces of their own, all of them for the microcontroller.
const APART: [&str; 4] = [
    "firmware",
    "host-tests/image/kernels",
    "host-tests/qemu",
    "host-tests/qemu/unit",
];

/// Formats them all.
pub fn format() -> bool {
    formatted(&[])
}

fn formatted(options: &[&str]) -> bool {
    let mut done = sh("cargo", &[&["fmt", "--all"], options].concat());
    for folder in APART {
        let manifest = format!("{folder}/Cargo.toml");
        let apart = ["fmt", "--manifest-path", &manifest];
        done &= sh("cargo", &[&apart, options].concat());
    }
    done
}

/// Checks them all; false if one has something to mend.
pub fn run() -> bool {
    setup::run();
    let mut clean = formatted(&["--check"]);
    if !clean {
        eprintln!("mend the format by: cargo xtask format");
    }
    let mut host = vec!["clippy", "--workspace", "--all-targets"];
    if !setup::emulator_builds() {
        eprintln!("SKIPPED: lint of the image test: see what is MISSING above");
        host.extend(WITHOUT_IMAGE);
    }
    host.extend(["--", "-D", "warnings"]);
    clean &= sh("cargo", &host);
    for folder in APART {
        if setup::target_installed() {
            // From the folder itself, whose configuration names the target; in the profile that it is built in afterwards.
            let lint = ["clippy", "--release", "--", "-D", "warnings"];
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
