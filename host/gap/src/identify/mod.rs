//! Identification: from logs to an axis file.

pub mod joint;
