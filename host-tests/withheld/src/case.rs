//! A case: what its seed makes of it, its axis file and its logs.

use crate::axis::{Axis, Wanted};
use crate::calibrate::{Bench, Chosen, measure};
use crate::draw::Draw;
use crate::experiment::{Experiment, NAMES};
use crate::form::{FOREIGN, Form, LISTED, entry};
use crate::friction::{Friction, Law};
use crate::simulate::FINE_S;
use crate::truth::{Changed, Class, Effect, Truth};
use std::f64::consts::TAU;
use std::fmt::Write as _;

/// A log as columns by their names in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct LogTable {
    /// The experiment.
    pub name: String,
    /// Names and values; those of `position_counts` are whole.
    pub columns: Vec<(&'static str, Vec<f64>)>,
}

/// A case: what is handed out, and what is withheld.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Axis file.
    pub axis_toml: String,
    /// Logs.
    pub logs: Vec<LogTable>,
    /// What is withheld.
    pub truth: Truth,
}

/// What kind of case it is to be.
struct Plan {
    class: Class,
    ratio: f64,
    ids: Vec<&'static str>,
}

/// Seeds that make up a full deal of the classes.
const DEAL: u64 = 40;
/// Cases of a deal: class, times the floor, how many.
const CLASSES: [(Class, f64, usize); 7] = [
    (Class::Single, 4.0, 14),
    (Class::Single, 1.0, 8),
    (Class::Single, 0.25, 4),
    (Class::Unknown, 4.0, 4),
    (Class::Pair, 4.0, 3),
    (Class::Clean, 0.0, 4),
    (Class::Parameters, 0.0, 3),
];

/// The `count`th card of a deck of `n` that is shuffled anew whenever it is used up.
fn dealt(count: u64, n: usize, stream: u64) -> usize {
    let mut cards: Vec<usize> = (0..n).collect();
    let mut draw = Draw::new(count / n as u64, stream);
    for i in (1..n).rev() {
        cards.swap(i, draw.below(i + 1));
    }
    cards[(count % n as u64) as usize]
}

/// Classes and effects are dealt, so that any run of seeds has about as many of each.
fn plan(seed: u64) -> Plan {
    let mut slot = dealt(seed, DEAL as usize, 100);
    for (i, (class, ratio, size)) in CLASSES.into_iter().enumerate() {
        if slot >= size {
            slot -= size;
            continue;
        }
        let count = (seed / DEAL)
            .wrapping_mul(size as u64)
            .wrapping_add(slot as u64);
        let stream = 101 + i as u64;
        let ids = match class {
            Class::Single => vec![LISTED[dealt(count, LISTED.len(), stream)]],
            Class::Unknown => vec![FOREIGN[dealt(count, FOREIGN.len(), stream)]],
            Class::Pair => pair(count, stream, seed),
            Class::Clean | Class::Parameters => Vec::new(),
        };
        return Plan { class, ratio, ids };
    }
    unreachable!("the classes fill a deal")
}

/// Effects that only delay: two of them add up to one.
const LATE: [&str; 5] = [
    "actuator.lag",
    "actuator.delay",
    "sensor.delay",
    "friction.lag",
    "mechanics.compliance",
];
/// Effects that nothing tells apart while the axis slides.
const ONE_SIDED: [&str; 2] = ["friction.asymmetry", "mechanics.offset"];

/// Two effects of different blocks on an axis that can have both.
fn pair(count: u64, stream: u64, seed: u64) -> Vec<&'static str> {
    let first = LISTED[dealt(count, LISTED.len(), stream)];
    let mut draw = Draw::new(seed, 1);
    loop {
        let second = draw.pick(&LISTED);
        let (Some(a), Some(b)) = (entry(first), entry(second)) else {
            continue;
        };
        let apart = [&LATE[..], &ONE_SIDED]
            .iter()
            .all(|group| !(group.contains(&first) && group.contains(&second)));
        let together =
            !(a.wanted.is_static && b.wanted.bristles || a.wanted.bristles && b.wanted.is_static);
        if a.block != b.block && apart && together {
            return vec![first, second];
        }
    }
}

/// Class and effects of the case of a seed.
pub fn planned(seed: u64) -> (Class, Vec<&'static str>) {
    let plan = plan(seed);
    (plan.class, plan.ids)
}

/// The case of a seed.
pub fn case(seed: u64) -> Case {
    make(seed, plan(seed))
}

/// A case of a class with given effects, each `ratio` times the floor; `None` if an id is not known.
///
/// ```
/// let case = bristle_withheld::case_of(3, bristle_withheld::Class::Single, &["actuator.cogging"], 4.0).unwrap();
/// assert_eq!(case.truth.effects[0].id, "actuator.cogging");
/// ```
pub fn case_of(seed: u64, class: Class, ids: &[&str], ratio: f64) -> Option<Case> {
    let ids = ids
        .iter()
        .map(|id| entry(id).map(|entry| entry.id))
        .collect::<Option<_>>()?;
    Some(make(seed, Plan { class, ratio, ids }))
}

fn make(seed: u64, plan: Plan) -> Case {
    // An axis on which an effect cannot be as strong as asked, or that runs away, is drawn anew. After so many the
    // nearest that an axis gives has to do: the truth says how strong that is.
    const ATTEMPTS: u64 = 8;
    (0..ATTEMPTS)
        .find_map(|attempt| attempt_at(seed, &plan, attempt, false))
        .or_else(|| (0..).find_map(|attempt| attempt_at(seed, &plan, ATTEMPTS + attempt, true)))
        .unwrap_or_else(|| unreachable!("an endless search ends with a case"))
}

fn attempt_at(seed: u64, plan: &Plan, attempt: u64, any_size: bool) -> Option<Case> {
    let mut draw = Draw::new(seed, 1000 + attempt);
    let chosen: Vec<Chosen> = plan
        .ids
        .iter()
        .filter_map(|id| entry(id))
        .map(|entry| Chosen {
            entry,
            shape: std::array::from_fn(|_| draw.unit()),
        })
        .collect();
    let wanted = chosen.iter().fold(Wanted::default(), |all, one| {
        let its = one.entry.wanted;
        Wanted {
            is_static: all.is_static || its.is_static,
            bristles: all.bristles || its.bristles,
            flat: all.flat || its.flat,
            linear: all.linear.or(its.linear),
        }
    });
    let axis = Axis::draw(&mut draw, &wanted);
    let experiments = experiments(&axis, &chosen, &mut draw);
    let bench = Bench {
        axis,
        experiments,
        seed,
    };
    let mut forms: Vec<Box<dyn Form>> = Vec::new();
    let mut effects = Vec::new();
    for one in &chosen {
        // A coarser step is enough to find the size.
        let (size, alone) = bench.calibrate(one, plan.ratio, 2.0 * FINE_S, any_size)?;
        let built = one.build(size, &bench.axis);
        forms.push(built.form);
        effects.push(Effect {
            id: one.entry.id.to_owned(),
            block: one.entry.block.to_owned(),
            resembles: one.entry.resembles.map(str::to_owned),
            size,
            parameters: built
                .parameters
                .into_iter()
                .map(|(name, value)| (named(name, axis.linear), value))
                .collect(),
            gap_rms_nm: alone.gap,
            ratio: alone.gap / alone.floor,
        });
    }
    let runs = bench.runs(&mut forms, FINE_S)?;
    let whole = measure(&runs);
    let (believed, changed) = believe(&axis, plan.class, &mut draw);
    let in_counts = draw.chance(0.6) && !plan.ids.contains(&"sensor.quantization");
    let with_limit = draw.chance(0.5);
    let logs = bench
        .experiments
        .iter()
        .zip(&runs)
        .map(|(experiment, run)| {
            let (effort_name, position_name) = match axis.linear {
                false => ("torque_nm", "position_rad"),
                true => ("force_n", "position_m"),
            };
            let position = if in_counts {
                (
                    "position_counts",
                    run.position
                        .iter()
                        .map(|q| (q / axis.count).round())
                        .collect(),
                )
            } else {
                (position_name, rounded(&run.position, 1e9))
            };
            // The converter's grid lies far below the noise.
            let grid = libm::pow(10.0, (-libm::log10(2e-3 * axis.effort_noise.0)).ceil());
            LogTable {
                name: experiment.name.to_owned(),
                columns: vec![
                    ("time_s", run.time_s.clone()),
                    (effort_name, rounded(&run.effort, grid)),
                    position,
                ],
            }
        })
        .collect();
    Some(Case {
        axis_toml: axis_file(&axis, &believed, with_limit),
        logs,
        truth: Truth {
            seed,
            class: plan.class,
            ratio: (!chosen.is_empty()).then_some(plan.ratio),
            effects,
            changed,
            linear: axis.linear,
            rate_hz: axis.rate_hz,
            experiments: bench
                .experiments
                .iter()
                .map(|one| one.name.to_owned())
                .collect(),
            floor_rms_nm: whole.floor,
            before_rms_nm: whole.before,
        },
    })
}

/// Decimal grid of `per_unit` steps.
fn rounded(values: &[f64], per_unit: f64) -> Vec<f64> {
    values
        .iter()
        .map(|value| (value * per_unit).round() / per_unit)
        .collect()
}

/// A rotary name as a linear axis has it.
fn named(name: &str, linear: bool) -> String {
    if linear {
        name.replace("_nm", "_n")
            .replace("_rad", "_m")
            .replace("_per_rev", "_per_m")
    } else {
        name.to_owned()
    }
}

/// Two to five experiments of 5 to 20 s, less than a minute and 150 000 samples in all, with one that shows each effect.
fn experiments(axis: &Axis, chosen: &[Chosen], draw: &mut Draw) -> Vec<Experiment> {
    const SAMPLES: f64 = 150_000.0;
    let most = ((SAMPLES / axis.rate_hz / 5.0) as usize).clamp(2, 5);
    let count = (2 + draw.below(4)).min(most);
    let mut names: Vec<&'static str> = Vec::new();
    for one in chosen {
        let shown_by = one.entry.shown_by;
        if !shown_by.is_empty() && !shown_by.iter().any(|name| names.contains(name)) {
            names.push(draw.pick(shown_by));
        }
    }
    while names.len() < count {
        let name = draw.pick(&NAMES);
        // A second one of a kind has other numbers, which is worth having now and then.
        if !names.contains(&name) || draw.chance(0.1) {
            names.push(name);
        }
    }
    let longest = (60.0 / names.len() as f64)
        .min(SAMPLES / axis.rate_hz / names.len() as f64)
        .clamp(5.0, 20.0);
    names
        .into_iter()
        .map(|name| {
            let seconds = draw.even(5f64.max(0.6 * longest), longest);
            Experiment::draw(name, axis, seconds, draw)
        })
        .collect()
}

/// What the axis file has, and where it is wrong.
fn believe(axis: &Axis, class: Class, draw: &mut Draw) -> ((f64, Friction), Vec<Changed>) {
    let small = |draw: &mut Draw| 1.0 + draw.sign() * draw.even(0.03, 0.1);
    let truth = &axis.friction;
    let (inertia, friction) = match class {
        Class::Clean => (axis.inertia, *truth),
        Class::Parameters => {
            // One or two of the three that every axis has.
            let first = draw.below(3);
            let second = if draw.chance(0.5) {
                (first + 1) % 3
            } else {
                first
            };
            let factors: [f64; 3] = std::array::from_fn(|i| {
                let wrong = i == first || i == second;
                if wrong {
                    1.0 + draw.sign() * draw.even(0.05, 0.3)
                } else {
                    1.0
                }
            });
            let mut friction = *truth;
            friction.coulomb *= factors[1];
            friction.stiction *= factors[1];
            friction.viscous *= factors[2];
            (axis.inertia * factors[0], friction)
        }
        _ => (axis.inertia * small(draw), truth.misjudged(draw, small)),
    };
    let changed = keys(axis, inertia, &friction)
        .into_iter()
        .zip(keys(axis, axis.inertia, truth))
        .filter(|((_, file), (_, truth))| (file / truth - 1.0).abs() > 1e-3)
        .map(|((key, file), (_, truth))| Changed { key, file, truth })
        .collect();
    ((inertia, friction), changed)
}

/// The numbers of the file that may be wrong.
fn keys(axis: &Axis, inertia: f64, friction: &Friction) -> Vec<(String, f64)> {
    let mut keys = vec![
        (
            if axis.linear {
                "mass_kg"
            } else {
                "inertia_kg_m2"
            },
            inertia,
        ),
        ("coulomb_nm", friction.coulomb),
        ("viscous_nm_s_rad", friction.viscous),
    ];
    if friction.law != Law::Static || friction.stiction > friction.coulomb {
        keys.push(("stiction_nm", friction.stiction));
        keys.push(("stribeck_velocity_rad_s", friction.stribeck_velocity));
    }
    if friction.law != Law::Static {
        keys.push(("stiffness_nm_rad", friction.stiffness));
        keys.push(("damping_nm_s_rad", friction.damping));
    }
    if friction.law == Law::ElastoPlastic {
        keys.push(("breakaway_ratio", friction.breakaway_ratio));
    }
    keys.into_iter()
        .map(|(name, value)| (key_named(name, axis.linear), value))
        .collect()
}

/// A key of the axis file as a linear axis has it.
fn key_named(name: &str, linear: bool) -> String {
    match (linear, name) {
        (false, _) => name.to_owned(),
        (true, "viscous_nm_s_rad") => "viscous_n_s_m".to_owned(),
        (true, "stiffness_nm_rad") => "stiffness_n_m".to_owned(),
        (true, "damping_nm_s_rad") => "damping_n_s_m".to_owned(),
        (true, name) => name.replace("_nm", "_n").replace("_rad_s", "_m_s"),
    }
}

fn axis_file(axis: &Axis, (inertia, friction): &(f64, Friction), with_limit: bool) -> String {
    let model = match friction.law {
        Law::Static if friction.stiction > friction.coulomb => "stribeck",
        Law::Static => "coulomb-viscous",
        Law::Lugre => "lugre",
        Law::ElastoPlastic => "elasto-plastic",
    };
    let mut lines = keys(axis, *inertia, friction).into_iter();
    let mut text = String::from("[axis]\n");
    let line = |text: &mut String, key: &str, value: f64| {
        // Writing into a String does not fail.
        let _ = writeln!(text, "{key} = {value:.3e}");
    };
    if let Some((key, value)) = lines.next() {
        line(&mut text, &key, value);
    }
    let (key, per_turn) = if axis.linear {
        ("counts_per_m", 1.0)
    } else {
        ("counts_per_rev", TAU)
    };
    let _ = writeln!(text, "{key} = {}", (per_turn / axis.count).round());
    let _ = writeln!(text, "\n[friction]\nmodel = \"{model}\"");
    for (key, value) in lines {
        line(&mut text, &key, value);
    }
    if with_limit {
        text += "\n[drive]\n";
        line(
            &mut text,
            if axis.linear {
                "force_limit_n"
            } else {
                "torque_limit_nm"
            },
            axis.torque_limit,
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::Level;
    use crate::noise::second_derivative;

    /// What someone with the log and the true numbers is left with is the floor that the truth states.
    #[test]
    fn a_clean_axis_leaves_the_stated_floor() {
        for seed in 0..6 {
            let mut draw = Draw::new(seed, 5000);
            let mut axis = Axis::draw(&mut draw, &Wanted::default());
            axis.rate_hz = 2000.0;
            // Slow torque without a loop: a loop makes fast torque of encoder noise, which no window of 3 ms follows.
            let mut experiment = Experiment::draw("breakaway", &axis, 10.0, &mut draw);
            experiment.gains = None;
            for (k, torque) in experiment.torque.iter_mut().enumerate() {
                *torque = 1.8 * axis.friction.stiction * libm::sin(k as f64 / axis.rate_hz * 4.0);
            }
            let bench = Bench {
                axis,
                experiments: vec![experiment],
                seed,
            };
            let runs = bench.runs(&mut [], FINE_S).unwrap();
            let (run, step) = (&runs[0], 1.0 / axis.rate_hz);
            let acceleration = second_derivative(&run.position, step);
            let mut z = 0.0;
            let (mut sum, mut noise, mut count) = (0.0, 0.0, 0.0f64);
            for (k, acceleration) in acceleration
                .iter()
                .enumerate()
                .take(run.effort.len() - 200)
                .skip(200)
            {
                // Velocity over 12 ms, about the middle of the sample, for friction that slides.
                let v = (run.position[k + 13] - run.position[k - 12]) / (25.0 * step);
                let friction = &axis.friction;
                let g = friction.level(v, &Level::default());
                z = friction.bristle(z, v, step, g);
                let dry = match friction.law {
                    Law::Static => g * v.signum(),
                    _ => friction.stiffness * z,
                };
                // Away from reversals, where the window of the acceleration is longer than the event.
                if run.regressors[k - 100..k + 100]
                    .iter()
                    .all(|row| row[2].abs() > 0.04 * axis.rated_speed)
                {
                    let left =
                        run.effort[k] - axis.inertia * acceleration - dry - friction.viscous * v;
                    sum += left * left;
                    // Fast motion has more of it than rest: the floor of these samples, not of all.
                    noise += run.noise[k] * run.noise[k];
                    count += 1.0;
                }
            }
            let (left, floor) = ((sum / count).sqrt(), (noise / count).sqrt());
            println!("seed {seed}: left {left:.3e}, floor {floor:.3e}, {count} samples");
            // Coloured noise of 30 ms over a few seconds: a spread of some 5 % in rms; the window and the velocity over
            // 12 ms leave a few percent more.
            assert!(
                count > 500.0 && (left / floor - 1.0).abs() < 0.2,
                "seed {seed}: {left:e} {floor:e}"
            );
        }
    }

    #[test]
    fn the_deal_is_even() {
        for n in [7, 31, 40] {
            let mut seen = vec![0; n];
            for count in 0..3 * n as u64 {
                seen[dealt(count, n, 9)] += 1;
            }
            assert!(seen.iter().all(|times| *times == 3));
        }
        assert_eq!(
            CLASSES.iter().map(|(_, _, size)| size).sum::<usize>() as u64,
            DEAL
        );
    }
}
