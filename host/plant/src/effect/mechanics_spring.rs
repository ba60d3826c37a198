//! A spring to the frame: a cable chain, a hose, a bellows.
//!
//! tau - k (q - q_0).
//!
//! Source: Hooke's law; for cable chains Armstrong, Khatib, Burdick, "The explicit dynamic model and inertial parameters
//! of the PUMA 560 arm", IEEE ICRA, 1986 (position-dependent bias).

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Spring {
    stiffness_nm_rad: f64,
    rest_rad: f64,
}

impl Effect for Spring {
    fn mechanics(&mut self, now: &Instant) -> f64 {
        -self.stiffness_nm_rad * (now.motion.position_rad - self.rest_rad)
    }

    fn fastest_rate_1_s(&self, inertia_kg_m2: f64) -> f64 {
        (self.stiffness_nm_rad.abs() / inertia_kg_m2).sqrt()
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "mechanics.spring",
    model: "tau - k (q - q_0)",
    parameters: &[
        Parameter::new(["stiffness_nm_rad", "stiffness_n_m"], Kind::Size, |scale| {
            [0.0, 2.0 * scale.coulomb_nm / scale.stroke_rad()]
        }),
        Parameter::new(["rest_rad", "rest_m"], Kind::Zero, |scale| {
            [scale.lowest_rad, scale.highest_rad]
        }),
    ],
    build: |values, _| {
        Box::new(Spring {
            stiffness_nm_rad: values[0],
            rest_rad: values[1],
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::{self, at};
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn is_a_slope_over_position() {
        let mut effect = (ENTRY.build)(&[0.5, 0.2], Unit::Rotary);
        assert!(effect.mechanics(&at(0.2, 9.0)).abs() < 1e-16);
        assert!((effect.mechanics(&at(0.4, -9.0)) + 0.1).abs() < 1e-16);
    }

    #[test]
    fn swings_without_gaining_energy() {
        // 100 rad/s; the far ends of a thousand radians of swing are where it was let go.
        let effect = (ENTRY.build)(&[1.0, 0.0], Unit::Rotary);
        let mut axis = testing::axis(testing::free(), vec![effect]).starting_at(1.0, 0.0);
        let mut last = [0.0_f64; 2];
        for k in 0..100_000 {
            axis.advance(0.0);
            let q = axis.truth().motion.position_rad;
            last = if k >= 99_000 {
                [last[0].min(q), last[1].max(q)]
            } else {
                [0.0; 2]
            };
        }
        // The symplectic step keeps amplitude to w h/2, here 1e-3 at the 20 steps of a sample.
        assert!(
            (last[1] - 1.0).abs() < 1e-3 && (last[0] + 1.0).abs() < 1e-3,
            "{last:?}"
        );
    }
}
