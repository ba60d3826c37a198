//! One step of the bristle deflection, shared by every model of the form dz/dt = v (1 - alpha
//! sgn(v) z/z_ss).
//!
//! The step is implicit in z: z+ = z + dq - alpha |dq| z+/z_ss. For alpha = 1 the new deflection is
//! a weighted mean of the old one and of z_ss sgn(dq), so it never leaves z_max for any step, and
//! z_ss sgn(dq) is its exact fixed point.
use crate::Real;

/// Deflection after a displacement `dq`. The caller keeps `dq` finite and `z_ss` above zero.
#[inline]
pub(crate) fn advance<T: Real>(z: T, dq: T, alpha: T, z_ss: T, z_max: T) -> T {
    ((z + dq) * z_ss / (z_ss + alpha * dq.abs())).within(z_max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elastic_without_alpha_and_fixed_at_the_steady_state() {
        assert_eq!(advance(0.25, 0.125, 0.0, 1.0, 2.0), 0.375);
        for dq in [1e-6_f64, 1e-3, 1.0, 1e6] {
            // One rounding each of the sum, product and quotient.
            assert!((advance(0.5, dq, 1.0, 0.5, 1.0) - 0.5).abs() <= 2.0 * f64::EPSILON);
        }
    }

    #[test]
    fn limited_where_alpha_alone_does_not() {
        assert_eq!(advance(0.9, 0.5, 0.0, 1.0, 1.0), 1.0);
    }
}
