//! Samples as rows of a log.

use super::Sample;
use bristle_core::trace::{
    END_SHIFT, FLAG_DRIVE_ENABLED, FLAG_EXPERIMENT, FLAG_INDEX_SEEN, FLAG_OVERRUN, Status,
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

    /// Writes the header row.
    ///
    /// # Errors
    /// As the writer.
    pub fn header(&self, to: &mut dyn Write) -> io::Result<()> {
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
        write!(
            to,
            "time_s,{torque},{position},{velocity},{z_luenberger},{z_time_free},tick,state,limit,fault"
        )?;
        for (name, _) in FLAGS {
            write!(to, ",{name}")?;
        }
        write!(to, ",ended")?;
        match (self.truth, self.unit) {
            (false, _) => {}
            (true, Unit::Rotary) => write!(
                to,
                ",true_torque_nm,true_velocity_rad_s,true_z_rad,true_friction_nm"
            )?,
            (true, Unit::Linear) => write!(
                to,
                ",true_force_n,true_velocity_m_s,true_z_m,true_friction_n"
            )?,
        }
        writeln!(to)
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
        let record = &sample.record;
        write!(to, "{:?},{:?},", sample.time_s, record.torque_ref_nm)?;
        match self.position {
            Position::Counts => write!(to, "{}", sample.counts)?,
            Position::Rad { counts_per_turn } => {
                let turns = sample.counts as f64 / counts_per_turn;
                write!(to, "{:?}", turns * std::f64::consts::TAU)?;
            }
        }
        write!(
            to,
            ",{:?},{:?},{:?},{}",
            record.velocity_rad_s, record.z_luenberger_rad, record.z_time_free_rad, record.tick
        )?;
        write_status(to, record.status)?;
        if self.truth {
            let truth = truth.copied().unwrap_or_default();
            write!(
                to,
                ",{:?},{:?},{:?},{:?}",
                truth.torque_nm, truth.motion.velocity_rad_s, truth.z_rad, truth.friction_nm
            )?;
        }
        writeln!(to)
    }
}

/// State and limit in words where they have some, the rest as numbers.
fn write_status(to: &mut dyn Write, status: Status) -> io::Result<()> {
    let [state, limit, fault, flags] = status.0.to_le_bytes();
    match status.state() {
        Some(known) => write!(to, ",{}", known.text())?,
        None => write!(to, ",{state}")?,
    }
    match status.limit() {
        Some(known) => write!(to, ",{}", known.text())?,
        None => write!(to, ",{limit}")?,
    }
    write!(to, ",{fault}")?;
    for (_, flag) in FLAGS {
        write!(to, ",{}", u8::from(flags & flag != 0))?;
    }
    match status.ended() {
        Some(known) => write!(to, ",{}", known.text()),
        None => write!(to, ",{}", flags >> END_SHIFT),
    }
}
