//! Builds the firmware, and puts it on the board.
//!
//! Two ways to a core library for the microcontroller, the first that works is taken: rustup's target, or the
//! distribution's compiler.

use crate::elf::Image;
use crate::setup::{TARGET, distribution_way, missing_target, rustup_way};
use crate::{check_elf, sh};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Bytes of flash that the firmware may take.
const MOST_FLASH_BYTES: u64 = 64 * 1024;
const CHIP: &str = "STM32G474RETx";

/// Builds the release image, says how large it is and checks the call tree of the control interrupt. `options` are
/// `--pwm` and `--distribution`, which skips the first way.
pub fn build(options: &[String]) -> bool {
    let Some(image) = compile(options) else {
        return false;
    };
    println!("{}", image.display());
    size(&image)
}

/// Builds, then looks at the image.
pub fn check(options: &[String]) -> bool {
    let Some(image) = compile(options) else {
        return false;
    };
    // Both, so that one failure does not hide the other.
    let small = size(&image);
    check_elf::run(&image) && small
}

/// Builds, and runs on the board: flashes, then shows the readable trace.
pub fn flash(options: &[String]) -> bool {
    compile(options).is_some_and(|image| probe("run", &image))
}

/// Shows the readable trace of the firmware that runs, without a reset.
pub fn attach(options: &[String]) -> bool {
    compile(options).is_some_and(|image| probe("attach", &image))
}

fn probe(action: &str, image: &Path) -> bool {
    let done = sh(
        "probe-rs",
        &[action, "--chip", CHIP, &image.to_string_lossy()],
    );
    if !done && !crate::there("probe-rs") {
        eprintln!("MISSING: probe-rs; cargo install probe-rs-tools --locked");
    }
    done
}

fn compile(options: &[String]) -> Option<PathBuf> {
    let has = |name: &str| options.iter().any(|option| option == name);
    let mut cargo = if !has("--distribution") && rustup_way() {
        Command::new("cargo")
    } else if let Some(cargo) = distribution_way() {
        cargo
    } else {
        missing_target();
        return None;
    };
    let folder = root().join("firmware");
    // The folder's own configuration names the target.
    cargo.current_dir(&folder).args(["build", "--release"]);
    let mut target =
        std::env::var_os("CARGO_TARGET_DIR").map_or(folder.join("target"), PathBuf::from);
    if has("--pwm") {
        cargo.args(["--features", "pwm"]);
        // Beside the plain image, which tests and tools expect at its place.
        target.push("pwm");
    }
    cargo.env("CARGO_TARGET_DIR", &target);
    // An environment that asks for incremental builds would split the handler over code generation units: 9 % more cycles.
    cargo.env("CARGO_INCREMENTAL", "0");
    eprintln!("+ cd {} && {cargo:?}", folder.display());
    if !cargo.status().is_ok_and(|status| status.success()) {
        return None;
    }
    Some(image(&target))
}

/// Where a build leaves the image.
pub fn image(target: &Path) -> PathBuf {
    target.join(TARGET).join("release/bristle-firmware")
}

/// Top of the repository.
pub fn root() -> PathBuf {
    let mut folder = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    folder.pop();
    folder
}

/// Prints what the image takes in flash; false if that is too much.
fn size(path: &Path) -> bool {
    let image = match Image::read(path) {
        Ok(image) => image,
        Err(error) => {
            eprintln!("{}: {error}", path.display());
            return false;
        }
    };
    for (name, bytes) in image.loaded_sections() {
        println!("{name:16} {bytes:7} bytes");
    }
    let total = image.flash_bytes();
    println!(
        "flash            {total:7} bytes, at most {MOST_FLASH_BYTES}; RAM {} bytes, CCM {} bytes",
        image.memory_bytes(0x2000_0000..0x2001_8000),
        image.memory_bytes(0x1000_0000..0x1000_8000)
    );
    total < MOST_FLASH_BYTES
}
