//! The columns a log may have: their names, what they hold and in which unit.

use bristle_plant::Unit;

use super::{EffortKind, PositionKind};

/// What a known column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Role {
    Time,
    Effort(EffortKind),
    Position(PositionKind),
    PositionLoad,
    PositionRef,
    Velocity,
    Temperature,
}

/// A known column.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    pub(crate) name: &'static str,
    pub(crate) role: Role,
    /// Rotary or linear, where the name says so.
    pub(crate) unit: Option<Unit>,
    /// Symbol of the unit, for messages.
    pub(crate) symbol: &'static str,
}

const fn column(name: &'static str, role: Role, unit: Option<Unit>, symbol: &'static str) -> Known {
    Known {
        name,
        role,
        unit,
        symbol,
    }
}

use EffortKind::{Current, TorqueMeasured, TorqueReference, Voltage};
use Unit::{Linear, Rotary};

/// Every known column.
pub(crate) const KNOWN: [Known; 17] = [
    column("time_s", Role::Time, None, "s"),
    column(
        "torque_nm",
        Role::Effort(TorqueMeasured),
        Some(Rotary),
        "N m",
    ),
    column("force_n", Role::Effort(TorqueMeasured), Some(Linear), "N"),
    column(
        "torque_ref_nm",
        Role::Effort(TorqueReference),
        Some(Rotary),
        "N m",
    ),
    column(
        "force_ref_n",
        Role::Effort(TorqueReference),
        Some(Linear),
        "N",
    ),
    column("current_a", Role::Effort(Current), None, "A"),
    column("voltage_v", Role::Effort(Voltage), None, "V"),
    column(
        "position_rad",
        Role::Position(PositionKind::Rad),
        Some(Rotary),
        "rad",
    ),
    column(
        "position_m",
        Role::Position(PositionKind::M),
        Some(Linear),
        "m",
    ),
    column(
        "position_counts",
        Role::Position(PositionKind::Counts),
        None,
        "encoder counts",
    ),
    column("position_load_rad", Role::PositionLoad, Some(Rotary), "rad"),
    column("position_load_m", Role::PositionLoad, Some(Linear), "m"),
    column("position_ref_rad", Role::PositionRef, Some(Rotary), "rad"),
    column("position_ref_m", Role::PositionRef, Some(Linear), "m"),
    column("velocity_rad_s", Role::Velocity, Some(Rotary), "rad/s"),
    column("velocity_m_s", Role::Velocity, Some(Linear), "m/s"),
    column("temperature_c", Role::Temperature, None, "deg C"),
];

/// The known column of a name.
pub(crate) fn known(name: &str) -> Option<Known> {
    KNOWN.into_iter().find(|known| known.name == name)
}

/// Name of the column that holds `role`.
pub(crate) fn name_of(role: Role, unit: Unit) -> &'static str {
    KNOWN
        .into_iter()
        .find(|known| known.role == role && known.unit.is_none_or(|its| its == unit))
        .map_or("", |known| known.name)
}
