//! A flexible coupling, belt or shaft: part of the inertia sits behind a spring and a damper, friction with it or not.
//!
//! J_m a = tau - k e - d de/dt, J_l a_l = k e + d de/dt - F, e = q - q_l; with friction on the motor, F is taken from its
//! row, at its velocity. The resonance is at sqrt(k/(J s (1 - s))), the
//! anti-resonance at sqrt(k/(J s)), with s the share of the inertia J behind the spring.
//!
//! Source: thesis (Aktas, ITU 2002) eqs. 2.25, 2.26; Ellis, "Control System Design Guide", 4th ed., ch. 16.

use super::{Coupling, Effect, Entry, Kind, Parameter, Scale};
use std::f64::consts::TAU;

struct Compliance {
    compliance_rad_nm: f64,
    load_share: f64,
    damping_ratio: f64,
    friction_on_motor: bool,
}

impl Effect for Compliance {
    fn coupling(&self, inertia_kg_m2: f64) -> Option<Coupling> {
        (self.compliance_rad_nm > 0.0).then(|| {
            let stiffness = 1.0 / self.compliance_rad_nm;
            Coupling::new(
                inertia_kg_m2,
                self.load_share,
                stiffness,
                self.damping_ratio,
                self.friction_on_motor,
            )
        })
    }
}

/// Waves a sample up to which a resonance shows: half as fast as could be sampled.
const SHOWN: f64 = 0.25;

/// Compliance of two equal halves that resonate at a frequency.
fn compliance_rad_nm(scale: &Scale, hz: f64) -> f64 {
    1.0 / (Coupling::reduced_kg_m2(scale.inertia_kg_m2, 0.5) * (TAU * hz).powi(2))
}

pub(super) const ENTRY: Entry = Entry {
    id: "mechanics.compliance",
    model: "J (1 - s) a = tau - T, J s a_l = T - F, T = e/compliance + d de/dt, e = q - q_l",
    parameters: &[
        Parameter::new(
            ["compliance_rad_nm", "compliance_m_n"],
            Kind::Size,
            |scale| {
                let most_hz = 300_f64.min(SHOWN / scale.sample_time_s);
                [
                    compliance_rad_nm(scale, most_hz),
                    compliance_rad_nm(scale, 20_f64.min(most_hz / 5.0)),
                ]
            },
        ),
        Parameter::same("load_share", Kind::Shape, |_| [0.1, 0.9]).or(0.5),
        Parameter::same("damping_ratio", Kind::Shape, |_| [0.005, 0.3]).or(0.03),
        Parameter::FRICTION_ON_MOTOR,
    ],
    build: |values, _| {
        Box::new(Compliance {
            compliance_rad_nm: values[0],
            load_share: values[1],
            damping_ratio: values[2],
            friction_on_motor: values[3] >= 0.5,
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing;
    use super::*;
    use crate::unit::Unit;

    /// Amplitude of motor velocity under a torque of 0.01 N m at a frequency, without friction.
    fn response(hz: f64) -> f64 {
        // k for 100 Hz with 1e-4 kg m^2 in halves.
        let effect = (ENTRY.build)(
            &[1.0 / (0.25e-4 * (TAU * 100.0).powi(2)), 0.5, 0.01, 0.0],
            Unit::Rotary,
        );
        let mut axis = testing::axis(testing::free(), vec![effect]);
        let (mut re, mut im) = (0.0, 0.0);
        for k in 0..20_000 {
            let angle = TAU * hz * f64::from(k) * testing::SAMPLE_S;
            axis.advance(0.01 * angle.sin());
            if k >= 10_000 {
                let v = axis.truth().motion.velocity_rad_s;
                re += v * angle.cos() / 5000.0;
                im += v * angle.sin() / 5000.0;
            }
        }
        re.hypot(im)
    }

    #[test]
    fn has_an_anti_resonance_below_a_resonance() {
        let rigid = |hz: f64| 0.01 / (1e-4 * TAU * hz);
        // sqrt(1 - s) of 100 Hz; 1 % of damping leaves a tenth or less of the rigid response, and ten times or more.
        let anti = 100.0 * 0.5_f64.sqrt();
        assert!(response(anti) < 0.1 * rigid(anti), "{}", response(anti));
        assert!(response(100.0) > 10.0 * rigid(100.0));
        // Far below, the axis is rigid: 1/(1 - (10/71)^2) and the like.
        assert!((response(10.0) / rigid(10.0) - 1.0).abs() < 0.02);
    }
}
