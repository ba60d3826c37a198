//! What a captured stream held and lacked.

use bristle_core::status::Report;
use bristle_core::trace::Record;

/// Most faults that are kept one by one.
pub const MOST_FAULTS: usize = 100;

/// A fault where it first showed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaultSeen {
    /// Time of the sample, s.
    pub time_s: f64,
    /// Its number.
    pub tick: u32,
    /// Number of the fault.
    pub number: u8,
    /// In words.
    pub text: &'static str,
}

/// How long something limited the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LimitSeen {
    /// Number of the limit.
    pub number: u8,
    /// In words.
    pub text: &'static str,
    /// Samples that say so.
    pub samples: u64,
}

/// What a stream held.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// Ticks a second.
    pub rate_hz: f64,
    /// Bytes of the stream.
    pub bytes: u64,
    /// Samples that arrived.
    pub samples: u64,
    /// Samples that did not, by the numbers of those that did.
    pub lost: u64,
    /// Places at which they are missing.
    pub gaps: u64,
    /// Times the numbers began anew.
    pub restarts: u32,
    /// Samples whose torque or velocity is no finite number; a log cannot hold them.
    pub not_finite: u64,
    /// Time of the first sample, s.
    pub first_s: f64,
    /// Time of the last sample, s.
    pub last_s: f64,
    /// Frames with a wrong checksum.
    pub damaged_frames: u32,
    /// Frames with a right checksum and a content that does not fit.
    pub odd_frames: u64,
    /// Bytes that belong to no whole frame.
    pub other_bytes: u64,
    /// Each fault as it showed, the first [`MOST_FAULTS`].
    pub faults: Vec<FaultSeen>,
    /// Faults, those that are not kept among them.
    pub faults_in_all: u64,
    /// What limited the output, by its number.
    pub limits: Vec<LimitSeen>,
    /// The last sample.
    pub last: Option<Record>,
    /// The last status frame.
    pub report: Option<Report>,
    /// The version of a stream of another form.
    pub foreign_version: Option<u32>,
}
