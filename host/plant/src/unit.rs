//! Rotary or linear: the one choice that all units of a file follow from.

use std::f64::consts::TAU;
use std::fmt;

/// What the motor does: turn (N m, rad) or travel (N, m).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// N m, rad, kg m^2.
    Rotary,
    /// N, m, kg.
    Linear,
}

impl Unit {
    /// Symbol of effort: `N m` or `N`.
    pub fn effort(self) -> &'static str {
        match self {
            Unit::Rotary => "N m",
            Unit::Linear => "N",
        }
    }

    /// Symbol of position: `rad` or `m`.
    pub fn position(self) -> &'static str {
        match self {
            Unit::Rotary => "rad",
            Unit::Linear => "m",
        }
    }

    /// Where a position lies within its turn, from -pi to pi, or along a linear axis.
    pub fn place_rad(self, position_rad: f64) -> f64 {
        match self {
            Self::Rotary => position_rad - TAU * (position_rad / TAU).round(),
            Self::Linear => position_rad,
        }
    }

    /// Angle of a wave that repeats `order` times a turn, or a metre, per rad or m of travel.
    pub fn wave_rad(self, order: f64) -> f64 {
        match self {
            Self::Rotary => order,
            Self::Linear => order * TAU,
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Unit::Rotary => "rotary",
            Unit::Linear => "linear",
        })
    }
}
