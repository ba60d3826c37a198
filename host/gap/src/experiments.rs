//! The experiments of `core` by name, sized for an axis.

use crate::believed::Believed;
use bristle_core::experiment::Experiment;
use bristle_core::experiment::multisine::LEAST_PERIOD_TICKS;
use bristle_core::real::Real;
use bristle_plant::Unit;

/// An experiment by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Named {
    /// Torque, 1.35 times stiction, 1 s.
    Sine,
    /// A pulse of 1.75 times stiction for 0.2 s, as much rest, then 0.3 of Coulomb friction with an oscillation of 0.3
    /// at 10 Hz about it: at most 0.6, below a break-away at 0.7.
    Pulse,
    /// A position sine of 1 rad (50 mm) and 2 s.
    Reversals,
    /// Speeds from ten Stribeck velocities down by halves, 0.5 s each way.
    Ladder,
    /// Binary torque of a tenth of Coulomb friction, 10 ms a bit.
    Prbs,
    /// A position triangle of three times z_ss and 4 s.
    DahlRamp,
    /// Torque ramps of 1 s to 1.5 times stiction after rests of 0.5 s, 1 s, ...
    BreakAway,
    /// Eight sines of torque an octave apart, 1 Hz to 128 Hz, together 1.5 times stiction at their peak.
    Multisine,
    /// Moves of 0.5 s from 1 rad (50 mm) down by halves, with pauses of 0.1 s to 0.4 s. Shorter where a quarter of the
    /// speed limit asks for it.
    Moves,
}

impl Named {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Sine,
        Self::Pulse,
        Self::Reversals,
        Self::Ladder,
        Self::Prbs,
        Self::DahlRamp,
        Self::BreakAway,
        Self::Multisine,
        Self::Moves,
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sine => "sine",
            Self::Pulse => "pulse",
            Self::Reversals => "reversals",
            Self::Ladder => "ladder",
            Self::Prbs => "prbs",
            Self::DahlRamp => "dahl-ramp",
            Self::BreakAway => "break-away",
            Self::Multisine => "multisine",
            Self::Moves => "moves",
        }
    }

    /// The one of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|named| named.name() == name)
    }

    /// Which one a signal is.
    pub fn of<T>(experiment: &Experiment<T>) -> Self {
        match experiment {
            Experiment::Sine { .. } => Self::Sine,
            Experiment::PulseThenOscillation { .. } => Self::Pulse,
            Experiment::Reversals { .. } => Self::Reversals,
            Experiment::SpeedLadder { .. } => Self::Ladder,
            Experiment::Prbs { .. } => Self::Prbs,
            Experiment::DahlRamp { .. } => Self::DahlRamp,
            Experiment::RestAndBreakAway { .. } => Self::BreakAway,
            Experiment::Multisine { .. } => Self::Multisine,
            Experiment::Moves { .. } => Self::Moves,
        }
    }

    /// Time in which it has shown what it is for, s: some periods, a whole sequence, three break-aways, eight speeds or
    /// lengths.
    pub fn seconds(self) -> f64 {
        match self {
            Self::Sine | Self::Multisine => 5.0,
            Self::Pulse => 3.0,
            Self::Reversals => 4.0,
            Self::Ladder | Self::DahlRamp => 8.0,
            Self::Prbs => 10.23,
            Self::BreakAway => 6.0,
            Self::Moves => 12.0,
        }
    }

    /// The signal for an axis at a sample rate.
    pub fn experiment<T: Real>(self, axis: &Believed, rate_hz: f64) -> Experiment<T> {
        let ticks = |seconds: f64| (seconds * rate_hz).round().max(1.0) as u32;
        let (coulomb, stiction) = (axis.coulomb_nm, axis.stiction_nm);
        match self {
            Self::Sine => Experiment::Sine {
                amplitude_nm: T::of(1.35 * stiction),
                period_ticks: ticks(1.0),
            },
            Self::Pulse => Experiment::PulseThenOscillation {
                pulse_nm: T::of(1.75 * stiction),
                pulse_ticks: ticks(0.2),
                mean_nm: T::of(0.3 * coulomb),
                amplitude_nm: T::of(0.3 * coulomb),
                period_ticks: ticks(0.1),
            },
            Self::Reversals => Experiment::Reversals {
                amplitude_rad: T::of(match axis.unit {
                    Unit::Rotary => 1.0,
                    Unit::Linear => 0.05,
                }),
                period_ticks: ticks(2.0),
            },
            Self::Ladder => Experiment::SpeedLadder {
                top_rad_s: T::of(
                    (10.0 * axis.stribeck_velocity_rad_s).min(0.5 * axis.speed_limit_rad_s),
                ),
                ratio: T::of(0.5),
                hold_ticks: ticks(0.5),
            },
            Self::Prbs => Experiment::Prbs {
                amplitude_nm: T::of(0.1 * coulomb),
                clock_ticks: ticks(0.01),
            },
            Self::DahlRamp => Experiment::DahlRamp {
                amplitude_rad: T::of(3.0 * coulomb / axis.stiffness_nm_rad),
                period_ticks: ticks(4.0),
            },
            Self::BreakAway => Experiment::RestAndBreakAway {
                peak_nm: T::of(1.5 * stiction),
                ramp_ticks: ticks(1.0),
                dwell_ticks: ticks(0.5),
            },
            Self::Multisine => Experiment::Multisine {
                amplitude_nm: T::of(1.5 * stiction),
                // A slow axis rate leaves the fastest sine its eight samples.
                period_ticks: ticks(1.0).max(LEAST_PERIOD_TICKS),
            },
            Self::Moves => {
                let whole = match axis.unit {
                    Unit::Rotary => 1.0,
                    Unit::Linear => 0.05,
                };
                // Half a second at half of the largest speed of the profile.
                let reach = 0.25 * (0.25 * axis.speed_limit_rad_s);
                Experiment::Moves {
                    length_rad: T::of(reach.min(whole)),
                    move_ticks: ticks(0.5),
                    pause_ticks: ticks(0.1),
                    pauses: 4,
                }
            }
        }
    }
}
