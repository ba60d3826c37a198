//! Least squares of what a model leaves over, weighted by its noise, with the priors of what is believed.

use super::follow::Rubbing;
use super::model::Model;
use super::record::Record;
use crate::error::InputError;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use rayon::prelude::*;

/// Relative change of cost and coordinates at which a fit stands still: a part of a nat for thousands of nodes.
pub const STANDS_STILL: f64 = 1e-4;
/// Relative change of cost at which a fit has shown what its start promises.
pub const PROMISES: f64 = 0.1;
/// Evaluations of the model in a fit, as a multiple of its parameters plus one.
const PATIENCE: usize = 3;

/// A fitted model.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Fitted coordinates, in the order of the model's parameters.
    pub at: Vec<f64>,
    /// What is left over at each node, N m.
    pub left_over: Vec<f64>,
    /// Sum of squares of the weighted rest and of the priors.
    pub cost: f64,
    /// Of the weighted rest with respect to the coordinates; a row for each node, or none where it was not asked for.
    pub jacobian: DMatrix<f64>,
}

/// Fits a model from `start`, with a weight for each node (zero leaves it out).
///
/// # Errors
/// The friction model refuses the parameters at the start.
pub fn fit(
    model: &Model,
    records: &[Record],
    weights: &[f64],
    start: Vec<f64>,
) -> Result<Fit, InputError> {
    let problem = Problem::new(model, records, weights, start, None)?;
    Ok(problem.settled(STANDS_STILL).into_fit_with_jacobian())
}

/// The same, on from what was fitted with these weights.
///
/// # Errors
/// See [`fit`].
pub fn fit_on(
    model: &Model,
    records: &[Record],
    weights: &[f64],
    from: Fit,
) -> Result<Fit, InputError> {
    let mut problem = Problem::new(model, records, weights, from.at, None)?;
    problem.there = Some((problem.at.clone(), from.jacobian));
    Ok(problem.settled(STANDS_STILL).into_fit_with_jacobian())
}

/// The same from close by: `known` holds the first columns of the Jacobian there, which stay as they are. Steps are as good
/// as these columns; where the fit stands still does not depend on them. Without a Jacobian where it comes out.
///
/// # Errors
/// See [`fit`].
pub fn fit_near(
    model: &Model,
    records: &[Record],
    weights: &[f64],
    start: Vec<f64>,
    known: &DMatrix<f64>,
) -> Result<Fit, InputError> {
    fit_near_until(STANDS_STILL, model, records, weights, start, known)
}

/// As [`fit_near`], until the cost changes by less than this part of itself: [`STANDS_STILL`], or [`PROMISES`].
///
/// # Errors
/// See [`fit`].
pub fn fit_near_until(
    cost_stands_still: f64,
    model: &Model,
    records: &[Record],
    weights: &[f64],
    start: Vec<f64>,
    known: &DMatrix<f64>,
) -> Result<Fit, InputError> {
    fit_until(
        cost_stands_still,
        model,
        records,
        weights,
        start,
        Some(known),
    )
}

/// As [`fit`], but without the Jacobian where it comes out, which takes a pass over the records for each parameter.
///
/// # Errors
/// See [`fit`].
pub fn fit_alone(
    model: &Model,
    records: &[Record],
    weights: &[f64],
    start: Vec<f64>,
) -> Result<Fit, InputError> {
    fit_until(STANDS_STILL, model, records, weights, start, None)
}

/// As [`fit_alone`], no further than a start takes to show what it promises.
///
/// # Errors
/// See [`fit`].
pub fn fit_roughly(
    model: &Model,
    records: &[Record],
    weights: &[f64],
    start: Vec<f64>,
) -> Result<Fit, InputError> {
    fit_until(PROMISES, model, records, weights, start, None)
}

fn fit_until(
    cost_stands_still: f64,
    model: &Model,
    records: &[Record],
    weights: &[f64],
    start: Vec<f64>,
    known: Option<&DMatrix<f64>>,
) -> Result<Fit, InputError> {
    let problem = Problem::new(model, records, weights, start, known)?;
    Ok(problem
        .settled(cost_stands_still)
        .into_fit(DMatrix::zeros(0, 0)))
}

/// What a model leaves over at a point, with its Jacobian there, as if it had been fitted.
///
/// # Errors
/// The friction model refuses the parameters.
pub fn fit_at(
    model: &Model,
    records: &[Record],
    weights: &[f64],
    at: Vec<f64>,
) -> Result<Fit, InputError> {
    Ok(Problem::new(model, records, weights, at, None)?.into_fit_with_jacobian())
}

/// The cost at a point.
///
/// # Errors
/// The friction model refuses the parameters.
pub fn cost_at(
    model: &Model,
    records: &[Record],
    weights: &[f64],
    at: Vec<f64>,
) -> Result<f64, InputError> {
    Ok(Problem::new(model, records, weights, at, None)?.cost())
}

struct Problem<'a> {
    model: &'a Model,
    records: &'a [Record],
    weights: &'a [f64],
    at: DVector<f64>,
    left_over: Vec<f64>,
    /// Friction of the contact along the motion there, N m.
    friction_nm: Vec<f64>,
    known: Option<&'a DMatrix<f64>>,
    /// Where the Jacobian is known as a whole, and what it is.
    there: Option<(DVector<f64>, DMatrix<f64>)>,
}

impl<'a> Problem<'a> {
    fn new(
        model: &'a Model,
        records: &'a [Record],
        weights: &'a [f64],
        at: Vec<f64>,
        known: Option<&'a DMatrix<f64>>,
    ) -> Result<Self, InputError> {
        let mut problem = Self {
            model,
            records,
            weights,
            at: DVector::from_vec(at),
            left_over: Vec::new(),
            friction_nm: Model::places(records),
            known,
            there: None,
        };
        problem.evaluate()?;
        Ok(problem)
    }

    fn evaluate(&mut self) -> Result<(), InputError> {
        let rubbing = Rubbing::Kept(&mut self.friction_nm);
        self.left_over = self
            .model
            .left_over_rubbing(self.records, self.at.as_slice(), rubbing)?;
        Ok(())
    }

    fn settled(self, cost_stands_still: f64) -> Self {
        let optimiser = LevenbergMarquardt::new()
            .with_ftol(cost_stands_still)
            .with_xtol(STANDS_STILL)
            .with_gtol(0.0)
            .with_patience(PATIENCE);
        optimiser.minimize(self).0
    }

    fn into_fit_with_jacobian(self) -> Fit {
        let jacobian = self.whole();
        self.into_fit(jacobian)
    }

    fn into_fit(self, jacobian: DMatrix<f64>) -> Fit {
        Fit {
            cost: self.cost(),
            at: self.at.as_slice().to_vec(),
            jacobian,
            left_over: self.left_over,
        }
    }

    fn cost(&self) -> f64 {
        self.stacked().norm_squared()
    }

    /// Weighted rest of the nodes, then the priors.
    fn stacked(&self) -> DVector<f64> {
        let free = &self.model.free;
        let nodes = self.left_over.len();
        DVector::from_iterator(
            nodes + free.len(),
            self.left_over
                .iter()
                .zip(self.weights)
                .map(|(r, w)| r * w)
                .chain(
                    free.iter()
                        .zip(self.at.iter())
                        .map(|(free, x)| (x - free.center) / free.spread),
                ),
        )
    }

    /// The Jacobian of the weighted rest: the known columns, then the others as they are here.
    fn whole(&self) -> DMatrix<f64> {
        if let Some((at, jacobian)) = &self.there
            && *at == self.at
        {
            return jacobian.clone();
        }
        let known = self.known.map_or(0, DMatrix::ncols);
        let mut whole = DMatrix::zeros(self.left_over.len(), self.at.len());
        if let Some(columns) = self.known {
            whole.columns_mut(0, known).copy_from(columns);
        }
        let columns = self.columns(known);
        whole
            .columns_mut(known, columns.ncols())
            .copy_from(&columns);
        whole
    }

    /// The columns from `first` on.
    fn columns(&self, first: usize) -> DMatrix<f64> {
        let columns: Vec<DVector<f64>> = (first..self.at.len())
            .into_par_iter()
            .map(|i| DVector::from_vec(self.column(i)))
            .collect();
        if columns.is_empty() {
            return DMatrix::zeros(self.left_over.len(), 0);
        }
        DMatrix::from_columns(&columns)
    }

    /// Which end of its range a parameter is at: -1, 1, or 0 for neither.
    fn end(&self, i: usize) -> f64 {
        let free = &self.model.free[i];
        let [low, high] = free.range.map(|value| free.coordinate(value));
        let near = 1e-9 * free.spread;
        if self.at[i] <= low + near {
            -1.0
        } else if self.at[i] >= high - near {
            1.0
        } else {
            0.0
        }
    }

    /// Forward difference by a small part of the prior's width, away from the end of the range.
    fn column(&self, i: usize) -> Vec<f64> {
        let free = &self.model.free[i];
        let mut at = self.at.as_slice().to_vec();
        let mut step = 1e-4 * free.spread;
        if free.coordinate(free.value(at[i] + step)) <= at[i] + 0.5 * step {
            step = -step;
        }
        at[i] += step;
        if free.value(at[i]) == free.value(self.at[i]) {
            // Held where it is.
            return vec![0.0; self.left_over.len()];
        }
        let rubbing = if self.model.leaves_contact(i) {
            Rubbing::Known(&self.friction_nm)
        } else {
            Rubbing::Anew
        };
        match self.model.left_over_rubbing(self.records, &at, rubbing) {
            Ok(moved) => moved
                .iter()
                .zip(&self.left_over)
                .zip(self.weights)
                .map(|((a, b), w)| (a - b) / step * w)
                .collect(),
            Err(_) => vec![0.0; self.left_over.len()],
        }
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, at: &DVector<f64>) {
        self.at.copy_from(at);
        for (x, free) in self.at.iter_mut().zip(&self.model.free) {
            *x = free.coordinate(free.value(*x));
        }
        if self.evaluate().is_err() {
            self.left_over.clear();
        }
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        (!self.left_over.is_empty()).then(|| self.stacked())
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let nodes = self.left_over.len();
        let free = &self.model.free;
        let mut stacked = self.whole().insert_rows(nodes, free.len(), 0.0);
        for (i, free) in free.iter().enumerate() {
            stacked[(nodes + i, i)] = 1.0 / free.spread;
        }
        // What presses against an end of its range is held there: a step that counts on its moving is never as good as it
        // promises, and the fit would stand still.
        let rest = self.stacked();
        for i in 0..free.len() {
            let descent = -stacked.column(i).dot(&rest);
            if descent * self.end(i) > 0.0 {
                stacked.column_mut(i).fill(0.0);
            }
        }
        Some(stacked)
    }
}
