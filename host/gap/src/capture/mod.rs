//! The firmware's binary stream, bytes in and samples out: frames may be cut, damaged, lost or none at all.
//!
//! Time is the number of the tick over the tick rate, so that samples that were lost leave a gap in it. Where the
//! numbers begin anew, since the microcontroller did, time goes on after a second, and the count of ticks and the
//! encoder's from there.

mod mcap;
mod recorder;
mod summary;
mod write;

pub use self::mcap::About;
pub use recorder::Recorder;
pub use summary::{FaultSeen, LimitSeen, MOST_FAULTS, Summary};
pub(crate) use write::word;
pub use write::{Layout, Position};

use bristle_core::status::{PROTOCOL_VERSION, Report};
use bristle_core::supervisor::{Fault, Limit};
use bristle_core::trace::{self, Continuity, Record};
use bristle_core::wire::{Decoder, Frame, Kind, MOST_PAYLOAD_BYTES, OVERHEAD_BYTES, Reader};
use std::collections::BTreeMap;

const MOST_FRAME_BYTES: usize = MOST_PAYLOAD_BYTES + OVERHEAD_BYTES;

/// A sample of the stream with its place in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Since boot, s.
    pub time_s: f64,
    /// Encoder position; the counter's wraps are undone.
    pub counts: i64,
    /// As sent.
    pub record: Record,
}

/// Decodes a stream. Feed it, then finish it; no bytes make it panic.
#[derive(Debug)]
pub struct Capture {
    frames: Box<Decoder<MOST_FRAME_BYTES>>,
    order: Order,
    notes: Notes,
    most_s: f64,
    enough: bool,
    finished: bool,
}

impl Capture {
    /// At the beginning of a stream of so many ticks a second.
    pub fn new(rate_hz: f64) -> Self {
        Self {
            frames: Box::default(),
            order: Order::new(rate_hz),
            notes: Notes::default(),
            most_s: f64::INFINITY,
            enough: false,
            finished: false,
        }
    }

    /// Takes samples of so much time from the first one on, and leaves the rest.
    #[must_use]
    pub fn at_most(mut self, most_s: f64) -> Self {
        self.most_s = most_s;
        self
    }

    /// Takes bytes and gives the samples that they complete.
    ///
    /// # Errors
    /// The first of `take`; what follows in `bytes` is lost then.
    pub fn feed<E>(
        &mut self,
        mut bytes: &[u8],
        mut take: impl FnMut(&Sample) -> Result<(), E>,
    ) -> Result<(), E> {
        self.notes.bytes += bytes.len() as u64;
        while !bytes.is_empty() {
            let taken = self.frames.feed(bytes);
            bytes = bytes.get(taken..).unwrap_or_default();
            while let Some(frame) = self.frames.next_frame() {
                self.notes.frame(&frame);
                for record in trace::samples(&frame) {
                    if self.enough || self.notes.foreign_version.is_some() {
                        break;
                    }
                    let mut order = self.order;
                    let sample = order.place(record);
                    // Half a tick, since the limit is where the next one would be.
                    let left_s = self.most_s - self.notes.until_s(&sample) - 0.5 / order.rate_hz;
                    if left_s < 0.0 {
                        self.enough = true;
                        break;
                    }
                    self.order = order;
                    if self.notes.sample(&sample) {
                        take(&sample)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Ends the stream. A false start may have held whole frames back; they come out here.
    ///
    /// # Errors
    /// The first of `take`.
    pub fn finish<E>(&mut self, take: impl FnMut(&Sample) -> Result<(), E>) -> Result<Summary, E> {
        let before = (self.notes.bytes, self.notes.frames);
        let damaged = self.frames.damaged_frames;
        let done = self.feed(&[0; MOST_FRAME_BYTES], take);
        self.notes.bytes = before.0;
        self.finished = true;
        if self.notes.frames == before.1 {
            // Nothing stood behind it: a frame that the end cut, not a damaged one.
            self.frames.damaged_frames = damaged;
        }
        done.map(|()| self.summary())
    }

    /// What was seen so far.
    pub fn summary(&self) -> Summary {
        let other_bytes = if self.finished {
            self.notes.bytes.saturating_sub(self.notes.frame_bytes)
        } else {
            u64::from(self.frames.skipped_bytes)
        };
        let limit = |(&number, &samples): (&u8, &u64)| LimitSeen {
            number,
            text: Limit::of(number).map_or("unknown limit", Limit::text),
            samples,
        };
        Summary {
            rate_hz: self.order.rate_hz,
            bytes: self.notes.bytes,
            samples: self.order.continuity.received,
            lost: self.order.continuity.lost,
            gaps: self.order.gaps,
            restarts: self.order.continuity.restarts,
            not_finite: self.notes.not_finite,
            first_s: self.notes.first_s,
            last_s: self.notes.last_s,
            damaged_frames: self.frames.damaged_frames,
            odd_frames: self.notes.odd_frames,
            other_bytes,
            faults: self.notes.faults.clone(),
            faults_in_all: self.notes.faults_in_all,
            limits: self.notes.limits.iter().map(limit).collect(),
            last: self.notes.last,
            report: self.notes.report,
            foreign_version: self.notes.foreign_version,
        }
    }

    /// Samples that arrived and samples that did not.
    pub fn counts(&self) -> (u64, u64) {
        (self.order.continuity.received, self.order.continuity.lost)
    }

    /// Time from the first sample to the last, s.
    pub fn span_s(&self) -> f64 {
        self.notes.last_s - self.notes.first_s
    }

    /// Whether more bytes would change nothing: there is enough, or the stream has another form.
    pub fn is_done(&self) -> bool {
        self.enough || self.notes.foreign_version.is_some()
    }
}

/// Puts samples in order: numbers and counters that do not wrap.
#[derive(Clone, Copy, Debug)]
struct Order {
    rate_hz: f64,
    continuity: Continuity,
    gaps: u64,
    last: Option<Last>,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    /// Number of the tick, without wraps and restarts.
    tick: u64,
    raw_counts: i32,
    counts: i64,
}

impl Order {
    fn new(rate_hz: f64) -> Self {
        Self {
            rate_hz,
            continuity: Continuity::default(),
            gaps: 0,
            last: None,
        }
    }

    fn place(&mut self, record: Record) -> Sample {
        let restarts = self.continuity.restarts;
        let missing = self.continuity.accept(record.tick);
        self.gaps += u64::from(missing > 0);
        let begins = self.continuity.restarts != restarts;
        let (tick, counts) = match self.last {
            None => (u64::from(record.tick), i64::from(record.counts)),
            // Nobody knows how long the restart took.
            Some(last) if begins => (
                last.tick
                    .saturating_add(self.rate_hz.ceil() as u64)
                    .max(last.tick + 2),
                i64::from(record.counts),
            ),
            Some(last) => {
                let step = record.counts.wrapping_sub(last.raw_counts);
                let counts = last.counts.saturating_add(i64::from(step));
                (last.tick + 1 + u64::from(missing), counts)
            }
        };
        self.last = Some(Last {
            tick,
            raw_counts: record.counts,
            counts,
        });
        Sample {
            time_s: tick as f64 / self.rate_hz,
            counts,
            record,
        }
    }
}

/// What a summary is made of.
#[derive(Clone, Debug, Default)]
struct Notes {
    bytes: u64,
    frames: u64,
    frame_bytes: u64,
    odd_frames: u64,
    not_finite: u64,
    first_s: f64,
    last_s: f64,
    last: Option<Record>,
    fault: u8,
    faults: Vec<FaultSeen>,
    faults_in_all: u64,
    limits: BTreeMap<u8, u64>,
    report: Option<Report>,
    foreign_version: Option<u32>,
}

impl Notes {
    fn frame(&mut self, frame: &Frame<'_>) {
        self.frames += 1;
        self.frame_bytes += (frame.payload.len() + OVERHEAD_BYTES) as u64;
        match frame.kind {
            Kind::Samples => {
                let samples = trace::samples(frame).count();
                self.odd_frames += u64::from(samples == 0 && frame.count > 0);
            }
            Kind::Status => {
                let version = Reader(frame.payload).u32();
                if version.is_some_and(|version| version != PROTOCOL_VERSION) {
                    self.foreign_version = version;
                } else if let Some(report) = Report::read(frame) {
                    self.report = Some(report);
                } else {
                    self.odd_frames += 1;
                }
            }
            Kind::Reply | Kind::Burst | Kind::Command => {}
        }
    }

    /// Time from the first sample to this one, s.
    fn until_s(&self, sample: &Sample) -> f64 {
        match self.last {
            Some(_) => sample.time_s - self.first_s,
            None => 0.0,
        }
    }

    /// Notes a sample; whether a log may hold it.
    fn sample(&mut self, sample: &Sample) -> bool {
        let record = &sample.record;
        if self.last.is_none() {
            self.first_s = sample.time_s;
        }
        self.last_s = sample.time_s;
        self.last = Some(*record);
        let [_, limit, fault, _] = record.status.0.to_le_bytes();
        *self.limits.entry(limit).or_default() += 1;
        if fault != self.fault && fault != Fault::None as u8 {
            self.faults_in_all += 1;
            if self.faults.len() < MOST_FAULTS {
                self.faults.push(FaultSeen {
                    time_s: sample.time_s,
                    tick: record.tick,
                    number: fault,
                    text: Fault::of(fault).map_or("unknown fault", Fault::text),
                });
            }
        }
        self.fault = fault;
        let finite = record.torque_ref_nm.is_finite() && record.velocity_rad_s.is_finite();
        self.not_finite += u64::from(!finite);
        finite
    }
}

#[cfg(test)]
mod mcap_tests;
#[cfg(test)]
mod tests;
