//! A counting timer: prescaler, reload, compare channels, flags. Counts up only; that is all the image uses.

/// Index of TIM7, the tick.
pub const TICK: usize = 0;
/// Index of TIM15, which a time driver may use.
pub const TIME: usize = 1;

/// Bits of SR and DIER: update, and compare 1 to 4.
const UPDATE: u32 = 1;
const CEN: u32 = 1;
const OPM: u32 = 1 << 3;

/// A register of a timer that does something; all others are plain words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// Control 1.
    Cr1,
    /// Interrupt enable.
    Dier,
    /// Flags; a zero written clears.
    Sr,
    /// Event generation.
    Egr,
    /// Counter.
    Cnt,
    /// Prescaler.
    Psc,
    /// Reload.
    Arr,
    /// Compare value.
    Ccr(usize),
}

/// A timer whose clock is the core clock.
#[derive(Clone, Debug)]
pub struct Timer {
    cr1: u32,
    dier: u32,
    sr: u32,
    psc: u32,
    arr: u32,
    ccr: [u32; 4],
    /// Count at cycle `since`.
    count: u32,
    since: u64,
    updates: u64,
}

impl Default for Timer {
    fn default() -> Self {
        Self {
            cr1: 0,
            dier: 0,
            sr: 0,
            psc: 0,
            arr: 0xffff,
            ccr: [0; 4],
            count: 0,
            since: 0,
            updates: 0,
        }
    }
}

impl Timer {
    fn runs(&self) -> bool {
        self.cr1 & CEN != 0
    }

    fn step_cycles(&self) -> u64 {
        u64::from(self.psc) + 1
    }

    fn period(&self) -> u64 {
        u64::from(self.arr) + 1
    }

    /// Count at a cycle that is not after the next update.
    pub fn count(&self, now: u64) -> u32 {
        if !self.runs() {
            return self.count;
        }
        let steps = (now - self.since) / self.step_cycles();
        ((u64::from(self.count) + steps) % self.period()) as u32
    }

    /// Cycle at which the count next becomes a value, after `now`.
    fn reaches(&self, value: u32, now: u64) -> Option<u64> {
        if !self.runs() || value > self.arr {
            return None;
        }
        let ahead = (u64::from(value) + self.period() - u64::from(self.count(now))) % self.period();
        let ahead = if ahead == 0 { self.period() } else { ahead };
        let done = (now - self.since) / self.step_cycles();
        Some(self.since + (done + ahead) * self.step_cycles())
    }

    /// The next cycle after `now` at which a flag rises.
    pub fn next_event(&self, now: u64) -> Option<u64> {
        let update = self.reaches(0, now);
        // A compare value matters only where its interrupt is enabled; software that polls one is not modelled.
        let compare = (0..4)
            .filter(|i| self.dier >> (i + 1) & 1 == 1)
            .filter_map(|i| self.reaches(self.ccr[i], now));
        compare.chain(update).min()
    }

    /// Raises the flags of the events at exactly this cycle; true for an update.
    pub fn fire(&mut self, at: u64) -> bool {
        if !self.runs() || at == self.since {
            return false;
        }
        let before = at - 1;
        let mut updated = false;
        for i in 0..4 {
            if self.reaches(self.ccr[i], before) == Some(at) {
                self.sr |= 2 << i;
            }
        }
        if self.reaches(0, before) == Some(at) {
            updated = true;
            self.updates += 1;
            self.sr |= UPDATE;
            self.count = 0;
            self.since = at;
            if self.cr1 & OPM != 0 {
                self.cr1 &= !CEN;
            }
        }
        updated
    }

    /// Its interrupt line.
    pub fn line(&self) -> bool {
        self.sr & self.dier & 0x1f != 0
    }

    /// Updates since the start.
    pub fn updates(&self) -> u64 {
        self.updates
    }

    /// A read.
    pub fn read(&self, register: Register, now: u64) -> u32 {
        match register {
            Register::Cr1 => self.cr1,
            Register::Dier => self.dier,
            Register::Sr => self.sr,
            Register::Egr => 0,
            Register::Cnt => self.count(now),
            Register::Psc => self.psc,
            Register::Arr => self.arr,
            Register::Ccr(i) => self.ccr[i],
        }
    }

    /// A write.
    pub fn write(&mut self, register: Register, value: u32, now: u64) {
        // What the count was up to here went by the old settings. A clock that only has its flags cleared keeps the
        // fraction of a step that its prescaler holds.
        if !matches!(register, Register::Sr | Register::Dier | Register::Ccr(_)) {
            self.count = self.count(now);
            self.since = now;
        }
        match register {
            Register::Cr1 => self.cr1 = value,
            Register::Dier => self.dier = value,
            Register::Sr => self.sr &= value,
            Register::Egr => {
                if value & UPDATE != 0 {
                    self.count = 0;
                    // URS: a software update raises no flag.
                    if self.cr1 & 4 == 0 {
                        self.sr |= UPDATE;
                    }
                }
                self.sr |= value & 0x1e;
            }
            Register::Cnt => self.count = value & self.arr,
            Register::Psc => self.psc = value & 0xffff,
            Register::Arr => self.arr = value & 0xffff,
            Register::Ccr(i) => self.ccr[i] = value & 0xffff,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn updates_every_period_and_raises_its_line() {
        let mut timer = Timer::default();
        timer.write(Register::Arr, 16_999, 100);
        timer.write(Register::Dier, 1, 100);
        timer.write(Register::Cr1, 1, 100);
        assert_eq!(timer.next_event(100), Some(17_100));
        assert!(timer.fire(17_100) && timer.line());
        assert_eq!(timer.count(17_400), 300);
        timer.write(Register::Sr, !1, 17_400);
        assert!(!timer.line());
        assert_eq!(timer.next_event(17_400), Some(34_100));
    }

    #[test]
    fn compares_with_a_prescaler() {
        let mut timer = Timer::default();
        timer.write(Register::Psc, 169, 0);
        timer.write(Register::Cr1, 1, 0);
        timer.write(Register::Ccr(1), 50, 0);
        timer.write(Register::Dier, 4, 0);
        assert_eq!(timer.next_event(0), Some(50 * 170));
        assert!(!timer.fire(50 * 170));
        assert!(timer.line());
    }
}
