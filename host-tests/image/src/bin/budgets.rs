//! Counts the instructions of the tick and its pieces. Writes `docs/budgets.md`, or with `--check` compares with it.

use bristle_image::{Image, against_c, budget, handler};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const HEAD: &str = "# Budgets

Written by the program `budgets` of `host-tests/image`; do not edit. With `--check` the same program compares, and fails
where a count of instructions has grown by more than 3 %, or a limit on cycles is exceeded that is not marked so here.

Instruction counts are exact: the release code runs in an emulator, and the counts repeat. Cycles are **estimates** from
them: each instruction costs what the Cortex-M4 manual says for its class without wait states, the upper end where it
gives a range, and a taken branch two cycles for the refill. Nothing here was measured on silicon. An instruction whose
condition fails counts, as it takes its cycle.

A piece runs as a function of its own, called with the inputs of a recorded run (the sine experiment of the thesis,
0.035 N m, 1 s, on the virtual axis of the bench, two periods) and then with extreme ones; its call and return count.
The handler is the interrupt of the firmware's image, from its first to its last instruction, in the same experiment,
arming and start included; the core's entry and exit come on top, about 22 cycles. Its further rows hold the ticks that
are not like those: stops, disarming, ends and new parameters; each fault of an axis or a host, in sine and loop; a sine
that begins while another one plays; every other experiment; and these with friction compensation and a feed-forward
table. What a tick does for the next one (its reference, compensation, orders, new parameters, statistics) is an interrupt
that follows the handler, after the torque has been put out: the follower. Both together are what a tick takes of its
17,000 cycles; the last rows count them tick by tick, and in the experiment of the thesis they stay within what the handler
alone may take.

";

const AGAINST_C: &str = "
## Against C

The time-free observer in Rust and in C (`host-tests/image/c/time_free.c`: the same law, checks and order of operations,
`-O3 -mcpu=cortex-m4 -mfpu=fpv4-sp-d16`), each the only thing in a program, over the inputs above; the means are of the
recorded run alone. Of the ratios none may exceed 1.1. The second C program may leave out the rounding between a product
and a sum, which the compiler does unless told otherwise, and Rust never does. The C compiler takes a multiply-accumulate
where it can, one instruction of three cycles; the Rust compiler a product and a sum, two instructions of one cycle each.

";

fn main() -> ExitCode {
    let check = std::env::args().any(|a| a == "--check");
    match run(check) {
        Ok(complaints) if complaints.is_empty() => ExitCode::SUCCESS,
        Ok(complaints) => {
            for complaint in &complaints {
                eprintln!("{complaint}");
            }
            // A table that is being written is written whatever it says; the check is what fails.
            ExitCode::from(u8::from(check))
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run(check: bool) -> Result<Vec<String>, String> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let document = here.join("../../docs/budgets.md");
    let kernels = kernels(here)?;
    let mut rows = budget::pieces(&Image::read(&kernels.join("kernels"))?)?;
    rows.extend(handler::rows(&Image::read(&firmware(here))?)?);
    let table = budget::table(&rows);
    println!("{table}");
    let known = std::fs::read_to_string(&document).unwrap_or_default();
    let mut complaints = budget::complaints(&rows, &known);
    let compared = against_c::run(&Image::read(&kernels.join("time_free"))?, here)?;
    if let Some(all) = &compared {
        println!("{}", against_c::table(all));
        complaints.extend(against_c::complaints(all));
    } else {
        let line = "=".repeat(80);
        println!("{line}\nSKIPPED: comparison with C: no arm-none-eabi-gcc\n{line}");
    }
    if !check {
        // Without the compiler the comparison of the last time stays.
        let against_c = match compared {
            Some(all) => format!("{AGAINST_C}{}", against_c::table(&all)),
            None => known
                .find(AGAINST_C)
                .map_or_else(String::new, |at| known[at..].to_owned()),
        };
        std::fs::write(&document, format!("{HEAD}{table}{against_c}"))
            .map_err(|e| format!("{}: {e}", document.display()))?;
    }
    Ok(complaints)
}

/// The folder of the pieces' programs: `BRISTLE_KERNELS`, or built here.
fn kernels(here: &Path) -> Result<PathBuf, String> {
    if let Some(path) = std::env::var_os("BRISTLE_KERNELS") {
        return Ok(path.into());
    }
    let crate_dir = here.join("kernels");
    let status = std::process::Command::new("cargo")
        .args(["build", "--release", "--quiet"])
        .current_dir(&crate_dir)
        // As the firmware: what is counted must not depend on who builds it.
        .env("CARGO_INCREMENTAL", "0")
        .status()
        .map_err(|e| format!("cargo: {e}"))?;
    if !status.success() {
        return Err("the kernels do not build; is the target thumbv7em-none-eabihf there?".into());
    }
    Ok(target(crate_dir.join("target")))
}

fn target(default: PathBuf) -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR")
        .map_or(default, PathBuf::from)
        .join("thumbv7em-none-eabihf/release")
}

/// The firmware's own image.
fn firmware(here: &Path) -> PathBuf {
    std::env::var_os("BRISTLE_FIRMWARE").map_or_else(
        || target(here.join("../../firmware/target")).join("bristle-firmware"),
        PathBuf::from,
    )
}
