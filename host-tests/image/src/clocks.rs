//! Reset and clock control: an oscillator is ready as soon as it is switched on, and the clock switch follows at once.

/// A register of RCC that answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Register {
    /// Oscillators and PLL.
    Cr,
    /// Clock switch.
    Cfgr,
    /// Low-speed external oscillator.
    Bdcr,
    /// Low-speed internal oscillator, and the cause of the last reset.
    Csr,
    /// 48 MHz oscillator.
    Crrcr,
}

/// Cause of a reset, as a bit of CSR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Power came on.
    Power = 1 << 27,
    /// Software asked.
    Software = 1 << 28,
    /// The independent watchdog ran out.
    Watchdog = 1 << 29,
}

/// RMVF: clears the causes.
const CLEAR_CAUSES: u32 = 1 << 23;
const CAUSES: u32 = 0xff << 24;

/// What a register holds after a write.
pub fn written(register: Register, before: u32, value: u32) -> u32 {
    match register {
        // HSION 8, HSEON 16, PLLON 24, each with its ready bit: HSI 10, HSE 17, PLL 25.
        Register::Cr => {
            let bit = |from: u32, to: u32| (value >> from & 1) << to;
            let ready = 1 << 10 | 1 << 17 | 1 << 25;
            value & !ready | bit(8, 10) | bit(16, 17) | bit(24, 25)
        }
        // SW to SWS.
        Register::Cfgr => value & !0b1100 | (value & 0b11) << 2,
        Register::Bdcr | Register::Crrcr => value & !2 | (value & 1) << 1,
        Register::Csr => {
            let causes = if value & CLEAR_CAUSES != 0 {
                0
            } else {
                before & CAUSES
            };
            value & !(CAUSES | CLEAR_CAUSES | 2) | (value & 1) << 1 | causes
        }
    }
}
