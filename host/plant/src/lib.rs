//! Simulated servo axis.
