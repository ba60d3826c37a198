//! What a sum of curves over nodes leaves of a rest, on data that took no part: ridge regression, its ridge by leaving out.
//!
//! Source: Hoerl, Kennard 1970, "Ridge regression: biased estimation for nonorthogonal problems", Technometrics 12(1).

use super::regime::{FOLDS, Node, Regime};
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

/// Ridges that are tried, where a weighted rest of one is noise.
const RIDGES: [f64; 6] = [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0];

/// Nodes of a rest, and how much each counts.
pub(super) struct Seen<'a> {
    pub(super) nodes: &'a [Node],
    pub(super) weights: &'a [f64],
}

impl Seen<'_> {
    /// What so many curves, of which `curve` gives one at a node, leave over of a rest at each node, N m, each part of the data by what the
    /// others say.
    pub(super) fn left_over(
        &self,
        rest_nm: &[f64],
        curves: usize,
        curve: impl Fn(usize, usize) -> f64 + Sync,
    ) -> Vec<f64> {
        let Self { nodes, weights } = *self;
        let counts = |i: &usize| {
            let node = &nodes[*i];
            !node.excluded && node.regime != Regime::Rest && weights[*i] > 0.0
        };
        let folds: Vec<Fold> = (0..FOLDS)
            .into_par_iter()
            .map(|fold| {
                let rows: Vec<usize> = (0..nodes.len())
                    .filter(|i| nodes[*i].fold == fold)
                    .filter(counts)
                    .collect();
                let seen = DMatrix::from_fn(rows.len(), curves, |row, at| {
                    weights[rows[row]] * curve(rows[row], at)
                });
                let rest = DVector::from_iterator(
                    rows.len(),
                    rows.iter().map(|&i| weights[i] * rest_nm[i]),
                );
                Fold {
                    square: seen.tr_mul(&seen),
                    slope: seen.tr_mul(&rest),
                    rows,
                    seen,
                    rest,
                }
            })
            .collect();
        // For each part of the data and ridge what is left of the rest, weighted.
        let left: Vec<Vec<DVector<f64>>> = (0..FOLDS)
            .into_par_iter()
            .map(|fold| {
                let others = folds.iter().enumerate().filter(|(at, _)| *at != fold);
                let mut square = DMatrix::zeros(curves, curves);
                let mut slope = DVector::zeros(curves);
                for (_, other) in others {
                    square += &other.square;
                    slope += &other.slope;
                }
                let here = &folds[fold];
                RIDGES
                    .iter()
                    .map(|&ridge| {
                        let mut square = square.clone();
                        for i in 0..curves {
                            square[(i, i)] += ridge;
                        }
                        match Cholesky::new(square) {
                            Some(root) => &here.rest - &here.seen * root.solve(&slope),
                            None => here.rest.clone(),
                        }
                    })
                    .collect()
            })
            .collect();
        let mut out = rest_nm.to_vec();
        for (fold, here) in folds.iter().enumerate() {
            // The ridge that does best on the other parts.
            let squares = |ridge: usize| -> f64 {
                let others = left.iter().enumerate().filter(|(at, _)| *at != fold);
                others.map(|(_, left)| left[ridge].norm_squared()).sum()
            };
            let others = folds.iter().enumerate().filter(|(at, _)| *at != fold);
            let unexplained: f64 = others.map(|(_, other)| other.rest.norm_squared()).sum();
            let best = (0..RIDGES.len()).min_by(|a, b| squares(*a).total_cmp(&squares(*b)));
            if let Some(best) = best.filter(|&best| squares(best) < unexplained) {
                for (&i, left) in here.rows.iter().zip(left[fold][best].iter()) {
                    out[i] = left / weights[i];
                }
            }
        }
        out
    }
}

/// A part of the data: its nodes, curves at each, and the rest, all weighted.
struct Fold {
    rows: Vec<usize>,
    seen: DMatrix<f64>,
    rest: DVector<f64>,
    square: DMatrix<f64>,
    slope: DVector<f64>,
}
