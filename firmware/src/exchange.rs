//! What passes between the control tick and the rest, without locks: samples out, orders and parameters in.
//!
//! Parameters lie in two slots. The tick runs on one; the other is written outside and named as the next one. The two
//! are exchanged between two ticks, so that one tick never sees two sets.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicPtr, AtomicU32, Ordering, compiler_fence};

use crate::output;
use crate::ring::{Putter, Ring, Taker};
use crate::timing::{QUEUE_NEWS, QUEUE_SAMPLES, TICKS_PER_WAKE};
use bristle_core::controller::Controller;
use bristle_core::feed_forward::FeedForward;
use bristle_core::order::Order;
use bristle_core::parameters::Config;
use bristle_core::trace::Record;

/// The trace's end of the sample queue.
pub type SampleOut = Taker<Record, QUEUE_SAMPLES>;

/// What the command task has for the tick.
#[derive(Clone, Copy)]
pub enum News {
    /// Something to be done.
    Order(Order),
    /// Other parameters, see [`take_over`].
    Parameters,
}
/// The command task's end of the queue into the tick.
pub type NewsIn = Putter<News, QUEUE_NEWS>;

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

/// What only the two handlers of the tick reach.
pub struct TickSide {
    /// Everything that a tick changes.
    pub controller: Controller,
    /// Count of core cycles at the last entry.
    pub entered: u32,
    /// Ticks until the tasks are woken.
    pub ticks_to_wake: u32,
}

/// What the tick runs on.
pub struct Parameters {
    /// Of the controller.
    pub config: Config,
    /// Of the output, see [`output::code`].
    pub half_codes_1_nm: f32,
}

impl Parameters {
    fn new(config: Config) -> Self {
        Self {
            half_codes_1_nm: output::half_codes_1_nm(config.deflection_1_nm),
            config,
        }
    }
}

/// How the ticks went; read by tasks and debuggers.
#[repr(C)]
pub struct Stats {
    /// Ticks since boot.
    pub ticks: AtomicU32,
    /// Cycles from timer to handler, of the last tick.
    pub latency_cycles: AtomicU32,
    /// The most so far.
    pub most_latency_cycles: AtomicU32,
    /// Cycles from the handler's entry to the end of what follows it, of the last tick.
    pub run_cycles: AtomicU32,
    /// The most so far.
    pub most_run_cycles: AtomicU32,
    /// Samples that found the queue full.
    pub queue_overruns: AtomicU32,
    /// Samples rejected by the encoder.
    pub rejected_encoder: AtomicU32,
    /// Samples rejected by the Luenberger-like observer.
    pub rejected_luenberger: AtomicU32,
    /// Samples rejected by the time-free observer.
    pub rejected_time_free: AtomicU32,
    /// Requests refused by the supervisor.
    pub requests_refused: AtomicU32,
}

/// All that the tick touches besides registers and parameters. One place, so that one address in a core register
/// reaches it all, and the largest part last.
#[repr(C)]
pub struct Shared {
    /// Only the handler reaches it once it runs.
    pub side: Place<TickSide>,
    /// Parameters that the tick runs on. Written by the tick.
    ///
    /// A pointer and not the slot's number: from a number the compiler selects the address of every field anew.
    active: AtomicPtr<Parameters>,
    /// Parameters that it shall run on. Written outside.
    next: AtomicPtr<Parameters>,
    /// Feed-forward table in use, or null. Written outside.
    table: AtomicPtr<FeedForward<f32>>,
    /// How the ticks went.
    pub stats: Stats,
    /// The tick takes.
    pub news: Ring<News, QUEUE_NEWS>,
    /// The tick puts.
    pub samples: Ring<Record, QUEUE_SAMPLES>,
}

/// All zeros before [`init`], as the memory is then.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".ccm.bss.shared")]
pub static SHARED: Shared = Shared {
    side: Place::empty(),
    active: AtomicPtr::new(core::ptr::null_mut()),
    next: AtomicPtr::new(core::ptr::null_mut()),
    table: AtomicPtr::new(core::ptr::null_mut()),
    stats: Stats {
        ticks: AtomicU32::new(0),
        latency_cycles: AtomicU32::new(0),
        most_latency_cycles: AtomicU32::new(0),
        run_cycles: AtomicU32::new(0),
        most_run_cycles: AtomicU32::new(0),
        queue_overruns: AtomicU32::new(0),
        rejected_encoder: AtomicU32::new(0),
        rejected_luenberger: AtomicU32::new(0),
        rejected_time_free: AtomicU32::new(0),
        requests_refused: AtomicU32::new(0),
    },
    news: Ring::new(),
    samples: Ring::new(),
};

#[unsafe(link_section = ".ccm.bss.config")]
static SLOTS: [Place<Parameters>; 2] = [Place::empty(), Place::empty()];

/// One is used, the other is written. In RAM: CCM has no room left, and one look-up a tick finds the bus free.
static TABLES: [Place<FeedForward<f32>>; 2] = [Place::empty(), Place::empty()];

/// Ends of the queues outside of the tick.
pub struct Ends {
    /// Samples out.
    pub samples: SampleOut,
    /// Orders and parameters in.
    pub news: NewsIn,
}

/// Fills all places and splits the queues.
///
/// # Safety
/// Called once, before the tick runs.
pub unsafe fn init(config: Config, controller: Controller) -> Ends {
    // SAFETY: nobody else runs yet.
    unsafe {
        SLOTS[0].fill(Parameters::new(config));
        TABLES[0].fill(FeedForward::EMPTY);
        TABLES[1].fill(FeedForward::EMPTY);
        SHARED.next.store(SLOTS[0].pointer(), Ordering::Relaxed);
        SHARED.active.store(SLOTS[0].pointer(), Ordering::Relaxed);
        SHARED.side.fill(TickSide {
            controller,
            entered: 0,
            ticks_to_wake: TICKS_PER_WAKE,
        });
        Ends {
            samples: SHARED.samples.taker(),
            news: SHARED.news.putter(),
        }
    }
}

/// The parameters that the tick runs on. Not before [`init`].
#[inline(always)]
pub fn parameters() -> &'static Parameters {
    let active = SHARED.active.load(Ordering::Relaxed);
    // SAFETY: a slot is named after it is filled, and is not written again before the other one has been active.
    unsafe { &*active }
}

/// Goes on to the parameters offered last.
///
/// # Safety
/// Only between two ticks, while nobody looks at [`parameters`].
#[inline(always)]
pub unsafe fn take_over() {
    let next = SHARED.next.load(Ordering::Relaxed);
    // On one core only the compiler could put reads of the slot before this.
    compiler_fence(Ordering::SeqCst);
    SHARED.active.store(next, Ordering::Relaxed);
}

/// The feed-forward table in use.
#[inline(always)]
pub fn table() -> Option<&'static FeedForward<f32>> {
    // SAFETY: null, or a table that is whole. It is written again only after another one, or none, has been named, and
    // the tick keeps no reference from one tick to the next.
    unsafe { SHARED.table.load(Ordering::Relaxed).as_ref() }
}

/// The table that is not in use. Only for the command task.
pub fn free_table() -> &'static mut FeedForward<f32> {
    let [first, second] = &TABLES;
    let free = if SHARED.table.load(Ordering::Relaxed) == first.pointer() {
        second
    } else {
        first
    };
    // SAFETY: filled by `init`; the tick looks at the other one, and the command task has no second reference.
    unsafe { free.get() }
}

/// Uses the table that was free, or none, from the next tick on. Only for the command task.
pub fn use_table(table: Option<&'static mut FeedForward<f32>>) {
    compiler_fence(Ordering::SeqCst);
    let table = table.map_or(core::ptr::null_mut(), core::ptr::from_mut);
    SHARED.table.store(table, Ordering::Relaxed);
    compiler_fence(Ordering::SeqCst);
}

/// True while the tick has not yet taken over the parameters offered last.
pub fn offer_is_pending() -> bool {
    SHARED.next.load(Ordering::Relaxed) != SHARED.active.load(Ordering::Relaxed)
}

/// Offers parameters to the tick; false while an offer is pending or there is no room for one. Only for the command task.
pub fn offer(news: &mut NewsIn, config: &Config) -> bool {
    if offer_is_pending() {
        return false;
    }
    let [first, second] = &SLOTS;
    let free = if SHARED.next.load(Ordering::Relaxed) == first.pointer() {
        second
    } else {
        first
    };
    // SAFETY: the tick runs on the other slot, and will until `next` names this one.
    unsafe { free.fill(Parameters::new(*config)) };
    compiler_fence(Ordering::SeqCst);
    let active = SHARED.active.load(Ordering::Relaxed);
    SHARED.next.store(free.pointer(), Ordering::Relaxed);
    let put = news.put(News::Parameters);
    if !put {
        SHARED.next.store(active, Ordering::Relaxed);
    }
    put
}
