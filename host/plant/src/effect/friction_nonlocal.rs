//! Presliding with non-local memory: friction remembers where it turned, and closes its minor loops.
//!
//! Eight Maxwell-slip elements of the same share of the level, s = mean of s_i; each is a spring that slips at its own
//! deflection z_ss (i/8)^c. Exact for any step in one direction. Where the model has bristles, their z_ss adds up.
//!
//! Source: Iwan, "A distributed-element model for hysteresis", ASME J. Appl. Mech. 33(4), 1966; Lampaert, Al-Bender,
//! Swevers, "A generalized Maxwell-slip friction model", IEEE Int. Conf. Physics and Control, 2003; Al-Bender, Lampaert,
//! Swevers, IEEE TAC 50(11), 2005.

use super::bristles::{Bristles, OnBristles};
use super::{Effect, Entry, Kind, Parameter};
use crate::contact::Contact;
use bristle_core::friction::Motion;

const ELEMENTS: usize = 8;

struct Nonlocal {
    z_ss_rad: f64,
    curvature: f64,
    damping_s: f64,
}

struct MaxwellSlip {
    reach_rad: [f64; ELEMENTS],
    shares: [f64; ELEMENTS],
    damping_s: f64,
}

impl MaxwellSlip {
    fn mean(&self) -> f64 {
        self.shares.iter().sum::<f64>() / ELEMENTS as f64
    }
}

impl Effect for Nonlocal {
    fn contact(&self, inner: Box<dyn Contact>) -> Box<dyn Contact> {
        // Below a picometre no velocity of an axis leaves it in stick.
        if self.z_ss_rad < 1e-12 {
            return inner;
        }
        OnBristles::wrap(inner, |z_rad| MaxwellSlip {
            reach_rad: std::array::from_fn(|i| {
                let place = (i + 1) as f64 / ELEMENTS as f64;
                (z_rad + self.z_ss_rad) * place.powf(self.curvature)
            }),
            shares: [0.0; ELEMENTS],
            damping_s: self.damping_s,
        })
    }
}

impl Bristles for MaxwellSlip {
    fn share(&mut self, motion: &Motion<f64>) -> f64 {
        let travel = motion.velocity_rad_s * motion.dt_s;
        let before = self.mean();
        for (share, reach) in self.shares.iter_mut().zip(&self.reach_rad) {
            *share = (*share + travel / reach).clamp(-1.0, 1.0);
        }
        let after = self.mean();
        if motion.dt_s > 0.0 {
            after + self.damping_s * (after - before) / motion.dt_s
        } else {
            after
        }
    }

    /// The mean over the elements.
    fn deflection_rad(&self) -> f64 {
        let each = self.shares.iter().zip(&self.reach_rad);
        each.map(|(share, reach)| share * reach).sum::<f64>() / ELEMENTS as f64
    }

    fn rescale(&mut self, times: f64) {
        for share in &mut self.shares {
            *share = (*share * times).clamp(-1.0, 1.0);
        }
    }

    fn slopes(&self) -> [f64; 2] {
        let slope = self.reach_rad.iter().map(|reach| 1.0 / reach).sum::<f64>() / ELEMENTS as f64;
        [slope, slope * self.damping_s]
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.nonlocal",
    model: "F with mean s_i for sgn(v), s_i a spring that slips at z_ss (i/8)^c",
    parameters: &[
        Parameter::new(["z_ss_rad", "z_ss_m"], Kind::Size, |scale| {
            scale.either([1e-3, 2e-2], [1e-6, 1e-4])
        }),
        Parameter::same("curvature", Kind::Shape, |_| [0.3, 3.0]).or(1.0),
        Parameter::same("damping_s", Kind::Shape, |_| [1e-4, 1e-2]).or(1e-3),
    ],
    build: |values, _| {
        Box::new(Nonlocal {
            z_ss_rad: values[0].abs(),
            curvature: values[1].clamp(0.0, 10.0),
            damping_s: values[2].max(0.0),
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;
    use crate::unit::Unit;

    fn walk(contact: &mut dyn Contact, travel_rad: f64) -> f64 {
        let steps = 100;
        let mut friction = 0.0;
        for _ in 0..steps {
            friction = contact.step(Motion {
                velocity_rad_s: travel_rad / (f64::from(steps) * 1e-3),
                applied_nm: 0.0,
                dt_s: 1e-3,
            });
        }
        friction
    }

    #[test]
    fn minor_loops_close_and_leave_no_trace() {
        let effect = (ENTRY.build)(&[1e-2, 1.0, 0.0], Unit::Rotary);
        let mut looped = effect.contact(testing::coulomb());
        let mut straight = effect.contact(testing::coulomb());
        let turned = walk(looped.as_mut(), 6e-3);
        // A loop inside the loop, and back to where it turned.
        for travel in [-4e-3, 2e-3, -1e-3, 1e-3, -2e-3] {
            walk(looped.as_mut(), travel);
        }
        let closed = walk(looped.as_mut(), 4e-3);
        assert!((closed - turned).abs() < 1e-12, "{closed} {turned}");
        // From there on it follows the curve that it had left.
        walk(straight.as_mut(), 6e-3);
        let (a, b) = (walk(looped.as_mut(), 2e-3), walk(straight.as_mut(), 2e-3));
        assert!((a - b).abs() < 1e-12);
    }

    #[test]
    fn a_turn_is_the_first_curve_at_twice_the_scale() {
        // Masing's rule, which every sum of Maxwell-slip elements keeps.
        let effect = (ENTRY.build)(&[1e-2, 1.0, 0.0], Unit::Rotary);
        let mut first = effect.contact(testing::coulomb());
        let rise = walk(first.as_mut(), 3e-3);
        let mut slid = effect.contact(testing::coulomb());
        assert!((walk(slid.as_mut(), 5e-2) - 0.02).abs() < 1e-15);
        let turned = 0.02 - walk(slid.as_mut(), -6e-3);
        assert!((turned - 2.0 * rise).abs() < 1e-12);
        assert!(rise < 0.02 && rise > 0.3 * 0.02, "{rise}");
    }
}
