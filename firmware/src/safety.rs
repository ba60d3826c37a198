//! What holds when other things fail: the watchdog, and what a panic or a fault of the core does to the drive.

use core::cell::Cell;
use core::panic::PanicInfo;
use core::sync::atomic::Ordering;

use cortex_m_rt::{ExceptionFrame, exception};
use critical_section::Mutex;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::{IWDG, RCC};

use crate::{board, exchange, output, timing};

/// True if the last reset was the watchdog's; forgets it.
pub fn take_watchdog_reset() -> bool {
    let was = RCC.csr().read().iwdgrstf();
    RCC.csr().modify(|w| w.set_rmvf(true));
    was
}

/// Starts the watchdog. It goes on while a debugger halts the core: a halted core holds the last torque, which the
/// reset takes away.
pub fn start_watchdog() {
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    IWDG.rlr().write(|w| w.set_rl(timing::WATCHDOG_RELOAD));
    while IWDG.sr().read().0 != 0 {}
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}

static TICKS_FED: Mutex<Cell<u32>> = Mutex::new(Cell::new(0));

/// Feeds the watchdog if the tick has advanced. Called by the interrupt that the tick pends.
pub fn feed_watchdog() {
    let ticks = exchange::SHARED.stats.ticks.load(Ordering::Relaxed);
    let before = critical_section::with(|cs| TICKS_FED.borrow(cs).replace(ticks));
    if ticks != before {
        IWDG.kr().write(|w| w.set_key(Key::RESET));
    }
}

/// No torque, no drive.
fn let_go() {
    board::set_drive_enable(false);
    output::write(output::CODE_SPAN / 2);
}

/// Waits for the watchdog, which reports at the next boot.
fn wait_for_reset() -> ! {
    loop {
        cortex_m::asm::nop();
    }
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    let_go();
    if let Some(place) = info.location() {
        defmt::error!("panic at {=str}:{=u32}", place.file(), place.line());
    }
    wait_for_reset()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    let_go();
    let _ = frame;
    wait_for_reset()
}

#[exception]
unsafe fn DefaultHandler(_number: i16) {
    let_go();
    wait_for_reset()
}
