//! Effects that a plain model leaves out. Each is one file with its parameters and its hooks; a new one is added to
//! [`ALL`] and nowhere else.

mod asymmetry;
mod cogging;
mod eccentricity;
mod offset;

use crate::contact::Contact;
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
    /// Acceleration of the motor in the step before, rad/s^2.
    pub acceleration_rad_s2: f64,
    /// Torque on the rotor as the effects before this one left it, N m; in `actuator` of the first effect, what the
    /// drive puts out.
    pub torque_nm: f64,
}

/// Where an effect takes hold. Every hook passes on what it does not change.
///
/// The hooks serve two users: the simulated axis, and a record that is followed backwards, where motion is measured and
/// torque is what is asked for. So a hook depends on what it is given and on its own past, not on who calls it.
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

    /// Inertia as a share of the believed one.
    fn inertia(&mut self, now: &Instant) -> f64 {
        let _ = now;
        1.0
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

    /// The friction model with the effect in it, for effects that change its state and not only its torque.
    fn contact(&self, inner: Box<dyn Contact>) -> Box<dyn Contact> {
        inner
    }

    /// What takes part of the inertia off the motor, given the whole of it.
    fn coupling(&self, inertia_kg_m2: f64) -> Option<Coupling> {
        let _ = inertia_kg_m2;
        None
    }
}

/// A part of the inertia behind a spring, a damper and a play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Inertia behind it as a share of the whole, above 0 and below 1.
    pub load_share: f64,
    /// N m/rad
    pub stiffness_nm_rad: f64,
    /// N m s/rad
    pub damping_nm_s_rad: f64,
    /// Whole width of the play, rad.
    pub gap_rad: f64,
}

/// The size of an axis and of its records, from which the usual range of a parameter follows. A linear axis reads m for
/// rad and N for N m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Rotary or linear.
    pub unit: Unit,
    /// F_C.
    pub coulomb_nm: f64,
    /// All of it.
    pub inertia_kg_m2: f64,
    /// Stribeck velocity.
    pub stribeck_velocity_rad_s: f64,
    /// Bristle deflection in slow sliding.
    pub z_ss_rad: f64,
    /// Highest speed on record.
    pub top_speed_rad_s: f64,
    /// Highest torque on record.
    pub top_torque_nm: f64,
    /// Lowest position on record.
    pub lowest_rad: f64,
    /// Highest position on record.
    pub highest_rad: f64,
    /// Length of the longest record.
    pub duration_s: f64,
    /// Length of a sample.
    pub sample_time_s: f64,
    /// Travel of an encoder count.
    pub rad_per_count: f64,
}

/// What role a parameter plays, for whoever searches for its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// At zero the effect is not there, and near zero it grows in proportion.
    Size,
    /// Waves a turn, or a metre: a whole number on a rotary axis.
    Order,
    /// Phase of a wave, rad.
    Phase,
    /// Frequency of a wave, Hz.
    Frequency,
    /// Anything else: times, speeds, exponents, places.
    Shape,
}

/// A parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Name with its unit on a rotary axis.
    pub name: &'static str,
    /// Name with its unit on a linear axis.
    pub linear_name: &'static str,
    /// Value where none is given.
    pub default: f64,
    /// Its role.
    pub kind: Kind,
    /// Usual lowest and highest value on an axis of a size: a prior, not a limit. With both above zero it spans them
    /// evenly in the logarithm.
    pub range: fn(&Scale) -> [f64; 2],
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

/// The entry of an id and its values in the order of its parameters, from named ones and defaults.
///
/// # Errors
/// An id or a parameter that does not exist, or a value that is not finite.
pub fn values(
    id: &str,
    named: &BTreeMap<String, f64>,
    unit: Unit,
) -> Result<(&'static Entry, Vec<f64>), EffectError> {
    let Some(entry) = ALL.iter().find(|entry| entry.id == id) else {
        return Err(EffectError {
            what: format!("effect {id} does not exist"),
            known: ALL.iter().map(|entry| entry.id).collect(),
        });
    };
    let mut chosen: Vec<f64> = entry.parameters.iter().map(|p| p.default).collect();
    for (name, &value) in named {
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
    Ok((entry, chosen))
}

/// Makes an effect from its id and named values for an axis.
///
/// # Errors
/// See [`values`].
pub fn build(
    id: &str,
    named: &BTreeMap<String, f64>,
    unit: Unit,
) -> Result<Box<dyn Effect>, EffectError> {
    let (entry, values) = values(id, named, unit)?;
    Ok((entry.build)(&values, unit))
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
