//! The fields of every experiment, in one list: how they go over the wire, and whether they can be played.

use super::{Experiment, moves, multisine};
use crate::real::Real;
use crate::wire::{FrameWriter, Reader};

impl<T: Real> Experiment<T> {
    /// Whether its numbers are within the ranges in which it is what its name says; times and finiteness apart.
    fn is_in_range(&self) -> bool {
        match *self {
            Self::SpeedLadder { ratio, .. } => ratio > T::ZERO && ratio <= T::ONE,
            Self::Multisine { period_ticks, .. } => period_ticks >= multisine::LEAST_PERIOD_TICKS,
            Self::Moves { pauses, .. } => pauses <= moves::MOST_PAUSES,
            _ => true,
        }
    }
}

macro_rules! experiments {
    ($($number:literal $variant:ident { $($field:ident: $type:ident),+ })+) => {
        /// Writes an experiment into a frame.
        pub(crate) fn write_experiment(experiment: &Experiment<f32>, frame: &mut FrameWriter<'_>) {
            match *experiment {
                $(Experiment::$variant { $($field),+ } => {
                    frame.u8($number);
                    $(frame.$type($field);)+
                })+
            }
        }

        /// Reads one; none where there is none.
        pub(crate) fn read_experiment(bytes: &mut Reader<'_>) -> Option<Experiment<f32>> {
            Some(match bytes.u8()? {
                $($number => Experiment::$variant { $($field: bytes.$type()?),+ },)+
                _ => return None,
            })
        }

        /// The experiment in the precision of the wire.
        pub fn in_single_precision(experiment: &Experiment<f64>) -> Experiment<f32> {
            trait Narrow<T> {
                fn narrow(self) -> T;
            }
            impl Narrow<f32> for f64 {
                fn narrow(self) -> f32 {
                    self as f32
                }
            }
            impl Narrow<u32> for u32 {
                fn narrow(self) -> u32 {
                    self
                }
            }
            match *experiment {
                $(Experiment::$variant { $($field),+ } => {
                    Experiment::$variant { $($field: $field.narrow()),+ }
                })+
            }
        }

        /// Whether every value is a number, every time at least a tick, and what has a range within it.
        pub fn is_playable(experiment: &Experiment<f32>) -> bool {
            trait Usable {
                fn usable(self) -> bool;
            }
            impl Usable for f32 {
                fn usable(self) -> bool {
                    self.is_finite()
                }
            }
            impl Usable for u32 {
                fn usable(self) -> bool {
                    self > 0
                }
            }
            match *experiment {
                $(Experiment::$variant { $($field),+ } => experiment.is_in_range() $(&& $field.usable())+,)+
            }
        }
    };
}

experiments! {
    0 Sine { amplitude_nm: f32, period_ticks: u32 }
    1 PulseThenOscillation { pulse_nm: f32, pulse_ticks: u32, mean_nm: f32, amplitude_nm: f32, period_ticks: u32 }
    2 Reversals { amplitude_rad: f32, period_ticks: u32 }
    3 SpeedLadder { top_rad_s: f32, ratio: f32, hold_ticks: u32 }
    4 Prbs { amplitude_nm: f32, clock_ticks: u32 }
    5 DahlRamp { amplitude_rad: f32, period_ticks: u32 }
    6 RestAndBreakAway { peak_nm: f32, ramp_ticks: u32, dwell_ticks: u32 }
    7 Multisine { amplitude_nm: f32, period_ticks: u32 }
    8 Moves { length_rad: f32, move_ticks: u32, pause_ticks: u32, pauses: u32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_played_is_seen() {
        assert!(!is_playable(&Experiment::Sine {
            amplitude_nm: f32::NAN,
            period_ticks: 1
        }));
        assert!(!is_playable(&Experiment::Prbs {
            amplitude_nm: 1.0,
            clock_ticks: 0
        }));
    }
}
