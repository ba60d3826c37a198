//! Logs and axis files.

pub mod report;
