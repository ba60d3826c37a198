//! What every step asks of a record.

use crate::signal::extent;

/// Least step between two positions that differ: the encoder's count, or the resolution of the print; zero where nothing
/// moves.
pub(super) fn grid(position: &[f64]) -> f64 {
    let mut steps: Vec<f64> = position
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|&step| step > 0.0)
        .collect();
    if steps.is_empty() {
        return 0.0;
    }
    // Rounding makes some steps smaller than a count; hardly one in a hundred.
    let place = steps.len() / 100;
    *steps.select_nth_unstable_by(place, f64::total_cmp).1
}

/// From the least to the greatest; zero for nothing.
pub(super) fn span(values: &[f64]) -> f64 {
    let (low, high) = extent(values);
    if low <= high { high - low } else { 0.0 }
}
