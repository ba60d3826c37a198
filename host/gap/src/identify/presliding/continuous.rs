//! From a sampled model back to the axis in stick: the zero-order hold undone by the logarithm of the system matrix.
//!
//! Source: thesis (Aktas, ITU 2002) eq. 2.29 and appendix 2, whose second coefficient of A has the wrong sign in print.

use nalgebra::{Matrix2, Vector2};

/// A(q) y(t) = B(q) u(t - delay) of second order: A = 1 + a1 q^-1 + a2 q^-2, B = b1 q^-1 + b2 q^-2, position in rad,
/// torque in N m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arx {
    /// a1, a2.
    pub a: [f64; 2],
    /// b1, b2.
    pub b: [f64; 2],
    /// Samples of delay beyond the one that a sampled system has.
    pub delay: usize,
    /// s
    pub sample_time_s: f64,
}

/// (n1 s + n0)/(s^2 + d1 s + d0). A rigid axis in stick has n1 = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Continuous {
    /// n1.
    pub n1: f64,
    /// n0.
    pub n0: f64,
    /// d1.
    pub d1: f64,
    /// d0.
    pub d0: f64,
}

impl Continuous {
    /// sigma0: the inverse of the gain at rest.
    pub fn stiffness_nm_rad(&self) -> f64 {
        self.d0 / self.n0
    }

    /// sigma1 + sigma2.
    pub fn damping_nm_s_rad(&self) -> f64 {
        self.d1 / self.n0
    }

    /// J.
    pub fn inertia_kg_m2(&self) -> f64 {
        1.0 / self.n0
    }
}

impl Arx {
    /// The continuous system that, with its input held over each sample, gives this one; none where there is no such:
    /// a pole that is zero, negative or not inside the unit circle.
    ///
    /// ```
    /// use bristle_gap::identify::presliding::Arx;
    /// // The thesis's appendix 2 with its sign mended.
    /// let arx = Arx { a: [-0.9201, 0.0438], b: [-0.000821, 0.01257], delay: 0, sample_time_s: 1e-3 };
    /// let axis = arx.continuous().unwrap();
    /// assert!((axis.stiffness_nm_rad() - 10.53).abs() < 0.01);
    /// // As printed there is no such system.
    /// assert!(Arx { a: [-0.9201, -0.04387], ..arx }.continuous().is_none());
    /// ```
    pub fn continuous(&self) -> Option<Continuous> {
        let [a1, a2] = self.a;
        let discriminant = 0.25 * a1 * a1 - a2;
        // log(M) = alpha + beta M on the spectrum {middle +- half}.
        let middle = -0.5 * a1;
        let (alpha, beta) = if discriminant >= 0.0 {
            let half = discriminant.sqrt();
            let [fast, slow] = [middle - half, middle + half];
            if !(fast > 0.0 && slow < 1.0) {
                return None;
            }
            // ln(slow/fast)/(slow - fast), without cancellation where they are close.
            let gap = slow - fast;
            let beta = if gap > 0.0 {
                (gap / fast).ln_1p() / gap
            } else {
                1.0 / fast
            };
            (slow.ln() - beta * slow, beta)
        } else {
            if a2 >= 1.0 {
                return None;
            }
            let half = (-discriminant).sqrt();
            let beta = half.atan2(middle) / half;
            (0.5 * a2.ln() - beta * middle, beta)
        };
        let system = Matrix2::new(-a1, 1.0, -a2, 0.0);
        let a = (Matrix2::identity() * alpha + system * beta) / self.sample_time_s;
        let b = a * (system - Matrix2::identity()).try_inverse()? * Vector2::from(self.b);
        let continuous = Continuous {
            n1: b[0],
            n0: a[(0, 1)] * b[1] - a[(1, 1)] * b[0],
            d1: -a.trace(),
            d0: a.determinant(),
        };
        let numbers = [continuous.n1, continuous.n0, continuous.d1, continuous.d0];
        (numbers.iter().all(|x| x.is_finite()) && continuous.n0 != 0.0).then_some(continuous)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undoes_the_hold() {
        // Overdamped, critical and oscillating.
        for (damping, stiffness) in [
            (0.0789, 10.53),
            (2.0 * (1e-4_f64 * 4.0).sqrt(), 4.0),
            (1e-3, 4.0),
        ] {
            let inertia = if stiffness == 4.0 { 1e-4 } else { 2.5246e-5 };
            let t = 1e-3;
            let (d1, d0, n0) = (damping / inertia, stiffness / inertia, 1.0 / inertia);
            // exp of [[0, 1, 0], [-d0, -d1, n0], [0, 0, 0]] t.
            let hold = nalgebra::Matrix3::new(0.0, 1.0, 0.0, -d0, -d1, n0, 0.0, 0.0, 0.0) * t;
            let step = hold.exp();
            let (a1, a2) = (
                -(step[(0, 0)] + step[(1, 1)]),
                step[(0, 0)] * step[(1, 1)] - step[(0, 1)] * step[(1, 0)],
            );
            let b1 = step[(0, 2)];
            let b2 = step[(0, 1)] * step[(1, 2)] - step[(1, 1)] * step[(0, 2)];
            let arx = Arx {
                a: [a1, a2],
                b: [b1, b2],
                delay: 0,
                sample_time_s: t,
            };
            let back = arx.continuous().unwrap();
            // Rounding, magnified by 1/(d1 t)^2 at the critical damping.
            for (name, found, true_one) in [
                ("sigma0", back.stiffness_nm_rad(), stiffness),
                ("sigma1 + sigma2", back.damping_nm_s_rad(), damping),
                ("J", back.inertia_kg_m2(), inertia),
            ] {
                assert!(
                    (found / true_one - 1.0).abs() < 1e-7,
                    "{name}: {found} {true_one}"
                );
            }
        }
    }
}
