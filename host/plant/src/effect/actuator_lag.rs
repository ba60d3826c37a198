//! A drive slower than believed: first order on torque.
//!
//! T dtau/dt = u - tau. A step takes u as held and gives the exact mean of tau over it, whatever its length.
//!
//! Source: thesis (Aktas, ITU 2002) eq. 2.26.

use super::first_order::FirstOrder;
use super::{Effect, Entry, Instant, Kind, Parameter};

struct Lag(FirstOrder);

impl Effect for Lag {
    fn actuator(&mut self, now: &Instant) -> f64 {
        self.0.mean(now.step_s, now.torque_nm)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "actuator.lag",
    model: "T dtau/dt = u - tau",
    parameters: &[Parameter::same("lag_s", Kind::Size, |_| [1e-4, 1e-2])],
    build: |values, _| Box::new(Lag(FirstOrder::new(values[0]))),
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    /// Mean over 4 ms after a step of torque, in steps of a length.
    fn mean(step_s: f64) -> f64 {
        let mut effect = (ENTRY.build)(&[2e-3], Unit::Rotary);
        let mut out = |torque_nm| {
            effect.actuator(&Instant {
                step_s,
                torque_nm,
                ..Instant::default()
            })
        };
        assert_eq!(out(0.0), 0.0);
        let steps = (4e-3 / step_s).round() as i32;
        (0..steps).map(|_| out(1.0)).sum::<f64>() / f64::from(steps)
    }

    #[test]
    fn a_step_comes_through_as_an_exponential_whatever_the_step() {
        // Mean of 1 - exp(-t/T) over 2 T.
        let expected = 1.0 - 0.5 * (1.0 - (-2.0_f64).exp());
        for step_s in [1e-5, 1e-3, 4e-3] {
            assert!((mean(step_s) - expected).abs() < 1e-12, "{step_s}");
        }
    }
}
