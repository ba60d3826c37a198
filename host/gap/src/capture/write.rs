//! Samples as rows of a log.

use super::Sample;
use bristle_core::experiment::End;
use bristle_core::supervisor::{Limit, State};
use bristle_core::trace::{
    END_SHIFT, FLAG_DRIVE_ENABLED, FLAG_EXPERIMENT, FLAG_INDEX_SEEN, FLAG_OVERRUN,
};
use bristle_plant::Unit;
use bristle_plant::axis::Truth;
use std::io::{self, Write};

/// How a log gives the position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Position {
    /// As the encoder counts it.
    Counts,
    /// In rad, with so many counts a turn.
    Rad {
        /// Counts a turn.
        counts_per_turn: f64,
    },
}

/// The flags, a column each.
const FLAGS: [(&str, u8); 4] = [
    ("experiment", FLAG_EXPERIMENT),
    ("drive_enabled", FLAG_DRIVE_ENABLED),
    ("index_seen", FLAG_INDEX_SEEN),
    ("overrun", FLAG_OVERRUN),
];

/// The words for the numbers of a column that has words in CSV and numbers in MCAP.
pub(crate) fn word(column: &str) -> Option<fn(u8) -> Option<&'static str>> {
    match column {
        "state" => Some(|number| State::of(number).map(State::text)),
        "limit" => Some(|number| Limit::of(number).map(Limit::text)),
        "ended" => Some(|number| End::of(number).map(End::text)),
        _ => None,
    }
}

/// The columns of a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    /// How it gives the position.
    pub position: Position,
    /// Names for a rotary or a linear axis.
    pub unit: Unit,
    /// With what only a simulation knows, in columns at the end.
    pub truth: bool,
}

impl Layout {
    /// What the firmware sends, with counts.
    pub const FIRMWARE: Self = Self {
        position: Position::Counts,
        unit: Unit::Rotary,
        truth: false,
    };

    /// Names of the columns.
    pub fn names(&self) -> Vec<&'static str> {
        let [torque, position, velocity, z_luenberger, z_time_free] = match self.unit {
            Unit::Rotary => [
                "torque_ref_nm",
                "position_rad",
                "velocity_rad_s",
                "z_luenberger_rad",
                "z_time_free_rad",
            ],
            Unit::Linear => [
                "force_ref_n",
                "position_m",
                "velocity_m_s",
                "z_luenberger_m",
                "z_time_free_m",
            ],
        };
        let position = match self.position {
            Position::Counts => "position_counts",
            Position::Rad { .. } => position,
        };
        let mut names = vec![
            "time_s",
            torque,
            position,
            velocity,
            z_luenberger,
            z_time_free,
            "tick",
            "state",
            "limit",
            "fault",
        ];
        names.extend(FLAGS.map(|(name, _)| name));
        names.push("ended");
        if self.truth {
            names.extend(match self.unit {
                Unit::Rotary => [
                    "true_torque_nm",
                    "true_velocity_rad_s",
                    "true_z_rad",
                    "true_friction_nm",
                ],
                Unit::Linear => [
                    "true_force_n",
                    "true_velocity_m_s",
                    "true_z_m",
                    "true_friction_n",
                ],
            });
        }
        names
    }

    /// Gives the values of a sample, in the order of the names. `truth` is for a layout that has it.
    pub(super) fn values(
        &self,
        sample: &Sample,
        truth: Option<&Truth>,
        mut give: impl FnMut(Value),
    ) {
        let record = &sample.record;
        give(Value::Double(sample.time_s));
        give(Value::Single(record.torque_ref_nm));
        give(match self.position {
            Position::Counts => Value::Whole(sample.counts),
            Position::Rad { counts_per_turn } => {
                let turns = sample.counts as f64 / counts_per_turn;
                Value::Double(turns * std::f64::consts::TAU)
            }
        });
        give(Value::Single(record.velocity_rad_s));
        give(Value::Single(record.z_luenberger_rad));
        give(Value::Single(record.z_time_free_rad));
        give(Value::Whole(i64::from(record.tick)));
        let status = record.status;
        let [state, limit, fault, flags] = status.0.to_le_bytes();
        give(Value::Code(state, status.state().map(State::text)));
        give(Value::Code(limit, status.limit().map(Limit::text)));
        give(Value::Whole(i64::from(fault)));
        for (_, flag) in FLAGS {
            give(Value::Whole(i64::from(flags & flag != 0)));
        }
        let ended = flags >> END_SHIFT;
        give(Value::Code(ended, status.ended().map(End::text)));
        if self.truth {
            let truth = truth.copied().unwrap_or_default();
            give(Value::Double(truth.torque_nm));
            give(Value::Double(truth.motion.velocity_rad_s));
            give(Value::Double(truth.z_rad));
            give(Value::Double(truth.friction_nm));
        }
    }

    /// Writes the header row.
    ///
    /// # Errors
    /// As the writer.
    pub fn header(&self, to: &mut dyn Write) -> io::Result<()> {
        writeln!(to, "{}", self.names().join(","))
    }

    /// Writes a row. Numbers are the shortest that read back equal in the precision of the microcontroller. `truth` is
    /// for a layout that has it.
    ///
    /// # Errors
    /// As the writer.
    pub fn row(
        &self,
        to: &mut dyn Write,
        sample: &Sample,
        truth: Option<&Truth>,
    ) -> io::Result<()> {
        let mut written = Ok(());
        let mut comma = "";
        self.values(sample, truth, |value| {
            if written.is_ok() {
                written = match value {
                    Value::Single(value) => write!(to, "{comma}{value:?}"),
                    Value::Double(value) => write!(to, "{comma}{value:?}"),
                    Value::Whole(value) => write!(to, "{comma}{value}"),
                    Value::Code(_, Some(word)) => write!(to, "{comma}{word}"),
                    Value::Code(number, None) => write!(to, "{comma}{number}"),
                };
            }
            comma = ",";
        });
        written?;
        writeln!(to)
    }
}

/// A value of a sample.
#[derive(Clone, Copy, Debug)]
pub(super) enum Value {
    Single(f32),
    Double(f64),
    Whole(i64),
    /// A number that mostly has a word.
    Code(u8, Option<&'static str>),
}
