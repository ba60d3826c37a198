//! Real-time transfer: rings in memory that a debug probe reads and writes while the core runs.
//!
//! Written by hand for one reason: a host that attaches may set a channel's mode to blocking, and the libraries obey.
//! Here the flags are ignored. What does not fit is dropped whole and counted.
//!
//! | channel | direction | content |
//! |---|---|---|
//! | 0 | up | defmt frames: log, readable trace |
//! | 1 | up | binary frames of `bristle_core::wire`: samples at full rate, replies, status |
//! | 0 | down | binary frames: commands |

use core::cell::UnsafeCell;
use core::ffi::CStr;
use core::sync::atomic::{AtomicPtr, AtomicU32, Ordering, compiler_fence, fence};

/// Bytes of up channel 0: some forty lines.
pub const LOG_BYTES: usize = 2048;
/// Bytes of up channel 1: about 50 ms of samples.
pub const TRACE_BYTES: usize = 16384;
/// Bytes of down channel 0: a few commands.
pub const COMMAND_BYTES: usize = 512;

/// A channel as the probe expects it.
#[repr(C)]
struct Channel {
    name: AtomicPtr<u8>,
    buffer: AtomicPtr<u8>,
    size: AtomicU32,
    write: AtomicU32,
    read: AtomicU32,
    flags: AtomicU32,
}

impl Channel {
    const fn closed() -> Self {
        Self {
            name: AtomicPtr::new(core::ptr::null_mut()),
            buffer: AtomicPtr::new(core::ptr::null_mut()),
            size: AtomicU32::new(0),
            write: AtomicU32::new(0),
            read: AtomicU32::new(0),
            flags: AtomicU32::new(0),
        }
    }

    fn open(&self, name: &'static CStr, buffer: *mut u8, size: usize) {
        self.name
            .store(name.as_ptr().cast_mut().cast(), Ordering::Relaxed);
        self.size.store(size as u32, Ordering::Relaxed);
        self.write.store(0, Ordering::Relaxed);
        self.read.store(0, Ordering::Relaxed);
        self.flags.store(0, Ordering::Relaxed);
        self.buffer.store(buffer, Ordering::Relaxed);
    }
}

/// The block that the probe searches for.
#[repr(C)]
struct Block {
    id: UnsafeCell<[u8; 16]>,
    up_channels: AtomicU32,
    down_channels: AtomicU32,
    up: [Channel; 2],
    down: [Channel; 1],
}

// SAFETY: `id` is written once at boot before anyone reads it, the rest is atomic.
unsafe impl Sync for Block {}

/// Found by name by probe-rs, and by content by others.
#[unsafe(no_mangle)]
static _SEGGER_RTT: Block = Block {
    id: UnsafeCell::new([0; 16]),
    up_channels: AtomicU32::new(0),
    down_channels: AtomicU32::new(0),
    up: [Channel::closed(), Channel::closed()],
    down: [Channel::closed()],
};

struct Bytes<const N: usize>(UnsafeCell<[u8; N]>);
// SAFETY: each buffer is reached only through the one `Up` or `Down` of its channel, and by the probe.
unsafe impl<const N: usize> Sync for Bytes<N> {}

static LOG: Bytes<LOG_BYTES> = Bytes(UnsafeCell::new([0; LOG_BYTES]));
static TRACE: Bytes<TRACE_BYTES> = Bytes(UnsafeCell::new([0; TRACE_BYTES]));
static COMMANDS: Bytes<COMMAND_BYTES> = Bytes(UnsafeCell::new([0; COMMAND_BYTES]));

/// Writer of an up channel. Bytes are put one after another and become visible together.
pub struct Up {
    channel: &'static Channel,
    buffer: *mut u8,
    size: usize,
    /// Where the next byte goes, not yet published.
    at: usize,
    /// Free bytes left, counted down while writing.
    free: usize,
    overflowed: bool,
}

// SAFETY: the only handle to its buffer.
unsafe impl Send for Up {}

impl Up {
    fn new(channel: &'static Channel, buffer: *mut u8, size: usize) -> Self {
        Self {
            channel,
            buffer,
            size,
            at: 0,
            free: 0,
            overflowed: false,
        }
    }

    /// Starts a message.
    pub fn begin(&mut self) {
        let write = self.channel.write.load(Ordering::Relaxed) as usize;
        let read = self.channel.read.load(Ordering::Relaxed) as usize;
        self.overflowed = false;
        // The probe writes `read`; what it writes is not trusted.
        if write >= self.size || read >= self.size {
            self.at = 0;
            self.free = 0;
            return;
        }
        self.at = write;
        // One byte stays free, to tell full from empty.
        self.free = if read > write {
            read - write - 1
        } else {
            self.size - write + read - 1
        };
    }

    /// Adds to the message, if all of it fits.
    pub fn put(&mut self, bytes: &[u8]) {
        if self.overflowed || bytes.len() > self.free {
            self.overflowed = true;
            return;
        }
        let first = bytes.len().min(self.size - self.at);
        // SAFETY: `at + first` is at most `size` and the rest less than `size`; the free part belongs to the writer.
        unsafe {
            core::ptr::copy_nonoverlapping(bytes.as_ptr(), self.buffer.add(self.at), first);
            core::ptr::copy_nonoverlapping(
                bytes.as_ptr().add(first),
                self.buffer,
                bytes.len() - first,
            );
        }
        self.free -= bytes.len();
        self.at += bytes.len();
        if self.at >= self.size {
            self.at -= self.size;
        }
    }

    /// Publishes the message; false if it did not fit, and then none of it is there.
    pub fn end(&mut self) -> bool {
        if self.overflowed {
            return false;
        }
        // The probe must not see the new index before the bytes.
        fence(Ordering::Release);
        self.channel.write.store(self.at as u32, Ordering::Release);
        true
    }
}

/// Reader of a down channel.
pub struct Down {
    channel: &'static Channel,
    buffer: *const u8,
    size: usize,
}

// SAFETY: the only handle to its buffer.
unsafe impl Send for Down {}

impl Down {
    /// Takes what has arrived, as much as fits.
    pub fn read(&mut self, into: &mut [u8]) -> usize {
        let write = self.channel.write.load(Ordering::Acquire) as usize;
        let mut read = self.channel.read.load(Ordering::Relaxed) as usize;
        if write >= self.size || read >= self.size {
            return 0;
        }
        let mut count = 0;
        for byte in into {
            if read == write {
                break;
            }
            // SAFETY: `read` is below `size`.
            *byte = unsafe { self.buffer.add(read).read_volatile() };
            count += 1;
            read += 1;
            if read == self.size {
                read = 0;
            }
        }
        self.channel.read.store(read as u32, Ordering::Release);
        count
    }
}

/// The three channels.
pub struct Channels {
    /// Up 0.
    pub log: Up,
    /// Up 1.
    pub trace: Up,
    /// Down 0.
    pub commands: Down,
}

/// Opens the channels. Called once at boot.
pub fn init() -> Channels {
    let block = &_SEGGER_RTT;
    let log = LOG.0.get().cast::<u8>();
    let trace = TRACE.0.get().cast::<u8>();
    let commands = COMMANDS.0.get().cast::<u8>();
    block.up[0].open(c"defmt", log, LOG_BYTES);
    block.up[1].open(c"trace", trace, TRACE_BYTES);
    block.down[0].open(c"commands", commands, COMMAND_BYTES);
    block.up_channels.store(2, Ordering::Relaxed);
    block.down_channels.store(1, Ordering::Relaxed);
    // The name last and backwards: a probe that finds it finds the rest in order, and finds no copy of it in flash.
    const BACKWARDS: [u8; 16] = *b"\0\0\0\0\0\0TTR REGGES";
    compiler_fence(Ordering::SeqCst);
    for (i, byte) in BACKWARDS.iter().enumerate() {
        // SAFETY: within the array; nobody else writes it.
        unsafe {
            block
                .id
                .get()
                .cast::<u8>()
                .add(15 - i)
                .write_volatile(*byte)
        };
    }
    compiler_fence(Ordering::SeqCst);
    Channels {
        log: Up::new(&block.up[0], log, LOG_BYTES),
        trace: Up::new(&block.up[1], trace, TRACE_BYTES),
        commands: Down {
            channel: &block.down[0],
            buffer: commands,
            size: COMMAND_BYTES,
        },
    }
}
