//! A sensor coarser than believed: several counts at once.
//!
//! step floor(q/step), as the encoder itself rounds.
//!
//! Source: Widrow, Kollar, "Quantization Noise", Cambridge, 2008, ch. 1: noise of step/sqrt(12).

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Quantization {
    step_rad: f64,
}

impl Effect for Quantization {
    fn sensor(&mut self, now: &Instant) -> f64 {
        let q = now.motion.position_rad;
        if self.step_rad > 0.0 {
            self.step_rad * (q / self.step_rad).floor()
        } else {
            q
        }
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "sensor.quantization",
    model: "step floor(q/step)",
    parameters: &[Parameter::new(
        ["step_rad", "step_m"],
        Kind::Size,
        |scale| [2.0 * scale.rad_per_count, 64.0 * scale.rad_per_count],
    )],
    build: |values, _| {
        Box::new(Quantization {
            step_rad: values[0].abs(),
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::at;
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn its_noise_is_that_of_its_step() {
        let mut effect = (ENTRY.build)(&[1e-3], Unit::Rotary);
        let errors: Vec<f64> = (0..100_000)
            .map(|k| f64::from(k) * 1.7e-6)
            .map(|q| effect.sensor(&at(q, 0.0)) - q)
            .collect();
        let mean = errors.iter().sum::<f64>() / 1e5;
        let rms = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / 1e5).sqrt();
        // 170 steps: the ends are part of one.
        assert!((rms / (1e-3 / 12.0_f64.sqrt()) - 1.0).abs() < 0.01);
        assert!((mean / -0.5e-3 - 1.0).abs() < 0.01);
    }
}
