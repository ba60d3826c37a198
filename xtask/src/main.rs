//! Chores of the project: `cargo xtask setup` installs what the tests need beyond the Rust toolchain, `cargo xtask test`
//! runs all of them.

mod setup;
mod test;

use std::process::{Command, ExitCode};

const USAGE: &str = "usage: cargo xtask <chore>

  setup   install what the tests need beyond the Rust toolchain: the microcontroller's target, a browser
  test    set up, then run every test";

fn main() -> ExitCode {
    let chore = std::env::args().nth(1);
    let done = match chore.as_deref() {
        Some("setup") => {
            setup::run();
            true
        }
        Some("test") => test::run(),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    if done {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Runs a command in sight of the user; false if it failed or is not there.
fn sh(program: &str, arguments: &[&str]) -> bool {
    eprintln!("+ {program} {}", arguments.join(" "));
    Command::new(program)
        .args(arguments)
        .status()
        .is_ok_and(|status| status.success())
}

/// Whether a program answers to `--version`.
fn there(program: &str) -> bool {
    Command::new(program)
        .arg("--version")
        .output()
        .is_ok_and(|output| output.status.success())
}
