//! Chores of the project: `cargo xtask setup` installs what the tests need beyond the Rust toolchain, `cargo xtask test`
//! runs all of them, and the rest is for the firmware.

mod check_elf;
mod distribution;
mod elf;
mod firmware;
mod lint;
mod setup;
mod test;

use std::process::{Command, ExitCode};

const USAGE: &str = "usage: cargo xtask <chore>

  setup   install what the tests need beyond the Rust toolchain: the microcontroller's target, a browser,
          emulators, a C compiler for the chip
  lint    set up, then check format and lint of every package
  format  format every package, the microcontroller's too
  test    set up, then run every test
  build-firmware [--pwm] [--distribution]
          build the microcontroller's image and say how large it is
  check-elf [--pwm]
          build it, and show that its control interrupt cannot panic, log, mask interrupts or emulate arithmetic
  budgets build it, count the instructions of the control tick and its pieces, write docs/budgets.md
  peers   time the joint fit against SciPy on the same cost and data, write docs/peers.md
  flash   build it, put it on the board with probe-rs and show its trace
  attach  show the trace of the board as it runs";

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let chore = arguments.next();
    let options: Vec<String> = arguments.collect();
    let done = match chore.as_deref() {
        Some("setup") => {
            setup::run();
            true
        }
        Some("lint") => lint::run(),
        Some("format") => lint::format(),
        Some("test") => test::run(),
        Some("build-firmware") => firmware::build(&options),
        Some("check-elf") => firmware::check(&options),
        Some("budgets") => test::budgets(),
        Some("peers") => sh(
            "cargo",
            &["bench", "--package", "bristle", "--bench", "peers"],
        ),
        Some("flash") => firmware::flash(&options),
        Some("attach") => firmware::attach(&options),
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
