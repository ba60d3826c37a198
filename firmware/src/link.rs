//! The binary up channel: the trace, bursts and the answers to commands share it.

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};

use critical_section::Mutex;

use crate::rtt::Up;

/// Binary frames that found no room on the link.
#[unsafe(no_mangle)]
pub static FRAMES_DROPPED: AtomicU32 = AtomicU32::new(0);

static LINK: Mutex<RefCell<Option<Up>>> = Mutex::new(RefCell::new(None));

/// Opens it.
pub fn open(link: Up) {
    critical_section::with(|cs| LINK.borrow_ref_mut(cs).replace(link));
}

/// Puts a frame on the link, whole or not at all.
pub fn send(bytes: &[u8]) {
    critical_section::with(|cs| {
        if let Some(link) = LINK.borrow_ref_mut(cs).as_mut() {
            link.begin();
            link.put(bytes);
            if !link.end() {
                FRAMES_DROPPED.fetch_add(1, Ordering::Relaxed);
            }
        }
    });
}
