//! The axis files of the repository, read and completed.

use bristle_gap::{AxisFile, Believed};
use std::path::Path;

/// Seconds of a sample in the thesis and on the board.
pub const T: f64 = 1e-4;

/// An axis of the folder `axes`.
pub fn axis(name: &str) -> Believed {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../axes")
        .join(name);
    let file = AxisFile::read(&path).unwrap();
    Believed::new(&file, &path).unwrap()
}
