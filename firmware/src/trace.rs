//! The trace out of the queue: every sample in binary frames, some as lines to read, and the status.
//!
//! Runs in the spare interrupt, below the tick and above the command task: no command, however long, holds it up. What
//! finds no room on the link is dropped whole and counted; nothing ever waits for a host.

use core::sync::atomic::{AtomicU32, Ordering};

use bristle_core::status::{PROTOCOL_VERSION, Report};
use bristle_core::supervisor::Fault;
use bristle_core::trace::{self as wire, MOST_SAMPLES, Record, SAMPLE_BYTES};
use bristle_core::wire::OVERHEAD_BYTES;

use crate::link::{self, FRAMES_DROPPED, send};
use crate::log::LOG_FRAMES_DROPPED;
use crate::rtt::Up;
use crate::{burst, exchange, timing};

/// Most frames in one run, so that a run has an end: 128 samples, when 10 have come since the last one.
const MOST_FRAMES: usize = 4;

/// Version of the parameters in use.
pub static PARAMETER_VERSION: AtomicU32 = AtomicU32::new(0);

/// What a run keeps for the next one.
pub struct Trace {
    samples: exchange::SampleOut,
    last: Record,
    fault: Fault,
    frame: [u8; MOST_SAMPLES * SAMPLE_BYTES + OVERHEAD_BYTES],
}

impl Trace {
    /// Opens the link.
    pub fn new(samples: exchange::SampleOut, up: Up) -> Self {
        link::open(up);
        Self {
            samples,
            last: Record::default(),
            fault: Fault::None,
            frame: [0; MOST_SAMPLES * SAMPLE_BYTES + OVERHEAD_BYTES],
        }
    }

    /// Sends what has come.
    pub fn run(&mut self) {
        let mut line = None;
        let mut status_due = false;
        for _ in 0..MOST_FRAMES {
            let mut frame = wire::begin(&mut self.frame);
            let mut count = 0;
            while usize::from(count) < MOST_SAMPLES
                && let Some(record) = self.samples.take()
            {
                wire::put(&mut frame, &record);
                burst::take(&record);
                count += 1;
                if record.tick.is_multiple_of(timing::TICKS_PER_LINE) {
                    line = Some(record);
                }
                status_due |= record.tick.is_multiple_of(timing::TICKS_PER_STATUS);
                self.last = record;
            }
            if count == 0 {
                break;
            }
            if let Some(bytes) = frame.finish(count) {
                send(bytes);
            }
        }
        self.tell(line);
        if status_due && let Some(bytes) = self.report().write(&mut self.frame) {
            send(bytes);
        }
    }

    /// The readable trace, and a word on every new fault.
    fn tell(&mut self, line: Option<Record>) {
        let fault = self.last.status.fault().unwrap_or_default();
        if fault != self.fault {
            self.fault = fault;
            defmt::warn!("fault {=u8}: {=str}", fault as u8, fault.text());
        }
        if let Some(record) = line {
            let state = record.status.state().unwrap_or_default();
            defmt::info!(
                "{=u32} {=str}: z {=f32} rad, v {=f32} rad/s, torque {=f32} N m",
                record.tick,
                state.text(),
                record.z_time_free_rad,
                record.velocity_rad_s,
                record.torque_ref_nm
            );
        }
    }

    fn report(&self) -> Report {
        let of = |counter: &AtomicU32| counter.load(Ordering::Relaxed);
        let stats = &exchange::SHARED.stats;
        Report {
            protocol_version: PROTOCOL_VERSION,
            tick: of(&stats.ticks),
            status: self.last.status,
            parameter_version: of(&PARAMETER_VERSION),
            queue_overruns: of(&stats.queue_overruns),
            frames_dropped: of(&FRAMES_DROPPED),
            log_frames_dropped: of(&LOG_FRAMES_DROPPED),
            rejected: [
                of(&stats.rejected_encoder),
                of(&stats.rejected_luenberger),
                of(&stats.rejected_time_free),
            ],
            requests_refused: of(&stats.requests_refused),
            latency_cycles: [of(&stats.latency_cycles), of(&stats.most_latency_cycles)],
            run_cycles: [of(&stats.run_cycles), of(&stats.most_run_cycles)],
        }
    }
}
