//! The sources of core as modules of a program that calls their unit tests one after the other. A test that fails
//! panics, which ends the run. The build script writes the modules and the list of tests.
#![no_std]
#![no_main]
#![allow(dead_code, unused_imports)]

extern crate std_on_target as std;

include!(concat!(env!("OUT_DIR"), "/core/modules.rs"));

use core::ptr::addr_of_mut;
use cortex_m_semihosting::{debug, hprintln};
use embedded_alloc::LlffHeap;
use panic_semihosting as _;

#[global_allocator]
static HEAP: LlffHeap = LlffHeap::empty();

const HEAP_BYTES: usize = 2 * 1024 * 1024;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut SPACE: [u8; HEAP_BYTES] = [0; HEAP_BYTES];
    // SAFETY: once, before anything is allocated, and nothing else uses the space.
    unsafe { HEAP.init(addr_of_mut!(*SPACE) as usize, HEAP_BYTES) }
    for (name, test) in TESTS {
        // Before it runs, so that the name is known if it fails.
        hprintln!("{}", name);
        test();
    }
    hprintln!("end, {} tests passed", TESTS.len());
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::nop();
    }
}
