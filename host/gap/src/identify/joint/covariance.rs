//! How well a fit knows its coordinates.

use super::fit::{Data, Joint};
use crate::inverse::{Own, Owner};
use nalgebra::{Cholesky, DMatrix, DVector};
use std::collections::BTreeMap;

/// Length of a block, s: longer than anything but drift remembers.
const BLOCK_S: f64 = 0.5;
/// Blocks of a short record, and the least that a spread can be taken from.
const LEAST_BLOCKS: f64 = 16.0;

/// Covariance of the fitted coordinates.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// Sandwich, with the few blocks allowed for.
    pub robust: DMatrix<f64>,
    /// What independent errors of the weights' size would give, with the priors.
    pub plain: DMatrix<f64>,
}

impl Covariance {
    /// Of a fit; none where the logs and priors leave a parameter without any hold.
    pub fn new(data: &Data, joint: &Joint) -> Option<Self> {
        let free = &joint.model.free;
        let prior = DMatrix::from_diagonal(&DVector::from_iterator(
            free.len(),
            free.iter().map(|free| free.spread.powi(-2)),
        ));
        let jacobian = &joint.fit.jacobian;
        let plain = Cholesky::new(jacobian.tr_mul(jacobian) + &prior)?.inverse();
        let mut scores: BTreeMap<(usize, usize, usize), DVector<f64>> = BTreeMap::new();
        for (row, node) in data.nodes.iter().enumerate() {
            let weight = data.weights[row];
            if weight == 0.0 {
                continue;
            }
            let record = &data.records[node.record];
            let whole_s = record
                .stretches
                .iter()
                .map(|stretch| stretch.effort_nm.len() as f64 * record.step_s)
                .sum::<f64>();
            let block_s = BLOCK_S.min(whole_s / LEAST_BLOCKS);
            let block = (node.sample as f64 * record.step_s / block_s) as usize;
            let score = jacobian.row(row).transpose() * (joint.fit.left_over[row] * weight);
            *scores
                .entry((node.record, node.stretch, block))
                .or_insert_with(|| DVector::zeros(free.len())) += score;
        }
        let mut square = prior;
        for score in scores.values() {
            square += score * score.transpose();
        }
        let blocks = scores.len() as f64;
        let few = blocks / (blocks - free.len() as f64).max(1.0);
        let robust = &plain * square * &plain * few;
        Some(Self { robust, plain })
    }

    /// Standard deviation of a coordinate: never less than that of independent errors.
    pub fn spread(&self, i: usize) -> f64 {
        self.robust[(i, i)].max(self.plain[(i, i)]).sqrt()
    }

    /// Correlation of two coordinates.
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        self.robust[(i, j)] / (self.robust[(i, i)] * self.robust[(j, j)]).sqrt()
    }
}

/// Whether a parameter is one of what presliding, break-away and the Stribeck curve show: the cost is no parabola of these.
pub(super) fn is_curved(owner: Owner) -> bool {
    matches!(
        owner,
        Owner::Own(
            Own::StictionExcess
                | Own::StribeckVelocity
                | Own::Stiffness
                | Own::Damping
                | Own::BreakawayRatio
        )
    )
}
