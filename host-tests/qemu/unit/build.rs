//! Copies the sources of core with their unit tests as plain functions, and lists these.
//!
//! The harness of the tests needs std. What is rewritten: `#[cfg(test)]` and `#[test]` go, test modules and functions
//! become public, and functions of numbers that std has are put in scope. Tests of a `proptest!` block are left out.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// As of the emulated board; see the build script beside this folder.
#[path = "../build.rs"]
mod board;

const IN_SCOPE: &str = "#[allow(unused_imports)] use {crate::Real as _, std::Float as _};\n";

fn main() {
    board::main();
    let from = PathBuf::from("../../../core/src");
    println!("cargo:rerun-if-changed={}", from.display());
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let to = out.join("core");
    let mut tests = Vec::new();
    folder(&from, &to, "", &mut tests);
    let mut modules = String::new();
    for line in read(&from.join("lib.rs")).lines() {
        if line.starts_with("pub mod ") || line.starts_with("pub use ") {
            let _ = writeln!(modules, "{line}");
        }
    }
    let _ = writeln!(modules, "const TESTS: [(&str, fn()); {}] = [", tests.len());
    for test in &tests {
        let _ = writeln!(modules, "    ({test:?}, crate::{test}),");
    }
    modules += "];\n";
    fs::write(to.join("modules.rs"), modules).expect("the folder for output can be written");
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Rewrites a folder of sources; `module` is its path with `::` behind.
fn folder(from: &Path, to: &Path, module: &str, tests: &mut Vec<String>) {
    fs::create_dir_all(to).expect("the folder for output can be written");
    let mut entries: Vec<_> = fs::read_dir(from)
        .expect("the sources of core")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    entries.sort();
    for path in entries {
        let name = path
            .file_stem()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let inner = match name.as_str() {
            "lib" | "mod" => module.to_owned(),
            name => format!("{module}{name}::"),
        };
        let target = to.join(path.file_name().expect("a name"));
        if path.is_dir() {
            folder(&path, &target, &inner, tests);
        } else {
            let text = source(&read(&path), &inner, tests);
            fs::write(target, text).expect("the folder for output can be written");
        }
    }
}

/// Rewrites a file, and adds the paths of its tests.
fn source(text: &str, module: &str, tests: &mut Vec<String>) -> String {
    let mut out = String::new();
    // A file that is a test module as a whole.
    let mut inside = if module.ends_with("tests::") {
        module.to_owned()
    } else {
        String::new()
    };
    // What ends a block of property tests, within one.
    let mut ends: Option<String> = None;
    let mut is_test = false;
    for line in text.lines() {
        let bare = line.trim();
        if let Some(indent) = line.strip_suffix("proptest! {") {
            ends = Some(format!("{indent}}}"));
        }
        if let Some(end) = &ends {
            // The formatter puts the end of the block below its beginning.
            if line == end {
                ends = None;
            }
            continue;
        }
        if bare == "#[cfg(test)]" || bare.starts_with("use proptest::") {
            continue;
        }
        if bare == "#[test]" {
            is_test = true;
            continue;
        }
        if let Some(rest) = line.strip_prefix("mod tests") {
            let _ = writeln!(out, "pub mod tests{rest}");
            if rest == " {" {
                inside = format!("{module}tests::");
                out += IN_SCOPE;
            }
            continue;
        }
        if line.starts_with("mod ") {
            let _ = writeln!(out, "pub {line}");
            continue;
        }
        if let (true, Some(rest)) = (is_test, bare.strip_prefix("fn ")) {
            let name = rest.split('(').next().unwrap_or_default();
            tests.push(format!("{inside}{name}"));
            let _ = writeln!(out, "pub {bare}");
            is_test = false;
            continue;
        }
        if !inside.is_empty() && module == inside && bare.starts_with("use super::") {
            out += IN_SCOPE;
        }
        let _ = writeln!(out, "{line}");
    }
    out
}
