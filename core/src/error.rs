//! What is wrong with a parameter.

use core::fmt;

/// A parameter outside the range in which its model means anything.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterError {
    /// Name of the parameter with its unit, as in the axis file of a rotary axis.
    pub name: &'static str,
    /// The value that was refused.
    pub value: f64,
    /// What it must be, to be read after "must be".
    pub must_be: &'static str,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {} must be {}", self.name, self.value, self.must_be)
    }
}

impl core::error::Error for ParameterError {}

/// Passes `value` on if `holds`, else says what it must be.
///
/// # Errors
/// [`ParameterError`] with the given name and requirement if `holds` is false or the value is not finite.
pub fn require<T: crate::Real>(
    name: &'static str,
    value: T,
    holds: bool,
    must_be: &'static str,
) -> Result<T, ParameterError> {
    if holds && value.is_finite() {
        Ok(value)
    } else {
        Err(ParameterError {
            name,
            value: value.to_f64(),
            must_be,
        })
    }
}

/// Passes on a finite value above zero.
///
/// # Errors
/// [`ParameterError`] for everything else.
pub fn positive<T: crate::Real>(name: &'static str, value: T) -> Result<T, ParameterError> {
    require(name, value, value > T::ZERO, "finite and above zero")
}

/// Passes on a finite value of zero or more.
///
/// # Errors
/// [`ParameterError`] for everything else.
pub fn not_negative<T: crate::Real>(name: &'static str, value: T) -> Result<T, ParameterError> {
    require(name, value, value >= T::ZERO, "finite and zero or more")
}
