//! One step of the bristle deflection, shared by every model of the form dz/dt = v (1 - alpha sgn(v) z/z_ss).
//!
//! The decay is taken at the end of the step (implicit Euler): z' = z + dq - alpha |dq| z'/z_ss. Three promises follow
//! for any step size: z_ss is the exact fixed point of steady sliding; the decay never overshoots; and no energy is made,
//! since z' (dq - dz) = alpha |dq| z'^2/z_ss >= 0 gives sigma0 z' dq >= sigma0 (z'^2 - z^2)/2.

use crate::Real;

/// Deflection after a displacement `dq`, rad, with alpha in 0..=1 and both limits above zero.
#[inline]
pub(crate) fn advance<T: Real>(z: T, dq: T, alpha: T, z_ss: T, z_max: T) -> T {
    ((z + dq) * z_ss / (z_ss + alpha * dq.abs())).within(z_max)
}
