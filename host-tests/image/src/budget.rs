//! What the pieces of the tick cost: exact instruction counts on recorded inputs, and the table that holds them.

use crate::axis::axis_of;
use crate::cost::Cost;
use crate::elf::Image;
use crate::machine::Machine;
use crate::pins::Still;
use bristle_core::experiment::Experiment;
use bristle_core::parameters::BENCH;
use bristle_plant::Rig;

/// Growth of an instruction count that the gate lets pass.
pub const GATE: f64 = 1.03;

/// Ticks of the recorded run: two periods of the sine.
const RUN: usize = 20_000;

/// A row of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What was counted.
    pub name: String,
    /// Its cost.
    pub cost: Cost,
    /// Estimated cycles that its longest run may take.
    pub limit: Option<u64>,
}

/// One tick of the recorded run.
#[derive(Clone, Copy)]
pub(crate) struct Tick {
    pub raw: u32,
    pub step: i32,
    pub torque_nm: f32,
    pub velocity_rad_s: f32,
}

/// The sine experiment of the thesis on the axis of the bench.
pub(crate) fn record() -> Vec<Tick> {
    let config = BENCH.build(1e-4, 1).expect("parameters of the image");
    let sine = Experiment::Sine {
        amplitude_nm: 0.035,
        period_ticks: 10_000,
    };
    let mut last_nm = 0.0;
    Rig::new(config.tick, axis_of(&BENCH, 1), sine)
        .take(RUN)
        .map(|r| Tick {
            raw: r.counts as u32,
            step: r.sample.step_counts,
            torque_nm: std::mem::replace(&mut last_nm, r.sample.torque_ref_nm),
            velocity_rad_s: r.sample.luenberger.velocity_rad_s,
        })
        .collect()
}

/// Steps and speeds that the recorded run does not have: around rest, across the table's end, and past belief.
pub(crate) fn extremes() -> Vec<(i32, f32)> {
    let steps = [0, 1, -1, 2, -3, 5, -50, 100, -800, 10_000, i32::MIN];
    let speeds = [
        0.0,
        1e-6,
        -0.01,
        0.29,
        -0.31,
        1.2,
        -2.39,
        2.41,
        30.0,
        -400.0,
        1e9,
        f32::NAN,
    ];
    let pairs = steps.iter().flat_map(|&s| speeds.map(|v| (s, v)));
    // Several times over, so that each pair meets the states that the others leave.
    let once: Vec<_> = pairs.collect();
    let stride = 17;
    (0..10 * once.len())
        .map(|i| once[i * stride % once.len()])
        .collect()
}

/// Counts the pieces.
///
/// # Errors
/// An image without them, or a fault in one.
pub fn pieces(image: &Image) -> Result<Vec<Row>, String> {
    let mut machine = Machine::new(image, Box::new(Still))?;
    let run = record();
    // Counts a sample as I16F16, and as an angle.
    let rad = std::f32::consts::TAU / BENCH.counts_per_rev;
    let fixed = |v: f32| ((v * 1e-4 / rad) * 65_536.0) as i32 as u32;
    let recorded = |f: &dyn Fn(&Tick) -> [u32; 2]| run.iter().map(f).collect::<Vec<_>>();
    let beyond = |f: &dyn Fn(i32, f32) -> [u32; 2]| {
        let all = extremes().into_iter();
        all.map(|(s, v)| f(s, v)).collect::<Vec<_>>()
    };
    let bits = f32::to_bits;
    let limit = Some(250);
    let limit_fixed = Some(200);
    let list = [
        (
            "elasto-plastic step",
            "kernel_elasto_plastic",
            recorded(&|t| [bits(t.velocity_rad_s), 0]),
            beyond(&|_, v| [bits(v), 0]),
            limit,
        ),
        (
            "elasto-plastic step, fixed point",
            "kernel_elasto_plastic_fixed",
            recorded(&|t| [fixed(t.velocity_rad_s), 0]),
            beyond(&|s, v| [fixed(v).wrapping_add_signed(s), 0]),
            limit_fixed,
        ),
        (
            "reduced-order observer, one state",
            "kernel_reduced_order",
            recorded(&|t| [bits(t.step as f32 * rad), bits(t.torque_nm)]),
            beyond(&|s, v| [bits(s as f32 * rad), bits(v)]),
            limit,
        ),
        (
            "Luenberger-like observer",
            "kernel_luenberger",
            recorded(&|t| [t.step as u32, bits(t.torque_nm)]),
            beyond(&|s, v| [s as u32, bits(v / 100.0)]),
            limit,
        ),
        (
            "time-free observer",
            "kernel_time_free",
            recorded(&|t| [t.step as u32, bits(t.velocity_rad_s)]),
            beyond(&|s, v| [s as u32, bits(v)]),
            limit,
        ),
        (
            "time-free observer, fixed point",
            "kernel_time_free_fixed",
            recorded(&|t| [t.step as u32, fixed(t.velocity_rad_s)]),
            beyond(&|s, v| [s as u32, fixed(v)]),
            limit_fixed,
        ),
        (
            "controller: the handler without its registers",
            "kernel_controller",
            orders(&run),
            beyond(&|s, v| [s as u32, u32::from(v > 1.0) * 3]),
            None,
        ),
    ];
    let mut rows = Vec::new();
    for (name, symbol, recorded, beyond, limit) in list {
        let mut calls = recorded;
        calls.extend(beyond);
        setup(&mut machine, image)?;
        let cost = count(&mut machine, image, symbol, &calls)?;
        rows.push(Row {
            name: name.to_owned(),
            cost,
            limit,
        });
    }
    rows.push(push(&mut machine, image)?);
    Ok(rows)
}

/// The recorded run as the controller gets it: armed once it is idle, then the experiment, and keep-alives.
fn orders(run: &[Tick]) -> Vec<[u32; 2]> {
    let order = |i| match i {
        200 => 1,
        201 => 2,
        _ if i % 500 == 0 => 3,
        _ => 0,
    };
    let all = run.iter().enumerate();
    all.map(|(i, t)| [t.raw, order(i)]).collect()
}

pub(crate) fn function(image: &Image, symbol: &str) -> Result<u32, String> {
    image
        .address(symbol)
        .ok_or_else(|| format!("no function {symbol} in the image"))
}

pub(crate) fn setup(machine: &mut Machine, image: &Image) -> Result<(), String> {
    let (well, _) = machine.call(function(image, "kernel_setup")?, [0; 2])?;
    if well == 1 {
        Ok(())
    } else {
        Err("kernel_setup refused the parameters".to_owned())
    }
}

fn count(
    machine: &mut Machine,
    image: &Image,
    symbol: &str,
    calls: &[[u32; 2]],
) -> Result<Cost, String> {
    let function = function(image, symbol)?;
    let mut total = Cost::default();
    for call in calls {
        total.add(machine.call(function, *call)?.1);
    }
    Ok(total)
}

/// Pushes of a sample: through the queue's end several times, and into a full queue.
fn push(machine: &mut Machine, image: &Image) -> Result<Row, String> {
    let (push, pop) = (
        function(image, "kernel_push")?,
        function(image, "kernel_pop")?,
    );
    let mut cost = Cost::default();
    for round in 0..5 {
        for tick in 0..700 {
            let (_, one) = machine.call(push, [round * 700 + tick, 0])?;
            cost.add(one);
        }
        for _ in 0..700 {
            machine.call(pop, [0; 2])?;
        }
    }
    Ok(Row {
        name: "push of a sample".to_owned(),
        cost,
        limit: Some(40),
    })
}

/// The table as it stands in the document.
pub fn table(rows: &[Row]) -> String {
    let mut text = "| piece | instructions, mean | most | cycles, mean | most | limit |\n\
                    |---|---:|---:|---:|---:|---:|\n"
        .to_owned();
    for row in rows {
        let c = row.cost;
        let mean = |sum: u64| sum as f64 / c.runs.max(1) as f64;
        let limit = row.limit.map_or(String::new(), |limit| {
            let over = if c.most_cycles > limit { OVER } else { "" };
            format!("{limit}{over}")
        });
        text += &format!(
            "| {} | {:.1} | {} | {:.1} | {} | {limit} |\n",
            row.name,
            mean(c.instructions),
            c.most_instructions,
            mean(c.cycles),
            c.most_cycles
        );
    }
    text
}

/// Marks a limit that is exceeded. The document says so, and the check fails only where it is new.
const OVER: &str = ", exceeded";

/// What is wrong with the counts: over their limits, or above those of the document by more than the gate lets pass.
pub fn complaints(rows: &[Row], document: &str) -> Vec<String> {
    let mut all = Vec::new();
    for row in rows {
        let known_miss = document
            .lines()
            .any(|line| line.starts_with(&format!("| {} |", row.name)) && line.contains(OVER));
        let most = row.cost.most_cycles;
        if let Some(limit) = row.limit.filter(|&limit| most > limit && !known_miss) {
            all.push(format!(
                "{}: {most} estimated cycles, limit {limit}",
                row.name
            ));
        }
        let known = document.lines().find_map(|line| {
            let mut cells = line.split('|').skip(1).map(str::trim);
            (cells.next()? == row.name).then_some(())?;
            let mean: f64 = cells.next()?.parse().ok()?;
            let most: f64 = cells.next()?.parse().ok()?;
            Some([mean, most])
        });
        let Some(known) = known else {
            all.push(format!("{}: not in the document", row.name));
            continue;
        };
        let mean = row.cost.instructions as f64 / row.cost.runs.max(1) as f64;
        let now = [mean, row.cost.most_instructions as f64];
        for (what, (was, is)) in ["mean", "most"].iter().zip(known.into_iter().zip(now)) {
            if is > was * GATE {
                all.push(format!(
                    "{}: {what} {is:.1} instructions, was {was:.1}",
                    row.name
                ));
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(most: u64) -> Row {
        Row {
            name: "a piece".to_owned(),
            cost: Cost {
                runs: 2,
                instructions: 2 * most - 10,
                most_instructions: most,
                cycles: 3 * most,
                most_cycles: 2 * most,
                last_instructions: most,
            },
            limit: Some(250),
        }
    }

    #[test]
    fn growth_above_the_gate_is_a_complaint() {
        let document = table(&[row(100)]);
        assert_eq!(complaints(&[row(100)], &document), Vec::<String>::new());
        assert_eq!(complaints(&[row(102)], &document), Vec::<String>::new());
        // Both the mean and the longest run grew.
        assert_eq!(complaints(&[row(104)], &document).len(), 2);
        assert_eq!(complaints(&[row(90)], &document), Vec::<String>::new());
    }

    #[test]
    fn limits_and_missing_rows_are_complaints() {
        // New where the document held the limit, known where it says that it does not.
        let long = complaints(&[row(126)], &table(&[row(125)]));
        assert_eq!(long, ["a piece: 252 estimated cycles, limit 250"]);
        assert!(complaints(&[row(126)], &table(&[row(126)])).is_empty());
        assert_eq!(
            complaints(&[row(100)], ""),
            ["a piece: not in the document"]
        );
    }
}
