//! Where the gap lies: shares of it by part of the motion, position, angle, speed, time, dwell, load, frequency and
//! acceleration, and whether chance would give as much.
//!
//! What is shared out is the square of what the refitted simulator leaves beyond what is open in each log and regime: what
//! could repeat. Noise of that size adds nothing on average, wherever it is.

mod chance;
mod course;
#[cfg(test)]
mod tests;

use super::hypothesis::Hypothesis;
use super::likelihood::Noise;
use super::regime::Node;
use super::tried::Search;
use super::waves::{Squares, over_orders};
use super::windows::Windows;
use crate::inverse::Record;
use crate::report::short;
use bristle_plant::Unit;
use bristle_plant::effect::Scale;
use course::{Course, Part, course};
use serde::Serialize;
use std::f64::consts::TAU;

/// A part of the data and its share of the gap's square.
#[derive(Clone, Debug, Serialize)]
pub struct Region {
    /// What the data were divided by.
    pub axis: &'static str,
    /// Which part of it.
    pub label: String,
    /// Share of the gap's square that lies there, 0 to 1.
    pub share: f64,
    /// Share of the time that is spent there, 0 to 1; of frequencies and waves the share of noise that lies there. Equal
    /// shares mean nothing.
    pub time_share: f64,
    /// Probability that chance gives any of the parts that were looked at as much more than its share of the time.
    pub significance: f64,
}

impl Region {
    /// The gap is concentrated there by more than chance.
    pub fn is_significant(&self) -> bool {
        self.significance < SIGNIFICANT
    }

    /// What lies there, in words.
    pub fn sentence(&self) -> String {
        let beside = if self.axis == "frequency" {
            format!(", {:.0} % of noise", 100.0 * self.time_share)
        } else if self.label.starts_with("every") {
            String::new()
        } else {
            format!(" in {:.0} % of the time", 100.0 * self.time_share)
        };
        format!(
            "{} {}: {:.0} % of the gap{beside}",
            self.axis,
            self.label,
            100.0 * self.share
        )
    }

    /// How probable it is by chance, in words.
    pub fn chance(&self) -> String {
        if self.significance < 0.001 {
            "< 0.001".to_string()
        } else {
            format!("{:.3}", self.significance)
        }
    }
}

/// Parts of position, speed, time and the like.
const PARTS: usize = 6;
/// Chance makes a region of noise in so many of all diagnoses.
const SIGNIFICANT: f64 = 0.05;
/// A wave with less of the gap than this says little of where it lies: where one is, its neighbours have a little each.
const LEAST_OF_A_WAVE: f64 = 0.05;
/// Nodes in a window of the spectrum over time: enough for six octaves, and a quarter of a second or so.
const WINDOW: usize = 128;

/// The gap's shares, what is significant before the rest, the most concentrated first. Where nothing is left beyond what is
/// open, shares of what the named effect takes away all the same.
pub fn regions(search: &Search, named: Option<&Hypothesis>) -> Vec<Region> {
    let ground = Ground {
        records: &search.records,
        nodes: &search.nodes,
        scale: &search.scale,
    };
    let before = &search.base.fit.left_over;
    let beyond = Gap::beyond(&search.nodes, &search.noise, before);
    match named {
        Some(named) if beyond.whole <= 0.0 => {
            let taken = Gap::taken(&search.nodes, before, &named.fit.left_over);
            ground.regions(&taken)
        }
        _ => ground.regions(&beyond),
    }
}

/// What there is to be shared out, with a value a node.
struct Gap {
    /// What is left over, N m; zero where nothing is shared out.
    rest: Vec<f64>,
    /// Its square beyond what is no gap, N^2 m^2; below zero where noise happens to be small.
    square: Vec<f64>,
    /// Sum of that.
    whole: f64,
}

impl Gap {
    /// What is left beyond what is open. A log and regime that leaves no more than that holds no part of the gap.
    fn beyond(nodes: &[Node], noise: &Noise, rest: &[f64]) -> Self {
        let usual = noise.usual(nodes, rest);
        let excess = nodes.iter().zip(rest).zip(usual).map(|((node, r), usual)| {
            let open_nm = noise.group(node).open_nm;
            if node.excluded || usual <= open_nm {
                (0.0, 0.0)
            } else {
                (*r, r * r - open_nm * open_nm)
            }
        });
        Self::new(excess)
    }

    /// What something takes away.
    fn taken(nodes: &[Node], before: &[f64], after: &[f64]) -> Self {
        let taken = nodes.iter().zip(before.iter().zip(after));
        Self::new(taken.map(|(node, (before, after))| {
            if node.excluded {
                (0.0, 0.0)
            } else {
                (*before, before * before - after * after)
            }
        }))
    }

    fn new(of_nodes: impl Iterator<Item = (f64, f64)>) -> Self {
        let (rest, square): (Vec<f64>, Vec<f64>) = of_nodes.unzip();
        Self {
            whole: square.iter().sum(),
            rest,
            square,
        }
    }
}

/// What the gap is laid against.
struct Ground<'a> {
    records: &'a [Record],
    nodes: &'a [Node],
    scale: &'a Scale,
}

impl Ground<'_> {
    fn regions(&self, gap: &Gap) -> Vec<Region> {
        if gap.whole <= 0.0 {
            return Vec::new();
        }
        let kept: Vec<usize> = (0..self.nodes.len())
            .filter(|&i| !self.nodes[i].excluded)
            .collect();
        let mut looks = Looks {
            gap,
            blocks: chance::blocks(self.records, self.nodes),
            kept,
            found: Vec::new(),
        };
        self.along(&mut looks);
        self.frequencies(&mut looks);
        let waves = looks.found.len();
        self.orders(&mut looks);
        let chances: Vec<f64> = looks.found.iter().map(|r| r.significance).collect();
        let corrected = chance::corrected(&chances);
        for (region, corrected) in looks.found.iter_mut().zip(corrected) {
            region.significance = corrected;
        }
        let orders = looks.found.split_off(waves);
        let share = |at: usize| orders.get(at).map_or(0.0, |wave| wave.share);
        let peaks = orders.iter().enumerate().filter(|&(at, wave)| {
            let beside = share(at.wrapping_sub(1)).max(share(at + 1));
            wave.is_significant() && wave.share >= LEAST_OF_A_WAVE.max(beside)
        });
        let mut regions: Vec<Region> = looks
            .found
            .iter()
            .chain(peaks.map(|(_, wave)| wave))
            .filter(|region| region.share > region.time_share)
            .cloned()
            .collect();
        regions.sort_by(|a, b| {
            let density = |region: &Region| region.share - region.time_share;
            let by_chance = b.is_significant().cmp(&a.is_significant());
            by_chance.then(density(b).total_cmp(&density(a)))
        });
        regions
    }

    /// Along everything that has a value at each node.
    fn along(&self, looks: &mut Looks<'_>) {
        let Self {
            records,
            nodes,
            scale,
        } = self;
        let course = course(records, nodes, scale);
        looks.divided("regime", &Part::ALL.map(Part::name), |i| {
            Part::ALL.iter().position(|part| *part == course[i].part)
        });
        let [position, speed, effort] = match scale.unit {
            Unit::Rotary => ["rad", "rad/s", "N m"],
            Unit::Linear => ["m", "m/s", "N"],
        };
        let acceleration = format!("{position}/s^2");
        looks.even("position", position, |i| {
            Some(nodes[i].position_rad(records))
        });
        if scale.unit == Unit::Rotary && scale.stroke_rad() > TAU {
            let labels: Vec<String> = (0..2 * PARTS)
                .map(|part| format!("{} to {} deg", 30 * part, 30 * (part + 1)))
                .collect();
            let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
            looks.divided("turn", &labels, |i| {
                let turn = nodes[i].position_rad(records).rem_euclid(TAU) / TAU;
                Some(((turn * labels.len() as f64) as usize).min(labels.len() - 1))
            });
        }
        looks.even("speed", speed, |i| Some(nodes[i].velocity_rad_s(records)));
        looks.even("time", "s", |i| Some(nodes[i].time_s(records)));
        let of = |value: fn(&Course) -> Option<f64>| {
            let course = &course;
            move |i: usize| value(&course[i])
        };
        looks.octaves("time since reversal", "s", of(|c| c.since_reversal_s));
        looks.octaves("dwell", "s", of(|c| c.dwell_s));
        looks.even("load", effort, of(|c| Some(c.load_nm)));
        looks.even("acceleration", &acceleration, |i| {
            Some(nodes[i].acceleration_rad_s2(records).abs())
        });
    }

    /// Along frequency, by octaves: where more lies than of the noise of encoder and effort, which the kernel colours.
    fn frequencies(&self, looks: &mut Looks<'_>) {
        let gap = looks.gap;
        let Windows { at_hz, density } = Windows::new(self.records, &gap.rest, WINDOW);
        let lines = at_hz.len();
        let squares: f64 = gap.rest.iter().map(|r| r * r).sum();
        let of_noise = 1.0 - gap.whole / squares;
        let whole: f64 = density.iter().flat_map(|(_, lines)| lines).sum();
        if whole <= 0.0 {
            return;
        }
        let noise: Vec<Vec<f64>> = self
            .records
            .iter()
            .map(|record| {
                let power = |hz: &f64| {
                    let waves = hz * record.node_s();
                    record.noise_power(self.scale.inertia_kg_m2, 0.0, waves)
                };
                at_hz.iter().map(power).collect()
            })
            .collect();
        let mut octaves: Vec<Region> = Vec::new();
        for octave in 0..PARTS {
            let from = if octave + 1 < PARTS {
                lines >> (octave + 1)
            } else {
                0
            };
            let band = from..lines >> octave;
            let inside = |lines: &[f64]| lines[band.clone()].iter().sum::<f64>();
            let parts: Vec<f64> = noise
                .iter()
                .map(|lines| inside(lines) / lines.iter().sum::<f64>())
                .collect();
            let of = |(place, lines): &(usize, Vec<f64>)| {
                let noise = parts[*place] * lines.iter().sum::<f64>();
                [inside(lines), noise]
            };
            let [held, noise] = density
                .iter()
                .map(of)
                .fold([0.0; 2], |[a, b], [x, y]| [a + x / whole, b + y / whole]);
            let low_hz = if from == 0 { 0.0 } else { at_hz[from - 1] };
            octaves.push(Region {
                axis: "frequency",
                label: format!("{} to {} Hz", short(low_hz), short(at_hz[band.end - 1])),
                share: (held - noise * of_noise).max(0.0),
                time_share: noise,
                significance: chance::of_excess(density.iter().map(|window| {
                    let [held, noise] = of(window);
                    held - noise
                })),
            });
        }
        looks.shared_out(octaves, 0.0);
    }

    /// Along the orders of a turn, or the waves of a stroke.
    fn orders(&self, looks: &mut Looks<'_>) {
        let gap = looks.gap;
        let mean = gap.rest.iter().sum::<f64>() / looks.kept.len() as f64;
        let (blocks, count) = &looks.blocks;
        let time_share = 2.0 / looks.kept.len() as f64;
        let of_order = |order: f64, waves: &[[f64; 2]]| {
            let mut products = vec![[0.0; 2]; *count];
            for (&i, [sin, cos]) in looks.kept.iter().zip(waves) {
                let products = &mut products[blocks[i]];
                products[0] += sin * (gap.rest[i] - mean);
                products[1] += cos * (gap.rest[i] - mean);
            }
            let right = products
                .iter()
                .fold([0.0; 2], |[a, b], [x, y]| [a + x, b + y]);
            let [a, b] = Squares::new(waves).solve(right)?;
            Some(Region {
                axis: "position",
                label: match self.scale.unit {
                    // Without zeros at the end.
                    Unit::Rotary => format!("every {} deg", (3.6e5 / order).round() / 1e3),
                    Unit::Linear => format!("every {} m", short(1.0 / order)),
                },
                share: ((a * right[0] + b * right[1]) / gap.whole).clamp(0.0, 1.0),
                time_share,
                significance: chance::of_wave(&products),
            })
        };
        let orders = over_orders(self.records, self.nodes, self.scale, &looks.kept, of_order);
        looks.found.extend(orders.into_iter().flatten());
    }
}

/// All parts that the gap is looked for in; their significance is not yet corrected for how many they are.
struct Looks<'a> {
    gap: &'a Gap,
    blocks: (Vec<usize>, usize),
    kept: Vec<usize>,
    found: Vec<Region>,
}

impl Looks<'_> {
    /// Parts of equal width.
    fn even(&mut self, axis: &'static str, unit: &str, value: impl Fn(usize) -> Option<f64>) {
        let [low, high] = self.extent(&value);
        let edges = std::array::from_fn(|k| low + (high - low) * k as f64 / PARTS as f64);
        self.between(axis, unit, edges, value);
    }

    /// Parts of which each is half as wide as the next one; the first from zero.
    fn octaves(&mut self, axis: &'static str, unit: &str, value: impl Fn(usize) -> Option<f64>) {
        let [_, high] = self.extent(&value);
        let edges = std::array::from_fn(|k| match k {
            0 => 0.0,
            k => high / f64::powi(2.0, (PARTS - k) as i32),
        });
        self.between(axis, unit, edges, value);
    }

    fn extent(&self, value: &impl Fn(usize) -> Option<f64>) -> [f64; 2] {
        let values = self.kept.iter().filter_map(|&i| value(i));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        })
    }

    fn between(
        &mut self,
        axis: &'static str,
        unit: &str,
        edges: [f64; PARTS + 1],
        value: impl Fn(usize) -> Option<f64>,
    ) {
        if edges[0] >= edges[PARTS] {
            return;
        }
        let labels: Vec<String> = edges
            .windows(2)
            .map(|edge| format!("{} to {} {unit}", short(edge[0]), short(edge[1])))
            .collect();
        let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
        self.divided(axis, &labels, |i| {
            let value = value(i)?;
            Some(
                edges[1..PARTS]
                    .iter()
                    .filter(|edge| value >= **edge)
                    .count(),
            )
        });
    }

    /// Parts with these labels, each node in one of them or none.
    fn divided(
        &mut self,
        axis: &'static str,
        labels: &[&str],
        part: impl Fn(usize) -> Option<usize>,
    ) {
        let (blocks, count) = &self.blocks;
        let mut wholes = vec![[0.0; 2]; *count];
        let mut inside = vec![[0.0; 2]; count * labels.len()];
        let mut totals = vec![[0.0; 2]; labels.len() + 1];
        let add = |sums: &mut [f64; 2], square: f64| {
            sums[0] += square;
            sums[1] += 1.0;
        };
        for &i in &self.kept {
            let square = self.gap.square[i];
            add(&mut wholes[blocks[i]], square);
            add(&mut totals[labels.len()], square);
            if let Some(part) = part(i) {
                add(&mut inside[blocks[i] * labels.len() + part], square);
                add(&mut totals[part], square);
            }
        }
        let [whole, nodes] = totals[labels.len()];
        let mean = whole / nodes;
        let mut parts = Vec::new();
        for (part, label) in labels.iter().enumerate() {
            let [square, time] = totals[part];
            if time == 0.0 {
                continue;
            }
            let time_share = time / nodes;
            let beyond = (0..*count).map(|block| {
                let ([square, time], [whole, nodes]) =
                    (inside[block * labels.len() + part], wholes[block]);
                square - mean * time - time_share * (whole - mean * nodes)
            });
            parts.push(Region {
                axis,
                label: (*label).to_string(),
                share: square.max(0.0),
                time_share,
                significance: chance::of_excess(beyond),
            });
        }
        let inside: f64 = totals[..labels.len()]
            .iter()
            .map(|[square, _]| square)
            .sum();
        self.shared_out(parts, (whole - inside).max(0.0));
    }

    /// Adds parts whose shares are squares still: all of them, with what lies in none, are the whole.
    fn shared_out(&mut self, mut parts: Vec<Region>, outside: f64) {
        let whole = outside + parts.iter().map(|part| part.share).sum::<f64>();
        for part in &mut parts {
            part.share /= whole.max(f64::MIN_POSITIVE);
        }
        self.found.extend(parts);
    }
}
