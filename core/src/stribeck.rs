//! The Stribeck curves g(v): friction level against speed without its viscous part, N m over rad/s.
//!
//! Source: Aktas, "Comparison of single state dynamic friction models and friction observers" (ITU, 2002), the table
//! after eq. 2.2. All six start at the stiction level at rest and fall, or stay, with speed.

use crate::error::{ParameterError, not_negative, positive, require};
use crate::real::Real;

/// A friction level that depends on speed.
pub trait Curve<T: Real> {
    /// Level at a speed (the absolute value of velocity), N m.
    fn level_nm(&self, speed_rad_s: T) -> T;
    /// Derivative of the level with respect to speed, N m s/rad; never positive.
    fn slope_nm_s_rad(&self, speed_rad_s: T) -> T;
    /// Level at rest, the largest.
    fn stiction_nm(&self) -> T;
    /// Level at high speed, the least.
    fn coulomb_nm(&self) -> T;
}

/// How the level falls from stiction to Coulomb friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape<T> {
    /// No fall: F_C at every speed.
    Constant,
    /// F_S - R |v|, down to F_C.
    PiecewiseLinear {
        /// R, N m s/rad.
        slope_nm_s_rad: T,
    },
    /// exp(-|v|/v_s)
    Exponential {
        /// v_s
        velocity_rad_s: T,
    },
    /// exp(-(v/v_s)^2)
    Gaussian {
        /// v_s
        velocity_rad_s: T,
    },
    /// exp(-a |v|^d)
    GeneralisedExponential {
        /// a, with |v| in rad/s.
        rate: T,
        /// d
        exponent: T,
    },
    /// 1/(1 + (v/v_s)^2)
    Lorentzian {
        /// v_s
        velocity_rad_s: T,
    },
}

/// One of the six curves of the thesis.
///
/// ```
/// use bristle_core::stribeck::{Curve, Shape, Stribeck};
/// let g = Stribeck::new(0.020, 0.026, Shape::Gaussian { velocity_rad_s: 0.3 })?;
/// assert_eq!(g.level_nm(0.0), 0.026);
/// assert!((g.level_nm(3.0_f64) - 0.020).abs() < 1e-9);
/// # Ok::<(), bristle_core::ParameterError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stribeck<T> {
    coulomb_nm: T,
    stiction_nm: T,
    shape: Shape<T>,
    /// 1/v_s of the shapes that have one.
    per_velocity: T,
}

impl<T: Real> Stribeck<T> {
    /// A curve from `stiction_nm` at rest down to `coulomb_nm`. The constant shape takes F_C alone.
    ///
    /// # Errors
    /// Coulomb friction not above zero, stiction below it, or a shape parameter not above zero.
    pub fn new(coulomb_nm: T, stiction_nm: T, shape: Shape<T>) -> Result<Self, ParameterError> {
        positive("coulomb_nm", coulomb_nm)?;
        require(
            "stiction_nm",
            stiction_nm,
            stiction_nm >= coulomb_nm,
            "at least coulomb_nm",
        )?;
        let mut per_velocity = T::ZERO;
        match shape {
            Shape::Constant => {}
            Shape::PiecewiseLinear { slope_nm_s_rad } => {
                not_negative("slope_nm_s_rad", slope_nm_s_rad)?;
            }
            Shape::Exponential { velocity_rad_s }
            | Shape::Gaussian { velocity_rad_s }
            | Shape::Lorentzian { velocity_rad_s } => {
                per_velocity = T::ONE / positive("stribeck_velocity_rad_s", velocity_rad_s)?;
            }
            Shape::GeneralisedExponential { rate, exponent } => {
                positive("stribeck_rate", rate)?;
                positive("stribeck_exponent", exponent)?;
            }
        }
        Ok(Self {
            coulomb_nm,
            stiction_nm: match shape {
                Shape::Constant => coulomb_nm,
                _ => stiction_nm,
            },
            shape,
            per_velocity,
        })
    }

    /// Coulomb friction at every speed.
    ///
    /// # Errors
    /// Coulomb friction not above zero.
    pub fn constant(coulomb_nm: T) -> Result<Self, ParameterError> {
        Self::new(coulomb_nm, coulomb_nm, Shape::Constant)
    }
}

impl<T: Real> Curve<T> for Stribeck<T> {
    #[inline]
    fn level_nm(&self, speed_rad_s: T) -> T {
        let fall = self.stiction_nm - self.coulomb_nm;
        match self.shape {
            Shape::Constant => self.coulomb_nm,
            Shape::PiecewiseLinear { slope_nm_s_rad } => {
                self.stiction_nm - (slope_nm_s_rad * speed_rad_s).least(fall)
            }
            Shape::Exponential { .. } => {
                self.coulomb_nm + fall * (-speed_rad_s * self.per_velocity).exp()
            }
            Shape::Gaussian { .. } => {
                let x = speed_rad_s * self.per_velocity;
                // exp(-50) is 2e-22: lost in the rounding of F_C for any fall of less than 10^5 times it.
                if x * x > T::of(50.0) {
                    return self.coulomb_nm;
                }
                self.coulomb_nm + fall * (-(x * x)).exp()
            }
            Shape::GeneralisedExponential { rate, exponent } => {
                self.coulomb_nm + fall * (-rate * speed_rad_s.powf(exponent)).exp()
            }
            Shape::Lorentzian { .. } => {
                let x = speed_rad_s * self.per_velocity;
                self.coulomb_nm + fall / (T::ONE + x * x)
            }
        }
    }

    fn slope_nm_s_rad(&self, speed_rad_s: T) -> T {
        let fall = self.stiction_nm - self.coulomb_nm;
        let two = T::of(2.0);
        match self.shape {
            Shape::Constant => T::ZERO,
            Shape::PiecewiseLinear { slope_nm_s_rad } => {
                if slope_nm_s_rad * speed_rad_s < fall {
                    -slope_nm_s_rad
                } else {
                    T::ZERO
                }
            }
            Shape::Exponential { .. } => {
                -fall * self.per_velocity * (-speed_rad_s * self.per_velocity).exp()
            }
            Shape::Gaussian { .. } => {
                let x = speed_rad_s * self.per_velocity;
                -two * x * fall * self.per_velocity * (-(x * x)).exp()
            }
            Shape::GeneralisedExponential { rate, exponent } => {
                // An exponent below one makes the slope infinite at rest; the next representable speed stands for it.
                let speed = speed_rad_s.most(T::EPSILON);
                -fall
                    * rate
                    * exponent
                    * speed.powf(exponent - T::ONE)
                    * (-rate * speed.powf(exponent)).exp()
            }
            Shape::Lorentzian { .. } => {
                let x = speed_rad_s * self.per_velocity;
                let y = T::ONE + x * x;
                -two * x * fall * self.per_velocity / (y * y)
            }
        }
    }

    #[inline]
    fn stiction_nm(&self) -> T {
        self.stiction_nm
    }

    #[inline]
    fn coulomb_nm(&self) -> T {
        self.coulomb_nm
    }
}

/// Segments of a [`Table`].
pub const SEGMENTS: usize = 64;

/// A curve sampled at even steps of speed and interpolated linearly: no elementary function, for the interrupt.
///
/// Above its top speed it stays at the last value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Table<T> {
    level_nm: [T; SEGMENTS + 1],
    coulomb_nm: T,
    segments_per_rad_s: T,
}

impl<T: Real> Table<T> {
    /// Samples `curve` from rest to `top_speed_rad_s`.
    ///
    /// # Errors
    /// A top speed that is not above zero.
    pub fn new(curve: &impl Curve<T>, top_speed_rad_s: T) -> Result<Self, ParameterError> {
        positive("top_speed_rad_s", top_speed_rad_s)?;
        let segments = T::of_count(SEGMENTS as i32);
        let mut level_nm = [T::ZERO; SEGMENTS + 1];
        let mut i = T::ZERO;
        for level in &mut level_nm {
            *level = curve.level_nm(top_speed_rad_s * i / segments);
            i += T::ONE;
        }
        Ok(Self {
            level_nm,
            coulomb_nm: curve.coulomb_nm(),
            segments_per_rad_s: segments / top_speed_rad_s,
        })
    }

    /// The same table in another precision.
    pub fn cast<U: Real>(&self) -> Table<U> {
        let to = |x: T| U::of(x.to_f64());
        Table {
            level_nm: self.level_nm.map(to),
            coulomb_nm: to(self.coulomb_nm),
            segments_per_rad_s: to(self.segments_per_rad_s),
        }
    }

    /// Segment of a speed, and the place in it from 0 to 1.
    #[inline]
    fn place(&self, speed_rad_s: T) -> (usize, T) {
        let x = (speed_rad_s * self.segments_per_rad_s).least(T::of_count(SEGMENTS as i32));
        let i = x.to_index().min(SEGMENTS - 1);
        (i, x - T::of_count(i as i32))
    }
}

impl<T: Real> Curve<T> for Table<T> {
    #[inline]
    fn level_nm(&self, speed_rad_s: T) -> T {
        let (i, part) = self.place(speed_rad_s);
        match (self.level_nm.get(i), self.level_nm.get(i + 1)) {
            (Some(&low), Some(&high)) => low + (high - low) * part,
            _ => self.coulomb_nm,
        }
    }

    fn slope_nm_s_rad(&self, speed_rad_s: T) -> T {
        let (i, part) = self.place(speed_rad_s);
        match (self.level_nm.get(i), self.level_nm.get(i + 1)) {
            (Some(&low), Some(&high)) if part < T::ONE => (high - low) * self.segments_per_rad_s,
            _ => T::ZERO,
        }
    }

    #[inline]
    fn stiction_nm(&self) -> T {
        self.level_nm[0]
    }

    #[inline]
    fn coulomb_nm(&self) -> T {
        self.coulomb_nm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> [Shape<f64>; 6] {
        [
            Shape::Constant,
            Shape::PiecewiseLinear {
                slope_nm_s_rad: 0.01,
            },
            Shape::Exponential {
                velocity_rad_s: 0.3,
            },
            Shape::Gaussian {
                velocity_rad_s: 0.3,
            },
            Shape::GeneralisedExponential {
                rate: 5.0,
                exponent: 1.5,
            },
            Shape::Lorentzian {
                velocity_rad_s: 0.3,
            },
        ]
    }

    #[test]
    fn every_shape_falls_from_stiction_to_coulomb() {
        for shape in shapes() {
            let g = Stribeck::new(0.020, 0.026, shape).unwrap();
            assert_eq!(g.level_nm(0.0), g.stiction_nm(), "{shape:?}");
            // The Lorentzian has the longest tail: 6e-3/(1+1e8) at 3000 rad/s.
            assert!((g.level_nm(3e3) - 0.020).abs() < 1e-9, "{shape:?}");
            let mut last = g.level_nm(0.0);
            for i in 1..2000 {
                let level = g.level_nm(f64::from(i) * 1e-3);
                assert!(level <= last && level >= 0.020, "{shape:?}");
                last = level;
            }
        }
    }

    #[test]
    fn slope_is_the_derivative() {
        for shape in shapes() {
            let g = Stribeck::new(0.020, 0.026, shape).unwrap();
            // Off the kink of the piecewise line at 0.6 rad/s.
            for v in [0.05, 0.2, 0.4, 0.9] {
                let h = 1e-6;
                let numeric = (g.level_nm(v + h) - g.level_nm(v - h)) / (2.0 * h);
                // Rounding of the difference: 1e-17/1e-6.
                assert!((g.slope_nm_s_rad(v) - numeric).abs() < 1e-9, "{shape:?}");
            }
        }
    }

    #[test]
    fn table_follows_its_curve() {
        let shape = Shape::Gaussian {
            velocity_rad_s: 0.3,
        };
        let curve = Stribeck::new(0.020, 0.026, shape).unwrap();
        let table = Table::new(&curve, 2.4).unwrap();
        let worst = (0..3000)
            .map(|i| f64::from(i) * 1e-3)
            .map(|v| (table.level_nm(v) - curve.level_nm(v)).abs())
            .fold(0.0, f64::max);
        // Linear interpolation: h^2/8 max|g''| = (2.4/64)^2/8 * 2*0.006/0.3^2.
        let limit = (2.4_f64 / 64.0).powi(2) / 8.0 * 2.0 * 0.006 / 0.09;
        assert!(worst < limit, "table error {worst:e} N m, limit {limit:e}");
    }

    #[test]
    fn table_answers_beyond_its_range_and_for_nan() {
        let curve = Stribeck::new(
            0.020_f32,
            0.026,
            Shape::Gaussian {
                velocity_rad_s: 0.3,
            },
        )
        .unwrap();
        let table = Table::new(&curve, 2.4).unwrap();
        assert_eq!(table.level_nm(1e30), table.level_nm(2.4));
        assert_eq!(table.level_nm(f32::INFINITY), table.level_nm(2.4));
        let _ = table.level_nm(f32::NAN);
    }

    #[test]
    fn refuses_what_means_nothing() {
        assert!(Stribeck::<f64>::constant(0.0).is_err());
        assert!(Stribeck::new(0.02, 0.01, Shape::Constant).is_err());
        let nan = Shape::Gaussian {
            velocity_rad_s: f64::NAN,
        };
        assert!(Stribeck::new(0.02, 0.03, nan).is_err());
    }
}
