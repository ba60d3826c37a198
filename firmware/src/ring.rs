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

// SAFETY: `put` and `taken` keep the two sides on different items; only one context is on each.
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

    /// The side that puts.
    ///
    /// # Safety
    /// Only one context puts.
    pub unsafe fn putter(&'static self) -> Putter<T, N> {
        Putter(self)
    }

    /// The side that takes.
    ///
    /// # Safety
    /// Only one context takes.
    pub unsafe fn taker(&'static self) -> Taker<T, N> {
        Taker(self)
    }

    #[inline(always)]
    fn place(&self, number: u32) -> *mut T {
        let index = (number & Self::MASK) as usize;
        // SAFETY: the mask keeps the index below N.
        unsafe { self.items.get().cast::<T>().add(index) }
    }

    /// Puts an item; false if there is no room.
    ///
    /// # Safety
    /// Only one context puts.
    #[inline(always)]
    pub unsafe fn put(&self, item: T) -> bool {
        let put = self.put.load(Ordering::Relaxed);
        if put.wrapping_sub(self.taken.load(Ordering::Relaxed)) > Self::MASK {
            cold_path();
            return false;
        }
        compiler_fence(Ordering::Acquire);
        // SAFETY: the taker does not look here before `put` says so.
        unsafe { self.place(put).write(item) };
        compiler_fence(Ordering::Release);
        self.put.store(put.wrapping_add(1), Ordering::Relaxed);
        true
    }

    /// True if there is no item, to the side that takes.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.taken.load(Ordering::Relaxed) == self.put.load(Ordering::Relaxed)
    }

    /// The oldest item, in its place.
    ///
    /// # Safety
    /// Only one context takes, and it has no use for the item after [`Self::release`].
    #[inline(always)]
    pub unsafe fn oldest(&self) -> Option<&T> {
        if self.is_empty() {
            return None;
        }
        cold_path();
        compiler_fence(Ordering::Acquire);
        let taken = self.taken.load(Ordering::Relaxed);
        // SAFETY: `put` says that an item is here, and the putter does not write here before `taken` says so.
        Some(unsafe { &*self.place(taken) })
    }

    /// Gives the place of the oldest item free. There must be one.
    ///
    /// # Safety
    /// Only one context takes.
    #[inline(always)]
    pub unsafe fn release(&self) {
        compiler_fence(Ordering::Release);
        let taken = self.taken.load(Ordering::Relaxed);
        self.taken.store(taken.wrapping_add(1), Ordering::Relaxed);
    }
}

/// The side that puts.
pub struct Putter<T: 'static, const N: usize>(&'static Ring<T, N>);

impl<T: Copy, const N: usize> Putter<T, N> {
    /// Puts an item; false if there is no room.
    #[inline(always)]
    pub fn put(&mut self, item: T) -> bool {
        // SAFETY: who made this says so.
        unsafe { self.0.put(item) }
    }
}

/// The side that takes.
pub struct Taker<T: 'static, const N: usize>(&'static Ring<T, N>);

impl<T: Copy, const N: usize> Taker<T, N> {
    /// The oldest item.
    #[inline(always)]
    pub fn take(&mut self) -> Option<T> {
        // SAFETY: who made this says so, and the item is copied.
        unsafe {
            let item = *self.0.oldest()?;
            self.0.release();
            Some(item)
        }
    }
}
