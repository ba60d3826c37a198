//! Whether a discrete-time error dies out, and which gain near a refused one would make it.

use core::fmt;

/// Where the error of an observer grows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Regime {
    /// Bristles hold: dz/dt = v.
    Stick,
    /// Sliding at steady deflection.
    Slip {
        /// Speed at which the error grows most.
        speed_rad_s: f64,
    },
    /// A linear model without regimes.
    Linear,
}

/// Gains whose error dynamics do not die out at the sample time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GainError {
    /// Name of the gain, as in the axis file.
    pub gain: &'static str,
    /// The refused value.
    pub value: f64,
    /// Where the error grows.
    pub regime: Regime,
    /// Growth of the error per sample: the spectral radius, 1 or more.
    pub growth: f64,
    /// The nearest value of the gain that passes everywhere, if one was found.
    pub nearest: Option<f64>,
}

impl fmt::Display for GainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} = {:.6}: the error does not die out ",
            self.gain, self.value
        )?;
        match self.regime {
            Regime::Stick => write!(f, "in stick")?,
            Regime::Slip { speed_rad_s } => write!(f, "in slip at {speed_rad_s:.3} rad/s")?,
            Regime::Linear => write!(f, "in the linear model")?,
        }
        write!(f, " ({:.6} times a sample); ", self.growth)?;
        match self.nearest {
            Some(value) => write!(f, "the nearest value that passes is {value:.6}"),
            None => write!(f, "no value of it passes with the other gains as they are"),
        }
    }
}

impl core::error::Error for GainError {}

/// A spectral radius below this counts as dying out; the rest is rounding.
pub const LARGEST_GROWTH: f64 = 1.0 - 1e-9;

/// Spectral radius of a square matrix, by Gelfand's formula with repeated squaring.
pub fn spectral_radius<const N: usize>(matrix: [[f64; N]; N]) -> f64 {
    // The power reached is 2^40: a Jordan block of a large norm still weighs less than 1e-9.
    const SQUARINGS: u32 = 40;
    let mut m = matrix;
    let mut radius = 1.0;
    let mut root = 1.0;
    for _ in 0..SQUARINGS {
        let norm = largest(&m);
        if norm == 0.0 {
            return 0.0;
        }
        if !norm.is_finite() {
            return norm;
        }
        radius *= libm::pow(norm, root);
        root *= 0.5;
        m = square(&m.map(|row| row.map(|x| x / norm)));
    }
    radius
}

/// Spectral radius of a two by two matrix, from its characteristic polynomial: a hundredth of the work, which counts where
/// f64 is done in software.
pub fn spectral_radius_of_two([[a, b], [c, d]]: [[f64; 2]; 2]) -> f64 {
    let mean = 0.5 * (a + d);
    // (a - d)^2/4 + b c rather than mean^2 - det: no difference of two nearly equal squares.
    let discriminant = 0.25 * (a - d) * (a - d) + b * c;
    if discriminant >= 0.0 {
        libm::fabs(mean) + libm::sqrt(discriminant)
    } else {
        libm::sqrt(mean * mean - discriminant)
    }
}

fn largest<const N: usize>(m: &[[f64; N]; N]) -> f64 {
    // A NaN must come out as one, which `max` would drop.
    m.iter().flatten().fold(
        0.0,
        |largest, x| {
            if x.abs() <= largest { largest } else { x.abs() }
        },
    )
}

fn square<const N: usize>(m: &[[f64; N]; N]) -> [[f64; N]; N] {
    let mut out = [[0.0; N]; N];
    for (row_out, row) in out.iter_mut().zip(m) {
        for (x, row_right) in row.iter().zip(m) {
            for (cell, y) in row_out.iter_mut().zip(row_right) {
                *cell += x * y;
            }
        }
    }
    out
}

/// The passing gain nearest to a failing one, or none within a million times `scale`, the size at which gains differ.
///
/// Looks at values on either side, spread evenly in the logarithm of the distance, then halves the last interval.
pub fn nearest_passing(gain: f64, scale: f64, passes: impl Fn(f64) -> bool) -> Option<f64> {
    let mut distance = scale * 1e-6;
    let mut last = [gain, gain];
    while distance < scale * 1e6 {
        for (side, last) in [1.0, -1.0].into_iter().zip(&mut last) {
            let candidate = gain + side * distance;
            if passes(candidate) {
                let (mut fails, mut holds) = (*last, candidate);
                for _ in 0..30 {
                    let middle = 0.5 * (fails + holds);
                    if passes(middle) {
                        holds = middle;
                    } else {
                        fails = middle;
                    }
                }
                return Some(short(holds, holds - fails, scale, &passes));
            }
            *last = candidate;
        }
        distance *= 1.5;
    }
    None
}

/// A passing value of six digits next to `holds`, towards `inward`: what is printed has to pass when it is read back, in
/// single precision too.
fn short(holds: f64, inward: f64, scale: f64, passes: &impl Fn(f64) -> bool) -> f64 {
    let size = libm::fmax(holds.abs(), scale * 1e-6);
    let digit = libm::pow(10.0, libm::floor(libm::log10(size)) - 5.0);
    let nearest = libm::round(holds / digit);
    let step = if inward < 0.0 { -1.0 } else { 1.0 };
    [0.0, 1.0, 2.0]
        .into_iter()
        .map(|steps| (nearest + steps * step) * digit)
        .find(|&value| passes(value))
        .unwrap_or(holds)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radius_of_known_matrices() {
        // Eigenvalues by hand: 0.9 and 0.5; a rotation by 0.99; a Jordan block of 0.8.
        let (sin, cos) = 0.3_f64.sin_cos();
        let cases = [
            ([[0.9, 100.0], [0.0, 0.5]], 0.9),
            ([[0.99 * cos, -0.99 * sin], [0.99 * sin, 0.99 * cos]], 0.99),
            ([[0.8, 1.0], [0.0, 0.8]], 0.8),
            ([[0.0, 0.0], [0.0, 0.0]], 0.0),
        ];
        for (matrix, radius) in cases {
            assert!(
                (spectral_radius(matrix) - radius).abs() < 1e-9,
                "{matrix:?}"
            );
        }
    }

    #[test]
    fn radius_is_not_small_for_nan() {
        assert!(spectral_radius([[f64::NAN]]).is_nan());
        assert!(spectral_radius([[f64::INFINITY]]).is_infinite());
        assert!(spectral_radius_of_two([[f64::NAN, 0.0], [0.0, 0.0]]).is_nan());
        assert!(spectral_radius_of_two([[0.0, f64::NAN], [1.0, 0.0]]).is_nan());
    }

    #[test]
    fn finds_the_edge_of_a_range() {
        let edge = nearest_passing(500.0, 1e4, |g| (565.0..2e4).contains(&g)).unwrap();
        assert!((edge - 565.0).abs() < 1e-6);
        assert_eq!(nearest_passing(500.0, 1e4, |_| false), None);
    }

    #[test]
    fn names_a_gain_of_six_digits_that_passes() {
        for (gain, low, high, named) in [
            (500.0, 562.313_412_4, 1e4, 562.314),
            (500.0, 562.313_000_1, 1e4, 562.314),
            (2e4, 0.0, 16_853.98, 16_853.9),
            (-3.0, -1.5, 0.0, -1.5),
        ] {
            let found = nearest_passing(gain, 1e4, |g| (low..high).contains(&g)).unwrap();
            assert!((found - named).abs() < 1e-6, "{found} for {named}");
        }
    }
}
