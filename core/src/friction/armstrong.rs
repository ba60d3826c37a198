//! Armstrong's model of seven parameters: a spring in stick, a delayed Stribeck curve in slip,
//! static friction that rises with dwell; torque N m, velocity rad/s, times s.
//!
//! Stick: F = sigma0 x. Slip: F = (F_C + F_s(gamma, t_d)/(1 + (v(t - tau_l)/v_s)^2)) sgn v + F_v v,
//! with F_s(gamma, t_d) = F_s,a + (F_s,inf - F_s,a) t_d/(t_d + gamma).
//!
//! Source: Aktas, ITU 2002, eqs. 2.7 and 2.8; Armstrong-Helouvry, Dupont and Canudas de Wit 1994,
//! Automatica 30, 1083-1138. The bracket of 2.8 closes too late in print and leaves F_s,a in twice;
//! the form above rises from F_s,a at once after a slip to F_s,inf after a long dwell. F_s is the
//! part above F_C, not the whole level at rest.
//!
//! # What the source leaves open, and what is done here
//! - Break-away is at |sigma0 x| > F_C + F_s(gamma, t_d). That level is the torque of the step in
//!   which it happens, and F_s keeps its value through the slip.
//! - A slip ends when the velocity is no longer in its direction. The spring then starts at the
//!   level the slip ended at, so friction is continuous over a reversal, and F_s,a is the Stribeck
//!   part of that level.
//! - An axis that has never slipped has dwelt for ever: it starts with F_s,inf.
//! - The lag is a true delay. It is kept as N samples tau_l/(N - 1) apart, whatever the step, read
//!   between samples; so a velocity that changes faster than that spacing is sampled, not averaged.
//!
//! # Energy
//! The literature proves nothing for this model. With the choices above it does hold: count sigma0
//! x^2/2 as stored in stick and B^2/(2 sigma0) in slip, B being the level of the last break-away.
//! Friction in slip opposes velocity, the spring restarts at no more than B, and the break-away
//! step does its work at the full B.

use super::{Friction, Motion, stiffness};
use crate::Real;
use crate::error::{ParameterError, not_negative, positive};

/// Armstrong's model; `N` samples carry the delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Armstrong<T, const N: usize> {
    stiffness_nm_rad: T,
    coulomb_nm: T,
    viscous_nm_s_rad: T,
    rest_rise_nm: T,
    stribeck_rad_s: T,
    lag_s: T,
    dwell_s: T,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Contact<T> {
    Stick {
        /// sigma0 x. The torque and not x, so that a restart is continuous to the last bit.
        spring_nm: T,
        dwell_s: T,
        /// F_s,a; none before the first slip.
        start_nm: Option<T>,
    },
    Slip {
        direction: T,
        /// F_s at the break-away.
        rise_nm: T,
        /// Its part left at the delayed velocity.
        stribeck_nm: T,
    },
}

/// Stick or slip, and the velocities on their way through the delay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmstrongState<T, const N: usize> {
    contact: Contact<T>,
    velocities_rad_s: [T; N],
    oldest: usize,
    /// Time since the newest sample, in spacings.
    phase: T,
}

impl<T: Real, const N: usize> Default for ArmstrongState<T, N> {
    fn default() -> Self {
        Self {
            contact: Contact::Stick {
                spring_nm: T::ZERO,
                dwell_s: T::ZERO,
                start_nm: None,
            },
            velocities_rad_s: [T::ZERO; N],
            oldest: 0,
            phase: T::ZERO,
        }
    }
}

impl<T: Real, const N: usize> ArmstrongState<T, N> {
    /// Whether the contact slips.
    pub fn slips(&self) -> bool {
        matches!(self.contact, Contact::Slip { .. })
    }

    /// Takes in the velocity of a step and gives the one `lag_s` before its end.
    fn delayed(&mut self, velocity_rad_s: T, dt_s: T, lag_s: T) -> T {
        if lag_s <= T::ZERO {
            return velocity_rad_s;
        }
        let after = |i: usize| if i + 1 < N { i + 1 } else { 0 };
        let full = T::of_count(N as i32);
        let passed = (self.phase + dt_s / lag_s * (full - T::ONE)).least(full);
        let whole = passed.to_index().min(N);
        for _ in 0..whole {
            if let Some(sample) = self.velocities_rad_s.get_mut(self.oldest) {
                *sample = velocity_rad_s;
            }
            self.oldest = after(self.oldest);
        }
        self.phase = passed - T::of_count(whole as i32);
        let at = |i: usize| self.velocities_rad_s.get(i).copied().unwrap_or_default();
        // Weights, not a difference: that of two absurd velocities could overflow.
        at(self.oldest) * (T::ONE - self.phase) + at(after(self.oldest)) * self.phase
    }
}

impl<T: Real, const N: usize> Armstrong<T, N> {
    /// The seven parameters: sigma0, F_C, F_v, F_s,inf (above F_C), v_s, tau_l and gamma.
    ///
    /// # Errors
    /// Stiffness, Coulomb friction or v_s not above zero, stiffness out of proportion, another one
    /// below zero.
    pub fn new(
        stiffness_nm_rad: T,
        coulomb_nm: T,
        viscous_nm_s_rad: T,
        rest_rise_nm: T,
        stribeck_rad_s: T,
        lag_s: T,
        dwell_s: T,
    ) -> Result<Self, ParameterError> {
        const { assert!(N >= 2 && N <= 1024, "a delay of 2 to 1024 samples") };
        positive("coulomb_nm", coulomb_nm)?;
        not_negative("rest_rise_nm", rest_rise_nm)?;
        Ok(Self {
            stiffness_nm_rad: stiffness(stiffness_nm_rad, coulomb_nm, coulomb_nm + rest_rise_nm)?,
            coulomb_nm,
            viscous_nm_s_rad: not_negative("viscous_nm_s_rad", viscous_nm_s_rad)?,
            rest_rise_nm,
            stribeck_rad_s: positive("stribeck_velocity_rad_s", stribeck_rad_s)?,
            lag_s: not_negative("lag_s", lag_s)?,
            dwell_s: not_negative("dwell_s", dwell_s)?,
        })
    }

    /// F_s after a dwell.
    fn rise_nm(&self, start_nm: Option<T>, dwell_s: T) -> T {
        match start_nm {
            None => self.rest_rise_nm,
            Some(start) if dwell_s <= T::ZERO => start,
            Some(start) => {
                // As one over a ratio: a dwell or a constant too large or small for f32 still gives
                // 0 to 1.
                let part = T::ONE / (T::ONE + self.dwell_s / dwell_s);
                (start + (self.rest_rise_nm - start) * part).least(self.rest_rise_nm)
            }
        }
    }

    fn stribeck_nm(&self, rise_nm: T, velocity_rad_s: T) -> T {
        let x = velocity_rad_s / self.stribeck_rad_s;
        rise_nm / (T::ONE + x * x)
    }

    /// Energy that the contact may still give back, J.
    pub fn stored_j(&self, state: &ArmstrongState<T, N>) -> T {
        let torque = match state.contact {
            Contact::Stick { spring_nm, .. } => spring_nm,
            Contact::Slip { rise_nm, .. } => self.coulomb_nm + rise_nm,
        };
        torque * torque / (self.stiffness_nm_rad + self.stiffness_nm_rad)
    }
}

impl<T: Real, const N: usize> Friction<T> for Armstrong<T, N> {
    type State = ArmstrongState<T, N>;
    const HOLDS_AT_REST: bool = false;

    fn step(&self, state: &mut ArmstrongState<T, N>, motion: Motion<T>) -> T {
        if !motion.is_usable() {
            return match state.contact {
                Contact::Stick { spring_nm, .. } => spring_nm,
                Contact::Slip {
                    direction,
                    stribeck_nm,
                    ..
                } => (self.coulomb_nm + stribeck_nm) * direction,
            };
        }
        let v = motion.velocity_rad_s;
        let delayed = state.delayed(v, motion.dt_s, self.lag_s);
        let (spring_nm, dwell_s, start_nm) = match state.contact {
            Contact::Slip {
                direction, rise_nm, ..
            } if v.sgn() == direction => {
                let stribeck_nm = self.stribeck_nm(rise_nm, delayed);
                state.contact = Contact::Slip {
                    direction,
                    rise_nm,
                    stribeck_nm,
                };
                return (self.coulomb_nm + stribeck_nm) * direction + self.viscous_nm_s_rad * v;
            }
            Contact::Slip {
                direction,
                stribeck_nm,
                ..
            } => (
                (self.coulomb_nm + stribeck_nm) * direction,
                T::ZERO,
                Some(stribeck_nm),
            ),
            Contact::Stick {
                spring_nm,
                dwell_s,
                start_nm,
            } => (spring_nm, dwell_s, start_nm),
        };
        // A dwell far beyond gamma changes nothing any more, and must not grow without end.
        let dwell_s = (dwell_s + motion.dt_s).least(T::of(1e12));
        let rise_nm = self.rise_nm(start_nm, dwell_s);
        let limit_nm = self.coulomb_nm + rise_nm;
        let reach = limit_nm / self.stiffness_nm_rad;
        let stretched_nm = spring_nm + self.stiffness_nm_rad * motion.displacement_rad(reach);
        if stretched_nm.abs() <= limit_nm {
            state.contact = Contact::Stick {
                spring_nm: stretched_nm,
                dwell_s,
                start_nm,
            };
            return stretched_nm;
        }
        let direction = stretched_nm.sgn();
        state.contact = Contact::Slip {
            direction,
            rise_nm,
            stribeck_nm: rise_nm,
        };
        limit_nm * direction + self.viscous_nm_s_rad * v
    }

    /// After a break-away from a long dwell; a slip that began after a short one is lower in its
    /// Stribeck part.
    fn steady_state_nm(&self, velocity_rad_s: T) -> T {
        (self.coulomb_nm + self.stribeck_nm(self.rest_rise_nm, velocity_rad_s))
            * velocity_rad_s.sgn()
            + self.viscous_nm_s_rad * velocity_rad_s
    }

    /// Stretch of the spring; in slip that of the level it would restart from.
    fn deflection_rad(&self, state: &ArmstrongState<T, N>) -> T {
        let torque = match state.contact {
            Contact::Stick { spring_nm, .. } => spring_nm,
            Contact::Slip {
                direction,
                stribeck_nm,
                ..
            } => (self.coulomb_nm + stribeck_nm) * direction,
        };
        torque / self.stiffness_nm_rad
    }

    fn rescale(&self, state: &mut ArmstrongState<T, N>, times: T) {
        if let Contact::Stick { spring_nm, .. } = &mut state.contact {
            *spring_nm = *spring_nm * times;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Model = Armstrong<f64, 16>;

    fn model(lag_s: f64, dwell_s: f64) -> Model {
        Model::new(10.0, 0.020, 0.003, 0.006, 0.3, lag_s, dwell_s).unwrap()
    }

    fn at(velocity_rad_s: f64, dt_s: f64) -> Motion<f64> {
        Motion {
            velocity_rad_s,
            applied_nm: 0.0,
            dt_s,
        }
    }

    /// Peak of the torque while the axis is pushed through break-away so slowly that the Stribeck
    /// part is whole.
    fn break_away(f: &Model, s: &mut ArmstrongState<f64, 16>) -> f64 {
        (0..60_000)
            .map(|_| f.step(s, at(1e-3, 1e-4)))
            .fold(0.0, f64::max)
    }

    #[test]
    fn sticks_as_a_spring_and_breaks_away_at_the_static_level() {
        let f = model(0.0, 1.0);
        let mut s = ArmstrongState::default();
        assert!((f.step(&mut s, at(1.0, 1e-3)) - 0.01).abs() < 1e-17);
        assert!(!s.slips());
        // The peak is B and the viscous part of 1e-3 rad/s.
        assert!((break_away(&f, &mut s) - 0.026 - 3e-6).abs() < 1e-9);
        assert!(s.slips());
    }

    #[test]
    fn in_stick_the_spring_is_rescaled_and_in_slip_nothing_is() {
        let f = model(0.0, 1.0);
        let mut s = ArmstrongState::default();
        f.step(&mut s, at(1.0, 1e-3));
        f.rescale(&mut s, 0.5);
        assert!((f.deflection_rad(&s) - 5e-4).abs() < 1e-18);
        break_away(&f, &mut s);
        let before = s;
        f.rescale(&mut s, 0.5);
        assert_eq!(s, before);
    }

    #[test]
    fn static_friction_rises_with_dwell() {
        let f = model(0.0, 1.0);
        let start = 0.006 / (1.0 + 100.0);
        for dwell in [0.0, 0.5, 1.0, 9.0] {
            let expected = start + (0.006 - start) * dwell / (dwell + 1.0);
            assert!((f.rise_nm(Some(start), dwell) - expected).abs() < 1e-17);
            let mut s = ArmstrongState::default();
            f.step(&mut s, at(3.0, 0.1));
            f.step(&mut s, at(3.0, 0.1));
            f.step(&mut s, at(0.0, dwell));
            // Far beyond the spring in no time: the step gives the break-away level.
            let torque = f.step(&mut s, at(1e6, 1e-7)) - 0.003 * 1e6;
            // The push adds 1e-7 s of dwell; 3000 N m of viscous torque rounds by 5e-13.
            assert!((torque - 0.020 - expected).abs() < 1e-8, "{dwell}");
        }
    }

    #[test]
    fn the_stribeck_part_follows_the_velocity_a_lag_later() {
        let (lag, dt) = (0.015, 1e-3);
        let f = model(lag, 1.0);
        let mut s = ArmstrongState::default();
        for _ in 0..100 {
            f.step(&mut s, at(0.1, dt));
        }
        let stribeck = |f: f64, v: f64| f - 0.003 * v - 0.020;
        let slow = 0.006 / (1.0 + (0.1_f64 / 0.3).powi(2));
        let fast = 0.006 / (1.0 + (0.9_f64 / 0.3).powi(2));
        for i in 1..=40 {
            let part = stribeck(f.step(&mut s, at(0.9, dt)), 0.9);
            let time = f64::from(i) * dt;
            // One spacing of the samples and one step on either side of the lag.
            if time < lag - 1e-9 {
                assert!((part - slow).abs() < 1e-12, "{time}");
            } else if time > lag + 2.0 * dt {
                assert!((part - fast).abs() < 1e-12, "{time}");
            }
        }
    }

    #[test]
    fn friction_is_continuous_over_a_stop() {
        let f = model(0.0, 1.0);
        let mut s = ArmstrongState::default();
        let mut last = 0.0;
        for _ in 0..1000 {
            last = f.step(&mut s, at(0.1, 1e-4));
        }
        let stopped = f.step(&mut s, at(0.0, 1e-4));
        // Only the viscous part is gone.
        assert!((last - stopped - 0.003 * 0.1).abs() < 1e-15);
        assert!(!s.slips());
    }

    #[test]
    fn refuses_what_means_nothing_and_keeps_its_state() {
        assert!(Model::new(10.0, 0.02, 0.0, -0.1, 0.3, 0.0, 1.0).is_err());
        assert!(Model::new(10.0, 0.02, 0.0, 0.1, 0.0, 0.0, 1.0).is_err());
        assert!(Model::new(10.0, 0.02, 0.0, 0.1, 0.3, f64::NAN, 1.0).is_err());
        let f = model(0.01, 1.0);
        let mut s = ArmstrongState::default();
        f.step(&mut s, at(0.1, 1e-3));
        let kept = s;
        assert_eq!(f.step(&mut s, at(f64::NAN, 1e-3)), 10.0 * 1e-4);
        assert_eq!(s, kept);
    }
}
