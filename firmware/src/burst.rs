//! The burst in RAM: fed by the trace, armed and read by commands. Both are below the tick, and share it by a critical
//! section, which does not mask the tick.

use bristle_core::burst::{BURST_SAMPLES, Burst};
use bristle_core::command::Reply;
use bristle_core::trace::{self as wire, MOST_SAMPLES, Record, SAMPLE_BYTES};
use bristle_core::wire::OVERHEAD_BYTES;
use core::cell::RefCell;
use critical_section::Mutex;

use crate::link::send;

static BURST: Mutex<RefCell<Burst<BURST_SAMPLES>>> = Mutex::new(RefCell::new(Burst::new()));

/// Takes a sample.
pub fn take(record: &Record) {
    with(|burst| burst.take(record));
}

/// Does something with it.
pub fn with<R>(action: impl FnOnce(&mut Burst<BURST_SAMPLES>) -> R) -> R {
    critical_section::with(|cs| action(&mut BURST.borrow_ref_mut(cs)))
}

/// Where it stands.
pub fn reply() -> Reply {
    with(|burst| Reply::to_burst(burst))
}

/// Sends the samples from a number on, as many as a frame holds. It may find no room on the link, as any frame; then the
/// host asks again.
pub fn read(first: u16) {
    let mut bytes = [0; 2 + MOST_SAMPLES * SAMPLE_BYTES + OVERHEAD_BYTES];
    let mut frame = wire::begin_burst(&mut bytes, first);
    let mut count = 0;
    while usize::from(count) < MOST_SAMPLES {
        // One at a time, so that the trace waits for no more than a copy.
        let number = usize::from(first) + usize::from(count);
        let Some(record) = with(|burst| burst.sample(number).copied()) else {
            break;
        };
        wire::put(&mut frame, &record);
        count += 1;
    }
    if let Some(bytes) = frame.finish(count) {
        send(bytes);
    }
}
