//! The simulated servo axis: drive, mechanics, friction, encoder and what a model leaves out.
//!
//! Everything is f64 and deterministic: the same configuration, seed and input give the same result bit for bit.

pub mod affected;
pub mod axis;
pub mod contact;
pub mod drive;
pub mod effect;
pub mod encoder;
pub mod levelled;
pub mod mechanics;
pub mod rig;
pub mod unit;

pub use axis::{Axis, Truth};
pub use contact::Contact;
pub use rig::Rig;
pub use unit::Unit;
