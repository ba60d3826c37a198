//! The time-free observer of `core` against a C implementation of it, on the same inputs: bits and cost.

use crate::budget::{self, Tick};
use crate::cost::Cost;
use crate::elf::Image;
use crate::machine::Machine;
use crate::pins::Still;
use bristle_core::parameters::BENCH;
use bristle_core::stribeck::{Curve, SEGMENTS, Shape, Stribeck};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What the C code may be beaten by: instructions and cycles of the Rust code over those of the C code.
pub const LIMIT: f64 = 1.1;

/// Compiler of the C code.
const COMPILER: &str = "arm-none-eabi-gcc";

/// Its options, as a user would give them for this chip.
const OPTIONS: [&str; 9] = [
    "-O3",
    "-mcpu=cortex-m4",
    "-mthumb",
    "-mfloat-abi=hard",
    "-mfpu=fpv4-sp-d16",
    "-std=c17",
    "-Wall",
    "-Wextra",
    "-Werror",
];

/// What a compiler made of the observer.
#[derive(Clone, Debug, PartialEq)]
pub struct Built {
    /// Which compiler.
    pub name: String,
    /// Steps of the recorded run.
    pub recorded: Cost,
    /// Steps beyond it, which reach every path.
    pub beyond: Cost,
    z_bits: Vec<u32>,
}

/// Runs both; nothing where the C compiler is missing. The second C row lets the compiler contract a product and a sum
/// to one rounding, which it does by default for GNU C and which Rust never does.
///
/// # Errors
/// C code that does not compile, a fault in it.
pub fn run(rust: &Image, here: &Path) -> Result<Option<Vec<Built>>, String> {
    let Ok(version) = Command::new(COMPILER).arg("-dumpversion").output() else {
        return Ok(None);
    };
    let version = String::from_utf8_lossy(&version.stdout).trim().to_owned();
    let mut all = vec![count(rust, "Rust".to_owned())?];
    for (what, contract) in [("", "-ffp-contract=off"), (", fused", "-ffp-contract=fast")] {
        let image = Image::read(&compile(here, contract)?)?;
        all.push(count(&image, format!("gcc {version} -O3{what}"))?);
    }
    Ok(Some(all))
}

fn compile(here: &Path, contract: &str) -> Result<PathBuf, String> {
    let folder = std::env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| here.join("kernels/target"), PathBuf::from)
        .join("against-c");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let to = folder.join(format!("time_free{contract}.elf"));
    let sources = here.join("c");
    let output = Command::new(COMPILER)
        .args(OPTIONS)
        .args([contract, "-ffreestanding", "-nostdlib", "-T"])
        .arg(sources.join("time_free.ld"))
        .arg(sources.join("time_free.c"))
        .arg("-o")
        .arg(&to)
        .output()
        .map_err(|e| format!("{COMPILER}: {e}"))?;
    if output.status.success() {
        Ok(to)
    } else {
        Err(String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

fn count(image: &Image, name: String) -> Result<Built, String> {
    let mut machine = Machine::new(image, Box::new(Still))?;
    if let Some(at) = image.address("parameters") {
        machine.write(at, &parameters())?;
    }
    budget::setup(&mut machine, image)?;
    let step = budget::function(image, "kernel_time_free")?;
    let mut z_bits = Vec::new();
    let mut steps = |calls: Vec<(i32, f32)>| -> Result<Cost, String> {
        let mut total = Cost::default();
        for (counts, velocity) in calls {
            let (z, cost) = machine.call(step, [counts as u32, velocity.to_bits()])?;
            z_bits.push(z);
            total.add(cost);
        }
        Ok(total)
    };
    let recorded = budget::record();
    let recorded = recorded.iter().map(|t: &Tick| (t.step, t.velocity_rad_s));
    let recorded = steps(recorded.collect())?;
    let beyond = steps(budget::extremes())?;
    Ok(Built {
        name,
        recorded,
        beyond,
        z_bits,
    })
}

/// The parameters of the bench as `struct time_free` of the C code holds them.
fn parameters() -> Vec<u8> {
    let top_speed_rad_s = 8.0 * BENCH.stribeck_velocity_rad_s;
    let shape = Shape::Gaussian {
        velocity_rad_s: BENCH.stribeck_velocity_rad_s,
    };
    let curve =
        Stribeck::new(BENCH.coulomb_nm, BENCH.stiction_nm, shape).expect("parameters of an axis");
    let levels = (0..SEGMENTS + 2)
        .map(|i| curve.level_nm(top_speed_rad_s * i.min(SEGMENTS) as f32 / SEGMENTS as f32));
    let config = BENCH.build(1e-4, 1).expect("parameters of an axis");
    let observer = &config.tick.time_free();
    let mut words: Vec<f32> = levels.collect();
    words.extend([
        SEGMENTS as f32 / top_speed_rad_s,
        1.0 / BENCH.stiffness_nm_rad,
        BENCH.breakaway_ratio,
        1.0 / (1.0 - BENCH.breakaway_ratio),
        observer.friction().z_max_rad(),
        std::f32::consts::TAU / BENCH.counts_per_rev,
        BENCH.max_speed_rad_s * 1.5 * 1e-4,
    ]);
    words.into_iter().flat_map(f32::to_le_bytes).collect()
}

/// Steps at which two differ, and by how many units in the last place at most. Finite values of one sign are compared
/// by their bits.
fn apart(a: &[u32], b: &[u32]) -> (usize, u32) {
    let different = a.iter().zip(b).filter(|(a, b)| a != b);
    different.fold((0, 0), |(many, most), (&a, &b)| {
        (many + 1, most.max(a.abs_diff(b)))
    })
}

/// Mean instructions, most, mean cycles, most, over both sequences but for the means, which are of the recorded one.
fn figures(built: &Built) -> [f64; 4] {
    let mean = |sum: u64| sum as f64 / built.recorded.runs.max(1) as f64;
    let most = |f: fn(&Cost) -> u64| f(&built.recorded).max(f(&built.beyond)) as f64;
    [
        mean(built.recorded.instructions),
        most(|c| c.most_instructions),
        mean(built.recorded.cycles),
        most(|c| c.most_cycles),
    ]
}

/// The table as it stands in the document.
pub fn table(all: &[Built]) -> String {
    let mut text =
        "| compiler | instructions, mean | most | cycles, mean | most | z against Rust |\n\
                    |---|---:|---:|---:|---:|---|\n"
            .to_owned();
    let Some((rust, others)) = all.split_first() else {
        return text;
    };
    let line = |name: &str, [a, b, c, d]: [f64; 4], places: usize, z: &str| {
        let most = if places == 1 { 0 } else { places }; // counts, or ratios
        format!("| {name} | {a:.places$} | {b:.most$} | {c:.places$} | {d:.most$} | {z} |\n")
    };
    text += &line(&rust.name, figures(rust), 1, "");
    for c in others {
        let steps = c.z_bits.len();
        let z = match apart(&rust.z_bits, &c.z_bits) {
            (0, _) => format!("equal in all {steps} steps"),
            (many, most) => {
                format!("differs in {many} of {steps} steps, by {most} in the last place")
            }
        };
        text += &line(&c.name, figures(c), 1, &z);
        text += &line(&format!("Rust over {}", c.name), ratios(rust, c), 3, "");
    }
    text
}

fn ratios(rust: &Built, c: &Built) -> [f64; 4] {
    let (rust, c) = (figures(rust), figures(c));
    std::array::from_fn(|i| rust[i] / c[i])
}

/// What is wrong: a C program that costs less than it may, or whose z differs where no rounding was left out.
pub fn complaints(all: &[Built]) -> Vec<String> {
    let Some((rust, others)) = all.split_first() else {
        return Vec::new();
    };
    let names = [
        "instructions, mean",
        "instructions, most",
        "cycles, mean",
        "cycles, most",
    ];
    let mut complaints = Vec::new();
    for c in others {
        let dear = names.into_iter().zip(ratios(rust, c));
        complaints.extend(
            dear.filter(|(_, ratio)| *ratio > LIMIT)
                .map(|(what, ratio)| {
                    format!("Rust over {}: {what}: {ratio:.3}, at most {LIMIT}", c.name)
                }),
        );
    }
    if let Some(c) = others.first() {
        let (many, most) = apart(&rust.z_bits, &c.z_bits);
        if many > 0 {
            complaints.push(format!(
                "z of {} differs in {many} steps, by {most}",
                c.name
            ));
        }
    }
    complaints
}

#[cfg(test)]
mod tests {
    use super::*;

    fn built(name: &str, instructions: u64, z_bits: &[u32]) -> Built {
        let recorded = Cost {
            runs: 1,
            instructions,
            most_instructions: instructions,
            cycles: 2 * instructions,
            most_cycles: 2 * instructions,
            last_instructions: instructions,
        };
        Built {
            name: name.to_owned(),
            recorded,
            beyond: Cost::default(),
            z_bits: z_bits.to_vec(),
        }
    }

    #[test]
    fn a_dearer_program_and_another_result_are_complaints() {
        let rust = built("Rust", 110, &[1, 2]);
        let same = [rust.clone(), built("gcc", 100, &[1, 2])];
        assert_eq!(complaints(&same), Vec::<String>::new());
        assert!(table(&same).contains("| Rust over gcc | 1.100 |"));
        // Mean and most, of instructions and of cycles; then the result.
        assert_eq!(
            complaints(&[rust.clone(), built("gcc", 99, &[1, 5])]).len(),
            5
        );
        // Only the first may not differ.
        let fused = built("fused", 100, &[1, 5]);
        assert_eq!(
            complaints(&[rust, same[1].clone(), fused]),
            Vec::<String>::new()
        );
    }
}
