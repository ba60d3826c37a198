//! Effects that a plain model leaves out. Each is one file with its parameters and its hooks; a new one is added to
//! [`ALL`] and nowhere else.

mod actuator_cogging;
mod actuator_deadzone;
mod actuator_delay;
mod actuator_gain;
mod actuator_lag;
mod actuator_ripple;
mod actuator_saturation;
mod actuator_voltage_limit;
mod disturbance_periodic;
mod first_order;
mod friction_asymmetry;
mod friction_dwell;
mod friction_lag;
mod friction_load;
mod friction_nonlocal;
mod friction_position;
mod friction_presliding;
mod friction_quadratic;
mod friction_stribeck;
mod friction_thermal;
mod history;
mod hook;
mod mechanics_backlash;
mod mechanics_compliance;
mod mechanics_end_stop;
mod mechanics_inertia_change;
mod mechanics_offset;
mod mechanics_spring;
mod mechanics_unbalance;
mod parameter;
mod sensor_delay;
mod sensor_eccentricity;
mod sensor_jitter;
mod sensor_lost_counts;
mod sensor_quantization;
#[cfg(test)]
pub(crate) mod testing;
mod wave;

pub use hook::{Coupling, Effect, FELT_S, Instant, Plain};
pub use parameter::{Entry, Kind, Parameter, Scale};

use crate::unit::Unit;
use std::collections::BTreeMap;
use std::fmt;

/// Every effect there is.
pub const ALL: &[Entry] = &[
    actuator_cogging::ENTRY,
    actuator_deadzone::ENTRY,
    actuator_delay::ENTRY,
    actuator_gain::ENTRY,
    actuator_lag::ENTRY,
    actuator_ripple::ENTRY,
    actuator_saturation::ENTRY,
    actuator_voltage_limit::ENTRY,
    disturbance_periodic::ENTRY,
    friction_asymmetry::ENTRY,
    friction_dwell::ENTRY,
    friction_lag::ENTRY,
    friction_load::ENTRY,
    friction_nonlocal::ENTRY,
    friction_position::ENTRY,
    friction_presliding::ENTRY,
    friction_quadratic::ENTRY,
    friction_stribeck::ENTRY,
    friction_thermal::ENTRY,
    mechanics_backlash::ENTRY,
    mechanics_compliance::ENTRY,
    mechanics_end_stop::ENTRY,
    mechanics_inertia_change::ENTRY,
    mechanics_offset::ENTRY,
    mechanics_spring::ENTRY,
    mechanics_unbalance::ENTRY,
    sensor_delay::ENTRY,
    sensor_eccentricity::ENTRY,
    sensor_jitter::ENTRY,
    sensor_lost_counts::ENTRY,
    sensor_quantization::ENTRY,
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
    let mut chosen = entry.defaults();
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
    use crate::contact::Contact;

    const UNITS: [Unit; 2] = [Unit::Rotary, Unit::Linear];

    fn scale(unit: Unit) -> Scale {
        Scale {
            unit,
            coulomb_nm: 0.02,
            inertia_kg_m2: 1e-4,
            stribeck_velocity_rad_s: 0.3,
            z_ss_rad: 2e-3,
            top_speed_rad_s: 4.0,
            top_torque_nm: 0.05,
            lowest_rad: -1.0,
            highest_rad: 2.0,
            duration_s: 10.0,
            sample_time_s: 1e-3,
            rad_per_count: 1e-6,
        }
    }

    /// Sine torque through stick, sliding and reversal, and what comes out to the last bit.
    fn run(contact: Box<dyn Contact>, effects: Vec<Box<dyn Effect>>) -> Vec<[u64; 3]> {
        let mut axis = testing::axis(contact, effects);
        let sample = |k: i32| {
            let reading = axis.advance(0.05 * (0.02 * f64::from(k)).sin());
            let truth = axis.truth();
            [
                truth.motion.position_rad.to_bits(),
                truth.motion.load_velocity_rad_s.to_bits(),
                reading.counts.cast_unsigned(),
            ]
        };
        (0..1000).map(sample).collect()
    }

    #[test]
    fn ids_are_unique_and_start_with_a_block() {
        let blocks = ["friction", "mechanics", "actuator", "sensor", "disturbance"];
        for (i, entry) in ALL.iter().enumerate() {
            assert!(ALL[..i].iter().all(|other| other.id != entry.id));
            assert!(blocks.contains(&entry.block()), "{}", entry.id);
            assert!(!entry.model.is_empty() && !entry.model.contains('\n'));
        }
    }

    #[test]
    fn parameters_have_roles_defaults_and_ranges() {
        for entry in ALL {
            let kinds = entry.parameters.iter().map(|p| p.kind);
            let sizes = kinds.filter(|kind| matches!(kind, Kind::Size | Kind::Limit));
            assert!(sizes.count() > 0, "{}", entry.id);
            for p in entry.parameters {
                let name = format!("{} {}", entry.id, p.name);
                if matches!(p.kind, Kind::Size | Kind::Limit) {
                    assert_eq!(p.default, 0.0, "{name}");
                }
                // A unit of the other kind of axis has no place in a name.
                assert!(
                    !p.linear_name.contains("rad") || p.name == p.linear_name,
                    "{name}"
                );
                assert!(
                    !p.linear_name.ends_with("_nm") && !p.name.ends_with("_m"),
                    "{name}"
                );
                for unit in UNITS {
                    let [low, high] = (p.range)(&scale(unit));
                    assert!(low.is_finite() && high.is_finite() && low <= high, "{name}");
                }
            }
        }
    }

    #[test]
    fn an_effect_of_no_size_leaves_every_bit() {
        for model in [testing::coulomb, testing::bristles] {
            let plain = run(model(), Vec::new());
            for entry in ALL {
                for unit in UNITS {
                    let effect = build(entry.id, &BTreeMap::new(), unit).unwrap();
                    assert!(run(model(), vec![effect]) == plain, "{}", entry.id);
                }
            }
        }
    }

    #[test]
    fn an_effect_of_usual_size_changes_the_axis_and_stays_finite() {
        for model in [testing::coulomb, testing::bristles] {
            let plain = run(model(), Vec::new());
            for entry in ALL {
                let scale = scale(Unit::Rotary);
                let mut changes = 0;
                for end in 0..2 {
                    let values: Vec<f64> = entry
                        .parameters
                        .iter()
                        .map(|p| (p.range)(&scale)[end])
                        .collect();
                    let changed = run(model(), vec![(entry.build)(&values, Unit::Rotary)]);
                    let finite = |row: &[u64; 3]| f64::from_bits(row[0]).abs() < 100.0;
                    assert!(changed.iter().all(finite), "{} at {values:?}", entry.id);
                    changes += i32::from(changed != plain);
                }
                // A limit that is not reached and a payload that comes too late are at one of the ends.
                assert!(changes > 0, "{}", entry.id);
            }
        }
    }

    #[test]
    fn hooks_bear_steps_of_a_whole_sample_along_a_record() {
        // Measured motion at 500 Hz, as a record is followed backwards: sliding, a stop, noise at rest.
        for entry in ALL {
            let scale = scale(Unit::Rotary);
            let values: Vec<f64> = entry
                .parameters
                .iter()
                .map(|p| (p.range)(&scale)[1])
                .collect();
            let mut effect = (entry.build)(&values, Unit::Rotary);
            effect.begin(&testing::PLAIN);
            let mut contact = effect.contact(testing::coulomb());
            for k in 0..2000 {
                let time_s = f64::from(k) * 2e-3;
                let v = if k < 1000 {
                    5.0 * (3.0 * time_s).sin()
                } else {
                    f64::from(k % 3 - 1)
                };
                let now = Instant {
                    time_s,
                    step_s: 2e-3,
                    acceleration_rad_s2: 15.0 * (3.0 * time_s).cos(),
                    torque_nm: 0.04 * (3.0 * time_s).sin(),
                    ..testing::at(time_s.sin(), v)
                };
                let friction = contact.step(bristle_core::friction::Motion {
                    velocity_rad_s: v,
                    applied_nm: now.torque_nm,
                    dt_s: now.step_s,
                });
                let torque = effect.actuator(&now) + effect.mechanics(&now);
                let needed =
                    effect.inertia(&now) * testing::PLAIN.inertia_kg_m2 * now.acceleration_rad_s2
                        + effect.friction(&now, friction)
                        - torque;
                // An end stop that a record passes through asks for more; all others for what an axis has.
                let most = if entry.id == "mechanics.end_stop" {
                    1e5
                } else {
                    2.0
                };
                assert!(needed.abs() < most, "{} at {time_s}: {needed}", entry.id);
                assert!(
                    (effect.sensor(&now) - time_s.sin()).abs() < 0.1,
                    "{}",
                    entry.id
                );
            }
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
