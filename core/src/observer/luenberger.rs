//! The Luenberger-like friction observer: velocity and z from torque and counts, position itself left out.
//!
//! Source: thesis (Aktas, ITU 2002) eqs. 4.7-4.21; Altpeter, "Friction modeling, identification and compensation"
//! (EPFL, 1999). With w = (v, z) and f(w) = (-(sigma0 z + sigma1 dz/dt + sigma2 v)/J, dz/dt) the observer is
//! dtheta/dt = f(w) + (u/J, 0) - L v, theta = w - L q, L = (l1, l2); the print has state and f scrambled (4.8, 4.9).
//! One sample of it, with q eliminated, is
//!
//! w' = w + T (f(w) + (u/J, 0)) + L (dq - T v),
//!
//! where dq is the measured step. The deflection inside f goes through the bounded step of the friction model, which
//! is what keeps the observer finite at any speed; an explicit Euler step of z turns unstable once it travels 2 z_ss a
//! sample.

use super::Estimate;
use super::stability::{
    GainError, LARGEST_GROWTH, Regime, nearest_passing, spectral_radius_of_two,
};
use core::hint::cold_path;

use crate::error::{ParameterError, positive, require};
use crate::friction::ElastoPlastic;
use crate::real::Real;
use crate::stribeck::Curve;
use core::fmt;

/// What the observer is built from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings<T> {
    /// J, kg m^2.
    pub inertia_kg_m2: T,
    /// Angle of one count, rad.
    pub rad_per_count: T,
    /// T, s.
    pub sample_time_s: T,
    /// l1, 1/s.
    pub l1_1_s: T,
    /// l2; the source finds no use for it, zero leaves z to the friction model.
    pub l2: T,
    /// Torque that acts besides the given one, such as gravity, N m.
    pub offset_nm: T,
    /// Largest speed of the axis; a step or an estimate beyond it is not believed.
    pub max_speed_rad_s: T,
    /// Largest torque of the axis; a torque beyond it is not believed.
    pub max_torque_nm: T,
}

impl<T: Real> Settings<T> {
    /// The same settings in another precision.
    pub fn cast<U: Real>(&self) -> Settings<U> {
        let to = |x: T| U::of(x.to_f64());
        Settings {
            inertia_kg_m2: to(self.inertia_kg_m2),
            rad_per_count: to(self.rad_per_count),
            sample_time_s: to(self.sample_time_s),
            l1_1_s: to(self.l1_1_s),
            l2: to(self.l2),
            offset_nm: to(self.offset_nm),
            max_speed_rad_s: to(self.max_speed_rad_s),
            max_torque_nm: to(self.max_torque_nm),
        }
    }
}

/// The observer over an elasto-plastic model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Luenberger<T, C> {
    friction: ElastoPlastic<T, C>,
    settings: Settings<T>,
    largest_step_rad: T,
    /// 1 - T (sigma2/J + l1): what stays of the velocity.
    kept: T,
    /// T/J.
    by_torque: T,
    /// T sigma0/J.
    by_deflection: T,
    /// sigma1/J.
    by_deflection_step: T,
}

/// Estimates, and how many samples were rejected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    /// v and z.
    pub estimate: Estimate<T>,
    /// Samples whose input or result was not believed; the estimate was kept.
    pub rejected: u32,
}

/// Why an observer was not built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BuildError {
    /// A parameter means nothing.
    Parameter(ParameterError),
    /// The error would not die out.
    Gain(GainError),
}

impl From<ParameterError> for BuildError {
    fn from(error: ParameterError) -> Self {
        Self::Parameter(error)
    }
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter(error) => error.fmt(f),
            Self::Gain(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for BuildError {}

impl<T: Real, C: Curve<T>> Luenberger<T, C> {
    /// Builds the observer if its error dies out in stick and in slip at every speed up to the largest.
    ///
    /// # Errors
    /// A setting that means nothing, or gains under which the discrete-time error does not die out: the error names
    /// the regime and the nearest l1 that passes.
    pub fn new(friction: ElastoPlastic<T, C>, settings: Settings<T>) -> Result<Self, BuildError> {
        positive("inertia_kg_m2", settings.inertia_kg_m2)?;
        positive("rad_per_count", settings.rad_per_count)?;
        positive("sample_time_s", settings.sample_time_s)?;
        positive("max_speed_rad_s", settings.max_speed_rad_s)?;
        positive("max_torque_nm", settings.max_torque_nm)?;
        for (name, value) in [
            ("l1_1_s", settings.l1_1_s),
            ("l2", settings.l2),
            ("offset_nm", settings.offset_nm),
        ] {
            require(name, value, true, "finite")?;
        }
        let (regime, growth) = largest_growth(&friction, &settings, settings.l1_1_s.to_f64());
        if growth < LARGEST_GROWTH {
            let by_torque = settings.sample_time_s / settings.inertia_kg_m2;
            return Ok(Self {
                settings,
                largest_step_rad: settings.max_speed_rad_s * settings.sample_time_s,
                kept: T::ONE
                    - by_torque * friction.viscous_nm_s_rad()
                    - settings.sample_time_s * settings.l1_1_s,
                by_torque,
                by_deflection: by_torque * friction.stiffness_nm_rad(),
                by_deflection_step: friction.damping_nm_s_rad() / settings.inertia_kg_m2,
                friction,
            });
        }
        let scale = 1.0 / settings.sample_time_s.to_f64();
        Err(BuildError::Gain(GainError {
            gain: "l1_1_s",
            value: settings.l1_1_s.to_f64(),
            regime,
            growth,
            nearest: nearest_passing(settings.l1_1_s.to_f64(), scale, |l1| {
                // As the gain will be held. Most candidates fail in one of the first regimes.
                growths(&friction, &settings, T::of(l1).to_f64())
                    .all(|(_, growth)| growth < LARGEST_GROWTH)
            }),
        }))
    }

    /// The friction model inside.
    pub fn friction(&self) -> &ElastoPlastic<T, C> {
        &self.friction
    }

    /// What it was built from.
    pub fn settings(&self) -> &Settings<T> {
        &self.settings
    }

    /// Takes the step in counts since the last sample and the mean torque on the rotor during it, and gives the
    /// estimate at this sample.
    #[inline]
    pub fn step(&self, state: &mut State<T>, step_counts: i32, torque_nm: T) -> Estimate<T> {
        let measured = T::of_count(step_counts) * self.settings.rad_per_count;
        // Written so that a NaN fails it.
        let possible = measured.abs() <= self.largest_step_rad
            && torque_nm.abs() <= self.settings.max_torque_nm;
        if !possible {
            cold_path();
            state.rejected = state.rejected.saturating_add(1);
        } else {
            let z_ss_rad = self.z_ss_rad(state);
            self.step_at(state, step_counts, torque_nm, z_ss_rad);
        }
        state.estimate
    }

    /// Deflection in steady sliding at the estimated velocity, rad.
    #[inline]
    pub(crate) fn z_ss_rad(&self, state: &State<T>) -> T {
        self.friction.z_ss_rad(state.estimate.velocity_rad_s.abs())
    }

    /// As [`Self::step`] for a step and a torque that can be, given [`Self::z_ss_rad`] of the state. Gives the step, rad.
    #[inline(always)]
    pub(crate) fn step_at(
        &self,
        state: &mut State<T>,
        step_counts: i32,
        torque_nm: T,
        z_ss_rad: T,
    ) -> T {
        let s = &self.settings;
        let Estimate {
            velocity_rad_s: v,
            z_rad: z,
        } = state.estimate;
        let measured = T::of_count(step_counts) * s.rad_per_count;
        let expected = s.sample_time_s * v;
        let next = self.friction.advance(z, expected, z_ss_rad);
        let velocity_rad_s =
            self.kept * v + s.l1_1_s * measured + self.by_torque * (torque_nm + s.offset_nm)
                - self.by_deflection * next
                - self.by_deflection_step * (next - z);
        let mut z_rad = next;
        if s.l2 != T::ZERO {
            cold_path();
            z_rad = (next + s.l2 * (measured - expected)).within(self.friction.z_max_rad());
        }
        // Written so that a NaN fails it, of the torque too.
        if velocity_rad_s.abs() <= s.max_speed_rad_s {
            state.estimate = Estimate {
                velocity_rad_s,
                z_rad,
            };
        } else {
            cold_path();
            state.rejected = state.rejected.saturating_add(1);
        }
        measured
    }

    /// Longest step that an axis can make in a sample, rad.
    pub(crate) fn largest_step_rad(&self) -> T {
        self.largest_step_rad
    }
}

/// The regime in which the error grows most, and its growth per sample.
fn largest_growth<T: Real, C: Curve<T>>(
    friction: &ElastoPlastic<T, C>,
    settings: &Settings<T>,
    l1: f64,
) -> (Regime, f64) {
    growths(friction, settings, l1).fold((Regime::Stick, 0.0), |worst, one| {
        // Written so that a NaN counts as the worst.
        if one.1 > worst.1 || one.1.is_nan() {
            one
        } else {
            worst
        }
    })
}

/// Growth of the error per sample in stick, and in slip at speeds from the largest down to a millionth of it, in even
/// steps of the logarithm.
///
/// The Jacobian of one sample with respect to (v, z), from the derivatives of the deflection step: in stick
/// dz'/dz = 1 and dz'/dv = T; in slip at z = z_ss, with h = T v/z_ss, dz'/dz = 1/(1 + h) and
/// dz'/dv = T v g'(v)/(g(v) (1 + h)), the derivative of z_ss with velocity kept.
fn growths<T: Real, C: Curve<T>>(
    friction: &ElastoPlastic<T, C>,
    settings: &Settings<T>,
    l1: f64,
) -> impl Iterator<Item = (Regime, f64)> {
    const SPEEDS: usize = 60;
    let t = settings.sample_time_s.to_f64();
    let l2 = settings.l2.to_f64();
    let per_inertia = t / settings.inertia_kg_m2.to_f64();
    let sigma0 = friction.stiffness_nm_rad().to_f64();
    let sigma1_per_t = friction.damping_nm_s_rad().to_f64() / t;
    let sigma2 = friction.viscous_nm_s_rad().to_f64();
    let growth = move |z_by_v: f64, z_by_z: f64| {
        spectral_radius_of_two([
            [
                1.0 - per_inertia * ((sigma0 + sigma1_per_t) * z_by_v + sigma2) - l1 * t,
                -per_inertia * (sigma0 * z_by_z + sigma1_per_t * (z_by_z - 1.0)),
            ],
            [z_by_v - l2 * t, z_by_z],
        ])
    };
    let speeds = core::iter::successors(Some(settings.max_speed_rad_s.to_f64()), |v| Some(0.8 * v));
    let slip = speeds.take(SPEEDS).map(move |speed| {
        let level = friction.curve().level_nm(T::of(speed)).to_f64();
        let slope = friction.curve().slope_nm_s_rad(T::of(speed)).to_f64();
        let decay = 1.0 / (1.0 + t * speed * sigma0 / level);
        let growth = growth(t * speed * slope / level * decay, decay);
        (Regime::Slip { speed_rad_s: speed }, growth)
    });
    core::iter::once((Regime::Stick, growth(t, 1.0))).chain(slip)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::{Friction, Motion, elasto_plastic};
    use crate::stribeck::{Shape, Stribeck};
    use std::string::ToString;

    const T: f64 = 1e-4;
    const COUNT: f64 = core::f64::consts::TAU / 16384.0;

    fn friction(coulomb_nm: f64, stiction_nm: f64) -> ElastoPlastic<f64, Stribeck<f64>> {
        let shape = Shape::Gaussian {
            velocity_rad_s: 0.3,
        };
        let curve = Stribeck::new(coulomb_nm, stiction_nm, shape).unwrap();
        ElastoPlastic::new(curve, 10.53, 0.076, 0.0029, 0.7).unwrap()
    }

    fn settings(l1_1_s: f64) -> Settings<f64> {
        Settings {
            inertia_kg_m2: 2.5246e-5,
            rad_per_count: COUNT,
            sample_time_s: T,
            l1_1_s,
            l2: 0.0,
            offset_nm: 0.0,
            max_speed_rad_s: 314.0,
            max_torque_nm: 1.0,
        }
    }

    /// Error left of a wrong start after `samples` of the sine experiment, against the model stepped the same way.
    fn error_after(samples: i32, l1: f64, coulomb: f64, stiction: f64) -> (f64, f64) {
        let friction = friction(coulomb, stiction);
        // A fine encoder, so that what is left is the observer's error and not the encoder's.
        let fine = Settings {
            rad_per_count: 1e-9,
            ..settings(l1)
        };
        let observer = Luenberger::new(friction, fine).unwrap();
        let mut state = State::default();
        state.estimate.velocity_rad_s = 2.0;
        let (mut v, mut z, mut q) = (0.0_f64, elasto_plastic::State::default(), 0.0_f64);
        let mut counts = 0_i64;
        for k in 0..samples {
            let u = 0.035 * (core::f64::consts::TAU * f64::from(k) * T).sin();
            let motion = Motion {
                velocity_rad_s: v,
                applied_nm: u,
                dt_s: T,
            };
            q += T * v;
            v += T / fine.inertia_kg_m2 * (u - friction.step(&mut z, motion));
            let now = (q / 1e-9).round() as i64;
            observer.step(&mut state, (now - counts) as i32, u);
            counts = now;
        }
        assert_eq!(state.rejected, 0);
        (
            (state.estimate.velocity_rad_s - v).abs(),
            (state.estimate.z_rad - z.z_rad).abs(),
        )
    }

    #[test]
    fn forgets_a_wrong_start() {
        let (v, z) = error_after(5000, 1700.0, 0.020, 0.026);
        // Rounding of a 1e-9 rad encoder: l1 * 1e-9 rad, and z over the same time constant.
        assert!(v < 1700.0 * 1e-9 * 2.0, "{v:e}");
        assert!(z < 2e-8, "{z:e}");
    }

    #[test]
    fn thesis_gains_are_finite_or_refused() {
        // Without the Stribeck fall both gains of the source hold, over five seconds of its sine.
        for l1 in [500.0, 1700.0] {
            let (v, z) = error_after(50_000, l1, 4.61e-4, 4.61e-4);
            assert!(v < 1e-3 && z < 1e-6, "l1 = {l1}: {v:e} {z:e}");
        }
        // With it, 500 cannot hold the fall of the curve: l1 > max(-g') / J - sigma2 / J is needed, up to T.
        let error = Luenberger::new(friction(0.020, 0.026), settings(500.0)).unwrap_err();
        let BuildError::Gain(gain) = error else {
            panic!("{error}")
        };
        let steepest = 0.006 / 0.3 * (2.0_f64 / core::f64::consts::E).sqrt();
        let edge = (steepest - 0.0029) / 2.5246e-5;
        let nearest = gain.nearest.unwrap();
        assert!(matches!(gain.regime, Regime::Slip { .. }), "{error}");
        // z follows in finite time, which takes off some of what fast bristles would ask for.
        assert!(nearest > 500.0 && nearest < edge, "{nearest} {edge}");
        assert!(Luenberger::new(friction(0.020, 0.026), settings(nearest)).is_ok());
    }

    #[test]
    fn refuses_gains_too_fast_for_the_sample_time() {
        let error = Luenberger::new(friction(0.020, 0.020), settings(30_000.0)).unwrap_err();
        assert!(error.to_string().contains("in stick"), "{error}");
        let BuildError::Gain(gain) = error else {
            panic!("{error}")
        };
        // -1 < 1 - T ((sigma1 + sigma2)/J + l1), and half of T^2 sigma0/J less: 2/T - 3125 - 21.
        assert!((gain.nearest.unwrap() - 16_854.0).abs() < 1.0, "{error}");
        let negative = Luenberger::new(friction(0.020, 0.020), settings(-4000.0)).unwrap_err();
        let BuildError::Gain(gain) = negative else {
            panic!("{negative}")
        };
        assert!(Luenberger::new(friction(0.020, 0.020), settings(gain.nearest.unwrap())).is_ok());
    }

    #[test]
    fn keeps_its_estimate_through_bad_input() {
        let observer = Luenberger::new(friction(0.020, 0.026), settings(1700.0)).unwrap();
        let mut state = State::default();
        for _ in 0..100 {
            observer.step(&mut state, 1, 0.03);
        }
        let before = state.estimate;
        for (counts, torque) in [
            (1, f64::NAN),
            (1, f64::INFINITY),
            (1, -1e30),
            (i32::MAX, 0.0),
            (i32::MIN, 0.0),
        ] {
            assert_eq!(observer.step(&mut state, counts, torque), before);
        }
        assert_eq!(state.rejected, 5);
    }
}
