//! The elasto-plastic model: bristles that stay purely elastic up to a break-away deflection, so that the axis holds
//! still under any load below it.
//!
//! dz/dt = v (1 - alpha(z, v) sgn(v) z/z_ss(v)), F = sigma0 z + sigma1 dz/dt + sigma2 v, z_ss(v) = g(v)/sigma0.
//! alpha is 0 below z_ba and when z and v differ in sign, 1 from z_ss on, and half a sine between.
//!
//! Source: Dupont, Hayward, Armstrong, Altpeter, "Single state elastoplastic friction models", IEEE TAC 47(5), 2002;
//! thesis (Aktas, ITU 2002) eqs. 2.23 and 2.24. The print of 2.23 leaves fraction and exponent open and 2.24 has z where
//! abs(z) is meant; the forms above are the right ones.

use super::{Friction, Motion, presliding, stiffness};
use crate::error::{ParameterError, not_negative, require};
use crate::real::Real;
use crate::stribeck::{Curve, Table};

/// Parameters of the elasto-plastic model over a Stribeck curve.
///
/// Dissipative from velocity to torque if sigma2 >= sigma1 (F_S/F_C - 1): the condition that Barabanov and Ortega
/// (IEEE TAC 45(4), 2000) give for LuGre is sufficient here too, since alpha only takes decay away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElastoPlastic<T, C> {
    curve: C,
    stiffness_nm_rad: T,
    compliance_rad_nm: T,
    damping_nm_s_rad: T,
    viscous_nm_s_rad: T,
    breakaway_ratio: T,
    per_mixed_range: T,
    z_max_rad: T,
}

/// Parts that a slip from z_ba is followed in at most. Each takes a quarter of what z is short of z_ss, or nearly; a slip takes 37 of them.
const PARTS: u32 = 48;

/// Deflection of the bristles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    /// z, rad.
    pub z_rad: T,
}

impl<T: Real, C: Curve<T>> ElastoPlastic<T, C> {
    /// sigma0, sigma1, sigma2 and the ratio z_ba/z_ss, which holds at every speed.
    ///
    /// # Errors
    /// Stiffness not above zero or out of proportion to the curve, a negative damping, or a ratio outside 0 <= ratio < 1.
    pub fn new(
        curve: C,
        stiffness_nm_rad: T,
        damping_nm_s_rad: T,
        viscous_nm_s_rad: T,
        breakaway_ratio: T,
    ) -> Result<Self, ParameterError> {
        stiffness(stiffness_nm_rad, curve.coulomb_nm(), curve.stiction_nm())?;
        not_negative("damping_nm_s_rad", damping_nm_s_rad)?;
        not_negative("viscous_nm_s_rad", viscous_nm_s_rad)?;
        require(
            "breakaway_ratio",
            breakaway_ratio,
            breakaway_ratio >= T::ZERO && breakaway_ratio < T::ONE,
            "at least 0 and below 1",
        )?;
        Ok(Self {
            z_max_rad: curve.stiction_nm() / stiffness_nm_rad,
            curve,
            stiffness_nm_rad,
            compliance_rad_nm: T::ONE / stiffness_nm_rad,
            damping_nm_s_rad,
            viscous_nm_s_rad,
            breakaway_ratio,
            per_mixed_range: T::ONE / (T::ONE - breakaway_ratio),
        })
    }

    /// sigma0, N m/rad.
    pub fn stiffness_nm_rad(&self) -> T {
        self.stiffness_nm_rad
    }

    /// sigma1, N m s/rad.
    pub fn damping_nm_s_rad(&self) -> T {
        self.damping_nm_s_rad
    }

    /// sigma2, N m s/rad.
    pub fn viscous_nm_s_rad(&self) -> T {
        self.viscous_nm_s_rad
    }

    /// z_ba/z_ss.
    pub fn breakaway_ratio(&self) -> T {
        self.breakaway_ratio
    }

    /// The Stribeck curve.
    pub fn curve(&self) -> &C {
        &self.curve
    }

    /// Deflection in steady sliding at a speed, rad.
    #[inline]
    pub fn z_ss_rad(&self, speed_rad_s: T) -> T {
        self.curve.level_nm(speed_rad_s) * self.compliance_rad_nm
    }

    /// Deflection that no input exceeds, rad: z_ss at rest.
    #[inline]
    pub fn z_max_rad(&self) -> T {
        self.z_max_rad
    }

    /// alpha in the mixed range, at a deflection from z_ba to z_ss given as a share of z_ss.
    #[inline]
    pub fn alpha(&self, share: T) -> T {
        half_sine((share - self.breakaway_ratio) * self.per_mixed_range)
    }

    /// Deflection after a displacement `dq` at the speed of a [`Self::z_ss_rad`], rad.
    #[inline]
    pub fn advance(&self, z_rad: T, dq_rad: T, z_ss_rad: T) -> T {
        self.deflect(z_rad, dq_rad, z_ss_rad).0
    }

    /// Deflection after a displacement, and the share of the displacement that was plastic. alpha is taken half-way.
    #[inline]
    fn deflect(&self, z: T, dq: T, z_ss: T) -> (T, T) {
        let half_way = z + T::of(0.5) * dq;
        let along = if dq < T::ZERO { -half_way } else { half_way };
        // Products rather than quotients are compared, and an elastic step adds without rounding twice.
        if along <= self.breakaway_ratio * z_ss {
            return ((z + dq).within(self.z_max_rad), T::ZERO);
        }
        let alpha = if along >= z_ss {
            T::ONE
        } else {
            self.alpha(along / z_ss)
        };
        let share = presliding::share(z, dq, alpha, z_ss);
        ((share * z_ss).within(self.z_max_rad), alpha * share.abs())
    }

    /// Deflection after a displacement that is not zero, however long, and its mean on the way: z_ba is met exactly, and where bristles slip the
    /// decay at the alpha of the middle of each part is. Both are right to a fifth of a hundredth of z_ss.
    fn bend(&self, z: T, dq: T, z_ss: T) -> (T, T) {
        let (sense, far) = (dq.sgn(), dq.abs());
        let half = T::of(0.5);
        let mut along = sense * z;
        let elastic = (self.breakaway_ratio * z_ss - along)
            .most(T::ZERO)
            .least(far);
        let mut sum = elastic * (along + half * elastic);
        along += elastic;
        let mut left = far - elastic;
        let mixed = (T::ONE - self.breakaway_ratio) * z_ss;
        for _ in 0..PARTS {
            let short = z_ss - along;
            // As good as sliding.
            if left <= T::ZERO || short <= T::of(2e-3) * z_ss {
                break;
            }
            let alpha = self.alpha(along / z_ss);
            let slows = T::of(0.3) * short / (T::ONE - alpha * along / z_ss);
            let part = (T::of(0.25) * mixed)
                .most(slows)
                .least(T::of(0.15) * z_ss)
                .least(left);
            let middle = presliding::share(along, half * part, alpha, z_ss);
            let alpha = self.alpha(middle.least(T::ONE));
            let (next, mean) = presliding::decay(along, part, alpha, z_ss);
            sum += part * mean;
            along = next;
            left -= part;
        }
        if left > T::ZERO {
            let (next, mean) = presliding::decay(along, left, T::ONE, z_ss);
            sum += left * mean;
            along = next;
        }
        (sense * along, sense * sum / far)
    }

    /// Torque at a deflection and a velocity of which a share was plastic.
    #[inline]
    fn torque_nm(&self, z: T, v: T, plastic: T) -> T {
        self.stiffness_nm_rad * z
            + self.damping_nm_s_rad * (v - v * plastic)
            + self.viscous_nm_s_rad * v
    }

    /// The same model over a sampled curve in another precision, for the interrupt.
    ///
    /// # Errors
    /// A top speed that is not above zero.
    pub fn tabulated<U: Real>(
        &self,
        top_speed_rad_s: T,
    ) -> Result<ElastoPlastic<U, Table<U>>, ParameterError> {
        let to = |x: T| U::of(x.to_f64());
        ElastoPlastic::new(
            Table::new(&self.curve, top_speed_rad_s)?.cast(),
            to(self.stiffness_nm_rad),
            to(self.damping_nm_s_rad),
            to(self.viscous_nm_s_rad),
            to(self.breakaway_ratio),
        )
    }
}

impl<T: Real, C: Curve<T>> Friction<T> for ElastoPlastic<T, C> {
    type State = State<T>;
    const HOLDS_AT_REST: bool = false;

    #[inline]
    fn step(&self, state: &mut State<T>, motion: Motion<T>) -> T {
        if !motion.is_usable() {
            return self.stiffness_nm_rad * state.z_rad;
        }
        let v = motion.velocity_rad_s;
        let dq = motion.displacement_rad(self.z_max_rad);
        let (next, plastic) = self.deflect(state.z_rad, dq, self.z_ss_rad(v.abs()));
        state.z_rad = next;
        self.torque_nm(next, v, plastic)
    }

    fn mean_over(&self, state: &mut State<T>, motion: Motion<T>, level_nm: Option<T>) -> T {
        if !motion.is_usable() {
            return self.stiffness_nm_rad * state.z_rad;
        }
        let v = motion.velocity_rad_s;
        let dq = motion.displacement_rad(self.z_max_rad);
        let before = state.z_rad;
        if dq == T::ZERO {
            return self.stiffness_nm_rad * before;
        }
        let level_nm = level_nm.unwrap_or_else(|| self.curve.level_nm(v.abs()));
        let (next, mean) = self.bend(before, dq, level_nm * self.compliance_rad_nm);
        state.z_rad = next.within(self.z_max_rad);
        self.stiffness_nm_rad * mean
            + self.damping_nm_s_rad * v * (next - before) / dq
            + self.viscous_nm_s_rad * v
    }

    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        velocity_rad_s.sgn() * self.curve.level_nm(velocity_rad_s.abs())
            + self.viscous_nm_s_rad * velocity_rad_s
    }

    fn deflection_rad(&self, state: &State<T>) -> T {
        state.z_rad
    }

    fn rescale(&self, state: &mut State<T>, times: T) {
        state.z_rad = state.z_rad * times;
    }
}

/// (1 + sin(pi (x - 1/2)))/2 for x from 0 to 1.
///
/// An even polynomial times x - 1/2, fitted for the least greatest error (1.9e-9) with both ends exact: cheaper than a
/// sine, and the same in every precision.
#[inline]
pub fn half_sine<T: Real>(x: T) -> T {
    let u = x - T::of(0.5);
    let s = u * u;
    let mut q = T::of(HALF_SINE[3]);
    for &c in [HALF_SINE[2], HALF_SINE[1], HALF_SINE[0]].iter() {
        q = q * s + T::of(c);
    }
    T::of(0.5) + u * (T::ONE + (s - T::of(0.25)) * q)
}

/// Coefficients of [`half_sine`] over the square of the distance from the middle, lowest first.
pub const HALF_SINE: [f64; 4] = [
    -2.283185144364166,
    1.2026721831131366,
    -0.2893574259628464,
    0.03856046234606336,
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stribeck::{Shape, Stribeck};

    fn bench() -> ElastoPlastic<f64, Stribeck<f64>> {
        with_breakaway(0.7)
    }

    fn with_breakaway(ratio: f64) -> ElastoPlastic<f64, Stribeck<f64>> {
        let shape = Shape::Gaussian {
            velocity_rad_s: 0.3,
        };
        let curve = Stribeck::new(0.020, 0.026, shape).unwrap();
        ElastoPlastic::new(curve, 10.53, 0.076, 0.0029, ratio).unwrap()
    }

    #[test]
    fn half_sine_is_half_a_sine() {
        let worst = (0..=10_000)
            .map(|i| f64::from(i) * 1e-4)
            .map(|x| (half_sine(x) - 0.5 * (1.0 + (core::f64::consts::PI * (x - 0.5)).sin())).abs())
            .fold(0.0, f64::max);
        // The error the fit was made to, with its last digit rounded up.
        assert!(worst < 1.9e-9, "{worst:e}");
        assert_eq!((half_sine(0.0_f32), half_sine(1.0_f32)), (0.0, 1.0));
    }

    #[test]
    fn the_mean_over_a_long_step_is_that_of_many_short_ones() {
        for ratio in [0.0, 0.3, 0.7, 0.97] {
            long_steps_are_as_short_ones(&with_breakaway(ratio));
        }
    }

    #[test]
    fn a_long_step_ends_whatever_the_level_is() {
        let model = with_breakaway(1.0 - 1e-15);
        for level_nm in [-1.0, 0.0, f64::MIN_POSITIVE, 1e-9, 0.02, 1e300] {
            for velocity_rad_s in [1e-9, -1.0, 1e9] {
                let mut state = State { z_rad: 1e-3 };
                let motion = Motion {
                    velocity_rad_s,
                    applied_nm: 0.0,
                    dt_s: 0.05,
                };
                model.mean_over(&mut state, motion, Some(level_nm));
                assert!(state.z_rad.abs() <= model.z_max_rad());
            }
        }
    }

    fn long_steps_are_as_short_ones(model: &ElastoPlastic<f64, Stribeck<f64>>) {
        let (mut long, mut short) = (State::default(), State::default());
        let parts = 1000;
        for k in 0..400 {
            // Through all ranges both ways: by up to eight times z_max a step.
            let motion = Motion {
                velocity_rad_s: 0.4 * (0.05 * f64::from(k)).sin(),
                applied_nm: 0.0,
                dt_s: 0.05,
            };
            let known = (k % 2 == 0).then(|| model.curve().level_nm(motion.velocity_rad_s.abs()));
            let mean_nm = model.mean_over(&mut long, motion, known);
            let short_motion = Motion {
                dt_s: motion.dt_s / f64::from(parts),
                ..motion
            };
            let sum_nm: f64 = (0..parts)
                .map(|_| model.step(&mut short, short_motion))
                .sum();
            let wrong_nm = mean_nm - sum_nm / f64::from(parts);
            // Half a hundredth of F_S; the damping adds 0.076 N m s/rad times what z is wrong by in 50 ms, as much as a
            // seventh of that; steps of 8e-3 z_max, whose torque is that of their end, lag by half of one.
            assert!(wrong_nm.abs() < 0.0115 * 0.026, "{k}: {wrong_nm:e}");
            short.z_rad = long.z_rad;
        }
        let held = long;
        let rest = Motion {
            dt_s: 0.05,
            ..Motion::default()
        };
        assert_eq!(model.mean_over(&mut long, rest, None), 10.53 * held.z_rad);
        assert_eq!(long, held);
    }

    #[test]
    fn elastic_below_breakaway() {
        let model = bench();
        let z_ba = 0.7 * 0.026 / 10.53;
        let mut z = 0.0;
        for i in 0..100_000 {
            // In and out by 0.49 z_ba about 0.5 z_ba, at rest as far as the Stribeck curve is concerned.
            let dq = 1e-3 * z_ba * if (i / 490) % 2 == 0 { 1.0 } else { -1.0 };
            z = model.advance(z, dq, model.z_ss_rad(0.0));
        }
        let moved: f64 = (0..100_000)
            .map(|i| if (i / 490) % 2 == 0 { 1e-3 } else { -1e-3 } * z_ba)
            .sum();
        // Rounding of 1e5 sums.
        assert!(
            (z - moved).abs() < 1e-13,
            "plastic slip {:e} rad",
            z - moved
        );
    }

    #[test]
    fn deflection_relaxes_at_once_after_reversal() {
        let model = bench();
        let z_ss = model.z_ss_rad(1.0);
        let back = model.advance(z_ss, -1e-5, z_ss);
        assert_eq!(back, z_ss - 1e-5);
    }
}
