//! What the tests need beyond the Rust toolchain. Nothing here is fatal: a test that lacks its tool says so and is
//! skipped.

use crate::{distribution, sh, there};
use std::process::Command;

/// Target of the microcontroller.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Installs what is missing, where that can be done.
pub fn run() {
    if !rustup_way() && distribution_way().is_none() {
        missing_target();
    }
    if !there("chromium") && !install("chromium") {
        eprintln!("MISSING: a browser for the test of reports; install the package chromium");
    }
    if !there("qemu-system-arm") && !install("qemu-system-arm") {
        eprintln!("MISSING: qemu-system-arm for core on the microcontroller's instruction set;");
        eprintln!("  install the package qemu-system-arm");
    }
    if !there("arm-none-eabi-gcc") && !install("gcc-arm-none-eabi") {
        eprintln!("MISSING: arm-none-eabi-gcc for the observer in C; install gcc-arm-none-eabi");
    }
    if !emulator_builds() {
        // The engine of the image test is C, built with cmake; its bindings are made with libclang.
        let _ = ["cmake", "libclang-dev", "pkg-config"].map(install);
        if !emulator_builds() {
            eprintln!("MISSING: cmake, libclang and pkg-config for the image test");
        }
    }
}

/// Whether the target's core library is there or could be added.
pub fn rustup_way() -> bool {
    target_installed() || sh("rustup", &["target", "add", TARGET])
}

/// Cargo with the distribution's compiler, which is installed where it is missing or too old.
pub fn distribution_way() -> Option<Command> {
    distribution::cargo().or_else(|| {
        // Old lists name an old compiler, which would install without an error.
        let _ = there("apt-get") && sh("apt-get", &["update"]);
        let _ = distribution::PACKAGES.map(install);
        distribution::cargo()
    })
}

/// Says how to get a core library for the microcontroller.
pub fn missing_target() {
    eprintln!("MISSING: a core library for {TARGET}. One of:");
    eprintln!("  rustup target add {TARGET}");
    eprintln!(
        "  the distribution's compiler, sources and linker: {}",
        distribution::PACKAGES.join(", ")
    );
}

/// Whether what the engine of the image test is built with is there.
pub fn emulator_builds() -> bool {
    let libclang = || {
        let folders = ["/usr/lib", "/usr/lib64", "/usr/local/lib"].map(std::path::PathBuf::from);
        let llvm = std::fs::read_dir("/usr/lib").into_iter().flatten();
        let llvm = llvm.filter_map(|entry| Some(entry.ok()?.path().join("lib")));
        let gnu = std::path::PathBuf::from("/usr/lib/x86_64-linux-gnu");
        folders.into_iter().chain([gnu]).chain(llvm).any(|folder| {
            let files = std::fs::read_dir(folder).into_iter().flatten();
            files.filter_map(Result::ok).any(|file| {
                let name = file.file_name().to_string_lossy().into_owned();
                name.starts_with("libclang.so") || name.starts_with("libclang-1")
            })
        })
    };
    there("cmake") && (std::env::var_os("LIBCLANG_PATH").is_some() || libclang())
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
