//! Eccentric code disc: the sensor reads q + A sin(q + p). On a linear axis the error repeats every metre.

use super::{Effect, Entry, Instant, Kind, Parameter};
use crate::unit::Unit;

struct Eccentricity {
    amplitude_rad: f64,
    phase_rad: f64,
    wave_rad: f64,
}

impl Effect for Eccentricity {
    fn sensor(&mut self, now: &Instant) -> f64 {
        let q = now.motion.position_rad;
        q + self.amplitude_rad * (self.wave_rad * q + self.phase_rad).sin()
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "sensor.eccentricity",
    parameters: &[
        Parameter {
            name: "amplitude_rad",
            linear_name: "amplitude_m",
            default: 0.0,
            kind: Kind::Size,
            range: |scale| match scale.unit {
                Unit::Rotary => [0.0, 0.03],
                Unit::Linear => [0.0, 1e-3],
            },
        },
        Parameter {
            name: "phase_rad",
            linear_name: "phase_rad",
            default: 0.0,
            kind: Kind::Phase,
            range: |_| [-std::f64::consts::PI, std::f64::consts::PI],
        },
    ],
    build: |values, unit| {
        Box::new(Eccentricity {
            amplitude_rad: values[0],
            phase_rad: values[1],
            wave_rad: unit.wave_rad(1.0),
        })
    },
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_once_a_turn() {
        let mut effect = (ENTRY.build)(&[1e-3, 0.0], Unit::Rotary);
        let mut error = |q: f64| {
            let mut now = Instant::default();
            now.motion.position_rad = q;
            effect.sensor(&now) - q
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!((error(quarter) - 1e-3).abs() < 1e-15);
        assert!((error(3.0 * quarter) + 1e-3).abs() < 1e-15);
        // Rounding of positions of some turns.
        assert!((error(5.0 * quarter) - 1e-3).abs() < 1e-14);
    }
}
