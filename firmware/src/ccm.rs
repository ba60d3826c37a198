//! Fills the core-coupled memory: code and tables of the control interrupt are copied from flash, its state cleared.

use core::ptr::addr_of_mut;

unsafe extern "C" {
    static mut __sccm: u32;
    static mut __eccm: u32;
    static mut __siccm: u32;
    static mut __sccm_bss: u32;
    static mut __eccm_bss: u32;
}

/// Called once at boot, before the interrupt is enabled.
///
/// # Safety
/// Nothing in CCM may be in use.
pub unsafe fn init() {
    // SAFETY: the linker script gives word-aligned bounds of memory that the caller says is unused. Volatile, so that
    // the loops are not taken for accesses to the one-word statics.
    unsafe {
        let mut to = addr_of_mut!(__sccm);
        let mut from = addr_of_mut!(__siccm);
        while to < addr_of_mut!(__eccm) {
            to.write_volatile(from.read_volatile());
            to = to.add(1);
            from = from.add(1);
        }
        let mut to = addr_of_mut!(__sccm_bss);
        while to < addr_of_mut!(__eccm_bss) {
            to.write_volatile(0);
            to = to.add(1);
        }
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
