//! The independent watchdog.

/// A register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// Keys: start, feed, unlock.
    Kr,
    /// Prescaler.
    Pr,
    /// Reload.
    Rlr,
    /// Updates under way; here they are at once.
    Sr,
    /// Window; only the reset value, which is none, is modelled.
    Winr,
}

/// Its clock, Hz: the nominal LSI.
const LSI_HZ: u64 = 32_000;
/// The core clock, Hz, that this emulator counts in.
const CORE_HZ: u64 = 170_000_000;

/// The watchdog.
#[derive(Clone, Debug)]
pub struct Watchdog {
    prescaler: u32,
    reload: u32,
    running: bool,
    fed_at: u64,
    feeds: u64,
}

impl Default for Watchdog {
    fn default() -> Self {
        Self {
            prescaler: 0,
            reload: 0xfff,
            running: false,
            fed_at: 0,
            feeds: 0,
        }
    }
}

impl Watchdog {
    /// Cycle at which it resets the chip.
    pub fn expires(&self) -> Option<u64> {
        let counts = u64::from(self.reload) + 1;
        let divider = 4_u64 << self.prescaler.min(6);
        self.running
            .then(|| self.fed_at + counts * divider * CORE_HZ / LSI_HZ)
    }

    /// How often it was fed.
    pub fn feeds(&self) -> u64 {
        self.feeds
    }

    /// A read.
    pub fn read(&self, register: Register) -> u32 {
        match register {
            Register::Pr => self.prescaler,
            Register::Rlr => self.reload,
            Register::Winr => 0xfff,
            Register::Kr | Register::Sr => 0,
        }
    }

    /// A write.
    pub fn write(&mut self, register: Register, value: u32, now: u64) {
        match (register, value) {
            (Register::Kr, 0xcccc) => {
                self.running = true;
                self.fed_at = now;
            }
            (Register::Kr, 0xaaaa) => {
                self.fed_at = now;
                self.feeds += 1;
            }
            (Register::Pr, _) => self.prescaler = value & 7,
            (Register::Rlr, _) => self.reload = value & 0xfff,
            _ => {}
        }
    }
}
