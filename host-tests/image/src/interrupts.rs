//! The nested vectored interrupt controller: enable, pending, active, priority, masks.

/// Exceptions up to 15, then interrupts.
pub const COUNT: usize = 16 + 112;
/// Bits of priority that the chip implements.
const PRIORITY_MASK: u8 = 0xf0;

/// Pendable exceptions other than interrupts.
pub const PENDSV: usize = 14;
/// See [`PENDSV`].
pub const SYSTICK: usize = 15;
/// See [`PENDSV`].
pub const SVCALL: usize = 11;

/// State of every exception.
#[derive(Clone, Debug)]
pub struct Interrupts {
    enabled: [bool; COUNT],
    pending: [bool; COUNT],
    active: [bool; COUNT],
    priority: [u8; COUNT],
    any_pending: bool,
}

impl Default for Interrupts {
    fn default() -> Self {
        let mut enabled = [false; COUNT];
        enabled[..16].fill(true);
        Self {
            enabled,
            pending: [false; COUNT],
            active: [false; COUNT],
            priority: [0; COUNT],
            any_pending: false,
        }
    }
}

impl Interrupts {
    /// Makes an exception pending.
    pub fn pend(&mut self, exception: usize) {
        self.pending[exception] = true;
        self.any_pending = true;
    }

    /// Takes a line that is high at a level: pending unless its handler runs.
    pub fn line(&mut self, interrupt: usize, high: bool) {
        if high && !self.active[16 + interrupt] {
            self.pend(16 + interrupt);
        }
    }

    /// Priority of what runs: lower is more urgent.
    fn running(&self) -> u16 {
        let active = (0..COUNT).filter(|&i| self.active[i]);
        active
            .map(|i| u16::from(self.priority[i]))
            .min()
            .unwrap_or(0x100)
    }

    /// The exception that would run next if nothing were masked.
    pub fn next(&self) -> Option<usize> {
        if !self.any_pending {
            return None;
        }
        let running = self.running();
        (0..COUNT)
            .filter(|&i| self.pending[i] && self.enabled[i])
            .filter(|&i| u16::from(self.priority[i]) < running)
            .min_by_key(|&i| (self.priority[i], i))
    }

    /// Whether the masks let an exception in.
    pub fn allowed(&self, exception: usize, primask: bool, basepri: u8) -> bool {
        let basepri = basepri & PRIORITY_MASK;
        !primask && (basepri == 0 || self.priority[exception] < basepri)
    }

    /// Whether anything enabled is pending, which ends a sleep.
    pub fn wakes(&self) -> bool {
        self.any_pending && (0..COUNT).any(|i| self.pending[i] && self.enabled[i])
    }

    /// An exception starts.
    pub fn enter(&mut self, exception: usize) {
        self.pending[exception] = false;
        self.active[exception] = true;
        self.any_pending = self.pending.contains(&true);
    }

    /// An exception ends.
    pub fn leave(&mut self, exception: usize) {
        self.active[exception] = false;
    }

    /// A read at an offset from 0xe000e100, of a word.
    pub fn read(&self, offset: u32) -> Option<u32> {
        let index = (offset & 0x7f) as usize / 4;
        Some(match offset {
            0x000..0x010 | 0x080..0x090 => word(&self.enabled, index),
            0x100..0x110 | 0x180..0x190 => word(&self.pending, index),
            0x200..0x210 => word(&self.active, index),
            0x300..0x370 => {
                let at = 16 + (offset - 0x300) as usize;
                u32::from_le_bytes(std::array::from_fn(|i| self.priority[at + i]))
            }
            _ => return None,
        })
    }

    /// A write at an offset from 0xe000e100: a word, or bytes of a priority word. False where there is no register.
    pub fn write(&mut self, offset: u32, size: usize, value: u32) -> bool {
        let index = (offset & 0x7f) as usize / 4;
        let bits = (0..32).filter(|b| value >> b & 1 == 1);
        let which = bits.map(|b| 16 + 32 * index + b).filter(|&i| i < COUNT);
        match offset {
            0x000..0x010 => which.for_each(|i| self.enabled[i] = true),
            0x080..0x090 => which.for_each(|i| self.enabled[i] = false),
            0x100..0x110 => which.for_each(|i| self.pend(i)),
            0x180..0x190 => which.for_each(|i| self.pending[i] = false),
            0x300..0x370 => {
                let at = 16 + (offset - 0x300) as usize;
                for (i, byte) in value.to_le_bytes().into_iter().take(size).enumerate() {
                    self.priority[at + i] = byte & PRIORITY_MASK;
                }
            }
            _ => return false,
        }
        true
    }

    /// Priorities of exceptions 4 to 15, a word at a time: SHPR1 to SHPR3.
    pub fn system_priority(&self, index: usize) -> u32 {
        u32::from_le_bytes(std::array::from_fn(|i| self.priority[4 + 4 * index + i]))
    }

    /// See [`Self::system_priority`].
    pub fn set_system_priority(&mut self, first: usize, size: usize, value: u32) {
        for (i, byte) in value.to_le_bytes().into_iter().take(size).enumerate() {
            self.priority[4 + first + i] = byte & PRIORITY_MASK;
        }
    }
}

fn word(flags: &[bool; COUNT], index: usize) -> u32 {
    let bits = flags[16..].iter().skip(32 * index).take(32);
    bits.enumerate().map(|(i, &f)| u32::from(f) << i).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn urgent_first_and_masks() {
        let mut nvic = Interrupts::default();
        // Interrupts 24 and 55 enabled, 24 at priority 8.
        nvic.write(0x000, 4, 1 << 24);
        nvic.write(0x004, 4, 1 << 23);
        nvic.write(0x300 + 24, 1, 0x80);
        nvic.line(24, true);
        nvic.line(55, true);
        assert_eq!(nvic.next(), Some(16 + 55));
        assert!(nvic.allowed(16 + 55, false, 0x10) && !nvic.allowed(16 + 24, false, 0x10));
        assert!(!nvic.allowed(16 + 55, true, 0));
        nvic.enter(16 + 55);
        assert_eq!(nvic.next(), None);
        nvic.leave(16 + 55);
        assert_eq!(nvic.next(), Some(16 + 24));
    }
}
