//! Which effects these logs can tell apart: the change that each makes, beyond what the simulator's own parameters can
//! do, laid against that of each other.

use super::hypothesis::{change, cosine};
use super::tried::Search;
use super::verdict::Verdict;
use nalgebra::DVector;

/// Correlation from which two effects look the same here.
const ALIKE: f64 = 0.95;

/// Groups of fitted effects that look the same, as ids.
pub fn groups(search: &Search, verdict: &Verdict) -> Vec<Vec<String>> {
    let single: Vec<_> = verdict
        .ranked
        .iter()
        .filter(|(hypothesis, _)| hypothesis.added.len() == 1)
        .collect();
    let changes: Vec<DVector<f64>> = single
        .iter()
        .map(|(hypothesis, _)| {
            let (before, after) = (&search.base.fit.left_over, &hypothesis.fit.left_over);
            change(before, after, &search.weights)
        })
        .collect();
    let mut groups = Vec::new();
    for i in 0..changes.len() {
        for j in 0..i {
            if cosine(&changes[i], &changes[j]).abs() > ALIKE {
                groups.push(vec![
                    single[j].0.added[0].id.to_string(),
                    single[i].0.added[0].id.to_string(),
                ]);
            }
        }
    }
    groups
}
