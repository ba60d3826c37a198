//! What a log says of itself, where it has room for it: who wrote it and when, units, parameters, firmware.

use crate::identify::sha256;
use crate::output::command_line;
use bristle_core::command::{Command, Reply};
use bristle_core::parameters::ENTRIES;
use bristle_gap::capture::About;
use bristle_gap::{AxisFile, InputError, Unit};
use std::path::Path;
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// Of any log.
pub fn about(rate_hz: f64, unit: Unit) -> About {
    let mut about = About::new();
    let mut say = |name: &str, value: String| about.insert(name.to_owned(), value);
    say("command", command_line());
    say("version", env!("CARGO_PKG_VERSION").to_owned());
    if let Ok(now) = OffsetDateTime::now_utc().format(&Rfc3339) {
        say("started", now);
    }
    say("rate_hz", rate_hz.to_string());
    let units = match unit {
        Unit::Rotary => "s, N m, rad, rad/s; counts of the encoder",
        Unit::Linear => "s, N, m, m/s; counts of the encoder",
    };
    say("units", units.to_owned());
    about
}

/// The axis file, as it was understood.
pub fn axis(about: &mut About, file: &AxisFile) {
    about.insert("axis_file".to_owned(), file.to_toml());
}

/// The firmware's image by its SHA-256.
pub fn firmware(about: &mut About, path: &Path) -> Result<(), InputError> {
    let hash = sha256(path)?;
    about.insert("firmware".to_owned(), path.display().to_string());
    about.insert("firmware_sha256".to_owned(), hash);
    Ok(())
}

/// The parameters that the firmware runs on, by asking for each.
pub fn parameters(
    about: &mut About,
    mut ask: impl FnMut(&Command) -> Result<Reply, InputError>,
) -> Result<(), InputError> {
    for (number, entry) in (0..).zip(ENTRIES) {
        if let Reply::Value { value, .. } = ask(&Command::Get(number))? {
            about.insert(format!("parameter {}", entry.name), value.to_string());
        }
    }
    Ok(())
}
