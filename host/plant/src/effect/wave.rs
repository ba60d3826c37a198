//! A wave over position that is no pure sine: with its second and third harmonic, as shares of it.

use crate::unit::Unit;

pub(super) struct Wave {
    wave_rad: f64,
    phase_rad: f64,
    harmonics: Option<[f64; 4]>,
}

impl Wave {
    /// Of so many waves a turn or a metre and a phase, with the sine and cosine of twice and three times its angle.
    pub(super) fn new(unit: Unit, order: f64, phase_rad: f64, harmonics: &[f64]) -> Self {
        let shares = [0, 1, 2, 3].map(|i| harmonics[i]);
        Self {
            wave_rad: unit.wave_rad(order),
            phase_rad,
            harmonics: (shares != [0.0; 4]).then_some(shares),
        }
    }

    /// At a position, the fundamental of amplitude one.
    pub(super) fn at(&self, position_rad: f64) -> f64 {
        let angle = self.wave_rad * position_rad + self.phase_rad;
        let sine = angle.sin();
        let Some([sine_2, cosine_2, sine_3, cosine_3]) = self.harmonics else {
            return sine;
        };
        let cosine = angle.cos();
        let squared = sine * sine;
        sine + 2.0 * sine_2 * sine * cosine
            + cosine_2 * (1.0 - 2.0 * squared)
            + sine_3 * sine * (3.0 - 4.0 * squared)
            + cosine_3 * cosine * (1.0 - 4.0 * squared)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_the_sum_of_its_harmonics() {
        let wave = Wave::new(Unit::Rotary, 3.0, 0.4, &[0.2, -0.1, 0.05, 0.03]);
        for q in [-2.0, 0.0, 0.7, 5.0] {
            let x: f64 = 3.0 * q + 0.4;
            let sum = x.sin() + 0.2 * (2.0 * x).sin() - 0.1 * (2.0 * x).cos()
                + 0.05 * (3.0 * x).sin()
                + 0.03 * (3.0 * x).cos();
            assert!((wave.at(q) - sum).abs() < 1e-14, "{q}");
        }
    }
}
