//! Noise as its autocovariance, with an autoregressive model that prolongs it: its size, its interval, and what is left
//! of it behind any filter.
//!
//! Yule-Walker equations with the order of least Bayesian information; interval of the variance from chi squared with the
//! degrees of freedom that the correlation leaves, n / (1 + 2 sum rho_k^2) (Bartlett).

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Highest order of the autoregressive model.
const HIGHEST_ORDER: usize = 32;
/// Lags kept at most, and the share of the variance below which they are dropped.
const MOST_LAGS: usize = 20_000;
const NEGLIGIBLE: f64 = 1e-5;

/// x\[k\] = sum of a\[i\] x\[k - 1 - i\] + white noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Autoregressive {
    /// a
    pub coefficients: Vec<f64>,
    /// Of the white noise.
    pub innovation_rms: f64,
}

/// Stationary noise of a sampled signal, in the signal's unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Noise {
    /// Root mean square, with the degrees of freedom of whatever was fitted before taken off.
    pub rms: f64,
    /// 90 % interval of it.
    pub interval: [f64; 2],
    /// Independent values behind it; infinite where it follows from a formula.
    pub degrees_of_freedom: f64,
    /// Model.
    pub autoregressive: Autoregressive,
    /// Autocovariance at lag 0, 1, ...; zero beyond.
    pub autocovariance: Vec<f64>,
}

impl Noise {
    /// From pieces of a signal that is noise alone, of zero mean. `freedom` is the share of their samples that was not
    /// used up by what was fitted to them. None with fewer than 20 samples.
    pub fn of(pieces: &[&[f64]], freedom: f64) -> Option<Self> {
        let samples: usize = pieces.iter().map(|piece| piece.len()).sum();
        if samples < 20 || freedom <= 0.0 {
            return None;
        }
        let highest = HIGHEST_ORDER.min(samples / 10);
        let lags: Vec<f64> = (0..=highest)
            .map(|lag| {
                let sum: f64 = pieces
                    .iter()
                    .flat_map(|piece| {
                        let later = piece.get(lag..).unwrap_or_default();
                        piece.iter().zip(later).map(|(a, b)| a * b)
                    })
                    .sum();
                // Divided by all samples: the matrix of the Yule-Walker equations stays positive.
                sum / (samples as f64 * freedom)
            })
            .collect();
        let autoregressive = best_order(&lags, samples as f64);
        let autocovariance = prolonged(&lags, &autoregressive);
        let variance = lags[0];
        let correlated: f64 = autocovariance
            .iter()
            .skip(1)
            .map(|r| (r / variance.max(f64::MIN_POSITIVE)).powi(2))
            .sum();
        let degrees_of_freedom = samples as f64 * freedom / (1.0 + 2.0 * correlated);
        let rms = variance.sqrt();
        Some(Self {
            rms,
            interval: interval(rms, degrees_of_freedom),
            degrees_of_freedom,
            autoregressive,
            autocovariance,
        })
    }

    /// From a known autocovariance.
    pub fn known(autocovariance: Vec<f64>) -> Self {
        let rms = autocovariance.first().copied().unwrap_or(0.0).sqrt();
        let mut lags = autocovariance.clone();
        lags.resize(HIGHEST_ORDER + 1, 0.0);
        Self {
            rms,
            interval: [rms, rms],
            degrees_of_freedom: f64::INFINITY,
            autoregressive: yule_walker(&lags, HIGHEST_ORDER).unwrap_or_default(),
            autocovariance,
        }
    }

    /// The same noise, larger or smaller.
    pub fn scale(&mut self, factor: f64) {
        self.rms *= factor;
        self.interval = self.interval.map(|rms| rms * factor);
        self.autoregressive.innovation_rms *= factor;
        for r in &mut self.autocovariance {
            *r *= factor * factor;
        }
    }

    /// Root mean square behind a filter of finite response.
    pub fn rms_through(&self, kernel: &[f64]) -> f64 {
        // sum_ij k_i k_j r_(i - j), ordered by lag.
        let of_lag = |lag: usize| -> f64 {
            let later = kernel.get(lag..).unwrap_or_default();
            kernel.iter().zip(later).map(|(a, b)| a * b).sum()
        };
        let variance: f64 = self
            .autocovariance
            .iter()
            .take(kernel.len())
            .enumerate()
            .map(|(lag, r)| r * of_lag(lag) * if lag == 0 { 1.0 } else { 2.0 })
            .sum();
        variance.max(0.0).sqrt()
    }

    /// Sum of the autocovariance over all lags, both signs: the variance of a mean over n samples is this over n.
    pub fn long_run_variance(&self) -> f64 {
        let sum: f64 = self.autocovariance.iter().skip(1).sum();
        (self.autocovariance.first().copied().unwrap_or(0.0) + 2.0 * sum).max(0.0)
    }
}

/// 90 % interval of a root mean square.
fn interval(rms: f64, degrees_of_freedom: f64) -> [f64; 2] {
    let Ok(chi) = ChiSquared::new(degrees_of_freedom.max(0.5)) else {
        return [rms, rms];
    };
    [0.95, 0.05].map(|p| rms * (degrees_of_freedom / chi.inverse_cdf(p)).sqrt())
}

fn yule_walker(lags: &[f64], order: usize) -> Option<Autoregressive> {
    if order == 0 {
        return Some(Autoregressive {
            coefficients: Vec::new(),
            innovation_rms: lags[0].sqrt(),
        });
    }
    let matrix = DMatrix::from_fn(order, order, |i, j| lags[i.abs_diff(j)]);
    let right = DVector::from_fn(order, |i, _| lags[i + 1]);
    let solved = matrix.cholesky()?.solve(&right);
    let variance = lags[0] - solved.dot(&right);
    (variance > 0.0).then(|| Autoregressive {
        coefficients: solved.iter().copied().collect(),
        innovation_rms: variance.sqrt(),
    })
}

fn best_order(lags: &[f64], samples: f64) -> Autoregressive {
    (0..lags.len())
        .filter_map(|order| yule_walker(lags, order))
        .min_by(|a, b| {
            let information = |model: &Autoregressive| {
                samples * model.innovation_rms.powi(2).ln()
                    + model.coefficients.len() as f64 * samples.ln()
            };
            information(a).total_cmp(&information(b))
        })
        .unwrap_or_default()
}

/// The autocovariance of the model: as measured up to its order, then by its recursion.
fn prolonged(lags: &[f64], model: &Autoregressive) -> Vec<f64> {
    let order = model.coefficients.len();
    let mut out = lags[..=order].to_vec();
    let floor = NEGLIGIBLE * lags[0];
    while out.len() < MOST_LAGS {
        let k = out.len();
        // All of the last values the recursion goes on from.
        if out[k - order.max(1)..].iter().all(|r| r.abs() < floor) || order == 0 {
            break;
        }
        let next = model
            .coefficients
            .iter()
            .enumerate()
            .map(|(i, a)| a * out[k - 1 - i])
            .sum();
        out.push(next);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// x_k = 0.8 x_(k-1) + w, of unit variance.
    fn coloured(samples: usize, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut x = 0.0;
        (0..samples)
            .map(|_| {
                let w: f64 = StandardNormal.sample(&mut random);
                x = 0.8 * x + 0.6 * w;
                x
            })
            .collect()
    }

    #[test]
    fn interval_covers_the_truth_nine_times_in_ten() {
        let covered = (0..400)
            .filter(|&seed| {
                let x = coloured(800, seed);
                let noise = Noise::of(&[&x], 1.0).unwrap();
                noise.interval[0] <= 1.0 && 1.0 <= noise.interval[1]
            })
            .count();
        // 360 of 400 with a binomial spread of 6; three of them, and 2 % for the approximation of Bartlett.
        assert!((334..=386).contains(&covered), "{covered}");
    }

    #[test]
    fn model_and_filtered_size() {
        let x = coloured(50_000, 5);
        let noise = Noise::of(&[&x[..30_000], &x[30_000..]], 1.0).unwrap();
        // The spread of a first-order coefficient is sqrt((1 - 0.64)/50 000) = 0.003.
        assert!((noise.autoregressive.coefficients[0] - 0.8).abs() < 0.015);
        assert!((noise.autoregressive.innovation_rms - 0.6).abs() < 0.01);
        // A mean of 20 and a difference, against the exact sums of 0.8^|i - j|.
        for kernel in [vec![0.05; 20], vec![1.0, -1.0], vec![1.0, -2.0, 1.0]] {
            let mut exact = 0.0;
            for (i, a) in kernel.iter().enumerate() {
                for (j, b) in kernel.iter().enumerate() {
                    exact += a * b * 0.8_f64.powi(i.abs_diff(j) as i32);
                }
            }
            let through = noise.rms_through(&kernel);
            // 50 000 samples of 4.6 correlated lags: 1 % each, three of them.
            assert!((through / exact.sqrt() - 1.0).abs() < 0.03, "{through}");
        }
    }

    #[test]
    fn known_noise_is_kept() {
        let noise = Noise::known(vec![6.0, -4.0, 1.0]);
        assert!((noise.rms_through(&[1.0]) - 6.0_f64.sqrt()).abs() < 1e-12);
        // 6 + 6 - 2 * 4.
        assert!((noise.rms_through(&[1.0, 1.0]) - 4.0_f64.sqrt()).abs() < 1e-12);
        assert!(noise.long_run_variance().abs() < 1e-12);
    }
}
