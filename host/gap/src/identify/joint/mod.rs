//! The joint fit: all parameters of a friction model from any mix of logs.

mod fit;
mod start;

pub use fit::{Data, Joint, entries};
pub use start::{OFFSET, prepare};

use crate::log::Log;
use std::ops::Range;

/// A log and the samples of it that no one should fit.
pub struct Usable {
    /// The log.
    pub log: Log,
    /// Ranges of its samples.
    pub excluded: Vec<Range<usize>>,
}
