//! Presliding with non-local memory: friction remembers where it turned, and closes its minor loops.
//!
//! F + p F_C (s - sgn(F)), s the mean of s_i + d ds_i/dt: a part p of Coulomb friction is carried by eight Maxwell-slip
//! elements of the same share, beside whatever carries the rest; each is a spring that slips at its own deflection
//! z_ss (i/8)^c. Exact for any step in one direction.
//!
//! Source: Iwan, "A distributed-element model for hysteresis", ASME J. Appl. Mech. 33(4), 1966; Lampaert, Al-Bender,
//! Swevers, "A generalized Maxwell-slip friction model", IEEE Int. Conf. Physics and Control, 2003; Al-Bender, Lampaert,
//! Swevers, IEEE TAC 50(11), 2005.

use super::{Effect, Entry, Instant, Kind, Parameter, Plain};

const ELEMENTS: usize = 8;
/// What carries the rest keeps a little.
const MOST: f64 = 0.98;

struct Nonlocal {
    part: f64,
    reach_rad: [f64; ELEMENTS],
    damping_s: f64,
    carried_nm: f64,
    shares: [f64; ELEMENTS],
    position_rad: Option<f64>,
}

impl Nonlocal {
    fn mean(&self) -> f64 {
        self.shares.iter().sum::<f64>() / ELEMENTS as f64
    }
}

impl Effect for Nonlocal {
    fn begin(&mut self, plain: &Plain) {
        // Below a picometre no velocity of an axis leaves it in stick.
        if self.reach_rad[ELEMENTS - 1] >= 1e-12 {
            self.carried_nm = self.part * plain.levels.coulomb_nm;
        }
    }

    fn changes_level(&self) -> bool {
        true
    }

    fn friction(&mut self, _: &Instant, friction_nm: f64) -> f64 {
        friction_nm - self.carried_nm.min(friction_nm.abs()).copysign(friction_nm)
    }

    fn mechanics(&mut self, now: &Instant) -> f64 {
        if self.carried_nm == 0.0 {
            return 0.0;
        }
        let position_rad = now.motion.position_rad;
        let last_rad = self.position_rad.replace(position_rad);
        let travel = position_rad - last_rad.unwrap_or(position_rad);
        let before = self.mean();
        for (share, reach) in self.shares.iter_mut().zip(&self.reach_rad) {
            *share = (*share + travel / reach).clamp(-1.0, 1.0);
        }
        let after = self.mean();
        let rate = if now.step_s > 0.0 {
            (after - before) / now.step_s
        } else {
            0.0
        };
        -self.carried_nm * (after + self.damping_s * rate)
    }

    fn fastest_rate_1_s(&self, inertia_kg_m2: f64) -> f64 {
        if self.carried_nm == 0.0 {
            return 0.0;
        }
        let slope = self.reach_rad.iter().map(|reach| 1.0 / reach).sum::<f64>() / ELEMENTS as f64;
        let stiffness_per_inertia = self.carried_nm * slope / inertia_kg_m2;
        stiffness_per_inertia
            .sqrt()
            .max(self.damping_s * stiffness_per_inertia)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.nonlocal",
    model: "F + p F_C (s - sgn(F)), s the mean of springs that slip at z_ss (i/8)^c",
    parameters: &[
        Parameter::same("part", Kind::Size, |_| [0.1, 1.0]),
        Parameter::new(["z_ss_rad", "z_ss_m"], Kind::Shape, |scale| {
            [0.5 * scale.z_ss_rad, 30.0 * scale.z_ss_rad]
        })
        .or(1e-3),
        Parameter::same("curvature", Kind::Shape, |_| [0.3, 3.0]).or(1.0),
        Parameter::same("damping_s", Kind::Shape, |_| [1e-4, 1e-2]).or(1e-3),
    ],
    build: |values, _| {
        let (z_ss_rad, curvature) = (values[1].abs(), values[2].clamp(0.0, 10.0));
        Box::new(Nonlocal {
            part: values[0].clamp(0.0, MOST),
            reach_rad: std::array::from_fn(|i| {
                let place = (i + 1) as f64 / ELEMENTS as f64;
                z_ss_rad * place.powf(curvature)
            }),
            damping_s: values[3].max(0.0),
            carried_nm: 0.0,
            shares: [0.0; ELEMENTS],
            position_rad: None,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::{self, PLAIN, at};
    use super::*;
    use crate::unit::Unit;

    /// What carries 0.01 N m over 10 mrad, and the friction after a way of it from where it last was, N m.
    fn walk() -> impl FnMut(f64) -> f64 {
        let mut effect = (ENTRY.build)(&[0.5, 1e-2, 1.0, 0.0], Unit::Rotary);
        effect.begin(&PLAIN);
        let mut position_rad = 0.0;
        effect.mechanics(&at(position_rad, 0.0));
        move |travel_rad| {
            let mut friction_nm = 0.0;
            for _ in 0..100 {
                position_rad += 0.01 * travel_rad;
                friction_nm = -effect.mechanics(&at(position_rad, 0.0));
            }
            friction_nm
        }
    }

    #[test]
    fn minor_loops_close_and_leave_no_trace() {
        let (mut looped, mut straight) = (walk(), walk());
        let turned = looped(6e-3);
        // A loop inside the loop, and back to where it turned.
        for travel in [-4e-3, 2e-3, -1e-3, 1e-3, -2e-3] {
            looped(travel);
        }
        let closed = looped(4e-3);
        assert!((closed - turned).abs() < 1e-12, "{closed} {turned}");
        // From there on it follows the curve that it had left.
        straight(6e-3);
        let (a, b) = (looped(2e-3), straight(2e-3));
        assert!((a - b).abs() < 1e-12);
    }

    #[test]
    fn a_turn_is_the_first_curve_at_twice_the_scale() {
        // Masing's rule, which every sum of Maxwell-slip elements keeps.
        let rise = walk()(3e-3);
        let mut slid = walk();
        assert!((slid(5e-2) - 0.01).abs() < 1e-15);
        let turned = 0.01 - slid(-6e-3);
        assert!((turned - 2.0 * rise).abs() < 1e-12);
        assert!(rise < 0.01 && rise > 0.3 * 0.01, "{rise}");
    }

    #[test]
    fn sliding_takes_as_much_torque_with_any_part_of_it() {
        for part in [0.0, 0.4, 1.0] {
            for contact in [testing::coulomb(), testing::bristles()] {
                let viscous_nm_s_rad = contact.steady_state_nm(1.0) - 0.02;
                let effect = (ENTRY.build)(&[part, 1e-3, 1.0, 1e-3], Unit::Rotary);
                let mut axis = testing::axis(contact, vec![effect]);
                while axis.truth().motion.velocity_rad_s < 2.0 {
                    axis.advance(0.05);
                }
                let before = axis.truth().motion.velocity_rad_s;
                for _ in 0..100 {
                    axis.advance(0.02 + viscous_nm_s_rad * before);
                }
                let after = axis.truth().motion.velocity_rad_s;
                // Bristles that are not yet bent for good brake by a thousandth of 0.02 N m.
                assert!((after - before).abs() < 2e-3, "{part}: {before} {after}");
            }
        }
    }
}
