//! The status frame: counters, timing and versions, a few times a second.

use crate::trace::Status;
use crate::wire::{Frame, FrameWriter, Kind, Reader};

/// Number of this wire form; a host that knows another one must not guess.
pub const PROTOCOL_VERSION: u32 = 2;

/// How the firmware fares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// [`PROTOCOL_VERSION`]
    pub protocol_version: u32,
    /// Ticks since boot.
    pub tick: u32,
    /// How the supervisor stands.
    pub status: Status,
    /// Version of the parameters in use; 0 are those of the image.
    pub parameter_version: u32,
    /// Samples that found the queue full.
    pub queue_overruns: u32,
    /// Binary frames that found no room on the link.
    pub frames_dropped: u32,
    /// Lines of the readable trace that found no room on the link.
    pub log_frames_dropped: u32,
    /// Samples rejected by encoder, Luenberger-like and time-free observer.
    pub rejected: [u32; 3],
    /// Requests that came at a time when they could not be followed, such as arming in a fault.
    pub requests_refused: u32,
    /// Core cycles from timer to handler: of the last tick, and the most so far.
    pub latency_cycles: [u32; 2],
    /// Core cycles from the handler's entry to the end of what follows it: of the last tick, and the most so far.
    pub run_cycles: [u32; 2],
}

const WORDS: usize = 14;

impl Report {
    fn words(&self) -> [u32; WORDS] {
        [
            self.protocol_version,
            self.tick,
            self.status.0,
            self.parameter_version,
            self.queue_overruns,
            self.frames_dropped,
            self.log_frames_dropped,
            self.rejected[0],
            self.rejected[1],
            self.rejected[2],
            self.requests_refused,
            self.latency_cycles[0] | (self.latency_cycles[1] << 16),
            self.run_cycles[0],
            self.run_cycles[1],
        ]
    }

    /// Writes the frame. Latencies are cut to 16 bits, as the timer that measures them is.
    pub fn write<'a>(&self, buffer: &'a mut [u8]) -> Option<&'a [u8]> {
        let mut frame = FrameWriter::new(buffer, Kind::Status);
        let mut limited = *self;
        limited.latency_cycles = limited.latency_cycles.map(|cycles| cycles.min(0xffff));
        limited.words().iter().for_each(|&word| frame.u32(word));
        frame.finish(1)
    }

    /// Reads it back.
    pub fn read(frame: &Frame<'_>) -> Option<Self> {
        if frame.kind != Kind::Status {
            return None;
        }
        let mut bytes = Reader(frame.payload);
        let mut words = [0; WORDS];
        for word in &mut words {
            *word = bytes.u32()?;
        }
        bytes.end()?;
        let [
            protocol_version,
            tick,
            status,
            parameter_version,
            queue_overruns,
            frames_dropped,
            log_frames_dropped,
            encoder,
            luenberger,
            time_free,
            requests_refused,
            latency,
            run,
            most_run,
        ] = words;
        Some(Self {
            protocol_version,
            tick,
            status: Status(status),
            parameter_version,
            queue_overruns,
            frames_dropped,
            log_frames_dropped,
            rejected: [encoder, luenberger, time_free],
            requests_refused,
            latency_cycles: [latency & 0xffff, latency >> 16],
            run_cycles: [run, most_run],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Decoder;

    #[test]
    fn comes_back() {
        let report = Report {
            protocol_version: PROTOCOL_VERSION,
            tick: 123,
            status: Status(0x0102_0304),
            parameter_version: 2,
            queue_overruns: 3,
            frames_dropped: 4,
            log_frames_dropped: 5,
            rejected: [6, 7, 8],
            requests_refused: 9,
            latency_cycles: [14, 1 << 15],
            run_cycles: [500, 600],
        };
        let mut buffer = [0; 128];
        let bytes = report.write(&mut buffer).unwrap();
        let mut decoder = Decoder::<128>::new();
        decoder.feed(bytes);
        assert_eq!(Report::read(&decoder.next_frame().unwrap()), Some(report));
    }
}
