//! Bristle on the NUCLEO-G474RE.
//!
//! Three levels, each of which only interrupts those below it:
//!
//! 1. the control tick, TIM7 at priority 0: encoder, observers, control, supervisor, output; and right after it, as an
//!    interrupt (CORDIC's) of the same priority, what the next tick finds done: orders, parameters, its reference;
//! 2. the spare interrupt (FMAC's), pended by the tick every millisecond: watchdog, trace;
//! 3. the executor's thread: commands.
#![no_std]
#![no_main]

mod board;
mod burst;
mod ccm;
mod command;
mod critical;
mod exchange;
mod link;
mod log;
mod output;
mod ring;
mod rtt;
mod safety;
mod tick;
mod timing;
mod trace;

use bristle_core::controller::Controller;
use bristle_core::parameters::BENCH;
use embassy_executor::Spawner;

/// Only the spare interrupt reaches it once it runs.
static TRACE: exchange::Place<trace::Trace> = exchange::Place::empty();

/// The spare interrupt; the vector table knows it by this name.
#[unsafe(no_mangle)]
unsafe extern "C" fn FMAC() {
    safety::feed_watchdog();
    // SAFETY: filled before the interrupt was enabled, and only this handler reaches it.
    unsafe { TRACE.get() }.run();
    command::WAKE.signal(());
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let channels = rtt::init();
    log::init(channels.log);
    // SAFETY: nothing in CCM runs yet.
    unsafe { ccm::init() };
    let peripherals = embassy_stm32::init(board::clocks());
    board::init(peripherals);
    let watchdog_reset = safety::take_watchdog_reset();
    let Ok(config) = BENCH.build(timing::TICK_S, timing::OUTPUT_DELAY_SAMPLES) else {
        // A test of core builds the same parameters.
        panic!("parameters of the image");
    };
    let controller = Controller::new(&config, board::read_encoder().count, watchdog_reset);
    // SAFETY: the tick does not run yet, and this is the only call.
    let ends = unsafe { exchange::init(config, controller) };
    // SAFETY: the spare interrupt does not run yet.
    unsafe { TRACE.fill(trace::Trace::new(ends.samples, channels.trace)) };
    defmt::info!(
        "bristle {=str}, watchdog reset: {=bool}",
        env!("CARGO_PKG_VERSION"),
        watchdog_reset
    );
    safety::start_watchdog();
    // SAFETY: everything the handlers use has been set up above.
    unsafe { board::start_ticks() };
    command::Commands::new(channels.commands, ends.news, BENCH)
        .run()
        .await
}
