//! What an axis is made to do: speed ladder, sines with reversals, multisine torque, rest and break-away, moves.

use crate::axis::Axis;
use crate::control::{Gains, Target};
use crate::draw::Draw;
use std::f64::consts::TAU;

/// One log's experiment, sample by sample.
pub(crate) struct Experiment {
    pub(crate) name: &'static str,
    /// Torque from the open-loop part, N m.
    pub(crate) torque: Vec<f64>,
    /// The loop, where one is closed.
    pub(crate) gains: Option<Gains>,
    /// Its reference.
    pub(crate) target: Vec<Target>,
}

/// Names of the experiments.
pub(crate) const NAMES: [&str; 5] = ["ladder", "sine", "multisine", "breakaway", "moves"];

impl Experiment {
    /// The experiment of a name, `seconds` long.
    pub(crate) fn draw(name: &'static str, axis: &Axis, seconds: f64, draw: &mut Draw) -> Self {
        let samples = (seconds * axis.rate_hz).round() as usize;
        let step = 1.0 / axis.rate_hz;
        let mut experiment = Self {
            name,
            torque: vec![0.0; samples],
            gains: None,
            target: vec![Target::default(); samples],
        };
        match name {
            "multisine" => multisine(&mut experiment.torque, axis, step, draw),
            "breakaway" => breakaway(&mut experiment.torque, axis, step, draw),
            _ => {
                let velocity = match name {
                    "ladder" => ladder(samples, axis, step, draw),
                    "sine" => sine(samples, axis, step, draw),
                    _ => moves(samples, axis, step, draw),
                };
                experiment.target = follow(&velocity, step);
                experiment.gains = Some(if draw.chance(0.7) {
                    Gains::stiff(axis, draw)
                } else {
                    Gains::soft(axis, draw)
                });
                return experiment;
            }
        }
        // A linear axis has ends; half of the rotary ones are driven without any loop.
        if axis.linear || draw.chance(0.5) {
            experiment.gains = Some(Gains::centring(axis));
        }
        experiment
    }
}

/// Position and acceleration of a velocity reference.
fn follow(velocity: &[f64], step: f64) -> Vec<Target> {
    let mut q = 0.0;
    (0..velocity.len())
        .map(|k| {
            let v = velocity[k];
            let next = velocity.get(k + 1).copied().unwrap_or(v);
            let target = Target {
                q,
                v,
                a: (next - v) / step,
            };
            q += 0.5 * (v + next) * step;
            target
        })
        .collect()
}

/// Speeds up and down in both directions, each held while the travel lasts.
fn ladder(samples: usize, axis: &Axis, step: f64, draw: &mut Draw) -> Vec<f64> {
    let levels = 5 + draw.below(5);
    let slowest = axis.rated_speed * draw.log(0.003, 0.01);
    let fastest = axis.rated_speed * draw.even(0.4, 0.9);
    let each = samples as f64 * step / (2.0 * levels as f64);
    let limit = axis.rated_speed / draw.even(0.08, 0.2);
    let mut velocity = Vec::with_capacity(samples);
    let mut now = 0.0;
    for k in 0..samples {
        let t = k as f64 * step;
        let level = ((t / (2.0 * each)) as usize).min(levels - 1);
        let speed = slowest * libm::pow(fastest / slowest, level as f64 / (levels - 1) as f64);
        // As many turns back and forth as the travel asks for, whole pairs of them.
        let pairs = (speed * each / (2.0 * axis.travel)).ceil().max(1.0);
        let forward = (t / each * pairs).fract() < 0.5;
        let forward = if pairs > 1.0 {
            forward
        } else {
            ((t / each) as usize).is_multiple_of(2)
        };
        let wanted = if forward { speed } else { -speed };
        let change = (wanted - now).clamp(-limit * step, limit * step);
        now += change;
        velocity.push(now);
    }
    velocity
}

/// One or two sines of position that start at rest.
fn sine(samples: usize, axis: &Axis, step: f64, draw: &mut Draw) -> Vec<f64> {
    let parts: Vec<(f64, f64)> = (0..1 + draw.below(2))
        .map(|_| {
            let frequency = draw.log(0.25, 2.0);
            let speed = (axis.rated_speed * draw.log(0.08, 0.6)).min(axis.travel * TAU * frequency);
            (frequency, speed / 1.5)
        })
        .collect();
    (0..samples)
        .map(|k| {
            let t = k as f64 * step;
            let fade = (t / 0.5).min(1.0);
            parts
                .iter()
                .map(|(f, v)| fade * v * libm::sin(TAU * f * t))
                .sum()
        })
        .collect()
}

/// Moves to random places with smooth speed, and rests of random length.
fn moves(samples: usize, axis: &Axis, step: f64, draw: &mut Draw) -> Vec<f64> {
    let mut velocity = vec![0.0; (0.2 / step) as usize];
    let mut place = 0.0;
    while velocity.len() < samples {
        let to = if draw.chance(0.25) {
            // Small moves show what happens at reversal.
            place + axis.travel * 0.02 * draw.even(-1.0, 1.0)
        } else {
            axis.travel * draw.even(-1.0, 1.0)
        };
        let way = to - place;
        let speed = axis.rated_speed * draw.even(0.3, 0.9);
        // The peak of 30 x^2 (1 - x)^2 is 1.875; the acceleration stays below what the drive can give.
        let time = (1.875 * way.abs() / speed)
            .max((5.8 * way.abs() * axis.inertia / (0.5 * axis.torque_limit)).sqrt())
            .max(0.05);
        let count = (time / step).ceil();
        for i in 0..count as usize {
            let x = (i as f64 + 0.5) / count;
            velocity.push(30.0 * x * x * (1.0 - x) * (1.0 - x) * way / (count * step));
        }
        place = to;
        let rest = (draw.log(0.05, 1.2) / step) as usize;
        velocity.extend(std::iter::repeat_n(0.0, rest));
    }
    velocity.truncate(samples);
    velocity
}

/// Sines of torque at random phase.
fn multisine(torque: &mut [f64], axis: &Axis, step: f64, draw: &mut Draw) {
    let highest = (0.12 / step).min(80.0);
    let lowest = if axis.linear { 2.0 } else { 0.7 };
    let count = 10 + draw.below(14);
    let rms = axis.scale() * draw.even(1.3, 2.2);
    let parts: Vec<(f64, f64)> = (0..count)
        .map(|i| {
            let place = (i as f64 + draw.unit()) / count as f64;
            (
                lowest * libm::pow(highest / lowest, place),
                draw.even(0.0, TAU),
            )
        })
        .collect();
    let each = rms * (2.0 / count as f64).sqrt();
    for (k, value) in torque.iter_mut().enumerate() {
        let t = k as f64 * step;
        let fade = (t / 0.3).min(1.0);
        *value = parts
            .iter()
            .map(|(f, p)| fade * each * libm::sin(TAU * f * t + p))
            .sum();
    }
}

/// Rests of random length, ramps that break away and ramps that do not.
fn breakaway(torque: &mut [f64], axis: &Axis, step: f64, draw: &mut Draw) {
    let stiction = axis.friction.stiction;
    let mut k = (0.3 / step) as usize;
    let mut sign = 1.0;
    while k < torque.len() {
        let slides = draw.chance(0.6);
        let peak = sign
            * stiction
            * if slides {
                draw.even(1.25, 1.7)
            } else {
                draw.even(0.3, 0.95)
            };
        sign = -sign;
        let up = (draw.log(0.08, 0.8) / step) as usize + 1;
        let down = (draw.log(0.02, 0.2) / step) as usize + 1;
        for i in 0..up + down {
            let share = if i < up {
                i as f64 / up as f64
            } else {
                1.0 - (i - up) as f64 / down as f64
            };
            if let Some(value) = torque.get_mut(k + i) {
                *value = peak * share;
            }
        }
        k += up + down + (draw.log(0.02, 1.5) / step) as usize;
    }
}
