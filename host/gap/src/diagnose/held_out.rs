//! What a model leaves over on data that took no part in its fit.
//!
//! A fit without a fold lies one Gauss-Newton step from the fit with all of them: solving that step costs a factorisation,
//! where fitting anew costs hundreds of passes over the records.

use super::hypothesis::makes_steps;
use super::regime::{FOLDS, Node};
use crate::inverse::{Fit, Model, Owner};
use nalgebra::{Cholesky, DMatrix, DVector};

/// A step is cut to so many standard deviations of the fit with all folds, of each parameter and, of those that stand for each other, of what
/// they are together: farther out the model is not straight.
const FARTHEST: f64 = 4.0;

/// A parameter of an effect of which one fold tells this part of what all tell, as of a stop that was hit once, is not left to what others
/// tell of it there. Its price is the Occam factor. Not of a step of the position, which has its moment to choose: two of them gained 98 nats by what the
/// method left over of a clean axis (trial 9400).
const ALONE: f64 = 0.9;
/// It is held by so many times what all tell of it.
const HOLDS: f64 = 1e6;

/// What each node leaves over under the fit of the other folds, N m.
pub fn held_out(model: &Model, fit: &Fit, weights: &[f64], nodes: &[Node]) -> Vec<f64> {
    let columns = model.free.len();
    let mut whole = DMatrix::<f64>::zeros(columns, columns);
    let mut parts = vec![
        (
            DMatrix::<f64>::zeros(columns, columns),
            DVector::<f64>::zeros(columns)
        );
        FOLDS
    ];
    for (i, free) in model.free.iter().enumerate() {
        whole[(i, i)] = free.spread.powi(-2);
    }
    for (fold, (square, slope)) in parts.iter_mut().enumerate() {
        let rows: Vec<usize> = (0..nodes.len())
            .filter(|&i| nodes[i].fold == fold && weights[i] > 0.0)
            .collect();
        let jacobian = fit.jacobian.select_rows(&rows);
        let rest = DVector::from_iterator(
            rows.len(),
            rows.iter().map(|&i| fit.left_over[i] * weights[i]),
        );
        *square = jacobian.tr_mul(&jacobian);
        *slope = jacobian.tr_mul(&rest);
        whole += &*square;
    }
    let deviations = spreads(model, fit);
    let known: Vec<f64> = (0..columns)
        .map(|i| parts.iter().map(|(square, _)| square[(i, i)]).sum())
        .collect();
    let of_effect = |i: usize| match model.free[i].owner {
        Owner::Own(_) => false,
        Owner::Effect(effect, _) | Owner::OnRecord(effect, ..) => {
            !makes_steps(model.effects[effect].entry)
        }
    };
    let moves: Vec<DVector<f64>> = parts
        .iter()
        .map(|(square, slope)| {
            let (mut others, mut slope) = (&whole - square, slope.clone());
            let alone = |&i: &usize| of_effect(i) && square[(i, i)] > ALONE * known[i];
            for i in (0..columns).filter(alone) {
                others[(i, i)] += HOLDS * whole[(i, i)];
                slope[i] = 0.0;
            }
            let step = Cholesky::new(others).map_or_else(
                || DVector::zeros(columns),
                |cholesky| cholesky.solve(&slope),
            );
            cut(step, &whole, &deviations)
        })
        .collect();
    nodes
        .iter()
        .enumerate()
        .map(|(i, node)| {
            if weights[i] == 0.0 {
                return fit.left_over[i];
            }
            let moved: f64 = fit.jacobian.row(i).transpose().dot(&moves[node.fold]);
            fit.left_over[i] + moved / weights[i]
        })
        .collect()
}

/// A step, no farther than [`FARTHEST`]. `precision` is that of the fit with all folds, `deviations` those of each parameter by it.
fn cut(step: DVector<f64>, precision: &DMatrix<f64>, deviations: &[f64]) -> DVector<f64> {
    let each = step.iter().zip(deviations);
    let each = each.fold(0.0, |far: f64, (x, deviation)| far.max(x.abs() / deviation));
    let together = (step.dot(&(precision * &step)) / step.len() as f64).sqrt();
    let far = each.max(together);
    if far > FARTHEST {
        step * (FARTHEST / far)
    } else {
        step
    }
}

/// What data and priors say of the fitted coordinates together: the inverse of their covariance.
pub(super) fn precision(model: &Model, fit: &Fit) -> DMatrix<f64> {
    let mut precision = fit.jacobian.tr_mul(&fit.jacobian);
    for (i, free) in model.free.iter().enumerate() {
        precision[(i, i)] += free.spread.powi(-2);
    }
    precision
}

/// Standard deviation of each fitted coordinate.
pub fn spreads(model: &Model, fit: &Fit) -> Vec<f64> {
    let columns = model.free.len();
    match Cholesky::new(precision(model, fit)) {
        Some(cholesky) => {
            let inverse = cholesky.inverse();
            (0..columns).map(|i| inverse[(i, i)].sqrt()).collect()
        }
        None => vec![f64::INFINITY; columns],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_cut_in_each_parameter_and_in_all_together() {
        // Two parameters of which the data know the sum to 0.1 and the difference to 10: each to 7.07.
        let precision = DMatrix::from_row_slice(2, 2, &[50.005, 49.995, 49.995, 50.005]);
        let deviations = [50.005_f64.sqrt(); 2];
        let cut = |step: [f64; 2]| {
            let step = cut(DVector::from_row_slice(&step), &precision, &deviations);
            [step[0], step[1]]
        };
        // Where the sum stays, no farther than four deviations of each; within them as it is.
        assert_eq!(cut([20.0, -20.0]), [20.0, -20.0]);
        let far = cut([100.0, -100.0]);
        assert!(
            far.iter()
                .all(|x| (x.abs() / deviations[0] - 4.0).abs() < 1e-9)
        );
        // Where it does not: four of 0.1, in the root mean square over two directions.
        let along = cut([1.0, 1.0]);
        assert!(
            along.iter().all(|x| (x - 4.0 * 0.1).abs() < 1e-9),
            "{along:?}"
        );
    }
}
