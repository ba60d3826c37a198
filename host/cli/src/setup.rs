//! The axis that a subcommand works on.

use bristle_gap::{AxisFile, Believed, InputError};
use std::path::{Path, PathBuf};

/// The demonstration axis, built in so that nothing else is needed.
pub const BENCH_AXIS: &str = include_str!("../../../axes/bench.toml");

/// An axis file and what follows from it.
pub struct Setup {
    /// As written.
    pub file: AxisFile,
    /// Completed.
    pub believed: Believed,
    /// Where it came from.
    pub name: String,
}

impl Setup {
    /// Reads an axis file, or takes the built-in one.
    pub fn new(path: Option<&PathBuf>) -> Result<Self, InputError> {
        let (file, path) = match path {
            Some(path) => (AxisFile::read(path)?, path.as_path()),
            None => {
                let path = Path::new("built-in bench axis");
                (AxisFile::parse(BENCH_AXIS, path)?, path)
            }
        };
        let believed = Believed::new(&file, path)?;
        crate::output::notices(&believed.assumed);
        Ok(Self {
            believed,
            file,
            name: path.display().to_string(),
        })
    }

    /// Length of a sample at the observers' rate, s.
    pub fn sample_time_s(&self) -> f64 {
        1.0 / self.believed.rate_hz
    }
}
