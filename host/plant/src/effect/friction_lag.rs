//! Friction whose level follows velocity late, as the lubricant film does.
//!
//! G(|v(t - T)|) in place of G(|v|), the steady-state level: static friction is multiplied, bristles slide at that
//! level. The sign does not lag: it would do work on the axis at each reversal and no stick would hold. A record that says
//! otherwise has `reversal_share`, the share of T by which the velocity that the whole model sees is late.
//! Where `delayed` is 0 the level follows velocity through a lag of first order of time constant T, which is as late while velocity
//! changes slowly.
//!
//! Source: Hess, Soom, "Friction at a lubricated line contact operating at oscillating sliding velocities", ASME J.
//! Tribology 112(1), 1990; Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, eq. 11.

use super::first_order::FirstOrder;
use super::history::History;
use super::{Effect, Entry, Kind, Parameter};
use crate::contact::Contact;
use crate::levelled::Levelled;
use bristle_core::friction::Motion;

struct Lag {
    lag_s: f64,
    reversal_s: f64,
    delayed: bool,
}

struct Lagging {
    inner: Levelled,
    time_s: f64,
    reversal: Option<History>,
    level: Late,
}

/// Velocity that the level follows: of a time before, or through a lag of first order.
enum Late {
    Delayed(History),
    Filtered(FirstOrder),
}

impl Effect for Lag {
    fn contact(&self, inner: Box<dyn Contact>) -> Box<dyn Contact> {
        if self.lag_s <= 0.0 {
            return inner;
        }
        Box::new(Lagging {
            inner: Levelled::new(inner),
            time_s: 0.0,
            reversal: (self.reversal_s > 0.0).then(|| History::new(self.reversal_s)),
            level: if self.delayed {
                Late::Delayed(History::new(self.lag_s))
            } else {
                Late::Filtered(FirstOrder::new(self.lag_s))
            },
        })
    }
}

impl Lagging {
    /// Friction of a step, by `at`, which is told the level in it, or by `own` where friction has no bristles.
    fn friction_nm(
        &mut self,
        motion: Motion<f64>,
        at: fn(&mut Levelled, Motion<f64>, f64) -> f64,
        own: fn(&mut Levelled, Motion<f64>) -> f64,
    ) -> f64 {
        self.time_s += motion.dt_s;
        let v = motion.velocity_rad_s;
        let seen = match &mut self.reversal {
            Some(history) => history.mean(self.time_s, v),
            None => v,
        };
        let late = match &mut self.level {
            Late::Delayed(history) => history.mean(self.time_s, v),
            Late::Filtered(lag) => lag.mean(motion.dt_s, v),
        };
        let motion = Motion {
            velocity_rad_s: seen,
            ..motion
        };
        let level_nm = self.inner.level_nm(late);
        if !self.holds_at_rest() {
            return at(&mut self.inner, motion, level_nm);
        }
        let now_nm = self.inner.level_nm(seen);
        let friction_nm = own(&mut self.inner, motion);
        if now_nm > 0.0 {
            friction_nm * level_nm / now_nm
        } else {
            friction_nm
        }
    }
}

impl Contact for Lagging {
    fn step(&mut self, motion: Motion<f64>) -> f64 {
        self.friction_nm(motion, Levelled::step, Levelled::step_own)
    }

    fn mean_over(&mut self, motion: Motion<f64>, _: Option<f64>) -> f64 {
        self.friction_nm(motion, Levelled::mean_over, Levelled::mean_own)
    }

    fn deflection_rad(&self) -> f64 {
        self.inner.deflection_rad()
    }

    fn holds_at_rest(&self) -> bool {
        self.inner.own().holds_at_rest()
    }

    fn steady_state_nm(&self, velocity_rad_s: f64) -> f64 {
        self.inner.own().steady_state_nm(velocity_rad_s)
    }

    fn rescale(&mut self, times: f64) {
        self.inner.rescale(times);
    }

    fn fastest_rate_1_s(&self, inertia_kg_m2: f64) -> f64 {
        self.inner.own().fastest_rate_1_s(inertia_kg_m2)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.lag",
    model: "F with the level G(|v(t - T)|) in place of G(|v|), or G(|w|), T dw/dt = v - w",
    parameters: &[
        Parameter::same("lag_s", Kind::Size, |_| [1e-3, 5e-2]),
        Parameter::same("reversal_share", Kind::Shape, |_| [0.01, 1.0]),
        Parameter::same("delayed", Kind::Form, |_| [0.0, 1.0]).or(1.0),
    ],
    build: |values, _| {
        Box::new(Lag {
            lag_s: values[0],
            reversal_s: values[0] * values[1].clamp(0.0, 1.0),
            delayed: values[2] >= 0.5,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;
    use crate::unit::Unit;
    use std::f64::consts::TAU;

    /// Friction over one period of v = 2 + sin at 5 Hz, after one to settle, against velocity of a time before.
    fn worst(lag_s: f64, reversal_share: f64, step_s: f64, against_s: f64) -> f64 {
        let effect = (ENTRY.build)(&[lag_s, reversal_share, 1.0], Unit::Rotary);
        let mut contact = effect.contact(testing::viscous(0.01));
        let v = |t: f64| 2.0 + (TAU * 5.0 * t).sin();
        let mut worst = 0.0_f64;
        for k in 0..(0.4 / step_s) as i32 {
            let t = f64::from(k) * step_s;
            let friction = contact.step(Motion {
                velocity_rad_s: v(t),
                applied_nm: 0.0,
                dt_s: step_s,
            });
            if t > 0.2 {
                worst = worst.max((friction - 0.02 - 0.01 * v(t - against_s)).abs());
            }
        }
        worst
    }

    #[test]
    fn follows_velocity_late_in_steps_of_any_length() {
        for step_s in [1e-5, 1e-4, 2e-3] {
            let error = worst(0.0125, 0.0, step_s, 0.0125);
            // Linear between steps: (w h)^2/8 of 0.01, where the delay falls between two.
            let limit = 0.01 * (TAU * 5.0 * step_s).powi(2) / 8.0 + 1e-6;
            assert!(error < limit, "{step_s}: {error:e}");
            assert!(worst(0.0125, 0.0, step_s, 0.0) > 1e-3);
        }
    }

    #[test]
    fn follows_velocity_through_a_lag_of_first_order_in_steps_of_any_length() {
        // A velocity that falls at once: what is left of the fall is e^(-t/T), in the mean over a step.
        let lag_s = 0.02_f64;
        for step_s in [1e-4, 2e-3, 5e-2] {
            let effect = (ENTRY.build)(&[lag_s, 0.0, 0.0], Unit::Rotary);
            let mut contact = effect.contact(testing::viscous(0.01));
            let mut step = |velocity_rad_s| {
                contact.step(Motion {
                    velocity_rad_s,
                    applied_nm: 0.0,
                    dt_s: step_s,
                })
            };
            step(10.0);
            for k in 0..20 {
                let friction_nm = step(1.0);
                let [from, to] = [k, k + 1].map(|k| (-f64::from(k) * step_s / lag_s).exp());
                let left = (from - to) * lag_s / step_s;
                let expected = 0.02 + 0.01 * (1.0 + 9.0 * left);
                assert!((friction_nm - expected).abs() < 1e-12, "{step_s} {k}");
            }
        }
    }

    #[test]
    fn bristles_are_as_stiff_and_slide_at_a_late_level() {
        // 0.02 N m and 1e-3 viscous, a z_ss of 2 mrad.
        let effect = (ENTRY.build)(&[0.2, 0.0, 1.0], Unit::Rotary);
        let mut contact = effect.contact(testing::bristles());
        let mut step = |velocity_rad_s, samples| {
            (0..samples)
                .map(|_| {
                    contact.step(Motion {
                        velocity_rad_s,
                        applied_nm: 0.0,
                        dt_s: 1e-4,
                    })
                })
                .last()
                .unwrap()
        };
        step(10.0, 5000);
        // 0.1 s after a fall to a tenth the level is that of 10 rad/s, and 0.3 s after it that of 1.
        assert!((step(1.0, 1000) - 0.03).abs() < 1e-9);
        assert!((step(1.0, 2000) - 0.021).abs() < 1e-9);
        // Turned back by a tenth of z_ss in 1 ms: sigma0 times that, and of damping and viscous friction 0.021 times both.
        let turned = step(-0.2, 10);
        assert!(
            (turned - (0.02 - 10.0 * 2e-4 - 0.021 * 0.2)).abs() < 2e-4,
            "{turned}"
        );
    }

    #[test]
    fn turns_with_velocity_unless_told_otherwise() {
        for (share, expected) in [(0.0, -1.0), (1.0, 1.0)] {
            let effect = (ENTRY.build)(&[0.02, share, 1.0], Unit::Rotary);
            let mut contact = effect.contact(testing::coulomb());
            let mut step = |velocity_rad_s| {
                contact.step(Motion {
                    velocity_rad_s,
                    applied_nm: 0.0,
                    dt_s: 1e-3,
                })
            };
            for _ in 0..50 {
                step(1.0);
            }
            let after = (0..10).map(|_| step(-1.0)).last().unwrap();
            assert_eq!(after.signum(), expected);
        }
    }
}
