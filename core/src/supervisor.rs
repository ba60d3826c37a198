//! Boot, idle, armed, fault: what may reach the drive, and why it may not. Pure; one step a tick.
//!
//! Outside of armed the torque is zero and the drive disabled, but for one case: after a command time-out the torque
//! goes to zero by a ramp, with the drive enabled until it is there. Every other fault takes torque and drive away in
//! the tick that sees it. A fault stays, with the number of the first one, until it is cleared and its cause is gone.

use core::hint::cold_path;

mod codes;
mod index;
mod limits;
mod seen;

pub(crate) use codes::codes;
pub use codes::{Fault, Limit, State};
pub use limits::Limits;
pub(crate) use seen::Usual;
pub use seen::{Alarms, Observation};

use index::Index;

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

    /// Finds the next tick that its number makes unusual: with new limits, after a request, and at such a tick. That may be
    /// this one if the host has been silent for too long. A watched tick comes after this one, which has been looked at.
    #[inline]
    pub(crate) fn renew(&mut self, limits: &Limits) {
        let silent = self.tick.wrapping_sub(self.asked_tick);
        let unwatched = self.watched_tick.wrapping_sub(self.tick).wrapping_sub(1);
        let left = limits
            .command_ticks
            .saturating_sub(silent)
            .min(unwatched.saturating_add(1));
        self.due_tick = self.tick.wrapping_add(left);
    }

    /// The number of this tick is one to look at.
    #[inline(always)]
    pub(crate) fn is_due(&self) -> bool {
        self.tick == self.due_tick
    }

    /// For a tick that is due: makes it an unusual one if the host has been silent for too long, otherwise finds the next
    /// one.
    #[inline(always)]
    pub(crate) fn time_out(&mut self, limits: &Limits) {
        self.renew(limits);
        if self.is_due() {
            self.held = Alarms::HELD;
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
                self.held = Alarms::HELD.when(self.ticks_limited >= limits.limit_ticks);
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

    /// After the tick in which a stop has brought the torque to zero: as long as no torque is asked for, the next ones are
    /// usual, up to the time-out's.
    #[inline(always)]
    pub(crate) fn rest(&mut self) {
        self.held = Alarms::default();
    }

    /// Ends a [`Self::rest`], if there is one: the next tick is an unusual one.
    #[inline(always)]
    pub(crate) fn rest_no_more(&mut self) {
        if self.stopping {
            self.hold();
        }
    }

    /// The next tick is an unusual one.
    #[inline(always)]
    pub(crate) fn hold(&mut self) {
        self.held = Alarms::HELD;
    }

    #[inline(always)]
    fn is_limited_too_long(&self, limits: &Limits) -> bool {
        self.ticks_limited >= limits.limit_ticks
    }

    #[inline(always)]
    fn is_silent_too_long(&self, limits: &Limits) -> bool {
        self.tick.wrapping_sub(self.asked_tick) >= limits.command_ticks
    }

    /// Whether anything speaks against a tick, or makes it an unusual one before its step.
    #[inline(always)]
    pub(crate) fn is_held_or(&self, alarms: Alarms) -> bool {
        alarms.and(self.held) != Alarms::default()
    }

    /// Before the step of a tick that [`Self::is_held_or`] has found: whether an experiment that plays ends in it by a
    /// fault, as far as that is known.
    #[inline(always)]
    pub(crate) fn is_against(&self, limits: &Limits, alarms: Alarms) -> bool {
        alarms != Alarms::default()
            || self.is_limited_too_long(limits)
            || self.is_silent_too_long(limits)
    }

    /// Takes the count at an index edge, before the step of its tick; false if counts were lost or made.
    #[inline]
    pub fn index_fits(&mut self, limits: &Limits, index: u32) -> bool {
        self.index.fits(limits, index)
    }

    /// One tick.
    #[inline]
    pub fn step(&mut self, limits: &Limits, seen: &Observation) -> Verdict {
        if self.is_due() {
            self.time_out(limits);
        }
        let usual = Usual {
            speed_rad_s: limits.speed_rad_s,
            torque_nm: limits.torque_nm,
        };
        if !self.is_held_or(seen.alarms)
            && let Some(verdict) = self.usual(limits, &usual, seen, |_| false)
        {
            return verdict;
        }
        cold_path();
        self.unusual(limits, seen)
    }

    /// A tick that [`Self::is_held_or`] has not found, as it nearly always is: nothing is wrong. Else `None`, and
    /// [`Self::unusual`] is what remains to be done. `may_be_limited` says it of a torque or slew beyond its limit.
    ///
    /// What is looked at here is what [`Self::examine`] and [`Self::armed`] look at, in the order of what it costs.
    #[inline]
    pub(crate) fn usual(
        &mut self,
        limits: &Limits,
        usual: &Usual,
        seen: &Observation,
        may_be_limited: impl FnOnce(f32) -> bool,
    ) -> Option<Verdict> {
        let mut ticks_stuck = 0;
        if seen.step_counts == 0 {
            // A tick with a step is the longer one, and goes straight on.
            cold_path();
            if seen.alarms.has(Alarms::REJECTED) {
                return None;
            }
            if self.torque_nm.abs() >= limits.stuck_nm {
                ticks_stuck = self.ticks_stuck.wrapping_add(1);
                if ticks_stuck >= limits.stuck_ticks {
                    return None;
                }
            }
        }
        let mut torque_nm = seen.wanted_nm;
        // The difference is zero, or NaN where the deflection is not finite.
        #[expect(clippy::eq_op, reason = "NaN where it is not finite")]
        let nothing = seen.z_rad - seen.z_rad;
        // Written so that a NaN fails it, as the next one.
        let slow = seen.velocity_rad_s.abs() + nothing <= usual.speed_rad_s;
        if !slow {
            cold_path();
            return None;
        }
        let mut limit = Limit::None;
        let mut ticks_limited = 0;
        let free = torque_nm.abs() <= usual.torque_nm
            && (torque_nm - self.torque_nm).abs() <= limits.slew_nm;
        if !free {
            cold_path();
            if !may_be_limited(torque_nm) {
                return None;
            }
            (torque_nm, limit) = self.limited(limits, torque_nm);
            ticks_limited = self.ticks_limited.wrapping_add(1);
            self.held = Alarms::HELD.when(ticks_limited >= limits.limit_ticks);
        }
        self.ticks_limited = ticks_limited;
        self.ticks_stuck = ticks_stuck;
        self.tick = self.tick.wrapping_add(1);
        self.torque_nm = torque_nm;
        Some(Verdict {
            torque_nm,
            drive_enabled: true,
            limit,
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
        // Of the limits these two do not hold only if armed and not stopping.
        let limited = matches!(limit, Limit::None | Limit::Torque | Limit::Slew);
        self.held = Alarms::HELD.when(!limited || self.ticks_limited >= limits.limit_ticks);
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
        let fault = if self.state == State::Armed {
            self.examine_armed(limits, seen)
        } else {
            self.examine(limits, seen)
        };
        if fault != Fault::None {
            cold_path();
            if self.state != State::Fault {
                self.state = State::Fault;
                self.fault = fault;
                self.stopping = fault == Fault::CommandTimeout;
            } else {
                // Something worse than the time-out that is being ramped down.
                self.stopping = false;
            }
        }
        match self.state {
            State::Armed => self.armed(limits, seen.wanted_nm),
            State::Fault if self.stopping => self.ramp(limits),
            _ => self.off(),
        }
    }

    /// The most serious thing wrong in a tick while torque may flow.
    #[inline(always)]
    fn examine_armed(&mut self, limits: &Limits, seen: &Observation) -> Fault {
        let stuck = self.stuck(limits, seen.step_counts);
        // Written so that what is not finite fails it.
        let slow = seen.velocity_rad_s.abs() + seen.nothing() <= limits.speed_rad_s;
        if seen.alarms != Alarms::default() || !slow {
            cold_path();
            if seen.is_finite() && seen.alarms.has(Alarms::UNWELL) {
                return Fault::DriveFault;
            }
            let fault = self.examine(limits, seen);
            if fault != Fault::None {
                return fault;
            }
        }
        if stuck {
            cold_path();
            Fault::StuckEncoder
        } else if !self.stopping && self.is_limited_too_long(limits) {
            cold_path();
            Fault::LimitTooLong
        } else if self.is_silent_too_long(limits) {
            cold_path();
            Fault::CommandTimeout
        } else {
            Fault::None
        }
    }

    /// The most serious thing wrong in this tick whether or not torque may flow. An unwell drive is not among them.
    #[inline(always)]
    fn examine(&self, limits: &Limits, seen: &Observation) -> Fault {
        if !seen.is_finite() {
            cold_path();
            return Fault::NotFinite;
        }
        let overspeed = seen.velocity_rad_s.abs() > limits.speed_rad_s;
        let alarms = seen.alarms.without(Alarms::UNWELL);
        if alarms == Alarms::default() && !overspeed {
            return Fault::None;
        }
        cold_path();
        if alarms.has(Alarms::ILLEGAL) {
            Fault::EncoderIllegal
        } else if alarms.has(Alarms::INDEX) {
            Fault::IndexMismatch
        } else if alarms.has(Alarms::REJECTED) || overspeed {
            Fault::Overspeed
        } else {
            Fault::DeadlineMissed
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
        let (torque_nm, limit) = self.limited(limits, wanted_nm);
        self.ticks_limited = if limit == Limit::None {
            0
        } else {
            self.ticks_limited.saturating_add(1)
        };
        self.torque_nm = torque_nm;
        (torque_nm, true, limit)
    }

    /// The torque that may be put out in place of one that is asked for, and what limits it.
    #[inline(always)]
    fn limited(&self, limits: &Limits, wanted_nm: f32) -> (f32, Limit) {
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
        (torque_nm, limit)
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
