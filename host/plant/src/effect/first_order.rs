//! A lag of first order: T dy/dt = x - y.

/// What follows a value that is held over each step.
pub(super) struct FirstOrder {
    lag_s: f64,
    last: Option<f64>,
}

impl FirstOrder {
    /// It starts at the first value.
    pub fn new(lag_s: f64) -> Self {
        Self { lag_s, last: None }
    }

    /// Takes a value as held over a step and gives the exact mean over it of what follows, whatever its length.
    pub fn mean(&mut self, step_s: f64, value: f64) -> f64 {
        if self.lag_s <= 0.0 || step_s <= 0.0 {
            return value;
        }
        let steps = step_s / self.lag_s;
        let start = self.last.unwrap_or(value) - value;
        let lost = -(-steps).exp_m1();
        self.last = Some(value + start * (1.0 - lost));
        value + start * lost / steps
    }
}
