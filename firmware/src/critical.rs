//! Critical sections that mask every interrupt but the control tick: BASEPRI instead of PRIMASK.
//!
//! Priority 0 is never masked, and nothing at priority 0 may use a critical section, since it would not exclude anyone.

use core::arch::asm;
use critical_section::RawRestoreState;

use crate::timing::{PRIORITY_BITS, PRIORITY_HIGHEST_MASKED};

struct Section;
critical_section::set_impl!(Section);

// SAFETY: one core; all users of critical sections run at PRIORITY_HIGHEST_MASKED or below, which BASEPRI masks. The
// control interrupt, the only one above, uses none.
unsafe impl critical_section::Impl for Section {
    unsafe fn acquire() -> RawRestoreState {
        let before: u32;
        let masked = u32::from(PRIORITY_HIGHEST_MASKED) << (8 - PRIORITY_BITS);
        // SAFETY: raises the mask or leaves it (BASEPRI_MAX), and touches no memory but what the barrier orders.
        unsafe {
            asm!(
                "mrs {before}, BASEPRI",
                "msr BASEPRI_MAX, {masked}",
                "isb",
                before = out(reg) before,
                masked = in(reg) masked,
                options(nostack, preserves_flags)
            );
        }
        before as u8
    }

    unsafe fn release(before: RawRestoreState) {
        // SAFETY: restores what `acquire` found.
        unsafe {
            asm!("msr BASEPRI, {before}", before = in(reg) u32::from(before), options(nostack, preserves_flags));
        }
    }
}
