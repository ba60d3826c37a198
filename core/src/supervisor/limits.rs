//! What the supervisor allows.

use crate::error::{ParameterError, not_negative, positive, require};

/// What is allowed. Times in ticks, changes per tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest torque, N m.
    pub torque_nm: f32,
    /// Largest change of torque in a tick, N m.
    pub slew_nm: f32,
    /// Change of torque in a tick of a stop, N m.
    pub ramp_nm: f32,
    /// Largest speed, rad/s.
    pub speed_rad_s: f32,
    /// Ticks at a limit after which it is a fault.
    pub limit_ticks: u32,
    /// Ticks without a command after which an armed drive is stopped.
    pub command_ticks: u32,
    /// Torque above which the axis must move, N m.
    pub stuck_nm: f32,
    /// Ticks above that torque without a count after which the encoder counts as stuck.
    pub stuck_ticks: u32,
    /// Counts of a turn.
    pub counts_per_turn: i32,
    /// Counts by which an index may be off.
    pub index_counts: i32,
    /// Ticks from boot to idle.
    pub boot_ticks: u32,
}

impl Limits {
    /// Passes on limits that mean something.
    ///
    /// # Errors
    /// The first value that does not.
    pub fn checked(self) -> Result<Self, ParameterError> {
        positive("torque_limit_nm", self.torque_nm)?;
        positive("slew_limit_nm", self.slew_nm)?;
        positive("ramp_nm", self.ramp_nm)?;
        positive("max_speed_rad_s", self.speed_rad_s)?;
        positive("stuck_torque_nm", self.stuck_nm)?;
        for (name, ticks) in [
            ("limit_time", self.limit_ticks),
            ("command_timeout", self.command_ticks),
            ("stuck_time", self.stuck_ticks),
        ] {
            require(name, f64::from(ticks), ticks > 0, "at least a tick")?;
        }
        positive("counts_per_rev", f64::from(self.counts_per_turn))?;
        not_negative("index_tolerance_counts", f64::from(self.index_counts))?;
        Ok(self)
    }
}
