//! The defmt logger over up channel 0. A frame goes out whole or not at all; those that did not are counted.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use crate::rtt::Up;

/// Frames that did not fit, since boot.
#[unsafe(no_mangle)]
pub static LOG_FRAMES_DROPPED: AtomicU32 = AtomicU32::new(0);

struct Inner {
    up: Option<Up>,
    encoder: defmt::Encoder,
    restore: critical_section::RestoreState,
}

struct State(UnsafeCell<Inner>);
// SAFETY: reached only inside a critical section, see `acquire`.
unsafe impl Sync for State {}

static STATE: State = State(UnsafeCell::new(Inner {
    up: None,
    encoder: defmt::Encoder::new(),
    restore: critical_section::RestoreState::invalid(),
}));
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Starts logging; what was logged before is lost.
pub fn init(up: Up) {
    critical_section::with(|_| {
        // SAFETY: inside a critical section.
        unsafe { (*STATE.0.get()).up = Some(up) };
    });
}

#[defmt::global_logger]
struct Logger;

// SAFETY: `acquire` opens a critical section that `release` closes; priority 0, which it does not mask, never logs.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        // SAFETY: `release` follows.
        let restore = unsafe { critical_section::acquire() };
        if TAKEN.swap(true, Ordering::Relaxed) {
            // Only a formatter that logs gets here.
            panic!("logged while logging");
        }
        // SAFETY: inside the critical section, and not taken twice.
        let inner = unsafe { &mut *STATE.0.get() };
        inner.restore = restore;
        if let Some(up) = &mut inner.up {
            up.begin();
            inner.encoder.start_frame(|bytes| up.put(bytes));
        }
    }

    unsafe fn flush() {}

    unsafe fn release() {
        // SAFETY: between `acquire` and here the critical section is held.
        let inner = unsafe { &mut *STATE.0.get() };
        if let Some(up) = &mut inner.up {
            inner.encoder.end_frame(|bytes| up.put(bytes));
            if !up.end() {
                LOG_FRAMES_DROPPED.fetch_add(1, Ordering::Relaxed);
            }
        }
        TAKEN.store(false, Ordering::Relaxed);
        // SAFETY: what `acquire` was given.
        unsafe { critical_section::release(inner.restore) };
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: between `acquire` and `release` the critical section is held.
        let inner = unsafe { &mut *STATE.0.get() };
        if let Some(up) = &mut inner.up {
            inner.encoder.write(bytes, |bytes| up.put(bytes));
        }
    }
}
