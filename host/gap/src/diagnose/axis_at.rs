//! A fitted point as an axis with effects, ready to be simulated.

use crate::axis_file::EffectEntry;
use crate::believed::Believed;
use crate::inverse::Point;
use bristle_plant::Unit;
use bristle_plant::effect::Kind;
use std::f64::consts::{PI, TAU};

/// The axis at a point with its effects as they are on the first record, ready to be simulated.
pub fn axis_at(point: &Point) -> Believed {
    let mut axis = point.believed().clone();
    axis.effects = entries(point, 0, axis.unit);
    axis
}

/// The effects of a point on a record, as an axis file holds them.
pub fn entries(point: &Point, record: usize, unit: Unit) -> Vec<EffectEntry> {
    point
        .effects_on(record)
        .iter()
        .map(|added| EffectEntry {
            id: added.entry.id.to_string(),
            parameters: added
                .entry
                .parameters
                .iter()
                .zip(&added.values)
                .map(|(parameter, &value)| {
                    let value = if parameter.kind == Kind::Phase {
                        (value + PI).rem_euclid(TAU) - PI
                    } else {
                        value
                    };
                    (parameter.name(unit).to_string(), value)
                })
                .collect(),
        })
        .collect()
}
