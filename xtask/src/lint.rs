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
    // What is built for the microcontroller is a chain of large packages, which keeps one core busy.
    std::thread::scope(|scope| {
        let apart = scope.spawn(|| APART.map(lint_apart));
        clean &= sh("cargo", &host);
        for said in apart.join().expect("linting does not panic") {
            eprint!("{}", said.text);
            clean &= said.clean;
        }
    });
    clean
}

/// What a lint came to, and what it said.
struct Said {
    clean: bool,
    text: String,
}

fn lint_apart(folder: &str) -> Said {
    if !setup::target_installed() {
        let text = format!("SKIPPED: lint of {folder}: see what is MISSING above\n");
        return Said { clean: true, text };
    }
    // From the folder itself, whose configuration names the target; in the profile that it is built in afterwards.
    let lint = ["clippy", "--release", "--", "-D", "warnings"];
    let output = Command::new("cargo")
        .current_dir(folder)
        .args(lint)
        .output();
    let (clean, said) = match output {
        Ok(output) => (
            output.status.success(),
            String::from_utf8_lossy(&output.stderr).into_owned(),
        ),
        Err(error) => (false, format!("{error}\n")),
    };
    let text = format!("+ cd {folder} && cargo {}\n{said}", lint.join(" "));
    Said { clean, text }
}
