//! Bristle on the NUCLEO-G474RE.
#![no_std]
#![no_main]

mod board;
mod ccm;
mod critical;
mod log;
mod output;
mod rtt;
mod tick;
mod timing;

use core::sync::atomic::Ordering;
use embassy_executor::Spawner;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use panic_probe as _;

static WAKE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// The spare interrupt that the tick pends.
#[unsafe(no_mangle)]
unsafe extern "C" fn FMAC() {
    WAKE.signal(());
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let channels = rtt::init();
    log::init(channels.log);
    // SAFETY: nothing in CCM runs yet.
    unsafe { ccm::init() };
    let p = embassy_stm32::init(board::clocks());
    board::init(p);
    defmt::info!("bristle");
    // SAFETY: all set up.
    unsafe { board::start_ticks() };
    loop {
        WAKE.wait().await;
        let n = tick::TICKS.load(Ordering::Relaxed);
        if n.is_multiple_of(timing::TICKS_PER_LINE) {
            defmt::info!("tick {}", n);
        }
    }
}
