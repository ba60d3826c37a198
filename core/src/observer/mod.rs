//! Friction observers: velocity and bristle deflection from encoder counts, and torque where they use it.
//!
//! Every observer takes the step in counts since the last sample, never an angle, and integrates its innovation form:
//! theta = w - L q of the source would multiply the rounding of a growing q by L. Bad input is rejected, counted, and
//! leaves the state as it was.

pub mod luenberger;
pub mod reduced_order;
pub mod stability;
pub mod time_free;
pub mod time_free_fixed;

pub use luenberger::Luenberger;
pub use reduced_order::ReducedOrder;
pub use time_free::TimeFree;
pub use time_free_fixed::TimeFreeFixed;

/// What an observer knows after a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate<T> {
    /// Velocity, rad/s.
    pub velocity_rad_s: T,
    /// Bristle deflection z, rad.
    pub z_rad: T,
}
