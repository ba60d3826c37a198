//! Logs, axis files and reports: reading, checking and writing them.
//!
//! Everything that comes from a user's file fails with one [`InputError`], which names the file, the line, the column
//! and the remedy in one line. No input makes this crate panic.

pub mod axis_file;
pub mod believed;
pub mod capture;
pub mod commission;
pub mod diagnose;
pub mod error;
pub mod experiments;
pub mod feed_forward;
pub mod floor;
pub mod hygiene;
pub mod identify;
mod input;
pub mod inverse;
pub mod log;
mod names;
pub mod observe;
pub mod output;
pub mod plan;
pub mod propose;
pub mod report;
pub mod run;
pub mod scale;
pub mod sensor;
pub mod signal;
pub mod simulate;
pub mod stretch;
mod toml_text;
pub mod trial;
pub mod tune;

pub use axis_file::AxisFile;
pub use believed::Believed;
pub use bristle_plant::Unit;
pub use error::InputError;
pub use log::Log;
