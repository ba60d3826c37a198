//! Values that lie a fixed time back, from stamped values of any step, in memory that is taken once.
//!
//! Stamps closer than 1/256 of the delay are thinned out; what lies between two is interpolated. Linear interpolation of
//! the means of even steps is the exact mean of the delayed signal that is held over each step.

use std::collections::VecDeque;

/// Thinning leaves at most two stamps in each 256th of the delay, and the interpolation takes four at its ends.
const STAMPS: usize = 2 * 256 + 8;

/// Stamped values of the last `delay_s`.
pub(super) struct History {
    delay_s: f64,
    stamps: VecDeque<(f64, f64)>,
}

impl History {
    /// An empty one.
    pub fn new(delay_s: f64) -> Self {
        Self {
            delay_s,
            stamps: VecDeque::with_capacity(STAMPS + 1),
        }
    }

    /// Adds a value; time that goes back starts anew.
    fn push(&mut self, time_s: f64, value: f64) {
        let newest = self.stamps.len().wrapping_sub(1);
        if self.stamps.back().is_some_and(|&(last, _)| time_s < last) {
            self.stamps.clear();
        } else if newest >= 1
            && newest < self.stamps.len()
            && time_s - self.stamps[newest - 1].0 < self.delay_s / 256.0
        {
            self.stamps.pop_back();
        }
        self.stamps.push_back((time_s, value));
    }

    /// Adds a value that is a mean over a step and gives the mean over a step as long, the delay before.
    pub fn mean(&mut self, time_s: f64, value: f64) -> f64 {
        self.push(time_s, value);
        let then = time_s - self.delay_s;
        while self.stamps.len() > 2 && self.stamps[1].0 <= then {
            self.stamps.pop_front();
        }
        if self.stamps.len() < 2 {
            return value;
        }
        let ((a, from), (b, to)) = (self.stamps[0], self.stamps[1]);
        from + (to - from) * ((then - a) / (b - a)).clamp(0.0, 1.0)
    }

    /// Adds a value at an instant and gives the smooth curve's value the delay before: a cubic through four stamps.
    pub fn smooth(&mut self, time_s: f64, value: f64) -> f64 {
        self.push(time_s, value);
        let then = time_s - self.delay_s;
        while self.stamps.len() > 4 && self.stamps[3].0 <= then {
            self.stamps.pop_front();
        }
        if then <= self.stamps[0].0 {
            return self.stamps[0].1;
        }
        let before = self.stamps.iter().take_while(|(t, _)| *t <= then).count();
        let window = self.stamps.len().min(4);
        let start = before.saturating_sub(2).min(self.stamps.len() - window);
        let near = self.stamps.range(start..start + window);
        near.clone()
            .map(|&(t, x)| {
                let others = near.clone().filter(|(other, _)| *other != t);
                x * others
                    .map(|(other, _)| (then - other) / (t - other))
                    .product::<f64>()
            })
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_signal_is_shifted_exactly() {
        // 2.5 steps back: half of each of two steps.
        let mut history = History::new(2.5e-3);
        let out: Vec<f64> = (0..8)
            .map(|k| history.mean(f64::from(k) * 1e-3, if k >= 3 { 1.0 } else { 0.0 }))
            .collect();
        let expected = [0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0];
        for (a, b) in out.iter().zip(expected) {
            // Rounding of times of milliseconds.
            assert!((a - b).abs() < 1e-12, "{out:?}");
        }
    }

    #[test]
    fn steps_of_any_length_give_the_delayed_curve() {
        for (step_s, delay_s) in [(1e-6, 3e-3), (1e-4, 3e-3), (2e-3, 3e-3), (2e-3, 2e-4)] {
            let mut history = History::new(delay_s);
            let mut worst = 0.0_f64;
            for k in 0..(0.1 / step_s) as i32 {
                let t = f64::from(k) * step_s;
                let seen = history.smooth(t, (30.0 * t).sin());
                assert!(history.stamps.len() <= STAMPS, "it must not grow");
                if t > delay_s + 4.0 * step_s {
                    worst = worst.max((seen - (30.0 * (t - delay_s)).sin()).abs());
                }
            }
            // A cubic through points h apart is off by at most 9/384 and at the edge 24/384 of (w h)^4, w h = 0.06.
            assert!(worst < 1e-6, "{step_s} {delay_s}: {worst:e}");
        }
    }

    #[test]
    fn time_that_goes_back_starts_anew() {
        let mut history = History::new(1e-3);
        history.mean(5.0, 7.0);
        assert_eq!(history.mean(0.0, 2.0), 2.0);
    }
}
