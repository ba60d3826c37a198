//! The summed equation (2.31) over all branches, u = sigma0 q - (sigma0/F) I + (sigma0 F_G/F) P + a constant for each
//! branch, with P the path and I the torque integrated over it, and its solution where the position has errors too.
//!
//! Total least squares with the errors' own covariance: Van Huffel and Vandewalle, The Total Least Squares Problem, SIAM
//! 1991, chapter 10 (generalised). Instruments: the curve itself over a position that is a straight line in time.

use super::branches::Branch;
use crate::identify::linear::instrumental;
use nalgebra::{DMatrix, DVector, Matrix4, Vector4};

/// A Dahl curve with exponent 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Curve {
    pub stiffness: f64,
    pub level: f64,
    pub offset: f64,
}

impl Curve {
    /// From sigma0, -sigma0/F and sigma0 F_G/F; none where stiffness or level is not above zero.
    fn of(p: [f64; 3]) -> Option<Self> {
        let curve = Self {
            stiffness: p[0],
            level: -p[0] / p[1],
            offset: -p[2] / p[1],
        };
        let positive = curve.stiffness > 0.0 && curve.level > 0.0;
        (positive && curve.numbers().iter().all(|x| x.is_finite())).then_some(curve)
    }

    pub fn numbers(&self) -> [f64; 3] {
        [self.stiffness, self.level, self.offset]
    }

    /// Torque along positions of a branch that begins with a torque.
    pub fn along(&self, direction: f64, position: &[f64], start: f64) -> Vec<f64> {
        let end = self.offset + direction * self.level;
        let origin = position.first().copied().unwrap_or(0.0);
        position
            .iter()
            .map(|q| {
                end + (start - end)
                    * (-self.stiffness * direction * (q - origin) / self.level).exp()
            })
            .collect()
    }
}

/// q, I, P and u of every row, each branch less its mean; and the mean covariance of their errors.
pub(super) struct Lines {
    rows: Vec<Vector4<f64>>,
    errors: Matrix4<f64>,
}

impl Lines {
    pub fn new(branches: &[Branch], count: f64) -> Self {
        // A dwell's mean is off by its uneven speed: half of what rounding to a count leaves.
        let position_error = 0.5 * count / 12.0_f64.sqrt();
        let rows = rows(branches, |branch| {
            (branch.position_rad.clone(), branch.torque_nm.clone())
        });
        let mut errors = Matrix4::zeros();
        let mut steps = Vec::new();
        let mut n = 0.0;
        for branch in branches {
            for u in &branch.torque_nm {
                let move_q = Vector4::new(1.0, branch.direction * u, branch.direction, 0.0);
                errors += position_error * position_error * move_q * move_q.transpose();
                n += 1.0;
            }
            // Second differences hold the noise and hardly the curve: their variance is 6 times its own.
            steps.extend(
                branch
                    .torque_nm
                    .windows(3)
                    .map(|u| (u[0] - 2.0 * u[1] + u[2]).powi(2) / 6.0),
            );
        }
        errors /= n;
        steps.sort_by(f64::total_cmp);
        // Median of a chi square with one degree of freedom.
        errors[(3, 3)] += steps.get(steps.len() / 2).copied().unwrap_or(0.0) / 0.455;
        Self { rows, errors }
    }

    /// Rows that remain when one part of so many is left out.
    fn kept(&self, without: Option<(usize, usize)>) -> impl Iterator<Item = usize> {
        let n = self.rows.len();
        (0..n).filter(move |row| without.is_none_or(|(part, parts)| row * parts / n != part))
    }

    /// Total least squares.
    pub fn total(&self, without: Option<(usize, usize)>) -> Option<Curve> {
        let mut moments = Matrix4::zeros();
        for row in self.kept(without) {
            moments += self.rows[row] * self.rows[row].transpose();
        }
        let scale = moments.diagonal().map(|x| 1.0 / x.sqrt());
        let scaled = |m: &Matrix4<f64>| Matrix4::from_fn(|i, j| m[(i, j)] * scale[i] * scale[j]);
        // The combination with least moment for its errors: the greatest eigenvalue of errors over moments.
        let lower = scaled(&moments).cholesky()?.l();
        let inverse = lower.try_inverse()?;
        let eigen = (inverse * scaled(&self.errors) * inverse.transpose()).symmetric_eigen();
        let vector = inverse.transpose() * eigen.eigenvectors.column(eigen.eigenvalues.imax());
        let x = vector.component_mul(&scale);
        Curve::of([-x[0] / x[3], -x[1] / x[3], -x[2] / x[3]])
    }

    /// Instrumental variables, the instruments from the curve that the round before gave.
    pub fn instrumental(
        &self,
        branches: &[Branch],
        without: Option<(usize, usize)>,
    ) -> Option<Curve> {
        const ROUNDS: usize = 6;
        let kept: Vec<usize> = self.kept(without).collect();
        let y = DVector::from_iterator(kept.len(), kept.iter().map(|&row| self.rows[row][3]));
        let x = DMatrix::from_fn(kept.len(), 3, |i, j| self.rows[kept[i]][j]);
        let mut curve = self.total(without)?;
        for _ in 0..ROUNDS {
            let clean = rows(branches, |branch| {
                let position = line(&branch.time_s, &branch.position_rad);
                let torque = curve.along(branch.direction, &position, branch.torque_nm[0]);
                (position, torque)
            });
            let z = DMatrix::from_fn(kept.len(), 3, |i, j| clean[kept[i]][j]);
            let p = instrumental(&y, &x, &z, 0)?.parameters;
            curve = Curve::of([p[0], p[1], p[2]])?;
        }
        Some(curve)
    }
}

fn rows(branches: &[Branch], of: impl Fn(&Branch) -> (Vec<f64>, Vec<f64>)) -> Vec<Vector4<f64>> {
    let mut all = Vec::new();
    for branch in branches {
        let (position, torque) = of(branch);
        let mut sum = 0.0;
        let rows: Vec<Vector4<f64>> = (0..position.len())
            .map(|k| {
                if k > 0 {
                    let path = branch.direction * (position[k] - position[k - 1]);
                    sum += 0.5 * (torque[k] + torque[k - 1]) * path;
                }
                let path = branch.direction * (position[k] - position[0]);
                Vector4::new(position[k], sum, path, torque[k])
            })
            .collect();
        let mean = rows.iter().sum::<Vector4<f64>>() / rows.len() as f64;
        all.extend(rows.into_iter().map(|row| row - mean));
    }
    all
}

/// The straight line through values over time.
fn line(time_s: &[f64], values: &[f64]) -> Vec<f64> {
    let n = values.len() as f64;
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n;
    let (t0, v0) = (mean(time_s), mean(values));
    let (mut above, mut below) = (0.0, 0.0);
    for (t, v) in time_s.iter().zip(values) {
        above += (t - t0) * (v - v0);
        below += (t - t0).powi(2);
    }
    let slope = if below > 0.0 { above / below } else { 0.0 };
    time_s.iter().map(|t| v0 + slope * (t - t0)).collect()
}
