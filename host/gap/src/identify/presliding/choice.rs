//! Model order and delay by evidence: what a model leaves of a part of the record that it was not fitted to.
//!
//! One is worse than the best if its squared errors are larger by twice the standard error of their difference (Diebold
//! and Mariano, J. Business and Economic Statistics 13(3), 1995); of those that are not, the simplest is taken.

use super::arx::{Model, Record, refined};

/// A model order and delay with what it leaves of the part of the record that it was not fitted to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Poles.
    pub order: usize,
    /// Samples of delay beyond the one that a sampled system has.
    pub delay: usize,
    /// Rms of position less simulated position, rad.
    pub held_out_rms_rad: f64,
    /// Not worse than the best.
    pub as_good: bool,
}

/// Longest stretch on which order and delay are chosen, samples.
const SAMPLES: usize = 30_000;
/// Parts of the held-out stretch whose mean squared errors are compared.
const PARTS: usize = 20;

struct Tried {
    model: Model,
    squares: Vec<f64>,
    mean: f64,
}

/// Orders 1 to 3 and delays 0 to 3, the chosen one first, then by error; and of those with two poles the model to go on
/// from: least delay of those as good as the best of them.
pub(super) fn choose(record: Record<'_>) -> (Vec<Candidate>, Option<Model>) {
    let n = record.position.len().min(SAMPLES);
    let (fitted, held_out) = (record.part(0, 2 * n / 3), record.part(2 * n / 3, n));
    let mut all: Vec<Tried> = (1..=3)
        .flat_map(|order| (0..=3).map(move |delay| (order, delay)))
        .filter_map(|(order, delay)| {
            let model = refined(fitted, order, delay)?;
            let residuals = model.residuals(held_out);
            let length = (residuals.len() / PARTS).max(1);
            let squares: Vec<f64> = residuals
                .chunks_exact(length)
                .map(|part| part.iter().map(|e| e * e).sum::<f64>() / length as f64)
                .collect();
            let mean = squares.iter().sum::<f64>() / squares.len() as f64;
            mean.is_finite().then_some(Tried {
                model,
                squares,
                mean,
            })
        })
        .collect();
    all.sort_by(|a, b| a.mean.total_cmp(&b.mean));
    let two = all.iter().filter(|tried| tried.model.order == 2);
    let start = two
        .clone()
        .next()
        .and_then(|best| {
            two.filter(|tried| !worse(tried, best))
                .min_by_key(|tried| tried.model.delay)
        })
        .map(|tried| tried.model.clone());
    let mut candidates: Vec<Candidate> = all
        .iter()
        .map(|tried| Candidate {
            order: tried.model.order,
            delay: tried.model.delay,
            held_out_rms_rad: tried.mean.sqrt(),
            as_good: !worse(tried, &all[0]),
        })
        .collect();
    candidates.sort_by_key(|c| {
        if c.as_good {
            (0, c.order, c.delay)
        } else {
            (1, 0, 0)
        }
    });
    (candidates, start)
}

fn worse(tried: &Tried, best: &Tried) -> bool {
    let differences: Vec<f64> = tried
        .squares
        .iter()
        .zip(&best.squares)
        .map(|(a, b)| a - b)
        .collect();
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    mean > 2.0 * (variance / n).sqrt()
}
