//! Logs as a diagnosis may use them: what hygiene leaves out is left out, what it finds is noted.

use crate::axis_file::AxisFile;
use crate::believed::Believed;
use crate::error::InputError;
use crate::hygiene::{Code, Hygiene, Severity, inspect};
use crate::inverse::Record;
use crate::log::Log;
use std::ops::Range;

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
            let excluded: Vec<Range<usize>> = hygiene
                .excluded
                .iter()
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
