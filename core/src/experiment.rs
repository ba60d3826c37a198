//! Test signals, the same on the microcontroller, in the emulator and on the virtual axis.
//!
//! Time is a count of ticks, so that a signal is the same after hours as at the start. Source of the experiments:
//! thesis (Aktas, ITU 2002), chapters 2.5, 3 and 4.5.

pub mod bounds;
pub mod fields;
pub mod moves;
pub mod multisine;

pub use bounds::{Bounds, End, Guard};

use core::hint::cold_path;

use crate::friction::elasto_plastic::HALF_SINE;
use crate::real::Real;

/// What an experiment asks of the axis at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reference<T> {
    /// Open loop: this torque, N m.
    Torque(T),
    /// Speed loop: this velocity, rad/s.
    Velocity(T),
    /// Position loop: this position, rad from where the experiment began, moving at this velocity, rad/s.
    Position {
        /// rad
        position_rad: T,
        /// rad/s
        velocity_rad_s: T,
    },
}

/// A test signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Experiment<T> {
    /// Sine torque; the thesis uses 0.035 N m and 1 s for its observers.
    Sine {
        /// Peak torque, N m.
        amplitude_nm: T,
        /// Ticks of a period.
        period_ticks: u32,
    },
    /// A torque pulse past break-away, rest, then a small oscillation about a mean, both below break-away: tells a model
    /// that drifts from one that holds.
    PulseThenOscillation {
        /// Torque of the pulse, N m.
        pulse_nm: T,
        /// Ticks of the pulse, and of the rest after it.
        pulse_ticks: u32,
        /// Mean of the oscillation, N m.
        mean_nm: T,
        /// Peak of the oscillation about its mean, N m.
        amplitude_nm: T,
        /// Ticks of an oscillation.
        period_ticks: u32,
    },
    /// A sine of position: two velocity reversals a period.
    Reversals {
        /// Peak, rad.
        amplitude_rad: T,
        /// Ticks of a period.
        period_ticks: u32,
    },
    /// Constant speeds in falling geometric steps, each in both directions: the steady-state friction map.
    SpeedLadder {
        /// First and highest speed, rad/s.
        top_rad_s: T,
        /// Each speed as a share of the one before.
        ratio: T,
        /// Ticks at each speed.
        hold_ticks: u32,
    },
    /// Pseudo-random binary torque of maximum length 1023, for presliding.
    Prbs {
        /// Torque, N m, either sign.
        amplitude_nm: T,
        /// Ticks a bit lasts.
        clock_ticks: u32,
    },
    /// A triangle of position at one low speed: torque over position is the Dahl curve.
    DahlRamp {
        /// Peak, rad.
        amplitude_rad: T,
        /// Ticks of a whole triangle.
        period_ticks: u32,
    },
    /// Rest, then a torque ramp past break-away, in turn in both directions, with longer rest each time.
    RestAndBreakAway {
        /// Peak of the ramp, N m.
        peak_nm: T,
        /// Ticks of the ramp.
        ramp_ticks: u32,
        /// Ticks of the first rest; the n-th rest is n times as long.
        dwell_ticks: u32,
    },
    /// Eight sines of torque an octave apart, see [`multisine`].
    Multisine {
        /// Peak of the sum, N m.
        amplitude_nm: T,
        /// Ticks of the slowest sine's period.
        period_ticks: u32,
    },
    /// Moves from rest to rest, out and back by ever shorter lengths, see [`moves`].
    Moves {
        /// First and longest way, rad; negative to begin the other way.
        length_rad: T,
        /// Ticks of every move.
        move_ticks: u32,
        /// Ticks of the shortest pause.
        pause_ticks: u32,
        /// Lengths of pause to draw from, 1 to so many times the shortest; 1 for all alike.
        pauses: u32,
    },
}

/// Plays an experiment tick by tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Player<T> {
    /// None is no torque.
    experiment: Option<Experiment<T>>,
    phase: u32,
    step: u32,
    bits: u16,
    level: T,
    /// One over the ticks of a period, a move or a ramp, for the experiments that have one: a product in the tick, where a
    /// division would take ten times as long.
    per_stretch: T,
    /// One over its seconds.
    per_stretch_1_s: T,
}

/// Seed of the shift register of [`Experiment::Prbs`]; any value but zero gives the same sequence, shifted.
const PRBS_START: u16 = 0x3ff;

impl<T: Real> Player<T> {
    /// Starts at the beginning; a tick lasts `tick_s`.
    pub fn new(experiment: Experiment<T>, tick_s: T) -> Self {
        let level = match experiment {
            Experiment::SpeedLadder { top_rad_s, .. } => top_rad_s,
            Experiment::Moves { length_rad, .. } => length_rad,
            _ => T::ZERO,
        };
        let stretch_ticks = match experiment {
            Experiment::Sine { period_ticks, .. }
            | Experiment::PulseThenOscillation { period_ticks, .. }
            | Experiment::Reversals { period_ticks, .. }
            | Experiment::DahlRamp { period_ticks, .. }
            | Experiment::Multisine { period_ticks, .. } => period_ticks,
            Experiment::Moves { move_ticks, .. } => move_ticks,
            Experiment::RestAndBreakAway { ramp_ticks, .. } => ramp_ticks,
            Experiment::SpeedLadder { .. } | Experiment::Prbs { .. } => 1,
        };
        let stretch_ticks = T::of_ticks(stretch_ticks.max(1));
        Self {
            per_stretch: T::ONE / stretch_ticks,
            per_stretch_1_s: T::ONE / (stretch_ticks * tick_s),
            experiment: Some(experiment),
            phase: 0,
            step: 0,
            bits: PRBS_START,
            level,
        }
    }

    /// Plays no torque.
    pub fn silent() -> Self {
        Self {
            experiment: None,
            phase: 0,
            step: 0,
            bits: PRBS_START,
            level: T::ZERO,
            per_stretch: T::ONE,
            per_stretch_1_s: T::ZERO,
        }
    }

    /// Plays no torque from now on.
    #[inline]
    pub fn silence(&mut self) {
        self.experiment = None;
    }

    /// The reference for this tick; the next call is for the next tick.
    #[inline(always)]
    pub fn next_tick(&mut self) -> Reference<T> {
        let Some(experiment) = self.experiment else {
            return Reference::Torque(T::ZERO);
        };
        match experiment {
            Experiment::Sine {
                amplitude_nm,
                period_ticks,
            } => Reference::Torque(amplitude_nm * self.sine(period_ticks).0),
            Experiment::PulseThenOscillation {
                pulse_nm,
                pulse_ticks,
                mean_nm,
                amplitude_nm,
                period_ticks,
            } => Reference::Torque(match self.step {
                0 | 1 => {
                    let torque = if self.step == 0 { pulse_nm } else { T::ZERO };
                    self.advance(pulse_ticks);
                    torque
                }
                _ => mean_nm + amplitude_nm * self.sine(period_ticks).0,
            }),
            Experiment::Reversals {
                amplitude_rad,
                period_ticks,
            } => {
                let (sin, cos) = self.sine(period_ticks);
                let rate = T::of(core::f64::consts::TAU) * self.per_stretch_1_s;
                Reference::Position {
                    position_rad: amplitude_rad * sin,
                    velocity_rad_s: amplitude_rad * cos * rate,
                }
            }
            Experiment::SpeedLadder {
                ratio, hold_ticks, ..
            } => {
                let speed = self.level;
                let forward = self.step.is_multiple_of(2);
                self.advance(hold_ticks);
                if !forward && self.phase == 0 {
                    self.level = self.level * ratio;
                }
                Reference::Velocity(if forward { speed } else { -speed })
            }
            Experiment::Prbs {
                amplitude_nm,
                clock_ticks,
            } => {
                let high = self.bits & 1 == 1;
                self.advance(clock_ticks);
                if self.phase == 0 {
                    self.shift();
                }
                Reference::Torque(if high { amplitude_nm } else { -amplitude_nm })
            }
            Experiment::DahlRamp {
                amplitude_rad,
                period_ticks,
            } => {
                let x = self.share(period_ticks);
                let four = T::of(4.0);
                let speed = four * amplitude_rad * self.per_stretch_1_s;
                let (position_rad, velocity_rad_s) = if x < T::of(0.25) {
                    (four * x, speed)
                } else if x < T::of(0.75) {
                    (T::of(2.0) - four * x, -speed)
                } else {
                    (four * x - four, speed)
                };
                Reference::Position {
                    position_rad: amplitude_rad * position_rad,
                    velocity_rad_s,
                }
            }
            Experiment::RestAndBreakAway {
                peak_nm,
                ramp_ticks,
                dwell_ticks,
            } => {
                let forward = self.step % 4 < 2;
                Reference::Torque(if self.step.is_multiple_of(2) {
                    self.advance(dwell_ticks.saturating_mul(self.step / 2 + 1));
                    T::ZERO
                } else {
                    let torque = peak_nm * self.share(ramp_ticks);
                    if forward { torque } else { -torque }
                })
            }
            Experiment::Multisine {
                amplitude_nm,
                period_ticks,
            } => {
                let (sin, cos) = self.sine(period_ticks);
                Reference::Torque(amplitude_nm * multisine::of_slowest(sin, cos))
            }
            Experiment::Moves {
                length_rad,
                move_ticks,
                pause_ticks,
                pauses,
            } => self.moving(length_rad, move_ticks, pause_ticks, pauses),
        }
    }

    /// As [`Self::next_tick`] while a sine or nothing plays: its torque, N m.
    #[inline(always)]
    pub fn next_tick_of_sine(&mut self) -> Option<T> {
        match self.experiment {
            Some(Experiment::Sine {
                amplitude_nm,
                period_ticks,
            }) => Some(amplitude_nm * self.sine(period_ticks).0),
            None => Some(T::ZERO),
            Some(_) => None,
        }
    }

    /// A tick of [`Experiment::Moves`]: out, pause, back, pause.
    #[inline(always)]
    fn moving(
        &mut self,
        length_rad: T,
        move_ticks: u32,
        pause_ticks: u32,
        pauses: u32,
    ) -> Reference<T> {
        let way = self.level;
        let out = self.step % 4 < 2;
        let (share, speed) = if self.step.is_multiple_of(2) {
            moves::profile(self.share(move_ticks))
        } else {
            self.advance(moves::pause(self.bits, pause_ticks, pauses));
            if self.phase == 0 {
                self.shift();
                if self.step == 4 * moves::LENGTHS {
                    self.step = 0;
                    self.level = length_rad;
                } else if !out {
                    self.level = way * T::of(0.5);
                }
            }
            (T::ONE, T::ZERO)
        };
        let velocity_rad_s = way * self.per_stretch_1_s * speed;
        if out {
            Reference::Position {
                position_rad: way * share,
                velocity_rad_s,
            }
        } else {
            Reference::Position {
                position_rad: way * (T::ONE - share),
                velocity_rad_s: -velocity_rad_s,
            }
        }
    }

    /// The next bit of the shift register. x^10 + x^7 + 1 is primitive: 1023 bits before it repeats.
    fn shift(&mut self) {
        let feedback = (self.bits ^ (self.bits >> 3)) & 1;
        self.bits = (self.bits >> 1) | (feedback << 9);
    }

    /// Sine and cosine at this tick's phase of a period, and on to the next.
    #[inline(always)]
    fn sine(&mut self, period_ticks: u32) -> (T, T) {
        sine_and_cosine(self.share(period_ticks))
    }

    /// How much of the experiment's period, move or ramp is over, 0 to 1, and on to the next tick.
    #[inline(always)]
    fn share(&mut self, stretch_ticks: u32) -> T {
        T::of_ticks(self.advance(stretch_ticks)) * self.per_stretch
    }

    /// The phase of this tick within a stretch of so many, and on to the next; a finished stretch counts a step.
    fn advance(&mut self, ticks: u32) -> u32 {
        let phase = self.phase;
        self.phase += 1;
        if self.phase >= ticks {
            cold_path();
            self.phase = 0;
            self.step = self.step.wrapping_add(1);
        }
        phase
    }
}

#[inline(always)]
fn sine_and_cosine<T: Real>(turns: T) -> (T, T) {
    (sine_of_turns(turns), sine_of_turns(turns + T::of(0.25)))
}

/// Sine of an angle in whole turns, zero or more: exact at every quarter, and elsewhere within 1.5e-11 of the sine, or
/// 1.5e-7 in f32.
///
/// A polynomial and not the library's sine, which works in f64 inside: in the interrupt that would be emulated.
#[inline(always)]
pub fn sine_of_turns<T: Real>(turns: T) -> T {
    let half_turns = turns + turns;
    // From the nearest whole half turn: a rising wave at even ones, at odd ones a falling one, which mirrors it.
    let nearest = (half_turns + T::of(0.5)).to_index();
    let beyond = half_turns - T::of_count(nearest as i32);
    let x = if nearest & 1 == 0 { beyond } else { -beyond };
    let square = x * x;
    let mut q = T::ZERO;
    for &c in HALF_SINE.iter().rev() {
        q = q * square + T::of(c);
    }
    (x + x) * (T::ONE + (square - T::of(0.25)) * q)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const TICK_S: f64 = 1e-4;

    fn torques(experiment: Experiment<f64>, ticks: usize) -> Vec<f64> {
        let mut player = Player::new(experiment, TICK_S);
        (0..ticks)
            .map(|_| match player.next_tick() {
                Reference::Torque(torque) => torque,
                other => panic!("{other:?}"),
            })
            .collect()
    }

    #[test]
    fn sine_repeats_exactly() {
        let experiment = Experiment::Sine {
            amplitude_nm: 0.035,
            period_ticks: 10_000,
        };
        let torque = torques(experiment, 30_000);
        assert_eq!(torque[..10_000], torque[20_000..]);
        assert!((torque[2_500] - 0.035).abs() < 1e-15);
    }

    #[test]
    fn sine_of_turns_is_a_sine() {
        let mut worst = (0.0_f64, 0.0_f64);
        for i in 0..=30_000 {
            let turns = f64::from(i) * 1e-4;
            let exact = libm::sin(core::f64::consts::TAU * turns);
            let narrow = turns as f32;
            let exact_narrow = libm::sin(core::f64::consts::TAU * f64::from(narrow));
            worst.0 = worst.0.max((sine_of_turns(turns) - exact).abs());
            worst.1 = worst
                .1
                .max((f64::from(sine_of_turns(narrow)) - exact_narrow).abs());
        }
        // Twice the fit's error of half_sine; a unit in the last place near one is 1.2e-7.
        assert!(worst.0 < 2.0 * 1.9e-9, "{worst:?}");
        assert!(worst.1 < 1.5e-7, "{worst:?}");
        for (quarter, value) in [0.0_f32, 1.0, 0.0, -1.0].into_iter().enumerate() {
            assert_eq!(sine_of_turns(quarter as f32 * 0.25), value);
        }
    }

    #[test]
    fn prbs_has_maximum_length() {
        let experiment = Experiment::Prbs {
            amplitude_nm: 1.0,
            clock_ticks: 3,
        };
        let torque = torques(experiment, 2 * 3 * 1023);
        assert_eq!(torque[..3 * 1023], torque[3 * 1023..]);
        // One more high bit than low ones, and no shorter period: autocorrelation -1 at every shift.
        let bits: Vec<f64> = torque.iter().step_by(3).take(1023).copied().collect();
        assert_eq!(bits.iter().sum::<f64>(), 1.0);
        for shift in 1..1023 {
            let sum: f64 = (0..1023).map(|i| bits[i] * bits[(i + shift) % 1023]).sum();
            assert_eq!(sum, -1.0, "shift {shift}");
        }
    }

    #[test]
    fn velocity_of_a_position_is_its_derivative() {
        let experiments = [
            Experiment::Reversals {
                amplitude_rad: 2.0,
                period_ticks: 10_000,
            },
            Experiment::DahlRamp {
                amplitude_rad: 2.0,
                period_ticks: 10_000,
            },
        ];
        for experiment in experiments {
            let mut player = Player::new(experiment, TICK_S);
            let mut last: Option<(f64, f64)> = None;
            for k in 0..20_000 {
                let Reference::Position {
                    position_rad,
                    velocity_rad_s,
                } = player.next_tick()
                else {
                    panic!("not a position")
                };
                if let Some((position, velocity)) = last {
                    let step = position_rad - position;
                    // Second-order remainder: half the largest acceleration, 2 (2 pi)^2 rad/s^2, times a tick.
                    assert!((step / TICK_S - velocity).abs() < 4e-3, "tick {k}");
                }
                last = Some((position_rad, velocity_rad_s));
            }
        }
    }

    #[test]
    fn ladder_goes_down_in_both_directions() {
        let experiment = Experiment::SpeedLadder {
            top_rad_s: 8.0,
            ratio: 0.5,
            hold_ticks: 2,
        };
        let mut player = Player::new(experiment, TICK_S);
        let speeds: Vec<f64> = (0..12)
            .map(|_| match player.next_tick() {
                Reference::Velocity(speed) => speed,
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(
            speeds,
            [
                8.0, 8.0, -8.0, -8.0, 4.0, 4.0, -4.0, -4.0, 2.0, 2.0, -2.0, -2.0
            ]
        );
    }

    #[test]
    fn break_away_rests_longer_each_time_and_alternates() {
        let experiment = Experiment::RestAndBreakAway {
            peak_nm: 1.0,
            ramp_ticks: 2,
            dwell_ticks: 1,
        };
        assert_eq!(
            torques(experiment, 10),
            [0.0, 0.0, 0.5, 0.0, 0.0, 0.0, -0.5, 0.0, 0.0, 0.0]
        );
    }

    #[test]
    fn pulse_then_rest_then_oscillation() {
        let experiment = Experiment::PulseThenOscillation {
            pulse_nm: 3.0,
            pulse_ticks: 2,
            mean_nm: 1.0,
            amplitude_nm: 0.5,
            period_ticks: 4,
        };
        let torque = torques(experiment, 8);
        assert_eq!(torque[..5], [3.0, 3.0, 0.0, 0.0, 1.0]);
        assert!((torque[5] - 1.5).abs() < 1e-15 && (torque[7] - 0.5).abs() < 1e-15);
    }
}
