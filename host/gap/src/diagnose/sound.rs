//! Logs as a diagnosis may use them: what hygiene leaves out is left out, what it finds is noted.
//!
//! Two findings may be what is sought, where the catalogue holds that effect: steps of the position are lost counts, and
//! a standstill at an end of the travel is an end stop, which stays in.

use super::lost::{LOST_COUNTS, Lost, Steps, mended};
use crate::axis_file::AxisFile;
use crate::believed::Believed;
use crate::error::InputError;
use crate::floor::drift_nm;
use crate::hygiene::{Code, Excluded, Finding, Hygiene, Jump, Severity, inspect};
use crate::inverse::Record;
use crate::log::Log;
use crate::signal::{extent, rms};
use bristle_plant::effect::Entry;
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// Part of the travel that counts as its end.
const END_PART: f64 = 0.02;

/// The logs, prepared.
pub(super) struct Sound {
    /// Those that move and whose scale agrees with the others; all of them where none moves.
    pub(super) records: Vec<Record>,
    /// Findings, a line each.
    pub(super) notes: Vec<String>,
    /// At least one log moves.
    pub(super) moves: bool,
    /// The counts that they lost.
    pub(super) lost: Option<Lost>,
    /// Slow drift, N m rms over the logs whose reference repeats; none where none does.
    pub(super) drift_nm: Option<f64>,
}

pub(super) fn sound(
    logs: &[Log],
    axis: &AxisFile,
    believed: &Believed,
    catalogue: &[&'static Entry],
) -> Result<Sound, InputError> {
    let inspected = logs
        .par_iter()
        .map(|log| inspect(log, axis))
        .collect::<Result<Vec<Hygiene>, _>>()?;
    let still = |hygiene: &Hygiene| {
        hygiene
            .findings
            .iter()
            .any(|finding| finding.code == Code::NeverMoved)
    };
    let moves = !inspected.iter().all(still);
    // The encoder is one for all logs: one whose scale alone is off is left out.
    let off_scale = |hygiene: &Hygiene| {
        let of_scale = |finding: &Finding| {
            finding.severity == Severity::Fatal && finding.code == Code::WrongScale
        };
        hygiene.findings.iter().any(of_scale)
    };
    let in_scale = inspected
        .iter()
        .any(|hygiene| hygiene.balance.is_some() && !off_scale(hygiene));
    let spared = |code: Code| code == Code::NeverMoved || (code == Code::WrongScale && in_scale);
    let stops = catalogue
        .iter()
        .any(|entry| entry.id == "mechanics.end_stop");
    let mut notes = Vec::new();
    for (log, hygiene) in logs.iter().zip(&inspected) {
        for finding in &hygiene.findings {
            if finding.severity == Severity::Fatal && !spared(finding.code) {
                return Err(finding.error(&log.file));
            }
            let left_out = if in_scale && finding.code == Code::WrongScale && off_scale(hygiene) {
                "; left out, as other logs agree with the file"
            } else {
                ""
            };
            notes.push(format!("{}: {finding}{left_out}", log.file.display()));
        }
    }
    let prepared = logs
        .par_iter()
        .zip(&inspected)
        .filter(|(_, hygiene)| !(moves && still(hygiene) || in_scale && off_scale(hygiene)))
        .map(|(log, hygiene)| prepared(log, hygiene, axis, believed, stops))
        .collect::<Result<Vec<Prepared>, InputError>>()?;
    let mut steps = Steps::default();
    let mut records = Vec::new();
    for one in prepared {
        match one.jumped {
            Some(jumped) => steps.add(&jumped.position_rad, jumped.jumps, jumped.as_recorded),
            None => steps.none(),
        }
        records.push(one.record);
    }
    let mut lost = steps.lost(believed.unit);
    let listed = catalogue.iter().any(|entry| entry.id == LOST_COUNTS);
    // Steps that do not speak for it by themselves may be few of many: a fit of all shows that, and takes none out that it counts on.
    if let Some(hardly) = lost.take_if(|lost| listed && !lost.is_shown()) {
        records = hardly.as_recorded(&records);
    }
    let drifts: Vec<f64> = logs
        .par_iter()
        .zip(&inspected)
        .filter_map(|(log, hygiene)| drift_nm(log, axis, hygiene))
        .collect();
    Ok(Sound {
        records,
        notes,
        moves,
        lost,
        drift_nm: (!drifts.is_empty()).then(|| rms(drifts)),
    })
}

/// A log, prepared.
struct Prepared<'a> {
    record: Record,
    /// Where its encoder jumped: what was made of it.
    jumped: Option<Jumped<'a>>,
}

struct Jumped<'a> {
    position_rad: Cow<'a, [f64]>,
    jumps: &'a [Jump],
    /// With the jumps in it.
    as_recorded: Record,
}

fn prepared<'a>(
    log: &'a Log,
    hygiene: &'a Hygiene,
    axis: &AxisFile,
    believed: &Believed,
    stops: bool,
) -> Result<Prepared<'a>, InputError> {
    let position_rad = log.position_rad(axis)?;
    let at_a_stop = |excluded: &Excluded| {
        stops
            && excluded.code == Code::StuckEncoder
            && at_an_end(&position_rad, excluded.samples.start)
    };
    let left_out = |also: &dyn Fn(&Excluded) -> bool| -> Vec<Range<usize>> {
        hygiene
            .excluded
            .iter()
            .filter(|excluded| !at_a_stop(excluded) && also(excluded))
            .map(|excluded| excluded.samples.clone())
            .collect()
    };
    let all = left_out(&|_| true);
    if hygiene.jumps.is_empty() {
        return Ok(Prepared {
            record: Record::new(log, axis, believed, &all)?,
            jumped: None,
        });
    }
    let mended = mended(log, &hygiene.jumps, believed.rad_per_count());
    let record = Record::new(&mended, axis, believed, &all)?;
    let moved = |excluded: &Excluded| excluded.code != Code::PositionJump;
    let as_recorded = Record::new(log, axis, believed, &left_out(&moved))?;
    Ok(Prepared {
        jumped: Some(Jumped {
            as_recorded: as_recorded.seen_through(record.kernel),
            jumps: &hygiene.jumps,
            position_rad,
        }),
        record,
    })
}

/// Whether a sample lies at an end of the travel.
fn at_an_end(position_rad: &[f64], sample: usize) -> bool {
    let (low, high) = extent(position_rad);
    let part = (position_rad[sample] - low) / (high - low);
    !(END_PART..=1.0 - END_PART).contains(&part)
}
