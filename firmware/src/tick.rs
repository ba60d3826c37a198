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

use bristle_core::controller::{Controller, Input};
use bristle_core::feed_forward::FeedForward;
use bristle_core::order::Order;
use bristle_core::supervisor::{Alarms, Request};

use crate::exchange::{self, News, SHARED, TickSide};
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
        .and(Alarms::UNWELL.when(!board::drive_is_healthy()));
    if entered.wrapping_sub(side.entered) > timing::LOST_CYCLES || latency > timing::LATE_CYCLES {
        cold_path();
        alarms = alarms.and(Alarms::LATE);
    }
    side.entered = entered;
    stats.latency_cycles.store(latency, Ordering::Relaxed);
    raise(&stats.most_latency_cycles, latency);
    let parameters = exchange::parameters();
    let config = &parameters.config;
    let controller = &mut side.controller;
    let input = Input {
        raw: reading.count,
        index: reading.index,
        alarms,
    };
    let out = controller.react(config, &input);
    output::write(output::code(out.torque_nm, parameters.half_codes_1_nm));
    board::set_drive_enable(out.drive_enabled);
    // SAFETY: only the tick puts.
    if !unsafe { SHARED.samples.put(out.record) } {
        cold_path();
        controller.lose_sample();
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
    let table = exchange::table();
    // SAFETY: nobody else takes.
    let news = unsafe { SHARED.news.oldest() };
    // What begins brings its first reference, and only what a table has added has to be taken off before.
    if table.is_some() || !matches!(news, Some(News::Order(Order::Play(..)))) {
        look_ahead(controller, table);
    }
    if let Some(news) = news {
        cold_path();
        follow(controller, news);
        // SAFETY: as above, and the news are not used any more.
        unsafe { SHARED.news.release() };
    } else {
        // A tick with news has enough to do, and this waits.
        side.ticks_to_wake -= 1;
        if side.ticks_to_wake <= 1 {
            cold_path();
            remind(side);
        }
    }
    let run = board::cycles().wrapping_sub(side.entered);
    stats.run_cycles.store(run, Ordering::Relaxed);
    raise(&stats.most_run_cycles, run);
}

/// Finds what the next tick does.
#[inline(always)]
fn look_ahead(controller: &mut Controller, table: Option<&FeedForward<f32>>) {
    let config = &exchange::parameters().config;
    if table.is_some() || !controller.look_ahead_in_sine(config) {
        cold_path();
        look_further_ahead(controller, table);
    }
}

/// What a sine without a table does not need; apart from it, as is what follows [`News`], so that the usual way has none of
/// their registers to save.
#[unsafe(link_section = ".ccm.text.look_further_ahead")]
#[inline(never)]
fn look_further_ahead(controller: &mut Controller, table: Option<&FeedForward<f32>>) {
    controller.look_ahead(&exchange::parameters().config, table);
}

/// Follows an order or goes on to other parameters.
#[inline(always)]
fn follow(controller: &mut Controller, news: &News) {
    match news {
        News::Order(Order::Request(request)) => ask(controller, *request),
        News::Order(order) => obey(controller, order),
        News::Parameters => take_over(controller),
    }
}

#[unsafe(link_section = ".ccm.text.ask")]
#[inline(never)]
fn ask(controller: &mut Controller, request: Request) {
    controller.ask(&exchange::parameters().config, request);
}

#[unsafe(link_section = ".ccm.text.obey")]
#[inline(never)]
fn obey(controller: &mut Controller, order: &Order) {
    controller.obey(&exchange::parameters().config, order);
}

#[unsafe(link_section = ".ccm.text.take_over")]
#[inline(never)]
fn take_over(controller: &mut Controller) {
    // SAFETY: not in the tick, and the only call.
    unsafe { exchange::take_over() };
    controller.take_over(&exchange::parameters().config);
}

/// Wakes the tasks, and in the tick before tells them what was refused.
#[inline(always)]
fn remind(side: &mut TickSide) {
    if side.ticks_to_wake == 0 {
        side.ticks_to_wake = timing::TICKS_PER_WAKE;
        board::wake_tasks();
    } else {
        let (stats, controller) = (&SHARED.stats, &side.controller);
        let refused = controller.supervisor().refused();
        stats.requests_refused.store(refused, Ordering::Relaxed);
        let [encoder, luenberger, time_free] = controller.rejected();
        stats.rejected_encoder.store(encoder, Ordering::Relaxed);
        stats
            .rejected_luenberger
            .store(luenberger, Ordering::Relaxed);
        stats.rejected_time_free.store(time_free, Ordering::Relaxed);
    }
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
        cold_path();
        most.store(value, Ordering::Relaxed);
    }
}
