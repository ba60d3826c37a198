//! The control tick: TIM7's interrupt at 10 kHz and priority 0.
//!
//! Deadline: 17,000 cycles from one to the next. Nothing masks it: critical sections stop at priority 1. What remains
//! is the core's own entry, about 12 cycles, and the wait states of the vector's fetch; the latency of each tick is
//! measured from the timer and reported. The output does not depend on it, since the timer itself puts out the value
//! written before.
//!
//! What does not depend on the counts of a tick runs in a second interrupt, right after the first one and at the same
//! priority: neither interrupts the other, nothing masks either, and the next tick finds it done.
//!
//! In the call trees of both there is no panic, log, critical section, allocation, 64-bit division or f64;
//! `cargo xtask check-elf` looks at the image for that.

use core::hint::cold_path;
use core::sync::atomic::{AtomicU32, Ordering};

use bristle_core::controller::Input;
use bristle_core::supervisor::Alarms;
use bristle_core::trace::FLAG_OVERRUN;

use crate::exchange::{self, SHARED};
use crate::{board, output, timing};

/// The handler; the vector table knows it by this name.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".ccm.text.TIM7_DAC")]
unsafe extern "C" fn TIM7_DAC() {
    let latency = board::cycles_since_update();
    let entered = board::cycles();
    board::acknowledge_tick();
    let reading = board::read_encoder();
    let stats = &SHARED.stats;
    // SAFETY: filled before the interrupt was enabled; the other handler never runs meanwhile, and nobody else reaches it.
    let side = unsafe { SHARED.side.get() };
    let mut alarms = Alarms::ILLEGAL
        .when(reading.illegal)
        .and(Alarms::UNWELL.when(!board::drive_is_healthy()))
        .and(Alarms::LATE.when(side.late));
    if entered.wrapping_sub(side.entered) > timing::LOST_CYCLES || latency > timing::LATE_CYCLES {
        cold_path();
        alarms = alarms.and(Alarms::LATE);
    }
    side.entered = entered;
    stats.latency_cycles.store(latency, Ordering::Relaxed);
    let parameters = exchange::parameters();
    let config = &parameters.config;
    let controller = &mut side.controller;
    let input = Input {
        raw: reading.count,
        index: reading.index,
        alarms,
    };
    let mut out = controller.react(config, &input);
    output::write(output::code(out.torque_nm, parameters.half_codes_1_nm));
    board::set_drive_enable(out.drive_enabled);
    out.record.status = out.record.status.with(side.overrun);
    side.overrun = 0;
    // SAFETY: only the tick puts.
    if !unsafe { SHARED.samples.put(out.record) } {
        cold_path();
        side.overrun = FLAG_OVERRUN;
        count(&stats.queue_overruns);
    }
    board::prepare_next_tick();
}

/// What can be done before the counts of the next tick are there: orders, parameters, the next reference, statistics.
/// The vector table knows it by this name.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".ccm.text.CORDIC")]
unsafe extern "C" fn CORDIC() {
    let stats = &SHARED.stats;
    // SAFETY: neither of the two handlers interrupts the other, and nobody else reaches it.
    let side = unsafe { SHARED.side.get() };
    let controller = &mut side.controller;
    stats
        .ticks
        .store(controller.supervisor().tick(), Ordering::Relaxed);
    controller.look_ahead(&exchange::parameters().config, exchange::table());
    // SAFETY: not in the tick, and the only call.
    let changed = unsafe { exchange::take_over() };
    let config = &exchange::parameters().config;
    if changed {
        cold_path();
        controller.take_over(config);
    }
    // SAFETY: nobody else takes.
    if let Some(order) = unsafe { SHARED.orders.oldest() } {
        cold_path();
        controller.obey(config, order);
        // SAFETY: as above.
        unsafe { SHARED.orders.release() };
    }
    raise(
        &stats.most_latency_cycles,
        stats.latency_cycles.load(Ordering::Relaxed),
    );
    side.ticks_to_wake -= 1;
    if side.ticks_to_wake == 0 {
        cold_path();
        side.ticks_to_wake = timing::TICKS_PER_WAKE;
        board::wake_tasks();
        let refused = controller.supervisor().refused();
        stats.requests_refused.store(refused, Ordering::Relaxed);
        let [encoder, luenberger, time_free] = controller.rejected();
        stats.rejected_encoder.store(encoder, Ordering::Relaxed);
        stats
            .rejected_luenberger
            .store(luenberger, Ordering::Relaxed);
        stats.rejected_time_free.store(time_free, Ordering::Relaxed);
    }
    let run = board::cycles().wrapping_sub(side.entered);
    stats.run_cycles.store(run, Ordering::Relaxed);
    raise(&stats.most_run_cycles, run);
    side.late = board::next_tick_is_due();
}

/// Adds one; nobody else writes, so that no exclusive access is needed.
#[inline(always)]
fn count(counter: &AtomicU32) {
    counter.store(
        counter.load(Ordering::Relaxed).wrapping_add(1),
        Ordering::Relaxed,
    );
}

#[inline(always)]
fn raise(most: &AtomicU32, value: u32) {
    if value > most.load(Ordering::Relaxed) {
        most.store(value, Ordering::Relaxed);
    }
}
