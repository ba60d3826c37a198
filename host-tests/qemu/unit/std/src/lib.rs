//! What the unit tests of core take from std, without an operating system. It stands under that name there.
#![no_std]

extern crate alloc;

pub use alloc::{format, string, vec};

#[doc(hidden)]
pub use cortex_m_semihosting;

/// Prints a line for the host to see.
#[macro_export]
macro_rules! println {
    ($($argument:tt)*) => {
        // Without arguments of its own that macro would print a line as it stands, braces and all.
        $crate::cortex_m_semihosting::hprintln!("{}", core::format_args!($($argument)*))
    };
}

/// Functions of a number that core leaves to std, but for those that the scalar of core has.
pub trait Float {
    /// e to the power, less one.
    #[must_use]
    fn exp_m1(self) -> Self;
    /// The whole number below.
    #[must_use]
    fn floor(self) -> Self;
    /// A whole power.
    #[must_use]
    fn powi(self, power: i32) -> Self;
    /// The nearest whole number.
    #[must_use]
    fn round(self) -> Self;
    /// Sine.
    #[must_use]
    fn sin(self) -> Self;
    /// Sine and cosine.
    #[must_use]
    fn sin_cos(self) -> (Self, Self)
    where
        Self: Sized;
}

macro_rules! float {
    ($t:ident, $exp_m1:ident, $floor:ident, $pow:ident, $round:ident, $sin:ident, $sin_cos:ident) => {
        impl Float for $t {
            fn exp_m1(self) -> Self {
                libm::$exp_m1(self)
            }
            fn floor(self) -> Self {
                libm::$floor(self)
            }
            fn powi(self, power: i32) -> Self {
                libm::$pow(self, power as $t)
            }
            fn round(self) -> Self {
                libm::$round(self)
            }
            fn sin(self) -> Self {
                libm::$sin(self)
            }
            fn sin_cos(self) -> (Self, Self) {
                libm::$sin_cos(self)
            }
        }
    };
}

float!(f32, expm1f, floorf, powf, roundf, sinf, sincosf);
float!(f64, expm1, floor, pow, round, sin, sincos);
