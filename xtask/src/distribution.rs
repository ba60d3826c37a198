//! A distribution's compiler with the sources of its library, which build the core library for the microcontroller where
//! rustup has nothing to offer. Debian 12 with its security updates, and 13: the packages below, beside any cargo.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Compiler, sources of its library, linker.
pub const PACKAGES: [&str; 3] = ["rustc-web", "rust-web-src", "lld"];

/// Cargo with that compiler; if something is not there, says what.
pub fn cargo() -> Option<Command> {
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
