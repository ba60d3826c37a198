//! Eccentric code disc: the sensor reads too much on one side of the turn and too little on the other.
//!
//! q + A w(n q + p), w a sine with harmonics: a disc that is oval besides. On a linear axis n is the turns of its screw in a metre.
//!
//! Source: Kaul, Tiwari, "Error modeling of optical incremental encoders" and makers' notes: A = eccentricity/radius.

use super::wave::Wave;
use super::{Effect, Entry, Instant, Kind, Parameter};

struct Eccentricity {
    amplitude_rad: f64,
    wave: Wave,
}

impl Effect for Eccentricity {
    fn sensor(&mut self, now: &Instant) -> f64 {
        let q = now.motion.position_rad;
        q + self.amplitude_rad * self.wave.at(q)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "sensor.eccentricity",
    model: "q + A w(n q + p), w(x) = sin x + harmonics",
    parameters: &[
        Parameter::new(["amplitude_rad", "amplitude_m"], Kind::Size, |scale| {
            scale.either([0.0, 0.03], [0.0, 1e-3])
        }),
        Parameter::TURN,
        Parameter::PHASE,
        Parameter::SECOND_SINE,
        Parameter::SECOND_COSINE,
        Parameter::THIRD_SINE,
        Parameter::THIRD_COSINE,
    ],
    build: |values, unit| {
        Box::new(Eccentricity {
            amplitude_rad: values[0],
            wave: Wave::new(unit, values[1], values[2], &values[3..]),
        })
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn is_once_a_turn() {
        let mut effect = (ENTRY.build)(&[1e-3, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0], Unit::Rotary);
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
