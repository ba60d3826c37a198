//! What is done with an axis: two to five experiments, sized for its stroke, speed and friction.

use super::dice::Dice;
use super::plant::Plant;
use bristle_core::experiment::multisine::LEAST_PERIOD_TICKS;
use bristle_core::experiment::{Experiment, Player, Reference};

/// An experiment on its way.
#[derive(Clone, Debug)]
pub struct Task {
    /// Its name.
    pub name: &'static str,
    /// Its signal.
    pub experiment: Experiment<f64>,
    /// Samples.
    pub samples: usize,
    /// Where its torque is added to a loop that holds this position sine: amplitude, rad, and period, s.
    pub carrier: Option<(f64, f64)>,
}

const NAMES: [&str; 5] = [
    "speed ladder",
    "sine with reversals",
    "multisine torque",
    "rest and break-away",
    "moves",
];

/// Draws a set of 20 s to 60 s in all.
pub fn draw(dice: &mut Dice, plant: &Plant) -> Vec<Task> {
    let count = 2 + dice.below(4);
    let mut left: Vec<usize> = (0..NAMES.len()).collect();
    let mut chosen: Vec<usize> = (0..count)
        .map(|_| left.remove(dice.below(left.len())))
        .collect();
    chosen.sort_unstable();
    let whole_s = dice.between(20.0, 60.0).min(18.0 * count as f64);
    chosen
        .into_iter()
        .map(|which| {
            let samples = (whole_s / count as f64 / plant.step_s).round() as usize;
            task(dice, plant, which, samples)
        })
        .collect()
}

fn task(dice: &mut Dice, plant: &Plant, which: usize, samples: usize) -> Task {
    let ticks = |seconds: f64| (seconds / plant.step_s).round().max(1.0) as u32;
    let friction = &plant.axis.friction;
    let coulomb = friction.coulomb.unwrap_or(0.0);
    let stiction = friction.stiction.unwrap_or(coulomb);
    let braking = coulomb / plant.axis.axis.inertia;
    let top = plant.top_speed_rad_s;
    let seconds = samples as f64 * plant.step_s;
    let mut carrier = None;
    let experiment = match which {
        0 => {
            // Ten speeds each way, where there is time.
            let hold_s = dice.between(0.3, 0.6).min(plant.stroke_rad / top);
            let rungs = (seconds / (2.0 * hold_s)).clamp(3.0, 14.0);
            Experiment::SpeedLadder {
                top_rad_s: top,
                ratio: dice.between(0.005, 0.03).powf(1.0 / rungs),
                hold_ticks: ticks(seconds / (2.0 * rungs.round())),
            }
        }
        1 => {
            let period_s = dice.between(1.0, 3.0);
            let amplitude_rad = (0.5 * plant.stroke_rad)
                .min(top * period_s / std::f64::consts::TAU)
                .min(3.0 * braking * (period_s / std::f64::consts::TAU).powi(2));
            Experiment::Reversals {
                amplitude_rad,
                period_ticks: ticks(period_s),
            }
        }
        2 => {
            if dice.chance(0.5) {
                let period_s = dice.between(1.5, 4.0);
                carrier = Some((
                    dice.between(0.2, 0.5)
                        * (0.5 * plant.stroke_rad).min(top * period_s / std::f64::consts::TAU),
                    period_s,
                ));
            }
            Experiment::Multisine {
                amplitude_nm: stiction
                    * if carrier.is_some() {
                        dice.between(0.5, 1.5)
                    } else {
                        dice.between(1.5, 2.5)
                    },
                period_ticks: ticks(dice.between(0.7, 2.0)).max(LEAST_PERIOD_TICKS),
            }
        }
        3 => {
            let peak = dice.between(1.3, 1.6);
            // Beyond break-away it gathers speed: only for as long as its top speed allows.
            let gathers = ((stiction - coulomb) + 0.5 * (peak - 1.0) * stiction)
                / plant.axis.axis.inertia
                * (peak - 1.0)
                / peak;
            Experiment::RestAndBreakAway {
                peak_nm: peak * stiction,
                ramp_ticks: ticks((0.7 * top / gathers).clamp(0.05, 1.0)),
                dwell_ticks: ticks(dice.between(0.1, 0.4)),
            }
        }
        _ => {
            let move_s = dice.between(0.3, 0.8);
            let length_rad = (0.8 * plant.stroke_rad)
                .min(0.5 * top * move_s)
                .min(0.6 * braking * move_s * move_s);
            Experiment::Moves {
                length_rad,
                move_ticks: ticks(move_s),
                pause_ticks: ticks(dice.between(0.05, 0.15)),
                pauses: 4,
            }
        }
    };
    Task {
        name: NAMES[which],
        experiment,
        samples,
        carrier,
    }
}

/// What the loop follows at a sample, and what is added to its torque.
pub struct Script {
    player: Player<f64>,
    carrier: Option<Player<f64>>,
}

impl Script {
    /// Of a task.
    pub fn new(task: &Task, step_s: f64) -> Self {
        let carrier = task.carrier.map(|(amplitude_rad, period_s)| {
            let period_ticks = (period_s / step_s).round().max(1.0) as u32;
            Player::new(
                Experiment::Reversals {
                    amplitude_rad,
                    period_ticks,
                },
                step_s,
            )
        });
        Self {
            player: Player::new(task.experiment, step_s),
            carrier,
        }
    }

    /// The next sample.
    pub fn next(&mut self) -> (Reference<f64>, f64) {
        let reference = self.player.next_tick();
        match (reference, &mut self.carrier) {
            (Reference::Torque(added), Some(carrier)) => (carrier.next_tick(), added),
            _ => (reference, 0.0),
        }
    }
}
