//! What an experiment may do and what it asks for: travel, speed, torque and time.
//!
//! What it asks for is compared with its bounds before it starts. While it plays, the tick compares what the axis does,
//! and ends it at the first bound that is passed. The supervisor's own limits lie beyond and stay faults.

use super::Experiment;
use super::fields::is_playable;
use crate::real::Real;
use crate::supervisor::codes;

codes! {
    /// Why an experiment ended. The numbers are part of the wire form.
    End {
        /// None has ended since boot, or one plays.
        #[default]
        None = 0 "not ended",
        /// It has played for its time.
        Finished = 1 "time is over",
        /// Further from its start than it may be.
        Travel = 2 "travel bound",
        /// Faster than it may be.
        Speed = 3 "speed bound",
        /// Its loop asked for more torque than it may have.
        Torque = 4 "torque bound",
        /// The host stopped or disarmed it.
        Stopped = 5 "stopped",
        /// A fault.
        Fault = 6 "fault",
    }
}

/// What an experiment may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<T> {
    /// Furthest from where it began, either way, rad.
    pub travel_rad: T,
    /// Fastest, rad/s.
    pub speed_rad_s: T,
    /// Largest torque, N m.
    pub torque_nm: T,
    /// Ticks for which it plays.
    pub ticks: u32,
}

impl Bounds<f32> {
    /// Nothing but the supervisor's limits, for so many ticks.
    pub const fn open(ticks: u32) -> Self {
        Self {
            travel_rad: f32::MAX,
            speed_rad_s: f32::MAX,
            torque_nm: f32::MAX,
            ticks,
        }
    }
}

/// What an experiment asks for by itself, whatever the axis makes of it. Zero where that depends on the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needs<T> {
    /// Furthest reference from the start, rad.
    pub travel_rad: T,
    /// Fastest reference, rad/s.
    pub speed_rad_s: T,
    /// Largest torque in open loop, N m.
    pub torque_nm: T,
}

impl<T: Real> Experiment<T> {
    /// What it asks for.
    pub fn needs(&self, tick_s: T) -> Needs<T> {
        let torque = |torque_nm: T| Needs {
            travel_rad: T::ZERO,
            speed_rad_s: T::ZERO,
            torque_nm: torque_nm.abs(),
        };
        let position = |travel_rad: T, rate: f64, ticks: u32| Needs {
            travel_rad: travel_rad.abs(),
            speed_rad_s: travel_rad.abs() * T::of(rate) / (T::of_ticks(ticks) * tick_s),
            torque_nm: T::ZERO,
        };
        match *self {
            Self::Sine { amplitude_nm, .. }
            | Self::Prbs { amplitude_nm, .. }
            | Self::Multisine { amplitude_nm, .. } => torque(amplitude_nm),
            Self::PulseThenOscillation {
                pulse_nm,
                mean_nm,
                amplitude_nm,
                ..
            } => torque(pulse_nm.abs().most(mean_nm.abs() + amplitude_nm.abs())),
            Self::RestAndBreakAway { peak_nm, .. } => torque(peak_nm),
            Self::Reversals {
                amplitude_rad,
                period_ticks,
            } => position(amplitude_rad, core::f64::consts::TAU, period_ticks),
            Self::DahlRamp {
                amplitude_rad,
                period_ticks,
            } => position(amplitude_rad, 4.0, period_ticks),
            Self::Moves {
                length_rad,
                move_ticks,
                ..
            } => position(length_rad, 2.0, move_ticks),
            Self::SpeedLadder {
                top_rad_s,
                hold_ticks,
                ..
            } => Needs {
                travel_rad: top_rad_s.abs() * T::of_ticks(hold_ticks) * tick_s,
                speed_rad_s: top_rad_s.abs(),
                torque_nm: T::ZERO,
            },
        }
    }
}

/// Why an experiment is refused before it begins. The numbers are part of the wire form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Refusal {
    /// A value that is no number or out of the range of its experiment.
    Range = 0,
    /// It asks for more travel than its bound.
    Travel = 1,
    /// It asks for more speed than its bound, or than the controller's limit.
    Speed = 2,
    /// It asks for more torque than its bound, or than the controller's limit.
    Torque = 3,
}

impl Refusal {
    /// The one with a number.
    pub fn of(number: u8) -> Option<Self> {
        [Self::Range, Self::Travel, Self::Speed, Self::Torque]
            .into_iter()
            .nth(usize::from(number))
    }

    /// In words, to be read after "the experiment".
    pub fn text(self) -> &'static str {
        match self {
            Self::Range => "has a value out of range",
            Self::Travel => "asks for more travel than its bound",
            Self::Speed => "asks for more speed than its bound or the controller's limit",
            Self::Torque => "asks for more torque than its bound or the controller's limit",
        }
    }
}

impl Bounds<f32> {
    /// Passes an experiment that stays within these bounds and the controller's limits by itself.
    ///
    /// # Errors
    /// What it asks too much of.
    pub fn admit(
        &self,
        experiment: &Experiment<f32>,
        limits: &crate::supervisor::Limits,
        tick_s: f32,
    ) -> Result<(), Refusal> {
        let positive = |value: f32| value.is_finite() && value > 0.0;
        let values = [self.travel_rad, self.speed_rad_s, self.torque_nm];
        if !is_playable(experiment) || !values.into_iter().all(positive) || self.ticks == 0 {
            return Err(Refusal::Range);
        }
        let needs = experiment.needs(tick_s);
        if needs.travel_rad > self.travel_rad {
            Err(Refusal::Travel)
        } else if needs.speed_rad_s > self.speed_rad_s.min(limits.speed_rad_s) {
            Err(Refusal::Speed)
        } else if needs.torque_nm > self.torque_nm.min(limits.torque_nm) {
            Err(Refusal::Torque)
        } else {
            Ok(())
        }
    }
}

/// Bounds as the tick compares them. Made outside of it, which has no time for divisions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guard {
    /// Counts from one end of the travel to the other; beyond half of the counter's range there is no bound.
    span_counts: u32,
    /// Fastest, rad/s.
    pub(crate) speed_rad_s: f32,
    /// Largest torque, N m.
    pub(crate) torque_nm: f32,
    ticks: u32,
}

/// Where and when a guarded experiment began.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Begin {
    /// Number of the tick.
    pub(crate) tick: u32,
    /// The encoder's counter at the lower end of the travel.
    lowest: u32,
}

impl Guard {
    /// Of bounds, for an encoder.
    pub fn new(bounds: &Bounds<f32>, rad_per_count: f32) -> Self {
        let travel_counts = (bounds.travel_rad / rad_per_count) as u32;
        Self {
            span_counts: travel_counts.saturating_mul(2),
            speed_rad_s: bounds.speed_rad_s,
            torque_nm: bounds.torque_nm,
            ticks: bounds.ticks,
        }
    }

    /// Of an experiment that begins in this tick at this reading of the counter.
    #[inline]
    pub(crate) fn begin(&self, tick: u32, raw: u32) -> Begin {
        Begin {
            tick,
            lowest: raw.wrapping_sub(self.span_counts / 2),
        }
    }

    /// Number of the first tick that is too late.
    #[inline]
    pub(crate) fn over(&self, begin: &Begin) -> u32 {
        begin.tick.wrapping_add(self.ticks)
    }

    /// Whether the encoder's counter is within the travel.
    #[inline(always)]
    pub(crate) fn is_near(&self, begin: &Begin, raw: u32) -> bool {
        raw.wrapping_sub(begin.lowest) <= self.span_counts
    }

    /// One tick: its number, the encoder's counter, velocity, and the torque that the experiment or its loop asks for.
    #[inline(always)]
    pub(crate) fn look(
        &self,
        begin: &Begin,
        tick: u32,
        raw: u32,
        velocity_rad_s: f32,
        wanted_nm: f32,
    ) -> End {
        if tick == self.over(begin) {
            End::Finished
        } else if !self.is_near(begin, raw) {
            End::Travel
        } else if velocity_rad_s.abs() > self.speed_rad_s {
            End::Speed
        } else if wanted_nm.abs() <= self.torque_nm {
            End::None
        } else {
            // Of a NaN too.
            End::Torque
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::{Player, Reference};
    use crate::parameters::BENCH;

    const TICK_S: f32 = 1e-4;

    /// One of each kind.
    fn all() -> [Experiment<f64>; 9] {
        [
            Experiment::Sine {
                amplitude_nm: 0.035,
                period_ticks: 1000,
            },
            Experiment::PulseThenOscillation {
                pulse_nm: 0.01,
                pulse_ticks: 100,
                mean_nm: -0.01,
                amplitude_nm: 0.02,
                period_ticks: 400,
            },
            Experiment::Reversals {
                amplitude_rad: -1.0,
                period_ticks: 2000,
            },
            Experiment::SpeedLadder {
                top_rad_s: 3.0,
                ratio: 0.5,
                hold_ticks: 500,
            },
            Experiment::Prbs {
                amplitude_nm: 0.002,
                clock_ticks: 10,
            },
            Experiment::DahlRamp {
                amplitude_rad: 0.006,
                period_ticks: 4000,
            },
            Experiment::RestAndBreakAway {
                peak_nm: 0.04,
                ramp_ticks: 1000,
                dwell_ticks: 100,
            },
            Experiment::Multisine {
                amplitude_nm: 0.03,
                period_ticks: 2048,
            },
            Experiment::Moves {
                length_rad: -1.0,
                move_ticks: 1000,
                pause_ticks: 100,
                pauses: 3,
            },
        ]
    }

    #[test]
    fn needs_are_what_the_signal_reaches() {
        for experiment in all() {
            let needs = experiment.needs(f64::from(TICK_S));
            let mut player = Player::new(experiment, f64::from(TICK_S));
            let mut reached = Needs {
                travel_rad: 0.0_f64,
                speed_rad_s: 0.0_f64,
                torque_nm: 0.0_f64,
            };
            let mut travel = 0.0;
            for _ in 0..30_000 {
                match player.next_tick() {
                    Reference::Torque(torque) => {
                        reached.torque_nm = reached.torque_nm.max(torque.abs());
                    }
                    Reference::Velocity(velocity) => {
                        travel += velocity * f64::from(TICK_S);
                        reached.travel_rad = reached.travel_rad.max(f64::abs(travel));
                        reached.speed_rad_s = reached.speed_rad_s.max(velocity.abs());
                    }
                    Reference::Position {
                        position_rad,
                        velocity_rad_s,
                    } => {
                        reached.travel_rad = reached.travel_rad.max(position_rad.abs());
                        reached.speed_rad_s = reached.speed_rad_s.max(velocity_rad_s.abs());
                    }
                }
            }
            // A ramp and a triangle end a tick before their peak; a multisine of 2048 ticks has 16 a fastest period,
            // which may miss the peak by (pi/16)^2/2.
            for (need, reached) in [
                (needs.travel_rad, reached.travel_rad),
                (needs.speed_rad_s, reached.speed_rad_s),
                (needs.torque_nm, reached.torque_nm),
            ] {
                assert!(
                    reached <= need * (1.0 + 1e-9) && reached >= need * 0.98,
                    "{experiment:?}: {needs:?}, reached {reached}"
                );
            }
        }
    }

    #[test]
    fn what_asks_for_too_much_is_refused() {
        let limits = BENCH.build(TICK_S, 1).unwrap().limits;
        let bounds = Bounds {
            travel_rad: 1.0,
            speed_rad_s: 10.0,
            torque_nm: 0.04,
            ticks: 1000,
        };
        let sine = |amplitude_nm| Experiment::Sine {
            amplitude_nm,
            period_ticks: 1000,
        };
        let moves = |length_rad, move_ticks| Experiment::Moves {
            length_rad,
            move_ticks,
            pause_ticks: 1,
            pauses: 1,
        };
        for (experiment, expected) in [
            (sine(0.04), Ok(())),
            (sine(0.041), Err(Refusal::Torque)),
            (sine(f32::NAN), Err(Refusal::Range)),
            (moves(1.0, 3000), Ok(())),
            (moves(1.1, 3000), Err(Refusal::Travel)),
            (moves(1.0, 1000), Err(Refusal::Speed)),
            (
                Experiment::Multisine {
                    amplitude_nm: 0.01,
                    period_ticks: 1023,
                },
                Err(Refusal::Range),
            ),
        ] {
            assert_eq!(
                bounds.admit(&experiment, &limits, TICK_S),
                expected,
                "{experiment:?}"
            );
        }
        // The controller's limit holds whatever the bound is.
        assert_eq!(
            Bounds::open(1).admit(&sine(0.1), &limits, TICK_S),
            Err(Refusal::Torque)
        );
        assert_eq!(
            Bounds::open(0).admit(&sine(0.01), &limits, TICK_S),
            Err(Refusal::Range)
        );
    }

    #[test]
    fn the_guard_says_which_bound() {
        let bounds = Bounds {
            travel_rad: 1.0,
            speed_rad_s: 2.0,
            torque_nm: 3.0,
            ticks: 2,
        };
        let guard = Guard::new(&bounds, 0.01);
        let open = Guard::new(&Bounds::open(5), 0.01);
        // The counter wraps, and so does the number of the tick.
        let start = 30_u32;
        let begin = guard.begin(u32::MAX, start);
        let unbound = open.begin(u32::MAX, start);
        for (counts, velocity_rad_s, wanted_nm, end) in [
            (-100, -2.0, -3.0, End::None),
            (100, 2.0, 3.0, End::None),
            (-101, 0.0, 0.0, End::Travel),
            (101, 0.0, 0.0, End::Travel),
            (i32::MIN, 0.0, 0.0, End::Travel),
            (0, -2.1, 0.0, End::Speed),
            (0, 0.0, -3.1, End::Torque),
        ] {
            let raw = start.wrapping_add_signed(counts);
            let look = |guard: &Guard, begin| guard.look(begin, 0, raw, velocity_rad_s, wanted_nm);
            assert_eq!(look(&guard, &begin), end);
            assert_eq!(look(&open, &unbound), End::None);
            assert_eq!(guard.is_near(&begin, raw), end != End::Travel);
        }
        assert_eq!(guard.look(&begin, 0, start, 0.0, f32::NAN), End::Torque);
        assert_eq!(
            [u32::MAX, 0, 1].map(|tick| guard.look(&begin, tick, start, 0.0, 0.0)),
            [End::None, End::None, End::Finished]
        );
    }
}
