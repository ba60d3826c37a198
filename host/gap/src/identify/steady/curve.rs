//! The steady-state equation over a map. With the curve's own one or two parameters given, the rest is linear: least
//! squares within physical bounds, solved exactly.
//!
//! Separation of the two kinds of parameters: Golub and Pereyra, SIAM J. Numer. Anal. 10(2), 1973.

use super::SteadyMap;
use crate::axis_file::StribeckShape;
use bristle_core::stribeck::{Curve, Shape, Stribeck};
use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

/// F_G, sigma2, F_C and F_S - F_C.
pub(super) type Linear = Vector4<f64>;

/// A point with its weight; weights have mean 1.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub velocity: f64,
    pub torque: f64,
    pub weight: f64,
}

/// A linear combination of the linear parameters, held at a value.
#[derive(Clone, Copy)]
pub(super) struct Held {
    pub direction: Linear,
    pub value: f64,
}

/// The rows of a map. A point's variance is its own plus the median one: what the equation leaves out is no smaller
/// where the torque happens to be quiet.
pub(super) fn rows(map: &SteadyMap) -> Vec<Row> {
    let errors: Option<Vec<f64>> = map
        .points
        .iter()
        .map(|point| point.standard_error_nm)
        .collect();
    let mut variances: Vec<f64> = errors.map_or_else(
        || vec![1.0; map.points.len()],
        |errors| errors.iter().map(|e| e * e).collect(),
    );
    let mut sorted = variances.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0);
    for variance in &mut variances {
        *variance = if median > 0.0 {
            *variance + median
        } else {
            1.0
        };
    }
    let mean = variances.iter().map(|v| 1.0 / v).sum::<f64>() / variances.len().max(1) as f64;
    map.points
        .iter()
        .zip(variances)
        .map(|(point, variance)| Row {
            velocity: point.velocity_rad_s,
            torque: point.torque_nm,
            weight: 1.0 / (variance * mean),
        })
        .collect()
}

/// The curve that falls from 1 at rest to 0: the piecewise line ends at `velocity`.
pub(super) fn shape(shape: StribeckShape, velocity: f64, exponent: f64) -> Shape<f64> {
    let velocity_rad_s = velocity;
    match shape {
        StribeckShape::Constant => Shape::Constant,
        StribeckShape::PiecewiseLinear => Shape::PiecewiseLinear {
            slope_nm_s_rad: 1.0 / velocity,
        },
        StribeckShape::Exponential => Shape::Exponential { velocity_rad_s },
        StribeckShape::Gaussian => Shape::Gaussian { velocity_rad_s },
        StribeckShape::GeneralisedExponential => Shape::GeneralisedExponential {
            rate: velocity.powf(-exponent),
            exponent,
        },
        StribeckShape::Lorentzian => Shape::Lorentzian { velocity_rad_s },
    }
}

/// The weighted normal equations at one setting of the curve's own parameters.
#[derive(Clone)]
pub(super) struct Normal {
    gram: Matrix4<f64>,
    right: Linear,
    square: f64,
    /// The offset can be told from F_C.
    both_ways: bool,
}

/// Rounding of the sum of squares, as a share of the torque's own.
const ROUNDING: f64 = 1e-14;

impl Normal {
    /// None where the curve takes no such parameters.
    pub fn new(
        rows: &[Row],
        kind: StribeckShape,
        velocity: f64,
        exponent: f64,
        both_ways: bool,
    ) -> Option<Self> {
        let fall = Stribeck::new(1.0, 2.0, shape(kind, velocity, exponent)).ok()?;
        let mut normal = Self {
            gram: Matrix4::zeros(),
            right: Vector4::zeros(),
            square: 0.0,
            both_ways,
        };
        for row in rows {
            let columns = columns(row.velocity, fall.level_nm(row.velocity.abs()) - 1.0);
            normal.gram += row.weight * columns * columns.transpose();
            normal.right += row.weight * row.torque * columns;
            normal.square += row.weight * row.torque * row.torque;
        }
        Some(normal)
    }

    /// Least sum of squares with sigma2, F_C and F_S - F_C not below zero, and what it takes.
    pub fn solve(&self, held: Option<Held>) -> Option<(f64, Linear)> {
        // Bit i of `zero` puts parameter i at its bound. Where the answer without bounds keeps them, it is the least.
        let within = |zero: u8| {
            let free: Vec<usize> = (0..4)
                .filter(|&i| {
                    if i == 0 {
                        self.both_ways
                    } else {
                        zero & (1 << (i - 1)) == 0
                    }
                })
                .collect();
            let solution = self.on(&free, held)?;
            (1..4)
                .all(|i| solution[i] >= 0.0)
                .then(|| (self.sum(&solution), solution))
        };
        within(0).or_else(|| (1..8).filter_map(within).min_by(|a, b| a.0.total_cmp(&b.0)))
    }

    fn on(&self, free: &[usize], held: Option<Held>) -> Option<Linear> {
        let size = free.len() + usize::from(held.is_some());
        if size == 0 {
            return Some(Linear::zeros());
        }
        let mut matrix = DMatrix::zeros(size, size);
        let mut right = DVector::zeros(size);
        // Columns scaled to a unit diagonal: speeds and signs differ by orders of magnitude.
        let scale: Vec<f64> = free
            .iter()
            .map(|&i| self.gram[(i, i)].sqrt().max(f64::MIN_POSITIVE))
            .collect();
        for (a, &i) in free.iter().enumerate() {
            for (b, &j) in free.iter().enumerate() {
                matrix[(a, b)] = self.gram[(i, j)] / (scale[a] * scale[b]);
            }
            right[a] = self.right[i] / scale[a];
        }
        if let Some(held) = held {
            let last = size - 1;
            for (a, &i) in free.iter().enumerate() {
                matrix[(a, last)] = held.direction[i] / scale[a];
                matrix[(last, a)] = held.direction[i] / scale[a];
            }
            right[last] = held.value;
        }
        let solved = matrix.lu().solve(&right)?;
        let mut solution = Linear::zeros();
        for (a, &i) in free.iter().enumerate() {
            solution[i] = solved[a] / scale[a];
        }
        solution.iter().all(|x| x.is_finite()).then_some(solution)
    }

    fn sum(&self, solution: &Linear) -> f64 {
        let sum =
            self.square - 2.0 * solution.dot(&self.right) + solution.dot(&(self.gram * solution));
        sum.max(ROUNDING * self.square)
    }
}

pub(super) fn columns(velocity: f64, fall: f64) -> Linear {
    let sign = velocity.signum();
    Linear::new(1.0, velocity, sign, fall * sign)
}
