//! Names of what a plan file holds: each experiment's numbers, its bounds and its times.

use bristle_core::experiment::Experiment;
use bristle_plant::Unit;

/// A number of an experiment.
pub(super) enum Place<'a> {
    /// As it stands.
    Value(&'a mut f64),
    /// Ticks, which the file gives in seconds.
    Ticks(&'a mut u32),
    /// A whole number.
    Whole(&'a mut u32),
}

/// A number of an experiment with its names.
pub(super) struct Field<'a> {
    rotary: &'static str,
    linear: &'static str,
    pub(super) place: Place<'a>,
}

impl Field<'_> {
    pub(super) fn name(&self, unit: Unit) -> &'static str {
        match unit {
            Unit::Rotary => self.rotary,
            Unit::Linear => self.linear,
        }
    }
}

macro_rules! fields {
    ($($variant:ident { $($field:ident $place:ident $rotary:literal $linear:literal,)+ })+) => {
        /// The numbers of an experiment.
        pub(super) fn fields(experiment: &mut Experiment<f64>) -> Vec<Field<'_>> {
            match experiment {
                $(Experiment::$variant { $($field),+ } => vec![
                    $(Field { rotary: $rotary, linear: $linear, place: Place::$place($field) },)+
                ],)+
            }
        }
    };
}

fields! {
    Sine {
        amplitude_nm Value "amplitude_nm" "amplitude_n",
        period_ticks Ticks "period_s" "period_s",
    }
    PulseThenOscillation {
        pulse_nm Value "pulse_nm" "pulse_n",
        pulse_ticks Ticks "pulse_s" "pulse_s",
        mean_nm Value "mean_nm" "mean_n",
        amplitude_nm Value "amplitude_nm" "amplitude_n",
        period_ticks Ticks "period_s" "period_s",
    }
    Reversals {
        amplitude_rad Value "amplitude_rad" "amplitude_m",
        period_ticks Ticks "period_s" "period_s",
    }
    SpeedLadder {
        top_rad_s Value "top_rad_s" "top_m_s",
        ratio Value "ratio" "ratio",
        hold_ticks Ticks "hold_s" "hold_s",
    }
    Prbs {
        amplitude_nm Value "amplitude_nm" "amplitude_n",
        clock_ticks Ticks "clock_s" "clock_s",
    }
    DahlRamp {
        amplitude_rad Value "amplitude_rad" "amplitude_m",
        period_ticks Ticks "period_s" "period_s",
    }
    RestAndBreakAway {
        peak_nm Value "peak_nm" "peak_n",
        ramp_ticks Ticks "ramp_s" "ramp_s",
        dwell_ticks Ticks "dwell_s" "dwell_s",
    }
    Multisine {
        amplitude_nm Value "amplitude_nm" "amplitude_n",
        period_ticks Ticks "period_s" "period_s",
    }
    Moves {
        length_rad Value "length_rad" "length_m",
        move_ticks Ticks "move_s" "move_s",
        pause_ticks Ticks "pause_s" "pause_s",
        pauses Whole "pauses" "pauses",
    }
}

/// What an experiment may not pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bound {
    Travel,
    Speed,
    Torque,
}

impl Bound {
    pub(super) const ALL: [Self; 3] = [Self::Travel, Self::Speed, Self::Torque];

    /// Its key, the axis file's key of the limit that it must stay within, and its unit.
    pub(super) fn names(self, unit: Unit) -> (&'static str, &'static str, &'static str) {
        match (self, unit) {
            (Self::Travel, Unit::Rotary) => ("most_travel_rad", "travel_limit_rad", "rad"),
            (Self::Travel, Unit::Linear) => ("most_travel_m", "travel_limit_m", "m"),
            (Self::Speed, Unit::Rotary) => ("most_speed_rad_s", "speed_limit_rad_s", "rad/s"),
            (Self::Speed, Unit::Linear) => ("most_speed_m_s", "speed_limit_m_s", "m/s"),
            (Self::Torque, Unit::Rotary) => ("most_torque_nm", "torque_limit_nm", "N m"),
            (Self::Torque, Unit::Linear) => ("most_force_n", "force_limit_n", "N"),
        }
    }
}

/// Keys of times.
pub(super) struct Time;

impl Time {
    pub(super) const MOST: &str = "most_s";
    pub(super) const REST: &str = "rest_s";
    pub(super) const PLAYS: &str = "seconds";
}
