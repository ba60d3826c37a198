//! Floating-point scalars, f32 and f64 from one source.
//!
//! Elementary functions come from `libm` on every target. The platform's own would differ in the last places between
//! host and microcontroller, and results there are compared bit for bit.

use core::fmt::Debug;
use core::hint::cold_path;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A floating-point scalar.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + 'static
{
    /// 0
    const ZERO: Self;
    /// 1
    const ONE: Self;
    /// Distance from 1 to the next number.
    const EPSILON: Self;

    /// The nearest scalar.
    fn of(value: f64) -> Self;
    /// The nearest scalar to a count.
    fn of_count(count: i32) -> Self;
    /// The nearest scalar to a number of ticks.
    fn of_ticks(ticks: u32) -> Self;
    /// Exact widening.
    fn to_f64(self) -> f64;
    /// The whole part as an index; negative values and NaN give 0.
    fn to_index(self) -> usize;
    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The sign of `sign` on the magnitude of `self`.
    fn copysign(self, sign: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// e to the power.
    fn exp(self) -> Self;
    /// `self` to a power.
    fn powf(self, power: Self) -> Self;

    /// -1, 0 or 1; 0 at zero, as the friction literature has it.
    #[inline]
    fn sgn(self) -> Self {
        if self > Self::ZERO {
            Self::ONE
        } else if self < Self::ZERO {
            -Self::ONE
        } else {
            Self::ZERO
        }
    }

    /// The smaller one.
    #[inline]
    fn least(self, other: Self) -> Self {
        if other < self { other } else { self }
    }

    /// The larger one.
    #[inline]
    fn most(self, other: Self) -> Self {
        if other > self { other } else { self }
    }

    /// Limited to plus or minus `limit`; NaN stays. One comparison where nothing is to be limited.
    #[inline]
    fn within(self, limit: Self) -> Self {
        if self.abs() > limit {
            cold_path();
            limit.copysign(self)
        } else {
            self
        }
    }
}

macro_rules! real {
    ($t:ident, $sqrt:ident, $exp:ident, $pow:ident) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = $t::EPSILON;

            #[inline]
            fn of(value: f64) -> Self {
                value as $t
            }
            #[inline]
            fn of_count(count: i32) -> Self {
                count as $t
            }
            #[inline]
            fn of_ticks(ticks: u32) -> Self {
                ticks as $t
            }
            #[inline]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn to_index(self) -> usize {
                // Through u32: one instruction on a Cortex-M4F, and a loop index needs no more range.
                self as u32 as usize
            }
            #[inline]
            fn is_finite(self) -> bool {
                $t::is_finite(self)
            }
            #[inline]
            fn abs(self) -> Self {
                $t::abs(self)
            }
            #[inline]
            fn copysign(self, sign: Self) -> Self {
                $t::copysign(self, sign)
            }
            #[inline]
            fn sqrt(self) -> Self {
                libm::$sqrt(self)
            }
            #[inline]
            fn exp(self) -> Self {
                libm::$exp(self)
            }
            #[inline]
            fn powf(self, power: Self) -> Self {
                libm::$pow(self, power)
            }
        }
    };
}

real!(f32, sqrtf, expf, powf);
real!(f64, sqrt, exp, pow);
