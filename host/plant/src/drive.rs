//! The drive in torque mode: output delay, first-order lag, torque limit.
//!
//! Source: thesis (Aktas, ITU 2002) eq. 2.26, T dM/dt = k u - M, with the gain already in u.

use std::collections::VecDeque;

/// What the drive is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriveConfig {
    /// Samples between a reference and its output; 1 for a converter triggered by the control timer.
    pub delay_samples: usize,
    /// Time constant of the torque loop, s; zero for none.
    pub lag_s: f64,
    /// The drive's own limit, N m.
    pub torque_limit_nm: Option<f64>,
}

/// A drive in operation.
#[derive(Clone, Debug)]
pub struct Drive {
    config: DriveConfig,
    under_way_nm: VecDeque<f64>,
    output_nm: f64,
    torque_nm: f64,
}

impl Drive {
    /// A drive at zero torque.
    pub fn new(config: DriveConfig) -> Self {
        Self {
            config,
            under_way_nm: std::iter::repeat_n(0.0, config.delay_samples).collect(),
            output_nm: 0.0,
            torque_nm: 0.0,
        }
    }

    /// Takes the reference of a new sample.
    pub fn accept(&mut self, reference_nm: f64) {
        self.under_way_nm.push_back(reference_nm);
        let delayed = self.under_way_nm.pop_front().unwrap_or(reference_nm);
        self.output_nm = match self.config.torque_limit_nm {
            Some(limit) => delayed.clamp(-limit, limit),
            None => delayed,
        };
    }

    /// Mean torque over the next part of the sample, N m; `keeps` is exp(-step/lag), see [`Drive::keeps`].
    pub fn advance(&mut self, step_s: f64, keeps: f64) -> f64 {
        if self.config.lag_s <= 0.0 {
            self.torque_nm = self.output_nm;
            return self.torque_nm;
        }
        let start = self.torque_nm - self.output_nm;
        self.torque_nm = self.output_nm + start * keeps;
        self.output_nm + start * (1.0 - keeps) * self.config.lag_s / step_s
    }

    /// The reference of a sample that makes its mean torque this one, N m, where there is neither delay nor limit; `keeps` is
    /// that of the whole sample.
    pub fn reference_for(&self, mean_nm: f64, sample_s: f64, keeps: f64) -> f64 {
        let keeps_in_mean = (1.0 - keeps) * self.config.lag_s / sample_s;
        (mean_nm - keeps_in_mean * self.torque_nm) / (1.0 - keeps_in_mean)
    }

    /// Torque at this moment, N m.
    pub fn torque_nm(&self) -> f64 {
        self.torque_nm
    }

    /// Of the change of torque during a sample the part that the second difference of positions lacks beside a torque that is as its
    /// mean throughout: integral of (h - t) (mean - M(t)) dt / h^2, for an exponential M from one torque to another.
    pub fn late_part(&self, sample_s: f64) -> f64 {
        if self.config.lag_s <= 0.0 {
            return 0.0;
        }
        let lag = self.config.lag_s / sample_s;
        let goes = 1.0 - self.keeps(sample_s);
        (lag - lag * lag * goes - 0.5 * lag * goes) / goes
    }

    /// What is left of a torque error after a step.
    pub fn keeps(&self, step_s: f64) -> f64 {
        if self.config.lag_s > 0.0 {
            (-step_s / self.config.lag_s).exp()
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_lags_and_limits() {
        let mut drive = Drive::new(DriveConfig {
            delay_samples: 1,
            lag_s: 1e-3,
            torque_limit_nm: Some(0.5),
        });
        let (step, keeps) = (1e-4, drive.keeps(1e-4));
        drive.accept(2.0);
        assert_eq!(drive.advance(step, keeps), 0.0);
        drive.accept(2.0);
        let mean: f64 = (0..10).map(|_| drive.advance(step, keeps)).sum::<f64>() / 10.0;
        // Mean of 0.5 (1 - exp(-t/1 ms)) over 1 ms is 0.5 exp(-1).
        assert!((mean - 0.5 * (-1.0_f64).exp()).abs() < 1e-15);
    }

    #[test]
    fn what_a_position_lacks_is_the_integral() {
        for lag_s in [1e-4, 4e-4, 2e-3] {
            let config = DriveConfig {
                lag_s,
                ..DriveConfig::default()
            };
            let (sample_s, steps) = (1e-3, 1000);
            let step_s = sample_s / f64::from(steps);
            let mut drive = Drive::new(config);
            let keeps = drive.keeps(step_s);
            drive.accept(1.0);
            let torques: Vec<f64> = (0..steps).map(|_| drive.advance(step_s, keeps)).collect();
            let mean = torques.iter().sum::<f64>() / f64::from(steps);
            let lacks: f64 = torques
                .iter()
                .zip(0..steps)
                .map(|(torque, step)| {
                    let left_s = sample_s - (f64::from(step) + 0.5) * step_s;
                    left_s * (mean - torque) * step_s / (sample_s * sample_s)
                })
                .sum();
            let found = drive.late_part(sample_s) * drive.torque_nm();
            // The midpoint rule leaves a millionth over a thousand steps.
            assert!((found - lacks).abs() < 1e-6, "{lag_s}: {found} {lacks}");
        }
        assert_eq!(Drive::new(DriveConfig::default()).late_part(1e-3), 0.0);
    }

    #[test]
    fn gives_the_mean_that_a_reference_is_for() {
        for lag_s in [0.0, 3e-4] {
            let mut drive = Drive::new(DriveConfig {
                lag_s,
                ..DriveConfig::default()
            });
            let (sample, keeps) = (1e-3, drive.keeps(1e-3));
            for wanted in [0.2, 0.5, -0.3, -0.3] {
                drive.accept(drive.reference_for(wanted, sample, keeps));
                let mean = drive.advance(sample, keeps);
                // Rounding.
                assert!((mean - wanted).abs() < 1e-15, "{lag_s} {wanted} {mean}");
            }
        }
    }
}
