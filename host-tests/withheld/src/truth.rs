//! What is withheld of a case.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Kind of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Class {
    /// One listed effect.
    Single,
    /// Two listed effects.
    Pair,
    /// One effect that no list has.
    Unknown,
    /// The axis file is right to four digits.
    Clean,
    /// Only numbers of the axis file are wrong.
    Parameters,
}

impl Class {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Single,
        Self::Pair,
        Self::Unknown,
        Self::Clean,
        Self::Parameters,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Pair => "pair",
            Self::Unknown => "unknown",
            Self::Clean => "clean",
            Self::Parameters => "parameters",
        }
    }
}

/// An effect that the axis has and its file lacks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// Id; of a listed effect the catalogue's.
    pub id: String,
    /// sensor, actuator, friction, mechanics or disturbance.
    pub block: String,
    /// The listed effect that one without a place in the list is most like.
    pub resembles: Option<String>,
    /// From 0, not there, to 1, as strong as practice knows.
    pub size: f64,
    /// Its parameters under the catalogue's names as far as its form has them.
    pub parameters: BTreeMap<String, f64>,
    /// Effort that the axis without it does not explain after a refit of inertia, dry and viscous friction, rms over
    /// all samples, N m: of this effect alone.
    pub gap_rms_nm: f64,
    /// That over the floor.
    pub ratio: f64,
}

/// A number that the axis file has wrong.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Changed {
    /// Its key.
    pub key: String,
    /// Value in the file.
    pub file: f64,
    /// Value of the axis.
    pub truth: f64,
}

/// What is withheld.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// The number that the case follows from.
    pub seed: u64,
    /// Its kind.
    pub class: Class,
    /// Gap over floor that was asked for, of each effect alone.
    pub ratio: Option<f64>,
    /// The effects.
    pub effects: Vec<Effect>,
    /// Numbers of the file that are wrong by more than rounding.
    pub changed: Vec<Changed>,
    /// `true`: linear, N and m.
    pub linear: bool,
    /// Samples a second.
    pub rate_hz: f64,
    /// Experiments in the order of the logs.
    pub experiments: Vec<String>,
    /// Noise in terms of effort, rms over all samples: what whoever knows the effect is left with.
    pub floor_rms_nm: f64,
    /// Noise and all effects after a refit of inertia, dry and viscous friction.
    pub before_rms_nm: f64,
}
