//! Thinning long lines for drawing without losing peaks.
//!
//! Plain subsampling would drop the short peaks a reader looks for (a stick-slip jump, a single
//! bad sample). So samples are put into buckets, and of each bucket the extremes are kept. The
//! kept samples are original samples at their own places, nothing is averaged.

/// The samples to draw of a time plot whose `lines` share one x.
///
/// Returns ascending indices: of each bucket and line the first minimum, first maximum and first
/// gap (not finite), and the first and last sample of all. `None` if `len` does not exceed
/// `limit`.
pub(super) fn envelope(len: usize, lines: &[&[f64]], limit: usize) -> Option<Vec<usize>> {
    if len <= limit {
        return None;
    }
    // Each line asks for two samples per bucket. With many lines the buckets would become coarser
    // than the pixels of a wide screen, so the count has a floor and the limit gives way.
    let buckets = (limit / (2 * lines.len().max(1))).max(MIN_BUCKETS);
    let size = len.div_ceil(buckets);
    let mut keep = vec![0];
    for start in (0..len).step_by(size) {
        let end = (start + size).min(len);
        for line in lines {
            keep_extremes(line, start, end, &mut keep);
        }
    }
    keep.push(len - 1);
    keep.sort_unstable();
    keep.dedup();
    Some(keep)
}

/// The points to draw of a curve whose x need not ascend (a loop).
///
/// Buckets run along the order of the points; of each the extremes in x and in y are kept.
pub(super) fn outline(xs: &[f64], ys: &[f64], limit: usize) -> Option<Vec<usize>> {
    envelope(xs.len().min(ys.len()), &[xs, ys], limit)
}

/// A bucket per pixel of a wide screen.
const MIN_BUCKETS: usize = 2_000;

fn keep_extremes(line: &[f64], start: usize, end: usize, keep: &mut Vec<usize>) {
    let mut min: Option<usize> = None;
    let mut max: Option<usize> = None;
    let mut gap: Option<usize> = None;
    for i in start..end {
        let v = line.get(i).copied().unwrap_or(f64::NAN);
        if !v.is_finite() {
            gap = gap.or(Some(i));
            continue;
        }
        if min.is_none_or(|m| v < line[m]) {
            min = Some(i);
        }
        if max.is_none_or(|m| v > line[m]) {
            max = Some(i);
        }
    }
    keep.extend([min, max, gap].into_iter().flatten());
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise that repeats, from a small generator.
    fn noise(n: usize) -> Vec<f64> {
        let mut s = 1_u32;
        (0..n)
            .map(|_| {
                s = s.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(s) / f64::from(u32::MAX)
            })
            .collect()
    }

    #[test]
    fn short_lines_stay() {
        assert_eq!(envelope(100, &[&noise(100)], 100), None);
    }

    #[test]
    fn single_peaks_survive_wherever_they_are() {
        let n = 1_000_003;
        for at in [0, 1, 77, 500_000, n - 2, n - 1] {
            let mut a = noise(n);
            let mut b = noise(n);
            a[at] = 50.0;
            b[n - 1 - at] = -50.0;
            let keep = envelope(n, &[&a, &b], 20_000).unwrap();
            assert!(keep.contains(&at) && keep.contains(&(n - 1 - at)), "{at}");
            assert!(keep.len() <= 20_002, "{}", keep.len());
            assert!(keep.windows(2).all(|w| w[0] < w[1]));
            assert_eq!((keep[0], *keep.last().unwrap()), (0, n - 1));
        }
    }

    #[test]
    fn every_bucket_keeps_its_extremes() {
        let n = 100_000;
        let a = noise(n);
        let keep = envelope(n, &[&a], 20_000).unwrap();
        let size = n.div_ceil(10_000);
        for (bucket, values) in a.chunks(size).enumerate() {
            let inside: Vec<f64> = keep
                .iter()
                .filter(|&&i| i / size == bucket)
                .map(|&i| a[i])
                .collect();
            let all = |v: &[f64], f: fn(f64, f64) -> f64| v.iter().copied().reduce(f).unwrap();
            assert_eq!(all(&inside, f64::min), all(values, f64::min));
            assert_eq!(all(&inside, f64::max), all(values, f64::max));
        }
    }

    #[test]
    fn gaps_stay_gaps() {
        let mut a = noise(100_000);
        a[40_000..60_000].fill(f64::NAN);
        a[777] = f64::NAN;
        let keep = envelope(a.len(), &[&a], 20_000).unwrap();
        assert!(keep.contains(&777));
        assert!(
            keep.iter()
                .filter(|&&i| (40_000..60_000).contains(&i))
                .all(|&i| a[i].is_nan())
        );
        assert!(keep.iter().any(|&i| (40_000..60_000).contains(&i)));
    }

    #[test]
    fn a_loop_keeps_its_extremes_in_x_and_y() {
        let n = 400_000;
        let t = |i: usize| i as f64 * 1e-3;
        let xs: Vec<f64> = (0..n).map(|i| t(i).cos()).collect();
        let mut ys: Vec<f64> = (0..n).map(|i| t(i).sin()).collect();
        ys[123_456] = 3.0;
        let keep = outline(&xs, &ys, 20_000).unwrap();
        assert!(keep.contains(&123_456));
        let widest = keep.iter().map(|&i| xs[i]).fold(f64::MIN, f64::max);
        assert_eq!(widest, 1.0);
    }
}
