//! `core` on the microcontroller's instruction set: the same cases in an emulated Cortex-M4 and here give the same bits,
//! and its unit tests pass there.

#[path = "../qemu/src/cases.rs"]
mod cases;

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

fn skip(why: &str) {
    let line = "=".repeat(80);
    // Past the capture of the harness: a skipped test passes, and its output would not be seen.
    let _ = writeln!(
        std::io::stderr(),
        "{line}\nSKIPPED: core on the microcontroller's instruction set: {why}\n{line}"
    );
}

fn answers(program: &str, argument: &str) -> bool {
    Command::new(program)
        .arg(argument)
        .output()
        .is_ok_and(|o| o.status.success())
}

/// What a program prints on the emulated board; nothing where a tool is missing.
fn on_the_target(folder: &str) -> Option<String> {
    if !answers("qemu-system-arm", "--version") {
        skip("qemu-system-arm is missing (Debian: qemu-system-arm)");
        return None;
    }
    let library = Command::new("rustc")
        .args([
            "--print",
            "target-libdir",
            "--target",
            "thumbv7em-none-eabihf",
        ])
        .output()
        .ok()?;
    let library = String::from_utf8_lossy(&library.stdout).trim().to_owned();
    if !Path::new(&library).is_dir() {
        skip("the target is missing (rustup target add thumbv7em-none-eabihf)");
        return None;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let mut cargo = Command::new("cargo");
    cargo.args(["run", "--release", "--quiet"]);
    let output = cargo.current_dir(folder).output().expect("cargo runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}\n{text}");
    Some(text)
}

#[test]
fn the_same_bits_as_on_the_host() {
    let Some(target) = on_the_target("qemu") else {
        return;
    };
    let mut sums = cases::Sums::default();
    let mut host = Vec::new();
    let mut results = BTreeMap::<&str, u32>::new();
    cases::all(&mut |case, bits| {
        *results.entry(case).or_default() += 1;
        host.extend(sums.take(case, bits));
    });
    host.extend(sums.end());
    let lines: Vec<&str> = target.lines().collect();
    let (last, lines) = lines.split_last().expect("the board printed");
    assert_eq!(*last, format!("end, {} results to a sum", cases::STRETCH));
    let mut differing = BTreeMap::<&str, (u32, u32)>::new();
    for ((case, stretch, sum), line) in host.iter().zip(lines) {
        if format!("{case} {stretch} {sum:08x}") != *line {
            differing.entry(case).or_insert((*stretch, 0)).1 += 1;
        }
    }
    for (case, count) in &results {
        match differing.get(case) {
            None => println!("{case}: {count} results equal bit for bit"),
            Some((first, many)) => println!(
                "{case}: {many} stretches of {} results differ, the first is number {first}",
                cases::STRETCH
            ),
        }
    }
    assert_eq!(host.len(), lines.len());
    assert!(differing.is_empty(), "{differing:?}");
}

/// Tests of a `proptest!` block, which needs std, stay on the host: two each of `command` and `wire`.
const ONLY_ON_THE_HOST: usize = 4;

fn tests_in(folder: &Path) -> usize {
    let entries = std::fs::read_dir(folder).expect("the sources of core");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths
        .map(|path| {
            if path.is_dir() {
                return tests_in(&path);
            }
            let text = std::fs::read_to_string(&path).expect("a source");
            text.lines().filter(|line| line.trim() == "#[test]").count()
        })
        .sum()
}

#[test]
fn the_unit_tests_pass() {
    let Some(output) = on_the_target("qemu/unit") else {
        return;
    };
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/src");
    let passed = tests_in(&sources) - ONLY_ON_THE_HOST;
    let last = output.lines().last();
    assert_eq!(last, Some(&*format!("end, {passed} tests passed")));
    println!("{passed} unit tests of core pass, {ONLY_ON_THE_HOST} run on the host only");
}
