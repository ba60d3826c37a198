//! Runs the cases and prints a sum of each stretch of results; the host's test reads them.
#![no_std]
#![no_main]

mod cases;

use cases::{STRETCH, Sums};
use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    let mut sums = Sums::default();
    cases::all(&mut |case, bits| {
        if let Some((case, stretch, sum)) = sums.take(case, bits) {
            hprintln!("{} {} {:08x}", case, stretch, sum);
        }
    });
    if let Some((case, stretch, sum)) = sums.end() {
        hprintln!("{} {} {:08x}", case, stretch, sum);
    }
    hprintln!("end, {} results to a sum", STRETCH);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::nop();
    }
}
