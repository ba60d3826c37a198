//! Whether probabilities mean what they say: reliability table, Brier score, expected calibration error.

use serde::Serialize;

/// A bin of probability.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// Lowest probability in it.
    pub from: f64,
    /// Highest.
    pub to: f64,
    /// Answers in it.
    pub count: usize,
    /// Their mean probability.
    pub said: f64,
    /// Share of them that were right.
    pub right: f64,
}

/// Calibration of a set of answers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// Answers that gave a probability.
    pub count: usize,
    /// Mean square of probability less 1 for right and 0 for wrong.
    pub brier: f64,
    /// Mean distance between what was said and what was right, over bins, weighted by answers.
    pub expected_error: f64,
    /// Bins that hold answers.
    pub bins: Vec<Bin>,
}

const BINS: usize = 10;

/// Calibration of probabilities that came with what was right or wrong; `None` without any.
pub fn calibration(answers: &[(f64, bool)]) -> Option<Calibration> {
    if answers.is_empty() {
        return None;
    }
    let count = answers.len() as f64;
    let worth = |right: bool| f64::from(u8::from(right));
    let bins: Vec<Bin> = (0..BINS)
        .filter_map(|i| {
            let (from, to) = (i as f64 / BINS as f64, (i + 1) as f64 / BINS as f64);
            // A probability of one belongs to the last.
            let place = |p: f64| ((p.clamp(0.0, 1.0) * BINS as f64) as usize).min(BINS - 1);
            let mine: Vec<_> = answers.iter().filter(|(p, _)| place(*p) == i).collect();
            let n = mine.len() as f64;
            (n > 0.0).then(|| Bin {
                from,
                to,
                count: mine.len(),
                said: mine.iter().map(|(p, _)| p).sum::<f64>() / n,
                right: mine.iter().map(|(_, right)| worth(*right)).sum::<f64>() / n,
            })
        })
        .collect();
    Some(Calibration {
        count: answers.len(),
        brier: answers
            .iter()
            .map(|(p, right)| (p - worth(*right)).powi(2))
            .sum::<f64>()
            / count,
        expected_error: bins
            .iter()
            .map(|bin| (bin.said - bin.right).abs() * bin.count as f64 / count)
            .sum(),
        bins,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic() {
        let answers = [
            (0.95, true),
            (0.95, true),
            (0.95, true),
            (0.95, false),
            (0.45, false),
            (1.0, true),
        ];
        let c = calibration(&answers).unwrap();
        assert_eq!((c.count, c.bins.len()), (6, 2));
        assert_eq!((c.bins[1].count, c.bins[1].right), (5, 0.8));
        assert!((c.bins[1].said - 0.96).abs() < 1e-12);
        // (5 times 0.16 and once 0.45)/6
        assert!((c.expected_error - (5.0 * 0.16 + 0.45) / 6.0).abs() < 1e-12);
        let brier = (3.0 * 0.0025 + 0.9025 + 0.2025 + 0.0) / 6.0;
        assert!((c.brier - brier).abs() < 1e-12);
        assert!(calibration(&[]).is_none());
    }
}
