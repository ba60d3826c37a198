//! The steady-state equation fitted with each of the six curves, and the choice among them.
//!
//! The choice is by Akaike's criterion corrected for few points (Hurvich and Tsai, Biometrika 76(2), 1989): a map has
//! some tens of points, too few to hold any back. A curve within two of the best is no worse; of those the one with the
//! fewest parameters is taken.

use super::curve::rows;
use super::problem::Problem;
use super::profile;
use super::{SteadyMap, SteadyPoint};
use crate::axis_file::StribeckShape;
use crate::error::InputError;
use crate::identify::{Estimate, LEVEL, Parameter, Verdict};
use bristle_core::stribeck::{Curve, Stribeck};
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
        .filter_map(|&shape| fit_curve(&problem, shape))
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

/// The fit with a curve; none where it has too many parameters for the points.
fn fit_curve(problem: &Problem<'_>, shape: StribeckShape) -> Option<CurveFit> {
    let parameters = 2
        + usize::from(problem.both_ways)
        + match shape {
            StribeckShape::Constant => 0,
            StribeckShape::GeneralisedExponential => 3,
            _ => 2,
        };
    let points = problem.rows.len();
    // The criterion divides by n - k - 1, and k counts the variance too.
    if points < parameters + 3 {
        return None;
    }
    let best = problem.optimum(shape)?;
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
    fit.estimates = profile::estimates(problem, shape, &best, limit);
    Some(fit)
}
