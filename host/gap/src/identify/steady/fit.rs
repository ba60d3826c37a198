//! The steady-state equation fitted with each of the six curves, and the choice among them.
//!
//! The choice is by Akaike's criterion corrected for few points (Hurvich and Tsai, Biometrika 76(2), 1989): a map has
//! some tens of points, too few to hold any back. A curve within two of the best is no worse; of those the one with the
//! fewest parameters is taken.

use super::curve::{Linear, Normal, Row, rows};
use super::profile::{self, Grid};
use super::{SteadyMap, SteadyPoint};
use crate::axis_file::StribeckShape;
use crate::error::InputError;
use crate::identify::{Estimate, LEVEL, Parameter, Verdict};
use bristle_core::stribeck::{Curve, Stribeck};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// The equation with one curve.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveFit {
    /// Which curve.
    pub shape: StribeckShape,
    /// F_G, on the side of friction; zero where only one direction was measured.
    pub offset_nm: f64,
    /// sigma2.
    pub viscous_nm_s_rad: f64,
    /// F_C.
    pub coulomb_nm: f64,
    /// F_S.
    pub stiction_nm: f64,
    /// v_s of a curve that falls; of the piecewise line, where it ends.
    pub stribeck_velocity_rad_s: Option<f64>,
    /// d of the generalised exponential curve.
    pub stribeck_exponent: Option<f64>,
    /// Root of the mean square that is left.
    pub residual_rms_nm: f64,
    /// Corrected Akaike criterion; less is better, only differences mean anything.
    pub evidence: f64,
    /// Each parameter with its interval by profile likelihood.
    pub estimates: Vec<Estimate>,
}

impl CurveFit {
    /// Torque at a constant velocity.
    pub fn torque_nm(&self, velocity_rad_s: f64) -> f64 {
        let kind = super::curve::shape(
            self.shape,
            self.stribeck_velocity_rad_s.unwrap_or(1.0),
            self.stribeck_exponent.unwrap_or(2.0),
        );
        let fall = Stribeck::new(1.0, 2.0, kind)
            .map_or(0.0, |curve| curve.level_nm(velocity_rad_s.abs()) - 1.0);
        let level = self.coulomb_nm + (self.stiction_nm - self.coulomb_nm) * fall;
        self.offset_nm + self.viscous_nm_s_rad * velocity_rad_s + level * velocity_rad_s.signum()
    }

    /// What the fit leaves of a point.
    pub fn residual_nm(&self, point: &SteadyPoint) -> f64 {
        point.torque_nm - self.torque_nm(point.velocity_rad_s)
    }
}

/// All curves over one map.
#[derive(Clone, Debug, PartialEq)]
pub struct SteadyFit {
    /// One for each curve that has fewer parameters than the map has points, in the order of [`StribeckShape::ALL`].
    pub fits: Vec<CurveFit>,
    /// Which of them the points bear out.
    pub chosen: usize,
    /// The parameters with their intervals. Where the chosen curve does not fall, those of a fall come from the curve
    /// that fits best with one, and are not identified.
    pub estimates: Vec<Estimate>,
    /// What the data cannot support, a line each.
    pub notes: Vec<String>,
}

impl SteadyFit {
    /// The chosen curve.
    pub fn best(&self) -> &CurveFit {
        &self.fits[self.chosen]
    }

    /// The fit with a curve.
    pub fn with(&self, shape: StribeckShape) -> Option<&CurveFit> {
        self.fits.iter().find(|fit| fit.shape == shape)
    }
}

/// Fits every curve.
///
/// # Errors
/// Fewer than five points, or all at one speed.
pub fn fit(map: &SteadyMap) -> Result<SteadyFit, InputError> {
    let rows = rows(map);
    let [low, high] = map.speed_range_rad_s().unwrap_or([0.0; 2]);
    if rows.len() < 5 || high <= 1.5 * low {
        let mut why = format!(
            "{} points of constant speed, from {low} to {high} rad/s",
            rows.len()
        );
        for line in &map.left_out {
            why = format!("{why}; {line}");
        }
        return Err(InputError::new(
            &map.source,
            why,
            "run a speed ladder: five speeds or more in each direction, the fastest ten times the slowest",
        ));
    }
    let both_ways = map.directions().iter().all(|&points| points > 0);
    let problem = Problem {
        rows: &rows,
        both_ways,
        low,
        high,
    };
    let fits: Vec<CurveFit> = StribeckShape::ALL
        .iter()
        .filter_map(|&shape| problem.fit(shape))
        .collect();
    if fits.is_empty() {
        return Err(InputError::new(
            &map.source,
            "no curve fits these points",
            "look at the points in a plot",
        ));
    }
    let least = fits
        .iter()
        .map(|fit| fit.evidence)
        .fold(f64::INFINITY, f64::min);
    let chosen = (0..fits.len())
        .filter(|&i| fits[i].evidence <= least + 2.0)
        .min_by(|&a, &b| {
            let key = |i: usize| (fits[i].estimates.len(), fits[i].evidence);
            key(a).0.cmp(&key(b).0).then(key(a).1.total_cmp(&key(b).1))
        })
        .unwrap_or(0);
    let mut estimates = fits[chosen].estimates.clone();
    if fits[chosen].shape == StribeckShape::Constant {
        let falling = fits[1..]
            .iter()
            .min_by(|a, b| a.evidence.total_cmp(&b.evidence));
        for fall in falling.into_iter().flat_map(|fit| &fit.estimates) {
            if !estimates
                .iter()
                .any(|known| known.parameter == fall.parameter)
            {
                let mut unknown = fall.clone();
                unknown.verdict = Verdict::NotIdentified;
                unknown.advice.get_or_insert_with(|| problem.slower());
                estimates.push(unknown);
            }
        }
    }
    let mut notes = map.left_out.clone();
    if !both_ways {
        notes.push(
            "only one direction was measured: the offset cannot be told from Coulomb friction"
                .to_string(),
        );
    }
    if fits.len() < StribeckShape::ALL.len() {
        notes.push(format!(
            "{} points are too few for the curves with more parameters",
            rows.len()
        ));
    }
    if let Some(ripple) = ripple(map).filter(|&ripple| ripple > MOST_RIPPLE) {
        notes.push(format!(
            "torque varies by {:.0} % of itself at constant speed: if the speed does too, the slow points are smeared",
            100.0 * ripple
        ));
        for estimate in &mut estimates {
            if falls(estimate.parameter) && estimate.verdict == Verdict::Identified {
                estimate.verdict = Verdict::Weak;
                estimate.advice =
                    Some("lower the gain of the speed loop, or use a finer encoder".to_string());
            }
        }
    }
    for estimate in estimates
        .iter()
        .filter(|estimate| estimate.verdict == Verdict::NotIdentified)
    {
        notes.extend(estimate.advice.clone());
    }
    notes.dedup();
    Ok(SteadyFit {
        fits,
        chosen,
        estimates,
        notes,
    })
}

/// Variation of torque at constant speed, as a share of the torque, from which on the axis does not move evenly.
const MOST_RIPPLE: f64 = 0.2;

/// Median over the points of a log; none of a table.
fn ripple(map: &SteadyMap) -> Option<f64> {
    let mut shares: Vec<f64> = map
        .points
        .iter()
        .filter(|point| point.standard_error_nm.is_some())
        .map(|point| point.spread_nm / point.torque_nm.abs())
        .collect();
    shares.sort_by(f64::total_cmp);
    shares.get(shares.len() / 2).copied()
}

/// Whether a parameter belongs to the fall from stiction.
fn falls(parameter: Parameter) -> bool {
    matches!(
        parameter,
        Parameter::Stiction | Parameter::StribeckVelocity | Parameter::StribeckExponent
    )
}

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
    fn fit(&self, shape: StribeckShape) -> Option<CurveFit> {
        let parameters = 2
            + usize::from(self.both_ways)
            + match shape {
                StribeckShape::Constant => 0,
                StribeckShape::GeneralisedExponential => 3,
                _ => 2,
            };
        let points = self.rows.len();
        // The criterion divides by n - k - 1, and k counts the variance too.
        if points < parameters + 3 {
            return None;
        }
        let best = self.optimum(shape)?;
        let free = (points - parameters) as f64;
        let quantile = FisherSnedecor::new(1.0, free).ok()?.inverse_cdf(LEVEL);
        let limit = best.sum * (1.0 + quantile / free);
        let (n, k) = (points as f64, (parameters + 1) as f64);
        let mut fit = CurveFit {
            shape,
            offset_nm: best.linear[0],
            viscous_nm_s_rad: best.linear[1],
            coulomb_nm: best.linear[2],
            stiction_nm: best.linear[2] + best.linear[3],
            stribeck_velocity_rad_s: (shape != StribeckShape::Constant).then_some(best.velocity),
            stribeck_exponent: (shape == StribeckShape::GeneralisedExponential)
                .then_some(best.exponent),
            residual_rms_nm: (best.sum / n).sqrt(),
            evidence: n * (best.sum / n).ln() + 2.0 * k + 2.0 * k * (k + 1.0) / (n - k - 1.0),
            estimates: Vec::new(),
        };
        fit.estimates = profile::estimates(self, &fit, &best, limit);
        Some(fit)
    }

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
    fn optimum(&self, shape: StribeckShape) -> Option<Optimum> {
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
