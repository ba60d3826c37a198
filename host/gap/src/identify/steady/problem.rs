//! The least squares of one curve: its own parameters over a grid, then downhill; the linear ones solved for at each setting.

use super::curve::{Linear, Normal, Row};
use crate::axis_file::StribeckShape;
use bristle_core::stribeck::{Curve, Stribeck};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

/// Settings of a curve's own parameters, even in their logarithms.
#[derive(Clone, Copy)]
pub(super) struct Grid {
    pub velocities: [f64; 2],
    pub velocity_count: usize,
    pub exponents: [f64; 2],
    pub exponent_count: usize,
}

impl Grid {
    pub fn new(
        velocities: [f64; 2],
        velocity_count: usize,
        exponents: [f64; 2],
        exponent_count: usize,
    ) -> Self {
        Self {
            velocities,
            velocity_count,
            exponents,
            exponent_count,
        }
    }

    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        let (exponents, count) = (self.exponents, self.exponent_count);
        spread(self.velocities, self.velocity_count).flat_map(move |velocity| {
            spread(exponents, count).map(move |exponent| (velocity, exponent))
        })
    }

    /// The nearest setting inside the bounds.
    pub fn within(&self, velocity: f64, exponent: f64) -> (f64, f64) {
        let clamp = |x: f64, [low, high]: [f64; 2]| x.max(low).min(high);
        (
            clamp(velocity, self.velocities),
            clamp(exponent, self.exponents),
        )
    }
}

/// So many values, even in their logarithms.
pub(super) fn spread([low, high]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    let ratio = (high / low).ln() / count.saturating_sub(1).max(1) as f64;
    (0..count).map(move |i| low * (ratio * i as f64).exp())
}

/// The points that a curve is laid through.
pub(super) struct Problem<'a> {
    pub rows: &'a [Row],
    pub both_ways: bool,
    /// Slowest and fastest speed.
    pub low: f64,
    pub high: f64,
}

/// A curve's own parameters with what they leave: v_s, d, the sum of squares and the linear parameters.
#[derive(Clone, Copy)]
pub(super) struct Optimum {
    pub velocity: f64,
    pub exponent: f64,
    pub sum: f64,
    pub linear: Linear,
}

/// Exponents of the generalised exponential curve: below one half it has no end, above six it is a step.
const EXPONENTS: [f64; 2] = [0.5, 6.0];

impl Problem<'_> {
    /// The sum of squares that a curve with these parameters of its own leaves.
    pub fn at(&self, shape: StribeckShape, velocity: f64, exponent: f64) -> Option<Optimum> {
        let normal = Normal::new(self.rows, shape, velocity, exponent, self.both_ways)?;
        let (sum, linear) = normal.solve(None)?;
        Some(Optimum {
            velocity,
            exponent,
            sum,
            linear,
        })
    }

    /// Every setting that is tried of a curve's own parameters.
    pub fn grid(&self, shape: StribeckShape) -> Grid {
        // Beyond these the curve is a step at rest, or a straight line over the whole range of speeds.
        let velocities = [0.2 * self.low, 5.0 * self.high];
        match shape {
            StribeckShape::Constant => Grid::new([1.0; 2], 1, [2.0; 2], 1),
            StribeckShape::GeneralisedExponential => Grid::new(velocities, 60, EXPONENTS, 16),
            _ => Grid::new(velocities, 100, [2.0; 2], 1),
        }
    }

    /// The best points of the grid, each followed downhill: the sum of squares has valleys.
    pub fn optimum(&self, shape: StribeckShape) -> Option<Optimum> {
        const STARTS: usize = 4;
        let grid = self.grid(shape);
        let mut tried: Vec<Optimum> = grid
            .points()
            .filter_map(|(v, d)| self.at(shape, v, d))
            .collect();
        tried.sort_by(|a, b| a.sum.total_cmp(&b.sum));
        tried.truncate(STARTS);
        if shape != StribeckShape::Constant {
            let polished: Vec<Optimum> = tried
                .iter()
                .filter_map(|start| Downhill::run(self, shape, &grid, start))
                .collect();
            tried.extend(polished);
        }
        tried.into_iter().min_by(|a, b| a.sum.total_cmp(&b.sum))
    }

    /// What would show a fall that these speeds do not.
    pub fn slower(&self) -> String {
        format!(
            "no fall from stiction is seen from {:.3e} to {:.3e} rad/s: v_s and F_S need slower points, or a \
             break-away experiment for F_S",
            self.low, self.high
        )
    }
}

/// The residuals over the curve's own parameters in their logarithms, with the linear ones solved for at each step.
struct Downhill<'a> {
    problem: &'a Problem<'a>,
    shape: StribeckShape,
    grid: &'a Grid,
    at: DVector<f64>,
}

impl<'a> Downhill<'a> {
    fn run(
        problem: &'a Problem<'a>,
        shape: StribeckShape,
        grid: &'a Grid,
        start: &Optimum,
    ) -> Option<Optimum> {
        let mut at = vec![start.velocity.ln()];
        if shape == StribeckShape::GeneralisedExponential {
            at.push(start.exponent.ln());
        }
        let downhill = Self {
            problem,
            shape,
            grid,
            at: DVector::from_vec(at),
        };
        LevenbergMarquardt::new()
            .with_patience(50)
            .minimize(downhill)
            .0
            .optimum(None)
    }

    fn optimum(&self, at: Option<&DVector<f64>>) -> Option<Optimum> {
        let at = at.unwrap_or(&self.at);
        let exponent = at.get(1).map_or(2.0, |d| d.exp());
        let (velocity, exponent) = self.grid.within(at[0].exp(), exponent);
        self.problem.at(self.shape, velocity, exponent)
    }

    fn left(&self, at: Option<&DVector<f64>>) -> Option<DVector<f64>> {
        let optimum = self.optimum(at)?;
        let kind = super::curve::shape(self.shape, optimum.velocity, optimum.exponent);
        let curve = Stribeck::new(1.0, 2.0, kind).ok()?;
        let rows = self.problem.rows.iter().map(|row| {
            let columns =
                super::curve::columns(row.velocity, curve.level_nm(row.velocity.abs()) - 1.0);
            row.weight.sqrt() * (row.torque - columns.dot(&optimum.linear))
        });
        Some(DVector::from_iterator(self.problem.rows.len(), rows))
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Downhill<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, at: &DVector<f64>) {
        self.at.copy_from(at);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.left(None)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        // Central differences: the cube root of the rounding.
        const STEP: f64 = 1e-5;
        let mut jacobian = DMatrix::zeros(self.problem.rows.len(), self.at.len());
        for i in 0..self.at.len() {
            let moved = |step: f64| {
                let mut at = self.at.clone();
                at[i] += step;
                self.left(Some(&at))
            };
            jacobian.set_column(i, &((moved(STEP)? - moved(-STEP)?) / (2.0 * STEP)));
        }
        Some(jacobian)
    }
}
