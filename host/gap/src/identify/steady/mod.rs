//! First step: torque against constant speed. From a log or a table to F_G, F_C, sigma2 and the Stribeck curve.
//!
//! Source: thesis (Aktas, ITU 2002) eq. 2.27 with any of its six curves in the place of the Gaussian:
//! u = F_G + sigma2 v + (F_C + (F_S - F_C) s(|v|)) sgn v.

mod curve;
mod fit;
mod problem;
mod profile;
mod stretches;

pub use fit::{CurveFit, SteadyFit, fit};
pub use stretches::Settings;

use crate::axis_file::AxisFile;
use crate::error::InputError;
use crate::log::Log;
use std::path::{Path, PathBuf};

/// Mean torque at a constant speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyPoint {
    /// With its sign.
    pub velocity_rad_s: f64,
    /// Mean torque.
    pub torque_nm: f64,
    /// Standard deviation of the torque about its mean; zero where unknown.
    pub spread_nm: f64,
    /// Standard error of the mean, corrected for the correlation of neighbouring samples; none in a table.
    pub standard_error_nm: Option<f64>,
}

/// Torque against speed.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyMap {
    /// Where it comes from: errors name it.
    pub source: PathBuf,
    /// In the order of the record.
    pub points: Vec<SteadyPoint>,
    /// What of the record was left out and why, a line each.
    pub left_out: Vec<String>,
}

impl SteadyMap {
    /// The stretches of constant speed of a log.
    ///
    /// # Errors
    /// Log and axis file do not fit.
    pub fn from_log(log: &Log, axis: &AxisFile, settings: &Settings) -> Result<Self, InputError> {
        stretches::find(log, axis, settings)
    }

    /// A table of velocity and torque.
    ///
    /// # Errors
    /// A number that is not finite, or a velocity of zero, where friction has no one value.
    pub fn from_table(points: &[(f64, f64)], source: impl AsRef<Path>) -> Result<Self, InputError> {
        for &(velocity, torque) in points {
            if !(velocity.is_finite() && torque.is_finite()) || velocity == 0.0 {
                return Err(InputError::new(
                    &source,
                    format!(
                        "velocity {velocity} with torque {torque} is no point of a steady-state map"
                    ),
                    "give finite numbers and leave out the points at rest",
                ));
            }
        }
        Ok(Self {
            source: source.as_ref().to_path_buf(),
            points: points
                .iter()
                .map(|&(velocity_rad_s, torque_nm)| SteadyPoint {
                    velocity_rad_s,
                    torque_nm,
                    spread_nm: 0.0,
                    standard_error_nm: None,
                })
                .collect(),
            left_out: Vec::new(),
        })
    }

    /// Slowest and fastest speed, whatever the direction; none without a point.
    pub fn speed_range_rad_s(&self) -> Option<[f64; 2]> {
        let speeds = || self.points.iter().map(|point| point.velocity_rad_s.abs());
        (!self.points.is_empty()).then(|| {
            [
                speeds().fold(f64::INFINITY, f64::min),
                speeds().fold(0.0, f64::max),
            ]
        })
    }

    /// Points with positive and with negative velocity.
    pub fn directions(&self) -> [usize; 2] {
        let forward = self
            .points
            .iter()
            .filter(|point| point.velocity_rad_s > 0.0)
            .count();
        [forward, self.points.len() - forward]
    }
}
