//! Numbers by chance.

use proptest::prelude::*;
use std::ops::Range;

/// Even over a range. Drawn in f64: proptest's sampler of f32 ranges asserts about its own rounding, which now and then
/// fails and with it a test of something else.
pub fn even(range: Range<f64>) -> impl Strategy<Value = f32> {
    range.prop_map(|x| x as f32)
}
