//! The control tick.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};

use crate::{board, output};

/// Ticks since boot.
#[unsafe(no_mangle)]
pub static TICKS: AtomicU32 = AtomicU32::new(0);

struct Cell<T>(UnsafeCell<T>);
// SAFETY: only the handler reaches it.
unsafe impl<T> Sync for Cell<T> {}

/// The handler of TIM7, 10 kHz, priority 0.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".ccm.text.TIM7_DAC")]
unsafe extern "C" fn TIM7_DAC() {
    let _latency = board::cycles_since_update();
    board::acknowledge_tick();
    let reading = board::read_encoder();
    let _ = (reading.index, reading.illegal, board::drive_is_healthy());
    output::write(output::code(0.0, 1.0));
    board::set_drive_enable(false);
    let n = TICKS.load(Ordering::Relaxed).wrapping_add(1);
    TICKS.store(n, Ordering::Relaxed);
    if n.is_multiple_of(crate::timing::TICKS_PER_WAKE) {
        board::wake_tasks();
    }
}
