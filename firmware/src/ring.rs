//! A queue between two contexts of one core, without locks: one side only puts, the other only takes.
//!
//! Written by hand because the size is a power of two here: a mask in place of a division, and no path to a panic.
//! On one core the compiler's order of stores is the only thing to hold; the hardware's own barrier is not needed.

use core::cell::UnsafeCell;
use core::hint::cold_path;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU32, Ordering, compiler_fence};

/// Room for `N` items; `N` is a power of two.
///
/// The counts lie before the items, in reach of an instruction's own offset.
#[repr(C)]
pub struct Ring<T, const N: usize> {
    /// Items put since boot; wraps.
    put: AtomicU32,
    /// Items taken since boot; wraps.
    taken: AtomicU32,
    items: UnsafeCell<[MaybeUninit<T>; N]>,
}

// SAFETY: `put` and `taken` keep the two sides on different items; there is one of each, see `split`.
unsafe impl<T: Send, const N: usize> Sync for Ring<T, N> {}

impl<T: Copy, const N: usize> Ring<T, N> {
    const MASK: u32 = {
        assert!(N.is_power_of_two());
        N as u32 - 1
    };

    /// Empty.
    pub const fn new() -> Self {
        Self {
            put: AtomicU32::new(0),
            taken: AtomicU32::new(0),
            items: UnsafeCell::new([MaybeUninit::uninit(); N]),
        }
    }

    /// The two sides.
    ///
    /// # Safety
    /// Called once.
    pub unsafe fn split(&'static self) -> (Putter<T, N>, Taker<T, N>) {
        (Putter(self), Taker(self))
    }

    #[inline(always)]
    fn place(&self, number: u32) -> *mut T {
        let index = (number & Self::MASK) as usize;
        // SAFETY: the mask keeps the index below N.
        unsafe { self.items.get().cast::<T>().add(index) }
    }
}

/// The side that puts.
pub struct Putter<T: 'static, const N: usize>(&'static Ring<T, N>);

impl<T: Copy, const N: usize> Putter<T, N> {
    /// Puts an item; false if there is no room.
    #[inline(always)]
    pub fn put(&mut self, item: T) -> bool {
        // Its own copy of the reference: a fence makes the compiler load `self.0` again.
        let ring = self.0;
        let put = ring.put.load(Ordering::Relaxed);
        if put.wrapping_sub(ring.taken.load(Ordering::Relaxed)) > Ring::<T, N>::MASK {
            cold_path();
            return false;
        }
        compiler_fence(Ordering::Acquire);
        // SAFETY: the taker does not look here before `put` says so.
        unsafe { ring.place(put).write(item) };
        compiler_fence(Ordering::Release);
        ring.put.store(put.wrapping_add(1), Ordering::Relaxed);
        true
    }
}

/// The side that takes.
pub struct Taker<T: 'static, const N: usize>(&'static Ring<T, N>);

impl<T: Copy, const N: usize> Taker<T, N> {
    /// The oldest item.
    #[inline(always)]
    pub fn take(&mut self) -> Option<T> {
        let ring = self.0;
        let taken = ring.taken.load(Ordering::Relaxed);
        if taken == ring.put.load(Ordering::Relaxed) {
            return None;
        }
        compiler_fence(Ordering::Acquire);
        // SAFETY: `put` says that an item is here, and the putter does not write here before `taken` says so.
        let item = unsafe { ring.place(taken).read() };
        compiler_fence(Ordering::Release);
        ring.taken.store(taken.wrapping_add(1), Ordering::Relaxed);
        Some(item)
    }

    /// Shows the oldest item in its place, then takes it; false if there is none.
    #[inline(always)]
    pub fn take_with(&mut self, look: impl FnOnce(&T)) -> bool {
        let ring = self.0;
        let taken = ring.taken.load(Ordering::Relaxed);
        if taken == ring.put.load(Ordering::Relaxed) {
            return false;
        }
        cold_path();
        compiler_fence(Ordering::Acquire);
        // SAFETY: as in `take`; the reference ends before `taken` says that the place is free.
        look(unsafe { &*ring.place(taken) });
        compiler_fence(Ordering::Release);
        ring.taken.store(taken.wrapping_add(1), Ordering::Relaxed);
        true
    }
}
