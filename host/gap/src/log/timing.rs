//! How evenly a log is sampled.

use super::Log;
use std::ops::Range;

/// An interval without samples where there should be some.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// Index of the last sample before it.
    pub before: usize,
    /// Time of that sample, s.
    pub start_s: f64,
    /// Time of the next sample, s.
    pub end_s: f64,
}

/// An interval this many median steps long is a gap: half a step is more than any jitter worth the name.
const GAP_STEPS: f64 = 1.5;
/// Deviation from the median step that still counts as uniform, as a part of the step: rounding of printed times.
const UNIFORM_PART: f64 = 0.01;

impl Log {
    /// Median of the sampling intervals, s; zero with fewer than two samples.
    pub fn median_step_s(&self) -> f64 {
        let mut steps: Vec<f64> = self.steps_s().collect();
        if steps.is_empty() {
            return 0.0;
        }
        let middle = steps.len() / 2;
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// Intervals longer than 1.5 median steps.
    pub fn gaps(&self) -> Vec<Gap> {
        let limit_s = GAP_STEPS * self.median_step_s();
        self.time_s
            .windows(2)
            .enumerate()
            .filter_map(|(before, pair)| match *pair {
                [start_s, end_s] if end_s - start_s > limit_s => Some(Gap {
                    before,
                    start_s,
                    end_s,
                }),
                _ => None,
            })
            .collect()
    }

    /// Samples of each stretch without a gap.
    pub fn stretches(&self) -> Vec<Range<usize>> {
        let mut start = 0;
        self.gaps()
            .into_iter()
            .map(|gap| gap.before + 1)
            .chain([self.len()])
            .map(|end| std::mem::replace(&mut start, end)..end)
            .collect()
    }

    /// Root-mean-square deviation of the intervals from their median, s; gaps do not count.
    pub fn jitter_s(&self) -> f64 {
        let median_s = self.median_step_s();
        let (sum, count) = self
            .steps_s()
            .filter(|&step| step <= GAP_STEPS * median_s)
            .fold((0.0, 0.0), |(sum, count), step| {
                (sum + (step - median_s).powi(2), count + 1.0)
            });
        if count > 0.0 {
            f64::sqrt(sum / count)
        } else {
            0.0
        }
    }

    /// No gaps, and every interval within 1 % of the median.
    pub fn is_uniform(&self) -> bool {
        let median_s = self.median_step_s();
        self.steps_s()
            .all(|step| (step - median_s).abs() <= UNIFORM_PART * median_s)
    }

    fn steps_s(&self) -> impl Iterator<Item = f64> {
        self.time_s.windows(2).map(|pair| pair[1] - pair[0])
    }
}
