//! Image in the loop: the firmware's ELF runs from reset in an emulated Cortex-M4, its registers are models, and the
//! virtual axis stands behind its encoder and its converter.
//!
//! Time is counted in estimated processor cycles: each instruction costs what the Cortex-M4 manual says for its class
//! without flash wait states (see [`cycles`]). Instruction counts are exact and repeat; an instruction whose condition
//! fails counts, as it takes its cycle. Cycles are estimates.

pub mod against_c;
pub mod axis;
pub mod budget;
pub mod bus;
pub mod clocks;
pub mod cost;
pub mod cycles;
pub mod elf;
pub mod exceptions;
pub mod handler;
pub mod host;
pub mod interrupts;
pub mod machine;
pub mod names;
pub mod pins;
pub mod registers;
pub mod rtt;
pub mod timer;
pub mod watchdog;

pub use elf::Image;
pub use machine::{Machine, Stop};
