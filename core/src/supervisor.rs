//! Boot, idle, armed, fault: what may reach the drive, and why it may not. Pure; one step a tick.
//!
//! Outside of armed the torque is zero and the drive disabled, but for one case: after a command time-out the torque
//! goes to zero by a ramp, with the drive enabled until it is there. Every other fault takes torque and drive away in
//! the tick that sees it. A fault stays, with the number of the first one, until it is cleared and its cause is gone.

use core::hint::cold_path;

use crate::error::{ParameterError, not_negative, positive, require};

macro_rules! codes {
    ($(#[$doc:meta])* $name:ident { $($(#[$entry:meta])* $variant:ident = $number:literal $text:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $name {
            $($(#[$entry])* $variant = $number,)+
        }

        impl $name {
            /// All of them, by number.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The one with a number.
            pub fn of(number: u8) -> Option<Self> {
                match number {
                    $($number => Some(Self::$variant),)+
                    _ => None,
                }
            }

            /// In words.
            pub fn text(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)+
                }
            }
        }
    };
}
pub(crate) use codes;

codes! {
    /// Where the supervisor stands.
    State {
        /// Before the inputs have settled.
        #[default]
        Boot = 0 "boot",
        /// Ready to be armed.
        Idle = 1 "idle",
        /// Torque may flow.
        Armed = 2 "armed",
        /// A fault is latched.
        Fault = 3 "fault",
    }
}

codes! {
    /// What keeps the output from being what was asked for.
    Limit {
        /// Nothing.
        #[default]
        None = 0 "nothing",
        /// The drive is not armed.
        Disarmed = 1 "not armed",
        /// The largest torque.
        Torque = 2 "torque limit",
        /// The largest change of torque in a tick.
        Slew = 3 "slew limit",
        /// A stop, or a command time-out, takes the torque down.
        Ramp = 4 "ramp to zero",
    }
}

codes! {
    /// Why the drive was taken away. The numbers are part of the wire form.
    Fault {
        /// No fault.
        #[default]
        None = 0 "no fault",
        /// Reported by the encoder's timer.
        EncoderIllegal = 1 "encoder: A and B changed at once, a count may be lost",
        /// The count at the index is not a whole number of turns from the first one.
        IndexMismatch = 2 "encoder: index at the wrong count, counts were lost or made",
        /// Velocity above the limit, or a step too large to be motion.
        Overspeed = 3 "overspeed",
        /// Torque or slew limit for too long.
        LimitTooLong = 4 "torque or slew limit reached for too long",
        /// A tick came late, was lost, or was still running when the next one was due.
        DeadlineMissed = 5 "control tick missed its deadline",
        /// A torque, velocity or deflection that is not a number.
        NotFinite = 6 "a value is not finite",
        /// The drive's own signal.
        DriveFault = 7 "drive reports a fault",
        /// No command for too long while armed.
        CommandTimeout = 8 "no command from the host for too long",
        /// The last reset was the watchdog's.
        WatchdogReset = 9 "the watchdog reset the controller",
        /// Torque well above break-away, and no count.
        StuckEncoder = 10 "torque above break-away but no encoder count",
    }
}

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

/// What the host asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// From idle to armed.
    Arm,
    /// To idle at once.
    Disarm,
    /// Torque to zero by a ramp; stays armed.
    Stop,
    /// An experiment begins: ends a stop.
    Start,
    /// From fault to idle.
    ClearFault,
    /// Only says that the host is there.
    KeepAlive,
}

/// What a tick saw.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Observation {
    /// Torque that the control asks for, N m.
    pub wanted_nm: f32,
    /// Estimated velocity, rad/s.
    pub velocity_rad_s: f32,
    /// Estimated deflection, rad; looked at only for whether it is a number.
    pub z_rad: f32,
    /// Step since the last tick, counts.
    pub step_counts: i32,
    /// The step was too large to be motion.
    pub step_rejected: bool,
    /// Count at an index edge since the last tick.
    pub index: Option<u32>,
    /// The encoder's timer saw both inputs change at once.
    pub illegal: bool,
    /// The drive says it is well.
    pub drive_healthy: bool,
    /// The tick before was late, lost or too long.
    pub late: bool,
    /// What the host asks for.
    pub request: Option<Request>,
}

/// What may be put out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// N m
    pub torque_nm: f32,
    /// Whether the drive is enabled.
    pub drive_enabled: bool,
    /// What limits the torque.
    pub limit: Limit,
}

/// The state machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supervisor {
    state: State,
    fault: Fault,
    torque_nm: f32,
    stopping: bool,
    ticks_in_boot: u32,
    ticks_limited: u32,
    ticks_silent: u32,
    ticks_stuck: u32,
    index: Option<u32>,
    refused: u32,
}

impl Supervisor {
    /// At boot. A reset by the watchdog is a fault to begin with.
    pub fn new(watchdog_reset: bool) -> Self {
        let (state, fault) = if watchdog_reset {
            (State::Fault, Fault::WatchdogReset)
        } else {
            (State::Boot, Fault::None)
        };
        Self {
            state,
            fault,
            torque_nm: 0.0,
            stopping: false,
            ticks_in_boot: 0,
            ticks_limited: 0,
            ticks_silent: 0,
            ticks_stuck: 0,
            index: None,
            refused: 0,
        }
    }

    /// Where it stands.
    pub fn state(&self) -> State {
        self.state
    }

    /// The latched fault.
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// Requests that came at the wrong time, since boot.
    pub fn refused(&self) -> u32 {
        self.refused
    }

    /// The encoder's index has been seen.
    pub fn index_seen(&self) -> bool {
        self.index.is_some()
    }

    /// Takes the torque down by a ramp, as [`Request::Stop`] does, if armed.
    pub fn stop(&mut self) {
        if self.state == State::Armed {
            self.stopping = true;
        }
    }

    /// True if an experiment may begin in this tick.
    #[inline]
    pub fn may_start(&self) -> bool {
        self.state == State::Armed
    }

    /// One tick.
    #[inline]
    pub fn step(&mut self, limits: &Limits, seen: &Observation) -> Verdict {
        self.follow(seen.request, seen.drive_healthy);
        if self.state == State::Boot {
            cold_path();
            self.ticks_in_boot += 1;
            if self.ticks_in_boot >= limits.boot_ticks {
                self.state = State::Idle;
            }
            return self.off();
        }
        let fault = self.examine(limits, seen);
        if fault != Fault::None && self.state != State::Fault {
            cold_path();
            self.state = State::Fault;
            self.fault = fault;
            self.stopping = fault == Fault::CommandTimeout;
        } else if fault != Fault::None && fault != Fault::CommandTimeout {
            // Something worse than the time-out that is being ramped down.
            self.stopping = false;
        }
        match self.state {
            State::Armed => self.armed(limits, seen.wanted_nm),
            State::Fault if self.stopping => self.ramp(limits),
            _ => self.off(),
        }
    }

    /// Follows a request, or counts it as refused.
    #[inline]
    fn follow(&mut self, request: Option<Request>, drive_healthy: bool) {
        let Some(request) = request else {
            self.ticks_silent = self.ticks_silent.saturating_add(1);
            return;
        };
        cold_path();
        self.ticks_silent = 0;
        match (request, self.state) {
            (Request::Arm, State::Idle) if drive_healthy => {
                self.state = State::Armed;
                self.torque_nm = 0.0;
                self.stopping = true;
                self.ticks_limited = 0;
                self.ticks_stuck = 0;
            }
            (Request::Disarm, State::Armed) => self.state = State::Idle,
            (Request::Stop, State::Armed) => self.stopping = true,
            (Request::Start, State::Armed) => self.stopping = false,
            (Request::ClearFault, State::Fault) => {
                self.state = State::Idle;
                self.fault = Fault::None;
                self.stopping = false;
                self.index = None;
            }
            (Request::KeepAlive | Request::Disarm, _) | (Request::Stop, State::Idle) => {}
            _ => self.refused = self.refused.saturating_add(1),
        }
    }

    /// The most serious thing wrong in this tick.
    #[inline]
    fn examine(&mut self, limits: &Limits, seen: &Observation) -> Fault {
        let armed = self.state == State::Armed;
        let index_fits = self.index_fits(limits, seen.index);
        // Finite only if all three are.
        let finite = (seen.wanted_nm + seen.velocity_rad_s + seen.z_rad).is_finite();
        let stuck = self.stuck(limits, seen.step_counts);
        let speed_rad_s = seen.velocity_rad_s.abs();
        // In nearly every tick nothing is wrong; only otherwise is it asked what.
        let anything = !finite
            || (seen.illegal | seen.step_rejected | seen.late | !index_fits)
            || speed_rad_s > limits.speed_rad_s
            || (armed
                && (!seen.drive_healthy
                    || stuck
                    || self.ticks_limited >= limits.limit_ticks
                    || self.ticks_silent >= limits.command_ticks));
        if !anything {
            return Fault::None;
        }
        cold_path();
        if !finite {
            Fault::NotFinite
        } else if armed && !seen.drive_healthy {
            Fault::DriveFault
        } else if seen.illegal {
            Fault::EncoderIllegal
        } else if !index_fits {
            Fault::IndexMismatch
        } else if seen.step_rejected || speed_rad_s > limits.speed_rad_s {
            Fault::Overspeed
        } else if armed && stuck {
            Fault::StuckEncoder
        } else if seen.late {
            Fault::DeadlineMissed
        } else if armed && self.ticks_limited >= limits.limit_ticks {
            Fault::LimitTooLong
        } else if armed && self.ticks_silent >= limits.command_ticks {
            Fault::CommandTimeout
        } else {
            Fault::None
        }
    }

    /// Whether the index lies whole turns from the first one. The reference moves by whole turns only, so that slow
    /// losses add up.
    #[inline]
    fn index_fits(&mut self, limits: &Limits, index: Option<u32>) -> bool {
        let Some(index) = index else { return true };
        let Some(reference) = self.index else {
            self.index = Some(index);
            return true;
        };
        let turn = limits.counts_per_turn;
        let distance = index.wrapping_sub(reference).cast_signed();
        let allowed = limits.index_counts.unsigned_abs();
        // An index comes a turn after the one before, or is the same one again.
        let off = nearest(distance, turn);
        if off.unsigned_abs() <= allowed {
            self.index = Some(index.wrapping_sub(off.cast_unsigned()));
            return true;
        }
        // Off, or indices were missed: only here is a division needed.
        cold_path();
        let off = nearest(distance.wrapping_rem(turn.max(1)), turn);
        self.index = Some(index.wrapping_sub(off.cast_unsigned()));
        off.unsigned_abs() <= allowed
    }

    /// Whether torque has been well above break-away for too long without a count.
    #[inline]
    fn stuck(&mut self, limits: &Limits, step_counts: i32) -> bool {
        if step_counts == 0 && self.torque_nm.abs() >= limits.stuck_nm {
            self.ticks_stuck = self.ticks_stuck.saturating_add(1);
        } else {
            self.ticks_stuck = 0;
        }
        self.ticks_stuck >= limits.stuck_ticks
    }

    #[inline]
    fn armed(&mut self, limits: &Limits, wanted_nm: f32) -> Verdict {
        if self.stopping {
            cold_path();
            self.ticks_limited = 0;
            return self.ramp(limits);
        }
        let mut limit = Limit::None;
        let mut torque_nm = wanted_nm;
        if torque_nm.abs() > limits.torque_nm {
            cold_path();
            torque_nm = limits.torque_nm.copysign(torque_nm);
            limit = Limit::Torque;
        }
        let change = torque_nm - self.torque_nm;
        if change.abs() > limits.slew_nm {
            cold_path();
            torque_nm = self.torque_nm + limits.slew_nm.copysign(change);
            limit = Limit::Slew;
        }
        self.ticks_limited = if limit == Limit::None {
            0
        } else {
            self.ticks_limited.saturating_add(1)
        };
        self.torque_nm = torque_nm;
        Verdict {
            torque_nm,
            drive_enabled: true,
            limit,
        }
    }

    /// A step towards zero. A fault that has got there takes the drive away.
    #[inline]
    fn ramp(&mut self, limits: &Limits) -> Verdict {
        let left = self.torque_nm.abs() - limits.ramp_nm;
        if left > 0.0 {
            self.torque_nm = left.copysign(self.torque_nm);
        } else {
            self.torque_nm = 0.0;
            if self.state == State::Fault {
                self.stopping = false;
                return self.off();
            }
        }
        Verdict {
            torque_nm: self.torque_nm,
            drive_enabled: true,
            limit: Limit::Ramp,
        }
    }

    #[inline]
    fn off(&mut self) -> Verdict {
        self.torque_nm = 0.0;
        Verdict {
            torque_nm: 0.0,
            drive_enabled: false,
            limit: Limit::Disarmed,
        }
    }
}

/// A distance of up to a turn and a half, less the nearest whole number of turns.
#[inline]
fn nearest(distance: i32, turn: i32) -> i32 {
    let half = turn >> 1;
    if distance > half {
        distance.wrapping_sub(turn)
    } else if distance < -half {
        distance.wrapping_add(turn)
    } else {
        distance
    }
}

#[cfg(test)]
mod tests;
