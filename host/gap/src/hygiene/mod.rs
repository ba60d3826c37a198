//! What is wrong with a log, found and named before anything is fitted to it.
//!
//! Every check is shy: it speaks only where a sound record of a rough axis could not look the same. A linear axis reads
//! m for rad and N for N m.

mod balance;
mod effort;
mod jump;
mod limits;
mod position;
mod regression;
mod spot;
mod timing;
mod velocity;

use crate::axis_file::AxisFile;
use crate::error::InputError;
use crate::log::Log;
use crate::stretch::stretches;
pub use balance::{Balance, Estimate, Skew};
pub use jump::Jump;
use std::fmt;
use std::ops::Range;
use std::path::Path;

/// What a finding is about. [`Code::name`] is stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Code {
    /// Samples are missing.
    Gap,
    /// Uneven sampling.
    Jitter,
    /// Fewer samples than any fit needs.
    TooShort,
    /// The position never changes by more than a count.
    NeverMoved,
    /// Effort and motion have opposite signs.
    WrongSign,
    /// Inertia and viscous friction, or the grid of positions, are off by one factor.
    WrongScale,
    /// Effort at its limit.
    Saturated,
    /// An effort column that is zero throughout.
    ZeroEffort,
    /// The position stands still under an effort that must move it.
    StuckEncoder,
    /// A single position far off its neighbours.
    PositionOutlier,
    /// The position jumps faster than the effort can move it.
    PositionJump,
    /// The velocity column is not the derivative of the position.
    VelocityMismatch,
    /// Effort and position were not recorded at the same time.
    TimingSkew,
}

impl Code {
    /// Name for programs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gap => "gap",
            Self::Jitter => "jitter",
            Self::TooShort => "too-short",
            Self::NeverMoved => "never-moved",
            Self::WrongSign => "wrong-sign",
            Self::WrongScale => "wrong-scale",
            Self::Saturated => "saturated",
            Self::ZeroEffort => "zero-effort",
            Self::StuckEncoder => "stuck-encoder",
            Self::PositionOutlier => "position-outlier",
            Self::PositionJump => "position-jump",
            Self::VelocityMismatch => "velocity-mismatch",
            Self::TimingSkew => "timing-skew",
        }
    }
}

/// What a finding means for a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// A guess that other causes explain as well.
    Note,
    /// The stretches stand in [`Hygiene::excluded`]; the rest is sound.
    Excluded,
    /// A fit runs; its result should be read with this in mind.
    Warning,
    /// A fit would give wrong numbers, or none.
    Fatal,
}

/// Something wrong with a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// About what.
    pub code: Code,
    /// What it means for a fit.
    pub severity: Severity,
    /// One line with its numbers; the remedy, if any, stands behind the last semicolon.
    pub text: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.code.name(), self.text)
    }
}

impl Finding {
    /// As an error of the log's file.
    pub fn error(&self, file: &Path) -> InputError {
        let (what, remedy) = self
            .text
            .rsplit_once("; ")
            .unwrap_or((self.text.as_str(), "record again"));
        InputError::new(file, format!("{}: {what}", self.code.name()), remedy)
    }
}

/// Samples that no fit should use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excluded {
    /// Samples of the log.
    pub samples: Range<usize>,
    /// Why.
    pub code: Code,
}

/// State of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hygiene {
    /// What is wrong, the worst first.
    pub findings: Vec<Finding>,
    /// By their first sample; two of different codes may overlap.
    pub excluded: Vec<Excluded>,
    /// Steps that the position made and the axis did not, by their sample.
    pub jumps: Vec<Jump>,
    /// Effort as inertia, friction and offset times what was measured, where the log shows enough of it.
    pub balance: Option<Balance>,
    /// When the effort was recorded against the position: information, not a finding, below a sample or so.
    pub skew: Option<Skew>,
}

impl Hygiene {
    /// A fit to the log would give wrong numbers, or none.
    pub fn is_fatal(&self) -> bool {
        self.findings
            .iter()
            .any(|finding| finding.severity == Severity::Fatal)
    }

    /// True for each sample that may be used.
    pub fn usable(&self, samples: usize) -> Vec<bool> {
        let mut usable = vec![true; samples];
        for excluded in &self.excluded {
            let range = excluded.samples.start.min(samples)..excluded.samples.end.min(samples);
            usable[range].fill(false);
        }
        usable
    }

    fn find(&mut self, code: Code, severity: Severity, text: String) {
        self.findings.push(Finding {
            code,
            severity,
            text,
        });
    }

    /// Merges overlapping ranges of one code; gives their number and the samples in them.
    fn exclude(&mut self, code: Code, mut ranges: Vec<Range<usize>>) -> (usize, usize) {
        ranges.sort_by_key(|range| range.start);
        let mut merged: Vec<Range<usize>> = Vec::new();
        for range in ranges {
            match merged.last_mut() {
                Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
                _ => merged.push(range),
            }
        }
        let counted = (merged.len(), merged.iter().map(Range::len).sum());
        self.excluded
            .extend(merged.into_iter().map(|samples| Excluded { samples, code }));
        counted
    }
}

/// Inspects a log.
///
/// # Errors
/// Log and axis file do not fit each other.
pub fn inspect(log: &Log, axis: &AxisFile) -> Result<Hygiene, InputError> {
    let mut out = Hygiene::default();
    let stretches = stretches(log, axis)?;
    timing::inspect(log, &mut out);
    effort::inspect(log, axis, &mut out)?;
    let grid = position::inspect(log, axis, &stretches, &mut out)?;
    if !out.is_fatal() {
        balance::inspect(log, axis, &stretches, grid, &mut out)?;
    }
    out.findings
        .sort_by_key(|finding| (std::cmp::Reverse(finding.severity), finding.code));
    out.excluded
        .sort_by_key(|excluded| (excluded.samples.start, excluded.code));
    Ok(out)
}

/// "1 stretch", "3 stretches".
fn many(count: usize, one: &str, more: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { more })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merges_ranges_of_one_code() {
        let mut hygiene = Hygiene::default();
        let counted = hygiene.exclude(Code::Saturated, vec![10..20, 0..5, 18..30]);
        assert_eq!(counted, (2, 25));
        let usable = hygiene.usable(25);
        assert_eq!(usable.iter().filter(|usable| **usable).count(), 5);
        assert!(usable[5] && !usable[10] && !usable[24]);
    }
}
