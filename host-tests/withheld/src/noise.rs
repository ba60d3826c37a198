//! What stands between an axis and its log: coloured effort noise, a position counter, and the floor both leave.

use crate::draw::Draw;

/// Effort noise: a white part and one that decays over a correlation time.
pub(crate) struct EffortNoise {
    white: f64,
    coloured: f64,
    kept: f64,
    state: f64,
}

impl EffortNoise {
    /// `rms` in all, `share` of its variance coloured with `correlation_s`, sampled every `step_s`.
    pub(crate) fn new(
        rms: f64,
        share: f64,
        correlation_s: f64,
        step_s: f64,
        draw: &mut Draw,
    ) -> Self {
        Self {
            white: rms * (1.0 - share).sqrt(),
            coloured: rms * share.sqrt(),
            kept: libm::exp(-step_s / correlation_s),
            state: draw.normal(),
        }
    }

    /// The next value.
    pub(crate) fn next(&mut self, draw: &mut Draw) -> f64 {
        self.state = self.kept * self.state + (1.0 - self.kept * self.kept).sqrt() * draw.normal();
        self.white * draw.normal() + self.coloured * self.state
    }
}

/// Standard deviation of the Gaussian window of [`second_derivative`], s: short enough for a break-away.
pub(crate) fn window_s(step_s: f64) -> f64 {
    (3e-3f64).max(2.0 * step_s)
}

/// Second derivative under a Gaussian window, one value a sample, for the step from that sample to the next; the ends,
/// where the window does not fit, are zero.
pub(crate) fn second_derivative(values: &[f64], step_s: f64) -> Vec<f64> {
    let window = window_s(step_s) / step_s;
    let half = (4.0 * window).ceil() as usize;
    let mut weights: Vec<f64> = (0..=2 * half)
        .map(|i| {
            let x = (i as f64 - half as f64) / window;
            (x * x - 1.0) * libm::exp(-0.5 * x * x)
        })
        .collect();
    // Zero on a constant, and exact on a parabola.
    let mean = weights.iter().sum::<f64>() / weights.len() as f64;
    weights.iter_mut().for_each(|weight| *weight -= mean);
    let second: f64 = (0..).zip(&weights).fold(0.0, |sum, (i, weight)| {
        let x = f64::from(i) - half as f64;
        sum + 0.5 * weight * x * x
    });
    let mut result = vec![0.0; values.len()];
    for k in half..values.len().saturating_sub(half) {
        let near = &values[k - half..=k + half];
        let sum: f64 = near
            .iter()
            .zip(&weights)
            .map(|(value, weight)| value * weight)
            .sum();
        result[k] = sum / (second * step_s * step_s);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effort_noise_has_its_size_and_its_colour() {
        let mut draw = Draw::new(1, 0);
        let mut noise = EffortNoise::new(2.0, 0.5, 0.01, 1e-3, &mut draw);
        let values: Vec<f64> = (0..200_000).map(|_| noise.next(&mut draw)).collect();
        let power = values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64;
        let lag: f64 = values.windows(6).map(|w| w[0] * w[5]).sum::<f64>() / values.len() as f64;
        // 10,000 independent stretches of the coloured half: a spread of 1.5 % in power; five of that.
        assert!((power / 4.0 - 1.0).abs() < 0.08, "{power}");
        // Half the variance, kept over five samples of a tenth of the correlation time: 2 exp(-0.5).
        assert!((lag / (2.0 * libm::exp(-0.5)) - 1.0).abs() < 0.12, "{lag}");
    }

    #[test]
    fn second_derivative_is_exact_on_a_parabola_and_follows_a_sine() {
        let parabola: Vec<f64> = (0..100)
            .map(|k| 3.0 + 0.5 * f64::from(k * k) * 1e-6)
            .collect();
        let curvature = second_derivative(&parabola, 1e-3);
        assert!((curvature[50] - 1.0).abs() < 1e-9, "{}", curvature[50]);
        assert!(curvature[0] == 0.0 && curvature[99] == 0.0);
        // A Gaussian window takes exp(-(w s)^2/2) off a sine.
        let w = 100.0;
        let sine: Vec<f64> = (0..400)
            .map(|k| libm::sin(w * f64::from(k) * 1e-3))
            .collect();
        let curvature = second_derivative(&sine, 1e-3);
        let expected = -w * w * libm::exp(-0.5 * (w * 3e-3) * (w * 3e-3)) * sine[200];
        // Cut at four standard deviations, the window lacks 1e-3 of itself.
        assert!((curvature[200] / expected - 1.0).abs() < 5e-3);
    }
}
