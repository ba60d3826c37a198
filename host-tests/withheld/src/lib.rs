//! Servo axes with a known effect in them, and the logs they would leave: cases for a blind check of a diagnosis.
//!
//! A case is drawn from its seed alone, bit for bit the same on every machine. Nothing here comes from the crates under
//! test: the physics, the integration, the controllers, the noise and the forms of the effects are its own, so that a
//! mistake there cannot hide by being made twice. What is shared is the meaning of the axis file: the friction law that
//! the file names is the law of the axis, less the withheld effect.
//!
//! Units are SI; a linear axis reads m for rad, N for N m and kg for kg m^2.

mod axis;
mod calibrate;
mod case;
mod control;
mod draw;
mod experiment;
mod form;
mod friction;
mod noise;
mod simulate;
mod truth;

pub use case::{Case, LogTable, case, case_of, planned};
pub use form::{FOREIGN, LISTED};
pub use truth::{Changed, Class, Effect, Truth};
