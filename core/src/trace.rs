//! The numbered sample that leaves the control tick, and its wire form in [`crate::wire`] frames.

use crate::experiment::End;
use crate::supervisor::{Fault, Limit, State};
use crate::wire::{Frame, FrameWriter, Kind, Reader};

/// Bytes of a sample on the wire.
pub const SAMPLE_BYTES: usize = 28;
/// Most samples in a frame.
pub const MOST_SAMPLES: usize = 32;

/// A tick, as it is traced.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// Number of the tick since boot; wraps after five days.
    pub tick: u32,
    /// The encoder's free-running counter.
    pub counts: i32,
    /// z of the Luenberger-like observer, rad.
    pub z_luenberger_rad: f32,
    /// z of the time-free observer, rad.
    pub z_time_free_rad: f32,
    /// Velocity of the Luenberger-like observer, rad/s.
    pub velocity_rad_s: f32,
    /// Torque put out by this tick, N m.
    pub torque_ref_nm: f32,
    /// How the supervisor stands.
    pub status: Status,
}

impl Record {
    /// Of no tick.
    pub const EMPTY: Self = Self {
        tick: 0,
        counts: 0,
        z_luenberger_rad: 0.0,
        z_time_free_rad: 0.0,
        velocity_rad_s: 0.0,
        torque_ref_nm: 0.0,
        status: Status(0),
    };
}

/// State, limit, fault and flags in one word, a byte each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status(pub u32);

/// An experiment plays.
pub const FLAG_EXPERIMENT: u8 = 1;
/// The drive is enabled.
pub const FLAG_DRIVE_ENABLED: u8 = 2;
/// The encoder's index has been seen since boot.
pub const FLAG_INDEX_SEEN: u8 = 4;
/// Samples before this one were lost, since the queue was full.
pub const FLAG_OVERRUN: u8 = 8;
/// Place of [`End`] in the flags: why the last experiment ended.
pub const END_SHIFT: u32 = 4;

impl Status {
    /// Puts the four together.
    #[inline]
    pub fn new(state: State, limit: Limit, fault: Fault, flags: u8) -> Self {
        Self(u32::from_le_bytes([
            state as u8,
            limit as u8,
            fault as u8,
            flags,
        ]))
    }

    /// With flags besides.
    #[inline]
    pub fn with(self, flags: u8) -> Self {
        Self(self.0 | u32::from(flags) << 24)
    }

    /// With a limit, where it has none.
    #[inline]
    pub fn limited(self, limit: Limit) -> Self {
        Self(self.0 | (limit as u32) << 8)
    }

    /// State; `None` for a number that no state has.
    pub fn state(self) -> Option<State> {
        State::of(self.0.to_le_bytes()[0])
    }

    /// What limits the output.
    pub fn limit(self) -> Option<Limit> {
        Limit::of(self.0.to_le_bytes()[1])
    }

    /// Latched fault.
    pub fn fault(self) -> Option<Fault> {
        Fault::of(self.0.to_le_bytes()[2])
    }

    /// Why the last experiment ended; `None` for a number that no end has.
    pub fn ended(self) -> Option<End> {
        End::of(self.flags() >> END_SHIFT)
    }

    /// Flags.
    pub fn flags(self) -> u8 {
        self.0.to_le_bytes()[3]
    }
}

/// Starts a frame of samples; [`put`] them, then finish it with their number.
pub fn begin(buffer: &mut [u8]) -> FrameWriter<'_> {
    FrameWriter::new(buffer, Kind::Samples)
}

/// Adds a sample.
pub fn put(frame: &mut FrameWriter<'_>, record: &Record) {
    frame.u32(record.tick);
    frame.u32(record.counts.cast_unsigned());
    frame.f32(record.z_luenberger_rad);
    frame.f32(record.z_time_free_rad);
    frame.f32(record.velocity_rad_s);
    frame.f32(record.torque_ref_nm);
    frame.u32(record.status.0);
}

/// The samples of a frame; none if it holds something else or its length and count disagree.
pub fn samples<'a>(frame: &Frame<'a>) -> impl Iterator<Item = Record> + 'a {
    let whole = frame.kind == Kind::Samples
        && frame.payload.len() == usize::from(frame.count) * SAMPLE_BYTES;
    let payload: &'a [u8] = if whole { frame.payload } else { &[] };
    payload.chunks_exact(SAMPLE_BYTES).filter_map(read)
}

/// Starts a frame of a burst's samples from a number on; [`put`] them, then finish it with how many there are.
pub fn begin_burst(buffer: &mut [u8], first: u16) -> FrameWriter<'_> {
    let mut frame = FrameWriter::new(buffer, Kind::Burst);
    frame.u16(first);
    frame
}

/// The number of the first sample in a burst's frame, and the samples; `None` if it holds something else or its length
/// and count disagree.
pub fn burst<'a>(frame: &Frame<'a>) -> Option<(u16, impl Iterator<Item = Record> + 'a)> {
    let (first, samples) = frame.payload.split_first_chunk()?;
    let whole =
        frame.kind == Kind::Burst && samples.len() == usize::from(frame.count) * SAMPLE_BYTES;
    let samples = samples.chunks_exact(SAMPLE_BYTES).filter_map(read);
    whole.then_some((u16::from_le_bytes(*first), samples))
}

fn read(bytes: &[u8]) -> Option<Record> {
    let mut bytes = Reader(bytes);
    Some(Record {
        tick: bytes.u32()?,
        counts: bytes.u32()?.cast_signed(),
        z_luenberger_rad: bytes.f32()?,
        z_time_free_rad: bytes.f32()?,
        velocity_rad_s: bytes.f32()?,
        torque_ref_nm: bytes.f32()?,
        status: Status(bytes.u32()?),
    })
}

/// Counts the samples that are missing from a trace, by their numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Continuity {
    expected: Option<u32>,
    /// Samples that arrived.
    pub received: u64,
    /// Samples that never did.
    pub lost: u64,
    /// Times the numbers went backwards: the microcontroller started anew.
    pub restarts: u32,
}

impl Continuity {
    /// Takes the number of the next sample and gives how many are missing before it.
    pub fn accept(&mut self, tick: u32) -> u32 {
        let missing = self
            .expected
            .map_or(0, |expected| tick.wrapping_sub(expected));
        self.expected = Some(tick.wrapping_add(1));
        self.received += 1;
        if missing.cast_signed() < 0 {
            self.restarts += 1;
            return 0;
        }
        self.lost += u64::from(missing);
        missing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Decoder, OVERHEAD_BYTES};
    use std::vec::Vec;

    const FLAGS: u8 = FLAG_EXPERIMENT | (End::Torque as u8) << END_SHIFT;

    fn record(tick: u32) -> Record {
        Record {
            tick,
            counts: -5,
            z_luenberger_rad: 1.5e-3,
            z_time_free_rad: -2.5e-3,
            velocity_rad_s: f32::MIN_POSITIVE,
            torque_ref_nm: 0.035,
            status: Status::new(State::Armed, Limit::Slew, Fault::None, FLAGS),
        }
    }

    #[test]
    fn a_batch_comes_back_bit_for_bit() {
        let mut buffer = [0; MOST_SAMPLES * SAMPLE_BYTES + OVERHEAD_BYTES];
        let mut frame = begin(&mut buffer);
        let sent: Vec<Record> = (0..MOST_SAMPLES as u32).map(record).collect();
        sent.iter().for_each(|record| put(&mut frame, record));
        let bytes = frame.finish(MOST_SAMPLES as u8).unwrap();
        let mut decoder = Decoder::<1024>::new();
        assert_eq!(decoder.feed(bytes), bytes.len());
        let frame = decoder.next_frame().unwrap();
        let got: Vec<Record> = samples(&frame).collect();
        assert_eq!(got, sent);
        let status = got[0].status;
        assert_eq!(status.state(), Some(State::Armed));
        assert_eq!(status.limit(), Some(Limit::Slew));
        assert_eq!(status.fault(), Some(Fault::None));
        assert_eq!(status.flags(), FLAGS);
        assert_eq!(status.ended(), Some(End::Torque));
    }

    #[test]
    fn a_count_that_does_not_fit_the_length_gives_nothing() {
        for (kind, count, length) in [
            (Kind::Samples, 2, SAMPLE_BYTES),
            (Kind::Samples, 1, SAMPLE_BYTES + 1),
            (Kind::Status, 1, SAMPLE_BYTES),
        ] {
            let payload = std::vec![0; length];
            let frame = Frame {
                kind,
                count,
                payload: &payload,
            };
            assert_eq!(samples(&frame).count(), 0);
        }
    }

    #[test]
    fn losses_show_in_the_numbers() {
        let mut continuity = Continuity::default();
        let missing = [7, 8, 12, 13, u32::MAX].map(|tick| continuity.accept(tick));
        // Backwards by more than half the range is forwards; u32::MAX after 13 is a restart.
        assert_eq!(missing, [0, 0, 3, 0, 0]);
        assert_eq!((continuity.lost, continuity.restarts), (3, 1));
        assert_eq!(continuity.accept(0), 0);
        assert_eq!(continuity.received, 6);
    }
}
