//! A gap that is laid somewhere is found there, and noise is found nowhere.

use super::*;
use crate::diagnose::nodes;
use crate::inverse::scale;
use crate::log::{Effort, EffortKind, Position, PositionKind};
use crate::{AxisFile, Believed, Log};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use std::path::Path;

const NOISE_NM: f64 = 0.01;
const STEP_S: f64 = 1e-3;
const SAMPLES: usize = 20_000;

fn noise(seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
    (0..SAMPLES).map(|_| NOISE_NM * draw()).collect()
}

/// Some turns forward and back, faster and slower, with a rest of 0.1 to 0.5 s after every second way.
fn position_rad() -> Vec<f64> {
    let mut way = 0_usize;
    let (mut from, mut left, mut pause) = (0.0, 0, 0);
    let mut at = 0.0;
    let mut out = Vec::with_capacity(SAMPLES);
    let length = |way: usize| 500 + 150 * (way % 3);
    while out.len() < SAMPLES {
        let samples = length(way);
        if pause > 0 {
            pause -= 1;
        } else {
            left += 1;
            let part = std::f64::consts::PI * left as f64 / samples as f64;
            let travel = [9.0, -8.0, 12.0, -13.2][way % 4];
            at = from + 0.5 * travel * (1.0 - part.cos());
            if left == samples {
                (from, left, way) = (at, 0, way + 1);
                pause = if way.is_multiple_of(2) {
                    100 + 100 * (way % 5)
                } else {
                    0
                };
            }
        }
        out.push(at);
    }
    out
}

struct Data {
    records: Vec<Record>,
    nodes: Vec<Node>,
    scale: Scale,
}

/// Travel of a linear axis where the other one turns by a radian, m.
const M_PER_RAD: f64 = 0.01;

impl Data {
    fn new(unit: Unit) -> Self {
        let (text, position, per_rad) = match unit {
            Unit::Rotary => (
                "[axis]\ninertia_kg_m2 = 1e-4\ncounts_per_rev = 1048576\n[friction]\ncoulomb_nm = 0.02\nstiffness_nm_rad = 2\n",
                PositionKind::Rad,
                1.0,
            ),
            Unit::Linear => (
                "[axis]\nmass_kg = 0.01\ncounts_per_m = 10000000\n[friction]\ncoulomb_n = 0.02\nstiffness_n_m = 200\n",
                PositionKind::M,
                M_PER_RAD,
            ),
        };
        let path = Path::new("axis.toml");
        let axis = AxisFile::parse(text, path).unwrap();
        let believed = Believed::new(&axis, path).unwrap();
        // Load that comes and goes, not in step with the motion.
        let load = |k: usize| 0.2 * (std::f64::consts::TAU * 0.83 * k as f64 * STEP_S).sin();
        let log = Log::new(
            "log.csv",
            unit,
            (0..SAMPLES).map(|k| k as f64 * STEP_S).collect(),
            vec![Effort {
                kind: EffortKind::TorqueMeasured,
                values: noise(1000)
                    .iter()
                    .enumerate()
                    .map(|(k, x)| load(k) + x)
                    .collect(),
            }],
            Position {
                kind: position,
                values: position_rad().iter().map(|q| per_rad * q).collect(),
            },
        );
        let records = vec![Record::new(&log, &axis, &believed, &[]).unwrap()];
        let scale = scale(&believed, &records);
        Self {
            nodes: nodes(&records, scale.z_ss_rad),
            records,
            scale,
        }
    }

    /// Noise as the nodes see it.
    fn noise(&self, seed: u64) -> Vec<f64> {
        let mut out = Vec::new();
        let kernel = self.records[0].kernel;
        let mut pairs = noise(seed)
            .windows(2)
            .map(|u| 0.5 * (u[0] + u[1]))
            .collect();
        kernel.apply(&mut pairs, &mut out);
        out.truncate(self.nodes.len());
        out
    }

    /// Regions of this gap in noise.
    fn regions(&self, laid: impl Fn(usize, &Course) -> f64) -> Vec<Region> {
        let ground = Ground {
            records: &self.records,
            nodes: &self.nodes,
            scale: &self.scale,
        };
        let course = course(&self.records, &self.nodes, &self.scale);
        let open = (NOISE_NM * self.records[0].kernel.of_effort()).powi(2);
        let rest = self.noise(1).into_iter().enumerate();
        ground.regions(&Gap::new(rest.map(|(i, noise)| {
            let r = noise + laid(i, &course[i]);
            (r, r * r - open)
        })))
    }

    /// The first region of an axis, which must be significant and hold most of the gap.
    fn first(regions: &[Region], axis: &str) -> String {
        let first = regions.iter().find(|region| region.axis == axis).unwrap();
        assert!(first.is_significant() && first.share > 0.8, "{first:?}");
        first.label.clone()
    }
}

#[test]
fn a_gap_is_found_where_it_is_laid() {
    let data = Data::new(Unit::Rotary);
    let laid_nm = 3.0 * NOISE_NM;
    let within = |inside: bool| if inside { laid_nm } else { 0.0 };

    let after_turns =
        data.regions(|_, course| within(course.since_reversal_s.is_some_and(|s| s < 0.02)));
    assert_eq!(
        Data::first(&after_turns, "time since reversal")
            .split(' ')
            .next(),
        Some("0")
    );
    assert_eq!(
        after_turns[0].axis, "time since reversal",
        "{after_turns:#?}"
    );

    let of_turn = data.regions(|i, _| {
        let angle = data.nodes[i]
            .position_rad(&data.records)
            .rem_euclid(TAU)
            .to_degrees();
        within((60.0..90.0).contains(&angle))
    });
    assert_eq!(Data::first(&of_turn, "turn"), "60 to 90 deg");
    assert_eq!(of_turn[0].axis, "turn");

    let loaded = data.regions(|_, course| within(course.load_nm > 0.19));
    assert_eq!(loaded[0].axis, "load");

    let rests = data.regions(|_, course| within(course.part == Part::Rest));
    assert_eq!(Data::first(&rests, "regime"), "rest");

    let wave =
        data.regions(|i, _| laid_nm * (24.0 * data.nodes[i].position_rad(&data.records)).sin());
    assert_eq!(wave[0].label, "every 15 deg", "{wave:#?}");

    let hum =
        data.regions(|i, _| laid_nm * (TAU * 40.0 * data.nodes[i].time_s(&data.records)).sin());
    let label = Data::first(&hum, "frequency");
    let ends: Vec<f64> = label
        .split(' ')
        .filter_map(|word| word.parse().ok())
        .collect();
    assert!(ends[0] < 40.0 && 40.0 < ends[1], "{label}");
    assert_eq!(hum[0].axis, "frequency");
}

#[test]
fn a_gap_is_found_along_what_axes_have_in_common() {
    for unit in [Unit::Rotary, Unit::Linear] {
        let data = Data::new(unit);
        let laid = |value: &dyn Fn(&Node, &Course) -> Option<f64>, [low, high]: [f64; 2]| {
            let gap = |i: usize, course: &Course| {
                let value = value(&data.nodes[i], course);
                let inside = value.is_some_and(|value| (low..=high).contains(&value));
                if inside { 3.0 * NOISE_NM } else { 0.0 }
            };
            data.regions(gap)
        };
        let records = &data.records;
        let most = |value: &dyn Fn(&Node) -> f64| data.nodes.iter().map(value).fold(0.0, f64::max);
        // In the last of six parts of each.
        let speed = |node: &Node| node.velocity_rad_s(records);
        let fast = laid(
            &|node, _| Some(speed(node)),
            [0.75 * most(&speed), f64::INFINITY],
        );
        assert_eq!(fast[0].axis, "speed", "{fast:#?}");
        let acceleration = |node: &Node| node.acceleration_rad_s2(records).abs();
        let hard = [0.85 * most(&acceleration), f64::INFINITY];
        let hard = laid(&|node, _| Some(acceleration(node)), hard);
        assert_eq!(hard[0].axis, "acceleration", "{hard:#?}");
        let late = laid(&|node, _| Some(node.time_s(records)), [17.0, 20.0]);
        assert_eq!(late[0].axis, "time", "{late:#?}");
        let rested = laid(&|_, course| course.dwell_s, [0.26, 1.0]);
        assert_eq!(rested[0].axis, "dwell", "{rested:#?}");
        let position = |node: &Node| node.position_rad(records);
        let end = [0.95 * most(&position), f64::INFINITY];
        let end = laid(&|node, _| Some(position(node)), end);
        assert_eq!(end[0].axis, "position", "{end:#?}");
    }
    // A wave of 20 over a stroke.
    let data = Data::new(Unit::Linear);
    let wave = 20.0 / data.scale.stroke_rad();
    let wave = data.regions(|i, _| {
        3.0 * NOISE_NM * (TAU * wave * data.nodes[i].position_rad(&data.records)).sin()
    });
    let every = format!("every {} m", short(data.scale.stroke_rad() / 20.0));
    assert_eq!(wave[0].label, every, "{wave:#?}");
}

#[test]
fn noise_lies_nowhere() {
    let data = Data::new(Unit::Rotary);
    let ground = Ground {
        records: &data.records,
        nodes: &data.nodes,
        scale: &data.scale,
    };
    let somewhere = (0..100)
        .filter(|&seed| {
            // Nothing is open: all of it is laid against everything.
            let gap = Gap::new(data.noise(seed).into_iter().map(|r| (r, r * r)));
            let regions = ground.regions(&gap);
            regions.iter().any(Region::is_significant)
        })
        .count();
    // All looks at once are wrong in one diagnosis of twenty.
    assert!(somewhere <= 5, "{somewhere} of 100");
}
