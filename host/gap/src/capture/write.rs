//! Samples as rows of a log.

use super::Sample;
use bristle_core::trace::{
    FLAG_DRIVE_ENABLED, FLAG_EXPERIMENT, FLAG_INDEX_SEEN, FLAG_OVERRUN, Status,
};
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

/// Writes the header row.
///
/// # Errors
/// As the writer.
pub fn header(to: &mut dyn Write, position: Position) -> io::Result<()> {
    let position = match position {
        Position::Counts => "position_counts",
        Position::Rad { .. } => "position_rad",
    };
    write!(
        to,
        "time_s,torque_ref_nm,{position},velocity_rad_s,z_luenberger_rad,z_time_free_rad,tick,state,limit,fault"
    )?;
    for (name, _) in FLAGS {
        write!(to, ",{name}")?;
    }
    writeln!(to)
}

/// Writes a row. Numbers are the shortest that read back equal in the precision of the microcontroller.
///
/// # Errors
/// As the writer.
pub fn write_row(to: &mut dyn Write, position: Position, sample: &Sample) -> io::Result<()> {
    let record = &sample.record;
    write!(to, "{:?},{:?},", sample.time_s, record.torque_ref_nm)?;
    match position {
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
    writeln!(to)
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
    Ok(())
}
