//! Boot, idle, armed, fault: what may reach the drive, and why it may not. Pure; one step a tick.
//!
//! Outside of armed the torque is zero and the drive disabled, but for one case: after a command time-out the torque
//! goes to zero by a ramp, with the drive enabled until it is there. Every other fault takes torque and drive away in
//! the tick that sees it. A fault stays, with the number of the first one, until it is cleared and its cause is gone.

use core::hint::cold_path;

mod index;

use index::Index;

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

/// What speaks against a tick, a bit each. One number, so that one look tells whether anything does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Alarms(u32);

impl Alarms {
    /// The encoder's timer saw both inputs change at once.
    pub const ILLEGAL: Self = Self(1);
    /// The drive does not say that it is well.
    pub const UNWELL: Self = Self(2);
    /// The tick before was late, lost or too long.
    pub const LATE: Self = Self(4);
    /// The index does not fit the counts.
    pub const INDEX: Self = Self(8);
    /// The step was too large to be motion.
    pub const REJECTED: Self = Self(16);
    /// The supervisor's own: not armed, or something stops or limits the torque.
    const HELD: Self = Self(32);

    /// These if `on`, otherwise none.
    #[inline]
    pub fn when(self, on: bool) -> Self {
        Self(u32::from(on) * self.0)
    }

    /// Both.
    #[inline]
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Any of `other` is among these.
    #[inline]
    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
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
    /// What speaks against the tick.
    pub alarms: Alarms,
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
    /// Where the supervisor stands.
    pub state: State,
    /// The latched fault.
    pub fault: Fault,
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
    ticks_stuck: u32,
    /// Number of the tick.
    tick: u32,
    /// Tick of the last request.
    asked_tick: u32,
    /// Tick at which somebody outside has to look.
    watched_tick: u32,
    /// The first tick that its number alone makes unusual: the time-out's or the watched one.
    due_tick: u32,
    index: Index,
    refused: u32,
    /// What spoke against the last unusual tick.
    alarms: Alarms,
    /// [`Alarms::HELD`], or none.
    held: Alarms,
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
            ticks_stuck: 0,
            tick: 0,
            asked_tick: 0,
            watched_tick: 0,
            due_tick: 0,
            index: Index::default(),
            refused: 0,
            alarms: Alarms::default(),
            held: Alarms::HELD,
        }
    }

    /// Number of the tick that comes next, from boot; wraps.
    #[inline]
    pub fn tick(&self) -> u32 {
        self.tick
    }

    /// Makes the tick of a number an unusual one, from the next request on.
    #[inline]
    pub(crate) fn watch(&mut self, tick: u32) {
        self.watched_tick = tick;
    }

    /// Finds the next tick that its number makes unusual: after a request, and with new limits.
    #[inline]
    pub(crate) fn renew(&mut self, limits: &Limits) {
        let silent = self.tick.wrapping_sub(self.asked_tick);
        let left = limits
            .command_ticks
            .saturating_sub(silent)
            .min(self.watched_tick.wrapping_sub(self.tick));
        self.due_tick = self.tick.wrapping_add(left);
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
        self.index.seen()
    }

    /// Takes the torque down by a ramp, as [`Request::Stop`] does, if armed.
    pub fn stop(&mut self) {
        if self.state == State::Armed {
            self.halt();
        }
    }

    /// True if an experiment may begin in this tick.
    #[inline]
    pub fn may_start(&self) -> bool {
        self.state == State::Armed
    }

    /// Follows a request, or counts it as refused, before the step of its tick.
    #[inline(always)]
    pub fn ask(&mut self, limits: &Limits, request: Request) {
        self.asked_tick = self.tick;
        self.renew(limits);
        match (request, self.state) {
            (Request::Arm, State::Idle) if !self.alarms.has(Alarms::UNWELL) => {
                self.state = State::Armed;
                self.torque_nm = 0.0;
                self.stopping = true;
                self.ticks_limited = 0;
                self.ticks_stuck = 0;
            }
            (Request::Disarm, State::Armed) => {
                self.state = State::Idle;
                self.held = Alarms::HELD;
            }
            (Request::Stop, State::Armed) => self.halt(),
            (Request::Start, State::Armed) => {
                self.stopping = false;
                self.held = Alarms::HELD.when(self.ticks_limited != 0);
            }
            (Request::ClearFault, State::Fault) => {
                self.state = State::Idle;
                self.fault = Fault::None;
                self.stopping = false;
                self.index = Index::default();
            }
            (Request::KeepAlive | Request::Disarm, _) | (Request::Stop, State::Idle) => {}
            _ => self.refused = self.refused.saturating_add(1),
        }
    }

    #[inline]
    fn halt(&mut self) {
        self.stopping = true;
        self.held = Alarms::HELD;
    }

    /// Takes the count at an index edge, before the step of its tick; false if counts were lost or made.
    #[inline]
    pub fn index_fits(&mut self, limits: &Limits, index: u32) -> bool {
        self.index.fits(limits, index)
    }

    /// One tick.
    #[inline]
    pub fn step(&mut self, limits: &Limits, seen: &Observation) -> Verdict {
        let (speed_rad_s, torque_nm) = (limits.speed_rad_s, limits.torque_nm);
        if let Some(verdict) = self.usual(limits, speed_rad_s, torque_nm, seen) {
            return verdict;
        }
        cold_path();
        self.unusual(limits, seen)
    }

    /// The tick as it nearly always is while torque flows: nothing is asked, nothing is wrong, nothing is limited. Else
    /// `None`, and [`Self::unusual`] is what remains to be done.
    ///
    /// The largest speed and torque that are usual are the limits, or less. What is looked at here is what [`Self::examine`] and [`Self::armed`] look at, in the order of what it costs.
    #[inline]
    pub(crate) fn usual(
        &mut self,
        limits: &Limits,
        usual_speed_rad_s: f32,
        usual_torque_nm: f32,
        seen: &Observation,
    ) -> Option<Verdict> {
        let tick = self.tick;
        if seen.alarms.and(self.held) != Alarms::default() || tick == self.due_tick {
            cold_path();
            return None;
        }
        let mut ticks_stuck = 0;
        if seen.step_counts == 0 {
            // A tick with a step is the longer one, and goes straight on.
            cold_path();
            if self.torque_nm.abs() >= limits.stuck_nm {
                ticks_stuck = self.ticks_stuck.wrapping_add(1);
                if ticks_stuck >= limits.stuck_ticks {
                    return None;
                }
            }
        }
        let torque_nm = seen.wanted_nm;
        // The difference is zero, or NaN where the deflection is not finite.
        #[expect(clippy::eq_op, reason = "NaN where it is not finite")]
        let nothing = seen.z_rad - seen.z_rad;
        let change_nm = torque_nm - self.torque_nm + nothing;
        // Written so that a NaN fails it.
        let usual = seen.velocity_rad_s.abs() <= usual_speed_rad_s
            && torque_nm.abs() <= usual_torque_nm
            && change_nm.abs() <= limits.slew_nm;
        if !usual {
            cold_path();
            return None;
        }
        self.ticks_stuck = ticks_stuck;
        self.tick = tick.wrapping_add(1);
        self.torque_nm = torque_nm;
        Some(Verdict {
            torque_nm,
            drive_enabled: true,
            limit: Limit::None,
            state: State::Armed,
            fault: Fault::None,
        })
    }

    /// Any tick: all the states, faults and limits.
    #[inline(always)]
    pub(crate) fn unusual(&mut self, limits: &Limits, seen: &Observation) -> Verdict {
        let (torque_nm, drive_enabled, limit) = self.decide(limits, seen);
        self.alarms = seen.alarms;
        self.tick = self.tick.wrapping_add(1);
        // Nothing limits the torque only if armed and not stopping.
        self.held = Alarms::HELD.when(limit != Limit::None);
        Verdict {
            torque_nm,
            drive_enabled,
            limit,
            state: self.state,
            fault: self.fault,
        }
    }

    /// Torque, whether the drive is enabled, and what limits the torque.
    #[inline(always)]
    fn decide(&mut self, limits: &Limits, seen: &Observation) -> (f32, bool, Limit) {
        if self.state == State::Boot {
            cold_path();
            self.index = Index::default();
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

    /// The most serious thing wrong in this tick.
    #[inline(always)]
    fn examine(&mut self, limits: &Limits, seen: &Observation) -> Fault {
        let armed = self.state == State::Armed;
        let stuck = armed && self.stuck(limits, seen.step_counts);
        // Finite only if all three are.
        if !(seen.wanted_nm + seen.velocity_rad_s + seen.z_rad).is_finite() {
            cold_path();
            return Fault::NotFinite;
        }
        // An unwell drive matters only if it may get torque.
        let ignored = Alarms::UNWELL.when(!armed);
        let alarms = seen.alarms.and(ignored);
        let overspeed = seen.velocity_rad_s.abs() > limits.speed_rad_s;
        if alarms != ignored || overspeed {
            cold_path();
            return if armed && alarms.has(Alarms::UNWELL) {
                Fault::DriveFault
            } else if alarms.has(Alarms::ILLEGAL) {
                Fault::EncoderIllegal
            } else if alarms.has(Alarms::INDEX) {
                Fault::IndexMismatch
            } else if alarms.has(Alarms::REJECTED) || overspeed {
                Fault::Overspeed
            } else if stuck {
                Fault::StuckEncoder
            } else {
                Fault::DeadlineMissed
            };
        }
        if !armed {
            return Fault::None;
        }
        if stuck {
            Fault::StuckEncoder
        } else if self.ticks_limited >= limits.limit_ticks {
            Fault::LimitTooLong
        } else if self.tick.wrapping_sub(self.asked_tick) >= limits.command_ticks {
            Fault::CommandTimeout
        } else {
            Fault::None
        }
    }

    /// Whether torque has been well above break-away for too long without a count.
    #[inline(always)]
    fn stuck(&mut self, limits: &Limits, step_counts: i32) -> bool {
        if step_counts == 0 && self.torque_nm.abs() >= limits.stuck_nm {
            self.ticks_stuck = self.ticks_stuck.saturating_add(1);
        } else {
            self.ticks_stuck = 0;
        }
        self.ticks_stuck >= limits.stuck_ticks
    }

    #[inline(always)]
    fn armed(&mut self, limits: &Limits, wanted_nm: f32) -> (f32, bool, Limit) {
        if self.stopping {
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
        (torque_nm, true, limit)
    }

    /// A step towards zero. A fault that has got there takes the drive away.
    #[inline(always)]
    fn ramp(&mut self, limits: &Limits) -> (f32, bool, Limit) {
        let torque_nm = self.torque_nm;
        if torque_nm > limits.ramp_nm {
            self.torque_nm = torque_nm - limits.ramp_nm;
        } else if torque_nm < -limits.ramp_nm {
            self.torque_nm = torque_nm + limits.ramp_nm;
        } else {
            self.torque_nm = 0.0;
            if self.state == State::Fault {
                self.stopping = false;
                return self.off();
            }
        }
        (self.torque_nm, true, Limit::Ramp)
    }

    #[inline(always)]
    fn off(&mut self) -> (f32, bool, Limit) {
        self.torque_nm = 0.0;
        (0.0, false, Limit::Disarmed)
    }
}

#[cfg(test)]
mod tests;
