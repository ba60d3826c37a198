//! One step of the bristle deflection, shared by every model of the form dz/dt = v (1 - alpha sgn(v) z/z_ss).
//!
//! The decay is taken at the end of the step (implicit Euler): z' = z + dq - alpha |dq| z'/z_ss. Three promises follow
//! for any step size: z_ss is the exact fixed point of steady sliding; the decay never overshoots; and no energy is made,
//! since z' (dq - dz) = alpha |dq| z'^2/z_ss >= 0 gives sigma0 z' dq >= sigma0 (z'^2 - z^2)/2.

use crate::Real;

/// Deflection after a displacement `dq` as a share of `z_ss`. The caller keeps `dq` finite and `z_ss` above zero.
#[inline]
pub(crate) fn share<T: Real>(z: T, dq: T, alpha: T, z_ss: T) -> T {
    (z + dq) / (z_ss + alpha * dq.abs())
}

/// Deflection after a displacement `dq`, no more than `z_max`.
#[inline]
pub(crate) fn advance<T: Real>(z: T, dq: T, alpha: T, z_ss: T, z_max: T) -> T {
    (share(z, dq, alpha, z_ss) * z_ss).within(z_max)
}

/// Deflection after a displacement `far` in its own sense under a constant alpha, and its mean on the way.
pub(crate) fn decay<T: Real>(along: T, far: T, alpha: T, z_ss: T) -> (T, T) {
    let x = alpha * far / z_ss;
    // Where next to nothing slips the quotients below have no digits.
    if x < T::of(1e-4) {
        let next = along + far - x * along;
        return (next, T::of(0.5) * (along + next));
    }
    let ends = z_ss / alpha;
    let off = along - ends;
    // As all along in sliding at a constant level.
    if off == T::ZERO {
        return (ends, ends);
    }
    // exp(-40) is lost in the rounding of what is left of z_ss.
    let left = if x > T::of(40.0) { T::ZERO } else { (-x).exp() };
    (ends + off * left, ends + off * (T::ONE - left) / x)
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
