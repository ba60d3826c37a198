//! Linear estimation shared by the steps: instrumental variables, of which least squares is a case, with a covariance
//! that allows for correlated residuals.

use nalgebra::{DMatrix, DVector};

/// Parameters with their covariance.
#[derive(Clone, Debug)]
pub(super) struct Solution {
    pub parameters: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

/// Solves Z'(y - X p) = 0. Z = X is least squares. None where the columns cannot be told apart.
///
/// Covariance by Newey and West (Econometrica 55(3), 1987) with `lags`.
pub(super) fn instrumental(
    y: &DVector<f64>,
    x: &DMatrix<f64>,
    z: &DMatrix<f64>,
    lags: usize,
) -> Option<Solution> {
    let scale =
        |m: &DMatrix<f64>| DVector::from_iterator(m.ncols(), m.column_iter().map(|c| c.norm()));
    let (sx, sz) = (scale(x), scale(z));
    if sx
        .iter()
        .chain(sz.iter())
        .any(|&s| !(s > 0.0 && s.is_finite()))
    {
        return None;
    }
    let mut cross = z.tr_mul(x);
    for i in 0..cross.nrows() {
        for j in 0..cross.ncols() {
            cross[(i, j)] /= sz[i] * sx[j];
        }
    }
    let right = z.tr_mul(y).component_div(&sz);
    // Singular beyond this the answer is rounding.
    const CONDITION: f64 = 1e13;
    let svd = cross.clone().svd(false, false);
    let (most, least) = (svd.singular_values.max(), svd.singular_values.min());
    if least.is_nan() || least * CONDITION <= most {
        return None;
    }
    let inverse = cross.try_inverse()?;
    let parameters = (&inverse * right).component_div(&sx);
    let residuals = y - x * &parameters;
    let meat = long_run(z, &residuals, lags, &sz);
    let mut covariance = &inverse * meat * inverse.transpose();
    for i in 0..covariance.nrows() {
        for j in 0..covariance.ncols() {
            covariance[(i, j)] /= sx[i] * sx[j];
        }
    }
    Some(Solution {
        parameters,
        covariance,
    })
}

/// Sum over lags of z_k e_k z_(k-lag)' e_(k-lag), Bartlett's weights.
fn long_run(z: &DMatrix<f64>, e: &DVector<f64>, lags: usize, scale: &DVector<f64>) -> DMatrix<f64> {
    let (n, p) = z.shape();
    let moments = DMatrix::from_fn(n, p, |i, j| z[(i, j)] * e[i] / scale[j]);
    let mut sum = moments.tr_mul(&moments);
    for lag in 1..=lags.min(n / 4) {
        let weight = 1.0 - lag as f64 / (lags as f64 + 1.0);
        let shifted = moments.rows(lag, n - lag).tr_mul(&moments.rows(0, n - lag));
        sum += weight * (&shifted + shifted.transpose());
    }
    sum * (n as f64 / (n.saturating_sub(p)).max(1) as f64)
}

/// Values of functions of the parameters with their standard deviations, by the delta method. None where a function
/// has no value nearby.
pub(super) fn delta<const N: usize>(
    solution: &Solution,
    function: impl Fn(&DVector<f64>) -> Option<[f64; N]>,
) -> Option<[(f64, f64); N]> {
    let at = function(&solution.parameters)?;
    let p = solution.parameters.len();
    let mut gradient = DMatrix::zeros(N, p);
    for j in 0..p {
        let deviation = solution.covariance[(j, j)].max(0.0).sqrt();
        // A thousandth of the deviation keeps to where the function is linear; above the rounding of the parameter.
        let step = (1e-3 * deviation).max(1e-7 * solution.parameters[j].abs());
        let mut moved = solution.parameters.clone();
        moved[j] += step;
        let above = function(&moved)?;
        moved[j] -= 2.0 * step;
        let below = function(&moved)?;
        for i in 0..N {
            gradient[(i, j)] = if step > 0.0 {
                (above[i] - below[i]) / (2.0 * step)
            } else {
                0.0
            };
        }
    }
    let covariance = &gradient * &solution.covariance * gradient.transpose();
    Some(std::array::from_fn(|i| {
        (at[i], covariance[(i, i)].max(0.0).sqrt())
    }))
}
