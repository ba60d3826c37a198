//! Break-away that grows with the time at rest and is lost within a short slip.
//!
//! F (1 + A theta), d theta/dt = (1 - theta)/T - theta |ds/dt|/D. The slip s is that of an anchor which the axis drags
//! along at a part of the distance D, so that noise at rest is no slip. Before the record the axis has long been at rest,
//! or has just slipped. In each step theta takes its exact exponential.
//!
//! Source: the ageing law of Dieterich, "Modeling of rock friction", J. Geophys. Res. 84(B5), 1979, and Ruina 1983, made
//! linear in theta; rising stiction: Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30(7), 1994, eq. 12.

use super::{Effect, Entry, Instant, Kind, Parameter};

/// Distance of the anchor as a part of D: a tremble of less is no slip.
const ANCHOR: f64 = 0.15;

struct Dwell {
    rise_share: f64,
    dwell_s: f64,
    slip_rad: f64,
    anchor_rad: Option<f64>,
    aged: f64,
}

impl Effect for Dwell {
    fn changes_level(&self) -> bool {
        true
    }

    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let q = now.motion.load_position_rad;
        let before = self.anchor_rad.unwrap_or(q);
        let reach = ANCHOR * self.slip_rad;
        let after = before.clamp(q - reach, q + reach);
        self.anchor_rad = Some(after);
        let ageing = now.step_s / self.dwell_s;
        let both = ageing + (after - before).abs() / self.slip_rad;
        if both > 0.0 {
            let end = ageing / both;
            self.aged = end + (self.aged - end) * (-both).exp();
        }
        friction_nm * (1.0 + self.rise_share * self.aged)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.dwell",
    model: "F (1 + A theta), theta to 1 within T at rest and to 0 within D of slip",
    parameters: &[
        Parameter::same("rise_share", Kind::Size, |_| [0.1, 1.0]),
        Parameter::same("dwell_s", Kind::Shape, |_| [0.05, 30.0]).or(1.0),
        Parameter::new(["slip_rad", "slip_m"], Kind::Shape, |scale| {
            [scale.z_ss_rad, 10.0 * scale.z_ss_rad]
        })
        .or(1e-3),
        Parameter::same("rested_before", Kind::Form, |_| [0.0, 1.0]).or(1.0),
    ],
    build: |values, _| {
        Box::new(Dwell {
            rise_share: values[0],
            dwell_s: values[1].max(f64::MIN_POSITIVE),
            slip_rad: values[2].abs().max(f64::MIN_POSITIVE),
            anchor_rad: None,
            aged: values[3].clamp(0.0, 1.0),
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::{self, at};
    use super::*;
    use crate::unit::Unit;

    /// Factor on friction after sliding well away and then a rest, in steps of a length.
    fn after_rest(rest_s: f64, step_s: f64) -> f64 {
        let mut effect = (ENTRY.build)(&[0.5, 0.5, 1e-3, 1.0], Unit::Rotary);
        let mut step = |q, step_s| {
            let now = Instant {
                step_s,
                ..at(q, 0.0)
            };
            effect.friction(&now, 1.0)
        };
        for k in 0..100 {
            step(f64::from(k) * 1e-3, 1e-5);
        }
        for _ in 0..(rest_s / step_s).round() as i32 {
            // A count of noise is no slip.
            step(0.099, 0.5 * step_s);
            step(0.099 + 1e-4, 0.5 * step_s);
        }
        step(0.099, 0.0)
    }

    #[test]
    fn break_away_rises_with_rest_whatever_the_step() {
        for (rest_s, share) in [(0.0, 0.0), (0.5, 1.0 - (-1.0_f64).exp()), (20.0, 1.0)] {
            for step_s in [1e-4, 2e-3] {
                let factor = after_rest(rest_s, step_s);
                // Left by a hundredth of a second of slip before: 1e-5/0.5 in each step against 1 in slip.
                assert!(
                    (factor - 1.0 - 0.5 * share).abs() < 2e-4,
                    "{rest_s}: {factor}"
                );
            }
        }
    }

    #[test]
    fn only_the_break_away_is_higher() {
        // Torque that rises slowly on a static axis of 0.02 N m: it lets go at 0.03 and then slides at 0.02.
        let effect = (ENTRY.build)(&[0.5, 0.5, 1e-3, 1.0], Unit::Rotary);
        let mut axis = testing::axis(testing::coulomb(), vec![effect]);
        let mut torque = 0.0;
        while axis.truth().motion.velocity_rad_s == 0.0 && torque < 1.0 {
            torque += 1e-5;
            axis.advance(torque);
        }
        assert!((torque - 0.03).abs() < 3e-5, "{torque}");
        for _ in 0..2000 {
            axis.advance(torque);
        }
        assert!((axis.truth().friction_nm - 0.02).abs() < 1e-5);
    }
}
