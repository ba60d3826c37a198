//! Friction models, friction observers and the control tick of a servo axis.
//!
//! The same source runs in the interrupt of the microcontroller and on the host: no `std`, no allocation, no unsafe
//! code, and elementary functions from one library so that a result is the same bit for bit on both.
//!
//! Names carry SI units of a rotary axis. A linear axis uses the same types: read m for rad, N for N m and kg for
//! kg m^2.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod burst;
pub mod command;
pub mod compensation;
pub mod control;
pub mod controller;
pub mod design_check;
pub mod encoder;
pub mod error;
pub mod experiment;
pub mod feed_forward;
pub mod friction;
pub mod observer;
pub mod order;
pub mod parameters;
pub mod real;
pub mod status;
pub mod stribeck;
pub mod supervisor;
pub mod tick;
pub mod trace;
pub mod wire;

pub use error::ParameterError;
pub use real::Real;
