//! How much of the gap a hypothesis closes on part of the data that took no part in its fit.

use super::regime::{FOLDS, Node, Regime};
use super::tried::Search;
use serde::Serialize;

/// 95 % quantile of a Student distribution with four degrees of freedom, one less than there are folds.
const STUDENT_95: f64 = 2.132;

/// How much of the gap is closed, with a 90 % interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Closed {
    /// (before - after)/(before - floor).
    pub value: f64,
    /// 5 % quantile.
    pub low: f64,
    /// 95 % quantile.
    pub high: f64,
}

/// A part of the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Rms of the refitted simulator, with the hypothesis, and of the floor, N m.
    pub rms_nm: [f64; 3],
    /// Share of the gap that is closed.
    pub closed: Closed,
}

/// The part of the data that `keep` says, with this left over of data that took no part; none where it is empty. The interval is from the jackknife over folds.
pub fn closed_over(
    search: &Search,
    held_out: &[f64],
    keep: &dyn Fn(&Node) -> bool,
) -> Option<Part> {
    let mut sums = [[0.0; 4]; FOLDS];
    for (i, node) in search.nodes.iter().enumerate() {
        if !node.excluded && keep(node) {
            let sums = &mut sums[node.fold];
            sums[0] += search.base.held_out[i].powi(2);
            sums[1] += held_out[i].powi(2);
            sums[2] += search.noise.group(node).floor_nm.powi(2);
            sums[3] += 1.0;
        }
    }
    let rms_without = |left_out: Option<usize>| {
        let mut total = [0.0; 4];
        for (_, sums) in sums
            .iter()
            .enumerate()
            .filter(|(fold, _)| Some(*fold) != left_out)
        {
            for (total, sum) in total.iter_mut().zip(sums) {
                *total += sum;
            }
        }
        [0, 1, 2].map(|i| f64::sqrt(total[i] / f64::max(total[3], 1.0)))
    };
    let share = |[before, after, floor]: [f64; 3]| {
        let least = floor.min(after).min(before);
        if before > least {
            (before - after) / (before - least)
        } else {
            0.0
        }
    };
    if sums.iter().all(|sums| sums[3] == 0.0) {
        return None;
    }
    let rms_nm = rms_without(None);
    let value = share(rms_nm);
    let parts: Vec<f64> = (0..FOLDS)
        .filter(|&fold| sums[fold][3] > 0.0)
        .map(|fold| share(rms_without(Some(fold))))
        .collect();
    let count = parts.len() as f64;
    let mean = parts.iter().sum::<f64>() / count;
    let square: f64 = parts.iter().map(|x| (x - mean).powi(2)).sum();
    let half = STUDENT_95 * ((count - 1.0) / count * square).sqrt();
    Some(Part {
        rms_nm,
        closed: Closed {
            value,
            low: value - half,
            high: (value + half).min(1.0),
        },
    })
}

/// How much of the gap is closed by what leaves this over of held-out data; the interval by the jackknife over folds.
pub fn closed(search: &Search, held_out: &[f64]) -> Closed {
    closed_over(search, held_out, &|node| node.regime != Regime::Rest)
        .map_or_else(Closed::default, |part| part.closed)
}
