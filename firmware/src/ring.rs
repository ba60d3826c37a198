//! A queue between two contexts of one core, without locks: one side only puts, the other only takes.
//!
//! Written by hand because the size is a power of two here: a mask in place of a division, and no path to a panic.
//! On one core the compiler's order of stores is the only thing to hold; the hardware's own barrier is not needed.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU32, Ordering, compiler_fence};

/// Room for `N` items; `N` is a power of two.
pub struct Ring<T, const N: usize> {
    items: UnsafeCell<[MaybeUninit<T>; N]>,
    /// Items put since boot; wraps.
    put: AtomicU32,
    /// Items taken since boot; wraps.
    taken: AtomicU32,
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
            items: UnsafeCell::new([MaybeUninit::uninit(); N]),
            put: AtomicU32::new(0),
            taken: AtomicU32::new(0),
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
        let put = self.0.put.load(Ordering::Relaxed);
        if put.wrapping_sub(self.0.taken.load(Ordering::Relaxed)) > Ring::<T, N>::MASK {
            return false;
        }
        compiler_fence(Ordering::Acquire);
        // SAFETY: the taker does not look here before `put` says so.
        unsafe { self.0.place(put).write(item) };
        compiler_fence(Ordering::Release);
        self.0.put.store(put.wrapping_add(1), Ordering::Relaxed);
        true
    }
}

/// The side that takes.
pub struct Taker<T: 'static, const N: usize>(&'static Ring<T, N>);

impl<T: Copy, const N: usize> Taker<T, N> {
    /// The oldest item.
    #[inline(always)]
    pub fn take(&mut self) -> Option<T> {
        let taken = self.0.taken.load(Ordering::Relaxed);
        if taken == self.0.put.load(Ordering::Relaxed) {
            return None;
        }
        compiler_fence(Ordering::Acquire);
        // SAFETY: `put` says that an item is here, and the putter does not write here before `taken` says so.
        let item = unsafe { self.0.place(taken).read() };
        compiler_fence(Ordering::Release);
        self.0.taken.store(taken.wrapping_add(1), Ordering::Relaxed);
        Some(item)
    }
}
