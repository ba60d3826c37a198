//! Logs and axis files.
