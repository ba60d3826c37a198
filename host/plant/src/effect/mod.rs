//! Effects that a plain model leaves out. Each is one file with its parameters and its hooks; a new one is added to
//! [`ALL`] and nowhere else.

mod asymmetry;
mod cogging;
mod eccentricity;
mod offset;

use crate::mechanics::Motion;
use crate::unit::Unit;
use std::collections::BTreeMap;
use std::fmt;

/// What an effect sees of a step, or of a sample in [`Effect::sensor`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Instant {
    /// s
    pub time_s: f64,
    /// s
    pub step_s: f64,
    /// Positions and velocities; in `sensor`, the motor position as the effects before this one left it.
    pub motion: Motion,
    /// Torque on the rotor as the effects before this one left it, N m.
    pub torque_nm: f64,
}

/// Where an effect takes hold. Every hook passes on what it does not change.
pub trait Effect: Send {
    /// Torque that reaches the rotor, N m.
    fn actuator(&mut self, now: &Instant) -> f64 {
        now.torque_nm
    }

    /// Torque added on the rotor, N m.
    fn mechanics(&mut self, now: &Instant) -> f64 {
        let _ = now;
        0.0
    }

    /// Friction torque, N m.
    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let _ = now;
        friction_nm
    }

    /// Motor position as the sensor sees it, rad.
    fn sensor(&mut self, now: &Instant) -> f64 {
        now.motion.position_rad
    }
}

/// A parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name with its unit on a rotary axis.
    pub name: &'static str,
    /// Name with its unit on a linear axis.
    pub linear_name: &'static str,
    /// Value where none is given.
    pub default: f64,
}

impl Parameter {
    /// Its name on an axis.
    pub fn name(&self, unit: Unit) -> &'static str {
        match unit {
            Unit::Rotary => self.name,
            Unit::Linear => self.linear_name,
        }
    }
}

/// An effect by its id: what it takes, and how it is made from values in the order of its parameters for a rotary axis
/// or a linear one.
pub struct Entry {
    /// Id, block and name.
    pub id: &'static str,
    /// What it takes.
    pub parameters: &'static [Parameter],
    /// Makes it.
    pub build: fn(&[f64], Unit) -> Box<dyn Effect>,
}

/// Every effect there is.
pub const ALL: &[Entry] = &[
    asymmetry::ENTRY,
    cogging::ENTRY,
    eccentricity::ENTRY,
    offset::ENTRY,
];

/// A name that no effect or parameter has, or a value that is no number.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectError {
    /// What was asked for.
    pub what: String,
    /// What there is.
    pub known: Vec<&'static str>,
}

impl fmt::Display for EffectError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; there is {}", self.what, self.known.join(", "))
    }
}

impl std::error::Error for EffectError {}

/// Makes an effect from its id and named values for an axis.
///
/// # Errors
/// An id or a parameter that does not exist, or a value that is not finite.
pub fn build(
    id: &str,
    values: &BTreeMap<String, f64>,
    unit: Unit,
) -> Result<Box<dyn Effect>, EffectError> {
    let Some(entry) = ALL.iter().find(|entry| entry.id == id) else {
        return Err(EffectError {
            what: format!("effect {id} does not exist"),
            known: ALL.iter().map(|entry| entry.id).collect(),
        });
    };
    let mut chosen: Vec<f64> = entry.parameters.iter().map(|p| p.default).collect();
    for (name, &value) in values {
        let place = entry.parameters.iter().position(|p| p.name(unit) == name);
        match place {
            Some(i) if value.is_finite() => chosen[i] = value,
            place => {
                return Err(EffectError {
                    what: match place {
                        Some(_) => format!("{id}: {name} = {value} is not finite"),
                        None => format!("{id} has no parameter {name}"),
                    },
                    known: entry.parameters.iter().map(|p| p.name(unit)).collect(),
                });
            }
        }
    }
    Ok((entry.build)(&chosen, unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_unique_and_every_effect_builds_from_nothing() {
        for (i, entry) in ALL.iter().enumerate() {
            assert!(ALL[..i].iter().all(|other| other.id != entry.id));
            assert!(build(entry.id, &BTreeMap::new(), Unit::Rotary).is_ok());
        }
    }

    #[test]
    fn says_what_there_is() {
        let error = build("actuator.coging", &BTreeMap::new(), Unit::Rotary)
            .err()
            .unwrap();
        assert!(error.to_string().contains("actuator.cogging"), "{error}");
        let values = BTreeMap::from([("size".to_string(), 1.0)]);
        let error = build("mechanics.offset", &values, Unit::Rotary)
            .err()
            .unwrap();
        assert!(error.to_string().contains("torque_nm"), "{error}");
    }
}
