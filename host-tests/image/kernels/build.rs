//! Puts memory.x, which lies at the top of the repository, on the linker's path, and compiles the comparison in C.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

fn main() {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let here = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let memory = here.join("../../../memory.x");
    fs::copy(&memory, out.join("memory.x")).expect("memory.x lies at the top of the repository");
    println!("cargo:rerun-if-changed={}", memory.display());
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    c_comparison(&out);
}

/// Compiles the comparison in C; without a compiler there is none.
fn c_comparison(out: &Path) {
    println!("cargo:rerun-if-changed=src/time_free.c");
    println!("cargo:rustc-check-cfg=cfg(c_comparison)");
    let object = out.join("time_free.o");
    let done = Command::new("arm-none-eabi-gcc")
        .args(["-O3", "-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard"])
        .args([
            "-mfpu=fpv4-sp-d16",
            "-fno-math-errno",
            "-ffunction-sections",
        ])
        .args(["-c", "src/time_free.c", "-o"])
        .arg(&object)
        .status();
    if done.is_ok_and(|status| status.success()) {
        println!("cargo:rustc-cfg=c_comparison");
        println!("cargo:rustc-link-arg-bins={}", object.display());
    } else {
        println!("cargo:warning=no arm-none-eabi-gcc with newlib: no comparison with C");
    }
}
