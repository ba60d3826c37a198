//! Friction compensation in a position or speed loop: the friction that the reference's motion will meet, and the one that
//! the observers see, as torque.
//!
//! u = forward F(z_r, v_r) + feedback F(z, v), F(z, v) = sigma0 z + sigma2 v. z_r is the elasto-plastic deflection along the
//! reference; z comes from the time-free observer, v from the Luenberger-like one, and both pass a first-order filter, as
//! one count changes sigma0 z by a step.
//!
//! The first term closes no loop, so that it cannot make one unstable. The second one is positive feedback: it takes
//! `feedback` times the believed friction off the axis. What is left still brakes as long as the true friction is more than
//! that, hence [`MOST_FEEDBACK`]. Its delay does no harm: a spring that is taken off late adds damping. Both together
//! give no more than the whole of the believed friction.
//!
//! Sources: Canudas de Wit, Olsson, Astrom, Lischinsky, "A new model for control of systems with friction", IEEE TAC 40(3),
//! 1995, section V (compensation from an observed deflection); Armstrong-Helouvry, Dupont, Canudas de Wit, "A survey of
//! models, analysis tools and compensation methods for the control of machines with friction", Automatica 30(7), 1994,
//! section 5 (over-compensation and its limit cycle).

use crate::error::{ParameterError, not_negative, positive, require};
use crate::friction::ElastoPlastic;
use crate::observer::Estimate;
use crate::real::Real;
use crate::stribeck::Curve;

/// Largest share of the observed friction: an axis whose true friction is 40 % below the believed one is still braked.
pub const MOST_FEEDBACK: f64 = 0.6;

/// Shares and filter; none of it changes in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensation<T> {
    forward: T,
    feedback: T,
    /// Part of what is new that the filter takes in a tick.
    follow: T,
    sample_time_s: T,
}

/// Deflection along the reference, filtered friction, and the torque that stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State<T> {
    z_rad: T,
    friction_nm: T,
    added_nm: T,
}

impl<T: Real> Compensation<T> {
    /// Share of the friction along the reference, share of the observed friction, and the time constant of the observed
    /// one's filter, s; two zeros for none.
    ///
    /// # Errors
    /// A negative share or time, `feedback` above [`MOST_FEEDBACK`], or both shares together above one.
    pub fn new(
        forward: T,
        feedback: T,
        filter_s: T,
        sample_time_s: T,
    ) -> Result<Self, ParameterError> {
        not_negative("friction_feedback", feedback)?;
        not_negative("friction_forward", forward)?;
        require(
            "friction_feedback",
            feedback,
            feedback <= T::of(MOST_FEEDBACK),
            "at most 0.6",
        )?;
        require(
            "friction_forward",
            forward,
            // 0.4 and 0.6 are one, rounded.
            forward + feedback <= T::ONE + T::EPSILON,
            "at most one less friction_feedback",
        )?;
        positive("sample_time_s", sample_time_s)?;
        not_negative("friction_filter_s", filter_s)?;
        Ok(Self {
            forward,
            feedback,
            follow: sample_time_s / (sample_time_s + filter_s),
            sample_time_s,
        })
    }

    /// Nothing is compensated.
    #[inline(always)]
    pub(crate) fn is_off(&self) -> bool {
        self.forward + self.feedback <= T::ZERO
    }

    /// By how much the torque changes with the velocity of the next reference and what the observers have seen, N m.
    #[inline(always)]
    pub(crate) fn step<C: Curve<T>>(
        &self,
        state: &mut State<T>,
        friction: &ElastoPlastic<T, C>,
        reference_rad_s: T,
        seen: Estimate<T>,
    ) -> T {
        let friction_nm =
            |z: T, v: T| friction.stiffness_nm_rad() * z + friction.viscous_nm_s_rad() * v;
        let z_ss = friction.z_ss_rad(reference_rad_s.abs());
        let step_rad = self.sample_time_s * reference_rad_s;
        state.z_rad = friction.advance(state.z_rad, step_rad, z_ss);
        let seen_nm = friction_nm(seen.z_rad, seen.velocity_rad_s);
        state.friction_nm += self.follow * (seen_nm - state.friction_nm);
        let torque_nm = self.forward * friction_nm(state.z_rad, reference_rad_s)
            + self.feedback * state.friction_nm;
        let change_nm = torque_nm - state.added_nm;
        state.added_nm = torque_nm;
        change_nm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::{Controller, Input};
    use crate::experiment::{Bounds, Experiment, Player, Reference};
    use crate::friction::{Friction, Motion, elasto_plastic};
    use crate::order::Order;
    use crate::parameters::{BENCH, Parameters};
    use crate::stribeck::{Shape, Stribeck};
    use crate::supervisor::Request;

    const TICK_S: f32 = 1e-4;
    const PERIOD_TICKS: u32 = 20_000;
    const REVERSALS: Experiment<f32> = Experiment::Reversals {
        amplitude_rad: 1.0,
        period_ticks: PERIOD_TICKS,
    };

    /// Rms tracking error in rad from a quarter of a period on, and how often the encoder changes its direction by three
    /// counts and more, while the axis of the bench follows one and a half periods.
    fn follow(parameters: &Parameters) -> (f64, u32) {
        const SUBSTEPS: u32 = 20;
        let config = parameters.build(TICK_S, 1).unwrap();
        let b = |value: f32| f64::from(value);
        let shape = Shape::Gaussian {
            velocity_rad_s: b(BENCH.stribeck_velocity_rad_s),
        };
        let curve = Stribeck::new(b(BENCH.coulomb_nm), b(BENCH.stiction_nm), shape).unwrap();
        let friction = ElastoPlastic::new(
            curve,
            b(BENCH.stiffness_nm_rad),
            b(BENCH.damping_nm_s_rad),
            b(BENCH.viscous_nm_s_rad),
            b(BENCH.breakaway_ratio),
        )
        .unwrap();
        let rad_per_count = b(BENCH.rad_per_count());
        let mut controller = Controller::new(&config, 0, false);
        let input = |raw: i64| Input {
            raw: raw as u32,
            ..Input::default()
        };
        for _ in 0..200 {
            controller.step(&config, &input(0));
        }
        controller.obey(&config, &Order::Request(Request::Arm));
        controller.step(&config, &input(0));
        controller.obey(&config, &config.play(REVERSALS, &Bounds::open(u32::MAX)));
        let mut player = Player::new(REVERSALS, TICK_S);
        let (mut q, mut v, mut z) = (0.5 * rad_per_count, 0.0, elasto_plastic::State::default());
        // What was put out at the tick before acts in this one.
        let mut torque_nm = 0.0;
        let (mut squares, mut ticks) = (0.0, 0);
        let (mut turn, mut forward, mut turns) = (0, true, 0);
        for k in 0..PERIOD_TICKS / 2 * 3 {
            let counts = (q / rad_per_count).floor() as i64;
            let Reference::Position { position_rad, .. } = player.next_tick() else {
                panic!("a position sine")
            };
            if k >= PERIOD_TICKS / 4 {
                squares += (q - f64::from(position_rad)).powi(2);
                ticks += 1;
            }
            if forward {
                turn = turn.max(counts);
            } else {
                turn = turn.min(counts);
            }
            if (counts - turn).abs() >= 3 {
                (turn, forward) = (counts, !forward);
                turns += 1;
            }
            if k % 1000 == 0 {
                controller.obey(&config, &Order::Request(Request::KeepAlive));
            }
            let acts_nm = torque_nm;
            torque_nm = f64::from(controller.step(&config, &input(counts)).torque_nm);
            let dt_s = f64::from(TICK_S) / f64::from(SUBSTEPS);
            for _ in 0..SUBSTEPS {
                let motion = Motion {
                    velocity_rad_s: v,
                    applied_nm: acts_nm,
                    dt_s,
                };
                v += dt_s / b(BENCH.inertia_kg_m2) * (acts_nm - friction.step(&mut z, motion));
                q += dt_s * v;
            }
        }
        ((squares / f64::from(ticks)).sqrt(), turns)
    }

    fn compensated() -> Parameters {
        Parameters {
            friction_forward: 0.5,
            friction_feedback: 0.5,
            ..BENCH
        }
    }

    /// With all friction believed to be `share` times what it is.
    fn believing(share: f32, parameters: Parameters) -> Parameters {
        Parameters {
            coulomb_nm: share * BENCH.coulomb_nm,
            stiction_nm: share * BENCH.stiction_nm,
            stribeck_velocity_rad_s: share * BENCH.stribeck_velocity_rad_s,
            stiffness_nm_rad: share * BENCH.stiffness_nm_rad,
            damping_nm_s_rad: share * BENCH.damping_nm_s_rad,
            viscous_nm_s_rad: share * BENCH.viscous_nm_s_rad,
            ..parameters
        }
    }

    #[test]
    fn takes_two_thirds_of_the_error_and_swings_with_no_wrong_parameter() {
        for share in [1.0, 0.7, 1.3] {
            let (without, turns) = follow(&believing(share, BENCH));
            // A period and a half of a sine.
            assert_eq!(turns, 3, "{share} without");
            let (with, turns) = follow(&believing(share, compensated()));
            std::println!("{share} of the friction believed: {with} of {without} rad rms");
            assert_eq!(turns, 3, "{share} with");
            // Believed wrongly, it must still gain.
            let most = if share == 1.0 { 1.0 / 3.0 } else { 1.0 };
            assert!(with < most * without, "{share}: {with} {without}");
        }
    }

    #[test]
    fn a_torque_in_open_loop_stays_what_it_is() {
        let sine = Experiment::Sine {
            amplitude_nm: 0.01,
            period_ticks: 1000,
        };
        let outputs = |parameters: &Parameters| {
            let config = parameters.build(TICK_S, 1).unwrap();
            let mut controller = Controller::new(&config, 0, false);
            (0..3000_u32).map(move |k| {
                let order = match k {
                    200 => Some(Order::Request(Request::Arm)),
                    201 => Some(config.play(sine, &Bounds::open(u32::MAX))),
                    _ => None,
                };
                if let Some(order) = order {
                    controller.obey(&config, &order);
                }
                let input = Input {
                    raw: k / 10,
                    ..Input::default()
                };
                controller.step(&config, &input)
            })
        };
        assert!(outputs(&BENCH).eq(outputs(&compensated())));
    }

    #[test]
    fn refuses_shares_that_could_drive_the_axis() {
        let build = |forward, feedback, filter_s| {
            Compensation::new(forward, feedback, filter_s, 1e-4_f32).is_ok()
        };
        for (forward, feedback) in [(0.0, 0.0), (0.4, 0.6), (1.0, 0.0), (0.7, 0.3), (0.9, 0.1)] {
            assert!(build(forward, feedback, 1e-3), "{forward} {feedback}");
        }
        for (forward, feedback) in [(0.0, 0.61), (0.5, 0.51), (-0.1, 0.0), (f32::NAN, 0.0)] {
            assert!(!build(forward, feedback, 1e-3), "{forward} {feedback}");
        }
        assert!(!build(0.5, 0.5, -1.0));
    }

    #[test]
    fn what_is_no_number_is_not_added() {
        let mut loop_ = crate::control::State::<f32>::default();
        let before = loop_;
        for bad in [f32::NAN, f32::INFINITY] {
            loop_.add(bad);
            assert_eq!(loop_, before);
        }
        loop_.add(0.25);
        assert_ne!(loop_, before);
    }
}
