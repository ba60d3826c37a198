//! Logs as a diagnosis may use them: what hygiene leaves out is left out, what it finds is noted.
//!
//! Two findings may be what is sought: jumps of few counts are lost counts, and a standstill at an end of the travel is
//! an end stop. They stay in where the catalogue holds that effect.

use crate::axis_file::AxisFile;
use crate::believed::Believed;
use crate::error::InputError;
use crate::hygiene::{Code, Excluded, Hygiene, Severity, inspect};
use crate::inverse::Record;
use crate::log::Log;
use bristle_plant::effect::Entry;
use std::ops::Range;

/// Largest jump that lost counts explain, in counts: the end of their usual range.
const LOST_COUNTS: f64 = 100.0;
/// Part of the travel that counts as its end.
const END_PART: f64 = 0.02;

/// The logs, prepared.
pub(super) struct Sound {
    /// Those that move; all of them where none does.
    pub(super) records: Vec<Record>,
    /// Findings, a line each.
    pub(super) notes: Vec<String>,
    /// At least one log moves.
    pub(super) moves: bool,
}

pub(super) fn sound(
    logs: &[Log],
    axis: &AxisFile,
    believed: &Believed,
    catalogue: &[&'static Entry],
) -> Result<Sound, InputError> {
    let inspected = logs
        .iter()
        .map(|log| inspect(log, axis))
        .collect::<Result<Vec<Hygiene>, _>>()?;
    let still = |hygiene: &Hygiene| {
        hygiene
            .findings
            .iter()
            .any(|finding| finding.code == Code::NeverMoved)
    };
    let moves = !inspected.iter().all(still);
    let (mut records, mut notes) = (Vec::new(), Vec::new());
    for (log, hygiene) in logs.iter().zip(&inspected) {
        for finding in &hygiene.findings {
            if finding.severity == Severity::Fatal && finding.code != Code::NeverMoved {
                return Err(finding.error(&log.file));
            }
            notes.push(format!("{}: {finding}", log.file.display()));
        }
        if !(moves && still(hygiene)) {
            let position = log.position_rad(axis)?;
            let sought = Sought {
                position_rad: &position,
                rad_per_count: believed.rad_per_count(),
                catalogue,
            };
            let excluded: Vec<Range<usize>> = hygiene
                .excluded
                .iter()
                .filter(|excluded| !sought.is(excluded))
                .map(|excluded| excluded.samples.clone())
                .collect();
            records.push(Record::new(log, axis, believed, &excluded)?);
        }
    }
    Ok(Sound {
        records,
        notes,
        moves,
    })
}

/// What the catalogue may explain.
struct Sought<'a> {
    position_rad: &'a [f64],
    rad_per_count: f64,
    catalogue: &'a [&'static Entry],
}

impl Sought<'_> {
    fn is(&self, excluded: &Excluded) -> bool {
        let has = |id: &str| self.catalogue.iter().any(|entry| entry.id == id);
        match excluded.code {
            Code::PositionJump => {
                has("sensor.lost_counts")
                    && self.jump_rad(&excluded.samples) <= LOST_COUNTS * self.rad_per_count
            }
            Code::StuckEncoder => {
                has("mechanics.end_stop") && self.at_an_end(excluded.samples.start)
            }
            _ => false,
        }
    }

    /// How far the position leaves the line that it was on.
    fn jump_rad(&self, samples: &Range<usize>) -> f64 {
        let q = self.position_rad;
        let last = samples.start.saturating_sub(1);
        let after = samples.end.min(q.len() - 1);
        let from = last.saturating_sub(10);
        let speed = (q[last] - q[from]) / (last - from).max(1) as f64;
        (q[after] - q[last] - speed * (after - last) as f64).abs()
    }

    fn at_an_end(&self, sample: usize) -> bool {
        let (low, high) = self
            .position_rad
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &q| {
                (low.min(q), high.max(q))
            });
        let part = (self.position_rad[sample] - low) / (high - low);
        !(END_PART..=1.0 - END_PART).contains(&part)
    }
}
