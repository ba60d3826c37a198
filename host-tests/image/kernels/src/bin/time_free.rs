//! The time-free observer alone, for the comparison with the C program of it: as there, nothing else in the program
//! calls it, and the compiler is free to do with that what it can.
#![no_std]
#![no_main]

use bristle_core::observer::{TimeFree, time_free};
use bristle_core::parameters::BENCH;
use bristle_core::stribeck::Table;
use core::hint::black_box;
use core::ptr::addr_of_mut;
use panic_halt as _;

struct Program {
    observer: TimeFree<f32, Table<f32>>,
    state: time_free::State<f32>,
}

static mut PROGRAM: Option<Program> = None;

/// Fills the parameters; 1 if all went well.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_setup() -> u32 {
    let program = BENCH.build(1e-4, 1).ok().map(|config| Program {
        observer: config.tick.time_free(),
        state: time_free::State::default(),
    });
    let well = program.is_some();
    // SAFETY: one thread of execution.
    unsafe { *addr_of_mut!(PROGRAM) = program };
    u32::from(well)
}

/// Step in counts, velocity; numbers travel as their bits in core registers.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_time_free(step: u32, velocity: u32) -> u32 {
    // SAFETY: one thread of execution; `kernel_setup` has filled it.
    let program = unsafe { (*addr_of_mut!(PROGRAM)).as_mut().unwrap_unchecked() };
    let state = &mut program.state;
    let velocity = f32::from_bits(velocity);
    let z = program.observer.step(state, step.cast_signed(), velocity);
    z.to_bits()
}

#[cortex_m_rt::entry]
fn main() -> ! {
    // Keeps the linker from dropping what nobody calls.
    black_box(kernel_setup());
    black_box(black_box(
        kernel_time_free as extern "C" fn(u32, u32) -> u32,
    )(0, 0));
    loop {
        core::hint::spin_loop();
    }
}
