//! Builds the firmware, and puts it on the board.
//!
//! Two ways to a core library for the microcontroller, the first that works is taken: rustup's target; or a
//! distribution's compiler with its library sources (Debian: rustc-web, rust-web-src), which then builds the core
//! library too.

use crate::elf::Image;
use crate::setup::{TARGET, target_installed};
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
        eprintln!("MISSING: a core library for {TARGET}. One of:");
        eprintln!("  rustup target add {TARGET}");
        eprintln!(
            "  a distribution's compiler and its sources, such as Debian's rustc-web and rust-web-src,"
        );
        eprintln!("  and a linker: rust-lld, or ld.lld from the package lld");
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

fn rustup_way() -> bool {
    target_installed() || sh("rustup", &["target", "add", TARGET])
}

/// Cargo with the distribution's compiler, which builds the core library from the distribution's sources.
fn distribution_way() -> Option<Command> {
    let rustc = std::env::var("DISTRIBUTION_RUSTC").unwrap_or("/usr/bin/rustc".into());
    let sysroot = printed(&rustc, "sysroot")?;
    let sources = Path::new(&sysroot).join("lib/rustlib/src/rust/library/core");
    if !sources.is_dir() {
        eprintln!(
            "MISSING: library sources of {rustc} at {}",
            sources.display()
        );
        return None;
    }
    let version = version(&rustc);
    if version < numbers(env!("CARGO_PKG_RUST_VERSION")) {
        let [major, minor] = version.map(|number| number.unwrap_or(0));
        eprintln!(
            "MISSING: {rustc} is Rust {major}.{minor}, and the firmware needs {}",
            env!("CARGO_PKG_RUST_VERSION")
        );
        return None;
    }
    let mut cargo = Command::new("cargo");
    cargo
        .env("RUSTC", &rustc)
        // The option is not yet stable; it only builds what would otherwise be downloaded.
        .env("RUSTC_BOOTSTRAP", "1")
        .env("CARGO_UNSTABLE_BUILD_STD", "core")
        .env(
            "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER",
            linker(&sysroot)?,
        );
    Some(cargo)
}

/// Version of a compiler, which calls itself `rustc 1.95.0 (...)`.
fn version(rustc: &str) -> [Option<u32>; 2] {
    let output = Command::new(rustc).arg("--version").output();
    let text = output.map_or(String::new(), |output| {
        String::from_utf8_lossy(&output.stdout).into_owned()
    });
    numbers(text.split_whitespace().nth(1).unwrap_or_default())
}

/// The first two numbers of a version.
fn numbers(version: &str) -> [Option<u32>; 2] {
    let mut parts = version.split('.');
    [(); 2].map(|()| parts.next().and_then(|part| part.parse().ok()))
}

fn printed(rustc: &str, what: &str) -> Option<String> {
    let output = Command::new(rustc).args(["--print", what]).output().ok()?;
    Some(String::from_utf8_lossy(&output.stdout).trim().to_string()).filter(|text| !text.is_empty())
}

/// rust-lld of the distribution or of any toolchain of rustup, else ld.lld.
fn linker(sysroot: &str) -> Option<PathBuf> {
    let mut sysroots = vec![PathBuf::from(sysroot)];
    sysroots.extend(printed("rustc", "sysroot").map(PathBuf::from));
    let host = sysroots.iter().find_map(|sysroot| {
        std::fs::read_dir(sysroot.join("lib/rustlib"))
            .ok()?
            .filter_map(Result::ok)
            .map(|entry| entry.path().join("bin/rust-lld"))
            .find(|path| path.is_file())
    });
    host.or_else(|| crate::there("ld.lld").then(|| PathBuf::from("ld.lld")))
        .or_else(|| {
            eprintln!("MISSING: a linker: rust-lld, or ld.lld from the package lld");
            None
        })
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
