//! Gaps, jitter, and logs that are too short.

use super::{Code, Hygiene, Severity, many};
use crate::log::Log;

/// Fewer samples than this hold no transient worth fitting.
const FEWEST_SAMPLES: usize = 100;
/// Jitter that is worth a word, as a part of the step: below it, resampling costs nothing that shows.
const JITTER_PART: f64 = 0.02;

pub(super) fn inspect(log: &Log, out: &mut Hygiene) {
    let step_s = log.median_step_s();
    let gaps = log.gaps();
    if let Some(longest) = gaps
        .iter()
        .max_by(|a, b| (a.end_s - a.start_s).total_cmp(&(b.end_s - b.start_s)))
    {
        let lost_s: f64 = gaps
            .iter()
            .map(|gap| gap.end_s - gap.start_s - step_s)
            .sum();
        let text = format!(
            "{} in time, {lost_s:.6} s missing, the longest {:.6} s from {:.6} s on: what lies between gaps is used \
             piece by piece",
            many(gaps.len(), "gap", "gaps"),
            longest.end_s - longest.start_s,
            longest.start_s
        );
        // The sample before a gap states an effort that holds until a sample that is not there.
        let before = gaps.iter().map(|gap| gap.before..gap.before + 1).collect();
        out.exclude(Code::Gap, before);
        out.find(Code::Gap, Severity::Excluded, text);
    }
    let jitter_s = log.jitter_s();
    if jitter_s > JITTER_PART * step_s {
        let text = format!(
            "sampling times jitter by {:.3} us rms, {:.1} % of the {:.6} ms step: signals are brought to even times, which \
             costs their highest frequencies",
            jitter_s * 1e6,
            100.0 * jitter_s / step_s,
            step_s * 1e3
        );
        out.find(Code::Jitter, Severity::Warning, text);
    }
    if log.len() < FEWEST_SAMPLES {
        let text = format!(
            "{} samples over {:.4} s are too few for any fit; record at least {FEWEST_SAMPLES}",
            log.len(),
            log.time_s.last().unwrap_or(&0.0) - log.time_s.first().unwrap_or(&0.0)
        );
        out.find(Code::TooShort, Severity::Fatal, text);
    }
}
