//! The control tick: TIM7's interrupt at 10 kHz and priority 0.
//!
//! Deadline: 17,000 cycles from one to the next. Nothing masks it: critical sections stop at priority 1. What remains
//! is the core's own entry, about 12 cycles, and the wait states of the vector's fetch; the latency of each tick is
//! measured from the timer and reported. The output does not depend on it, since the timer itself puts out the value
//! written before.
//!
//! In the call tree of this function there is no panic, log, critical section, allocation, 64-bit division or f64;
//! `cargo xtask check-elf` looks at the image for that.

use core::hint::cold_path;
use core::sync::atomic::{AtomicU32, Ordering};

use bristle_core::controller::Input;

use crate::exchange::{self, QUEUE_OVERRUNS};
use crate::{board, output, timing};

/// How the ticks went; read by tasks and debuggers.
#[repr(C)]
pub struct Stats {
    /// Ticks since boot.
    pub ticks: AtomicU32,
    /// Cycles from timer to handler, of the last tick.
    pub latency_cycles: AtomicU32,
    /// The most so far.
    pub most_latency_cycles: AtomicU32,
    /// Cycles of the handler, of the last tick.
    pub run_cycles: AtomicU32,
    /// The most so far.
    pub most_run_cycles: AtomicU32,
    /// Samples rejected by the encoder.
    pub rejected_encoder: AtomicU32,
    /// Samples rejected by the Luenberger-like observer.
    pub rejected_luenberger: AtomicU32,
    /// Samples rejected by the time-free observer.
    pub rejected_time_free: AtomicU32,
    /// Requests refused by the supervisor.
    pub requests_refused: AtomicU32,
}

/// See [`Stats`].
#[unsafe(no_mangle)]
#[unsafe(link_section = ".ccm.bss.stats")]
pub static TICK_STATS: Stats = Stats {
    ticks: AtomicU32::new(0),
    latency_cycles: AtomicU32::new(0),
    most_latency_cycles: AtomicU32::new(0),
    run_cycles: AtomicU32::new(0),
    most_run_cycles: AtomicU32::new(0),
    rejected_encoder: AtomicU32::new(0),
    rejected_luenberger: AtomicU32::new(0),
    rejected_time_free: AtomicU32::new(0),
    requests_refused: AtomicU32::new(0),
};

/// The handler; the vector table knows it by this name.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".ccm.text.TIM7_DAC")]
unsafe extern "C" fn TIM7_DAC() {
    let latency = board::cycles_since_update();
    let entered = board::cycles();
    board::acknowledge_tick();
    let reading = board::read_encoder();
    // SAFETY: filled before the interrupt was enabled, and only this handler reaches it.
    let side = unsafe { exchange::TICK.get() };
    // SAFETY: this is the tick, and the only call.
    let (config, changed) = unsafe { exchange::config() };
    let lost = entered.wrapping_sub(side.entered) > timing::LOST_CYCLES;
    let input = Input {
        raw: reading.count,
        index: reading.index,
        illegal: reading.illegal,
        drive_healthy: board::drive_is_healthy(),
        late: side.late | lost | (latency > timing::LATE_CYCLES),
        overrun: side.overrun,
    };
    let controller = &mut side.controller;
    if changed {
        cold_path();
        controller.take_over(config);
    }
    side.orders.take_with(|order| controller.obey(config, order));
    let out = side.controller.step(config, &input);
    output::write(output::code(out.torque_nm, config.deflection_1_nm));
    board::set_drive_enable(out.drive_enabled);
    side.overrun = !side.samples.put(out.record);
    if side.overrun {
        cold_path();
        count(&QUEUE_OVERRUNS);
    }
    side.entered = entered;
    TICK_STATS
        .ticks
        .store(out.record.tick.wrapping_add(1), Ordering::Relaxed);
    TICK_STATS.latency_cycles.store(latency, Ordering::Relaxed);
    raise(&TICK_STATS.most_latency_cycles, latency);
    // What need not be done every tick is spread, so that the longest tick is short.
    side.ticks_to_wake -= 1;
    if side.ticks_to_wake == timing::TICKS_PER_WAKE / 2 {
        report(side);
    } else if side.ticks_to_wake == 0 {
        side.ticks_to_wake = timing::TICKS_PER_WAKE;
        board::wake_tasks();
    }
    let run = board::cycles().wrapping_sub(entered);
    TICK_STATS.run_cycles.store(run, Ordering::Relaxed);
    raise(&TICK_STATS.most_run_cycles, run);
    side.late = board::next_tick_is_due();
}

/// Counters of the controller, for those outside who may not reach it.
#[inline(always)]
fn report(side: &exchange::TickSide) {
    let stats = &TICK_STATS;
    let [encoder, luenberger, time_free] = side.controller.rejected();
    stats.rejected_encoder.store(encoder, Ordering::Relaxed);
    stats
        .rejected_luenberger
        .store(luenberger, Ordering::Relaxed);
    stats.rejected_time_free.store(time_free, Ordering::Relaxed);
    stats
        .requests_refused
        .store(side.controller.supervisor().refused(), Ordering::Relaxed);
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
