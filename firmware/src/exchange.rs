//! What passes between the control tick and the rest, without locks: samples out, orders and parameters in.
//!
//! Parameters lie in two slots. The tick runs on one; the other is written outside and named as the next one. The tick
//! takes it over at its start, so that one tick never sees two sets.

use core::cell::UnsafeCell;
use core::hint::cold_path;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicPtr, AtomicU32, Ordering, compiler_fence};

use crate::ring::{Putter, Ring, Taker};
use crate::timing::{QUEUE_ORDERS, QUEUE_SAMPLES, TICKS_PER_WAKE};
use bristle_core::controller::{Controller, Order};
use bristle_core::parameters::Config;
use bristle_core::trace::Record;

/// The tick's end of the sample queue, and the other one.
pub type SampleIn = Putter<Record, QUEUE_SAMPLES>;
/// See [`SampleIn`].
pub type SampleOut = Taker<Record, QUEUE_SAMPLES>;
/// The command task's end of the order queue, and the tick's.
pub type OrderIn = Putter<Order, QUEUE_ORDERS>;
/// See [`OrderIn`].
pub type OrderOut = Taker<Order, QUEUE_ORDERS>;

/// A place that one context at a time reaches.
pub struct Place<T>(UnsafeCell<MaybeUninit<T>>);

// SAFETY: every user of a place says why nobody else reaches it.
unsafe impl<T> Sync for Place<T> {}

impl<T> Place<T> {
    /// Empty; all zeros, as CCM and RAM are at the start.
    pub const fn empty() -> Self {
        Self(UnsafeCell::new(MaybeUninit::zeroed()))
    }

    /// Fills it.
    ///
    /// # Safety
    /// Nobody else may reach it meanwhile.
    pub unsafe fn fill(&self, value: T) {
        // SAFETY: the caller's promise. Through the pointer, so that a large value is not copied to and fro.
        unsafe { self.pointer().write(value) };
    }

    /// Where it is.
    const fn pointer(&self) -> *mut T {
        self.0.get().cast()
    }

    /// What is in it.
    ///
    /// # Safety
    /// It must be filled, and nobody else may reach it while the reference lives.
    #[expect(clippy::mut_from_ref, reason = "exclusive by the caller's promise")]
    #[inline(always)]
    pub unsafe fn get(&self) -> &mut T {
        // SAFETY: the caller's promise.
        unsafe { &mut *self.pointer() }
    }
}

/// The tick's side.
pub struct TickSide {
    /// Everything that a tick changes.
    pub controller: Controller,
    /// Samples out.
    pub samples: SampleIn,
    /// Orders in.
    pub orders: OrderOut,
    /// The sample before found the queue full.
    pub overrun: bool,
    /// The tick before was late, lost or too long.
    pub late: bool,
    /// Count of core cycles at the last entry.
    pub entered: u32,
    /// Ticks until the tasks are woken.
    pub ticks_to_wake: u32,
}

/// The tick's state; only the handler reaches it once it runs.
#[unsafe(link_section = ".ccm.bss.tick")]
pub static TICK: Place<TickSide> = Place::empty();

#[unsafe(link_section = ".ccm.bss.config")]
static CONFIGS: [Place<Config>; 2] = [Place::empty(), Place::empty()];

/// Parameters that the tick runs on. Written by the tick.
///
/// A pointer and not the slot's number: from a number the compiler selects the address of every field anew.
static ACTIVE: AtomicPtr<Config> = AtomicPtr::new(core::ptr::null_mut());
/// Parameters that it shall run on. Written outside.
static NEXT: AtomicPtr<Config> = AtomicPtr::new(core::ptr::null_mut());

static SAMPLES: Ring<Record, QUEUE_SAMPLES> = Ring::new();
static ORDERS: Ring<Order, QUEUE_ORDERS> = Ring::new();

/// Samples that found the queue full.
#[unsafe(no_mangle)]
pub static QUEUE_OVERRUNS: AtomicU32 = AtomicU32::new(0);

/// The ends of the queues outside of the tick.
pub struct Ends {
    /// Samples out.
    pub samples: SampleOut,
    /// Orders in.
    pub orders: OrderIn,
}

/// Fills all places and splits the queues.
///
/// # Safety
/// Called once, before the tick runs.
pub unsafe fn init(config: Config, controller: Controller) -> Ends {
    // SAFETY: nobody else runs yet.
    unsafe {
        CONFIGS[0].fill(config);
        NEXT.store(CONFIGS[0].pointer(), Ordering::Relaxed);
        ACTIVE.store(CONFIGS[0].pointer(), Ordering::Relaxed);
        let (samples_in, samples_out) = SAMPLES.split();
        let (orders_in, orders_out) = ORDERS.split();
        TICK.fill(TickSide {
            controller,
            samples: samples_in,
            orders: orders_out,
            overrun: false,
            late: false,
            entered: 0,
            ticks_to_wake: TICKS_PER_WAKE,
        });
        Ends {
            samples: samples_out,
            orders: orders_in,
        }
    }
}

/// The parameters of this tick, and whether they are new.
///
/// # Safety
/// Only for the tick, once at its start.
#[inline(always)]
pub unsafe fn config() -> (&'static Config, bool) {
    let next = NEXT.load(Ordering::Relaxed);
    // On one core only the compiler could put reads of the slot before this.
    compiler_fence(Ordering::SeqCst);
    let changed = next != ACTIVE.load(Ordering::Relaxed);
    if changed {
        cold_path();
        ACTIVE.store(next, Ordering::Relaxed);
    }
    // SAFETY: a slot is named as the next one after it is filled, and is not written again before the other one has
    // been active.
    (unsafe { &*next }, changed)
}

/// True while the tick has not yet taken over the parameters offered last.
pub fn offer_is_pending() -> bool {
    NEXT.load(Ordering::Relaxed) != ACTIVE.load(Ordering::Relaxed)
}

/// Offers parameters to the tick; false while an offer is pending. Only for the command task.
pub fn offer(config: &Config) -> bool {
    if offer_is_pending() {
        return false;
    }
    let [first, second] = &CONFIGS;
    let free = if NEXT.load(Ordering::Relaxed) == first.pointer() {
        second
    } else {
        first
    };
    // SAFETY: the tick runs on the other slot, and will until `NEXT` names this one.
    unsafe { free.fill(*config) };
    compiler_fence(Ordering::SeqCst);
    NEXT.store(free.pointer(), Ordering::Relaxed);
    true
}
