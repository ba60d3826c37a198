//! The last samples, and windows of them thinned to what a terminal can show.

use bristle_core::trace::Status;
use bristle_gap::capture::Sample;
use std::collections::VecDeque;

/// Longest time that is kept, s.
const KEPT_S: f64 = 60.0;

/// What is kept of a sample: 36 bytes, so that a minute at full rate takes 22 MB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// s
    pub time_s: f64,
    /// Since the first one, in counts.
    pub counts: i64,
    /// rad/s
    pub velocity_rad_s: f32,
    /// N m
    pub torque_nm: f32,
    /// Of the Luenberger-like observer, rad.
    pub z_rad: f32,
    /// Of the time-free observer, rad.
    pub z_time_free_rad: f32,
    /// State, limit, fault.
    pub status: Status,
}

impl From<&Sample> for Point {
    fn from(sample: &Sample) -> Self {
        let record = &sample.record;
        Self {
            time_s: sample.time_s,
            counts: sample.counts,
            velocity_rad_s: record.velocity_rad_s,
            torque_nm: record.torque_ref_nm,
            z_rad: record.z_luenberger_rad,
            z_time_free_rad: record.z_time_free_rad,
            status: record.status,
        }
    }
}

/// The last samples in order.
#[derive(Default)]
pub struct Buffer {
    points: VecDeque<Point>,
}

impl Buffer {
    /// Takes the next one.
    pub fn push(&mut self, point: Point) {
        // A stream that began anew is another one.
        if self
            .points
            .back()
            .is_some_and(|last| point.time_s <= last.time_s)
        {
            self.points.clear();
        }
        self.points.push_back(point);
        while self
            .points
            .front()
            .is_some_and(|first| first.time_s < point.time_s - KEPT_S)
        {
            self.points.pop_front();
        }
    }

    /// The newest.
    pub fn last(&self) -> Option<&Point> {
        self.points.back()
    }

    /// The oldest.
    pub fn first(&self) -> Option<&Point> {
        self.points.front()
    }

    /// The samples from one time up to another.
    pub fn window(&self, from_s: f64, to_s: f64) -> impl ExactSizeIterator<Item = &Point> + Clone {
        let begin = self.points.partition_point(|point| point.time_s < from_s);
        let end = self.points.partition_point(|point| point.time_s <= to_s);
        self.points.range(begin..end.max(begin))
    }
}

/// A curve of a window as least and largest value of each of so many columns: nothing of a peak is lost.
pub fn envelope<'a>(
    points: impl Iterator<Item = &'a Point>,
    columns: usize,
    from_s: f64,
    to_s: f64,
    value: impl Fn(&Point) -> f64,
) -> Vec<(f64, f64)> {
    let mut curve: Vec<(f64, f64)> = Vec::with_capacity(2 * columns);
    let width_s = (to_s - from_s).max(f64::MIN_POSITIVE) / columns as f64;
    let mut last = usize::MAX;
    for point in points {
        let y = value(point);
        if !y.is_finite() {
            continue;
        }
        let column = ((point.time_s - from_s) / width_s) as usize;
        if column == last {
            // Two points stand for a column: the least, then the largest.
            let n = curve.len();
            curve[n - 2].1 = curve[n - 2].1.min(y);
            curve[n - 1].1 = curve[n - 1].1.max(y);
        } else {
            last = column;
            curve.extend([(point.time_s, y); 2]);
        }
    }
    curve
}

/// A curve of two values against each other, every n-th sample of a window so that no more than so many are left.
pub fn against<'a>(
    points: impl ExactSizeIterator<Item = &'a Point>,
    most: usize,
    pair: impl Fn(&Point) -> (f64, f64),
) -> Vec<(f64, f64)> {
    let every = points.len().div_ceil(most.max(1)).max(1);
    points
        .step_by(every)
        .map(pair)
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect()
}

/// Least and largest value with a twentieth of room; never empty.
pub fn bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values {
        low = low.min(value);
        high = high.max(value);
    }
    if low > high || (low == 0.0 && high == 0.0) {
        return [-1.0, 1.0];
    }
    let room = if low < high {
        0.05 * (high - low)
    } else {
        0.5 * high.abs()
    };
    [low - room, high + room]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(tick: u32) -> Point {
        Point {
            time_s: f64::from(tick) * 1e-4,
            counts: i64::from(tick),
            velocity_rad_s: if tick == 777 { 100.0 } else { 0.0 },
            torque_nm: f32::NAN,
            z_rad: tick as f32,
            z_time_free_rad: 0.0,
            status: Status::default(),
        }
    }

    fn buffer(ticks: u32) -> Buffer {
        let mut buffer = Buffer::default();
        (0..ticks).for_each(|tick| buffer.push(point(tick)));
        buffer
    }

    #[test]
    fn a_minute_is_kept_and_a_new_stream_begins_anew() {
        let mut buffer = buffer(700_000);
        assert!((buffer.first().unwrap().time_s - 9.9999).abs() < 1e-9);
        assert_eq!(buffer.window(20.0, 20.9999).len(), 10_000);
        assert_eq!(buffer.window(1e3, 2e3).len(), 0);
        buffer.push(point(3));
        assert_eq!(buffer.window(0.0, 1e9).len(), 1);
    }

    #[test]
    fn an_envelope_keeps_the_one_sample_that_stands_out() {
        let buffer = buffer(10_000);
        let velocity = |point: &Point| f64::from(point.velocity_rad_s);
        let curve = envelope(buffer.window(0.0, 1.0), 50, 0.0, 1.0, velocity);
        assert_eq!(curve.len(), 100);
        assert_eq!(curve.iter().filter(|(_, y)| *y == 100.0).count(), 1);
        // What is no number is no point.
        let torque = |point: &Point| f64::from(point.torque_nm);
        assert!(envelope(buffer.window(0.0, 1.0), 50, 0.0, 1.0, torque).is_empty());
    }

    #[test]
    fn a_pair_is_thinned_to_what_is_asked_for() {
        let buffer = buffer(10_000);
        let pair = |point: &Point| (f64::from(point.velocity_rad_s), f64::from(point.z_rad));
        let curve = against(buffer.window(0.0, 1.0), 300, pair);
        assert!((200..=300).contains(&curve.len()), "{}", curve.len());
        assert_eq!(bounds(curve.iter().map(|(x, _)| *x)), [-1.0, 1.0]);
        assert_eq!(bounds([2.0, 2.0].into_iter()), [1.0, 3.0]);
        assert_eq!(bounds([].into_iter()), [-1.0, 1.0]);
    }
}
