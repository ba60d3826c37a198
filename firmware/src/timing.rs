//! Every clock and timing constant, with its reason.

/// Core clock, Hz: the highest the chip has, in range-1 boost mode. 24 MHz crystal / 6 * 85 / 2.
pub const CORE_HZ: u32 = 170_000_000;

/// Crystal of the NUCLEO-G474RE (X3), Hz. The internal oscillator is off by up to 1 %, and so would every velocity be.
pub const CRYSTAL_HZ: u32 = 24_000_000;

/// Rate of the control tick, Hz: the observers' design rate, and 17,000 core cycles exactly.
pub const TICK_HZ: u32 = 10_000;

/// Core cycles of a tick. TIM7 runs from the core clock, so this is also its period.
pub const TICK_CYCLES: u32 = CORE_HZ / TICK_HZ;
const _: () = assert!(TICK_CYCLES * TICK_HZ == CORE_HZ);

/// s
pub const TICK_S: f32 = 1.0 / TICK_HZ as f32;

/// Cycles from the timer's update to the entry of the handler above which the tick counts as late: 5 us. The entry takes 12
/// cycles plus the flash wait of the vector, and nothing masks the interrupt. Only the tick before can hold it up, so
/// that one which is still running when this one is due shows here too.
pub const LATE_CYCLES: u32 = TICK_CYCLES / 20;

/// Cycles between two entries above which a tick was lost.
pub const LOST_CYCLES: u32 = TICK_CYCLES * 3 / 2;

/// Samples that the converter puts a reference out after it was computed: the timer that starts the tick also starts
/// the conversion, of the value written during the tick before.
pub const OUTPUT_DELAY_SAMPLES: usize = 1;

/// Ticks between two wake-ups of the low-priority tasks: a millisecond. A batch of the trace is what comes together in
/// it, and the shortest answer time to a command.
pub const TICKS_PER_WAKE: u32 = TICK_HZ / 1000;
const _: () = assert!(TICKS_PER_WAKE >= 2);

/// Ticks between two lines of the readable trace: 20 lines a second are as many as one can read.
pub const TICKS_PER_LINE: u32 = TICK_HZ / 20;

/// Ticks between two status frames.
pub const TICKS_PER_STATUS: u32 = TICK_HZ / 10;

/// Reload value of the independent watchdog at LSI/4 = 8 kHz: 20 ms, 19 to 22 ms over the tolerance of the LSI
/// oscillator (29.5 to 34 kHz). Long enough for the twentyfold of a wake-up, short enough that an axis at 0.1 N m does
/// not get far.
pub const WATCHDOG_RELOAD: u16 = 160;

/// Bits of priority that the chip implements.
pub const PRIORITY_BITS: u8 = 4;

/// The control tick; nothing else has it, and nothing masks it.
pub const PRIORITY_TICK: u8 = 0;

/// What a critical section masks, and everything below it.
pub const PRIORITY_HIGHEST_MASKED: u8 = 1;

/// The spare interrupt that wakes the tasks, and all of embassy's.
pub const PRIORITY_TASKS: u8 = 8;

/// Samples that the queue out of the handler holds: 51 ms, twice the longest that the spare interrupt could be held up
/// before the watchdog ends it. A power of two.
pub const QUEUE_SAMPLES: usize = 512;

/// Orders and parameters that the queue into the handler holds; it takes one a tick, the host sends at most some in a
/// millisecond.
pub const QUEUE_NEWS: usize = 8;

/// Periods of the torque PWM in a tick, with the `pwm` feature: 40 kHz, above hearing and far above the drive's filter.
pub const PWM_PER_TICK: u32 = 4;

/// Core cycles of a PWM period.
pub const PWM_CYCLES: u32 = TICK_CYCLES / PWM_PER_TICK;
const _: () = assert!(PWM_CYCLES * PWM_PER_TICK == TICK_CYCLES);
