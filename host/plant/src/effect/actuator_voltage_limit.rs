//! Torque that falls with speed as the back-EMF uses up the supply voltage.
//!
//! u within M (-1 - v/v_0) and M (1 - v/v_0), neither crossing zero: M at stall, nothing from the no-load speed v_0 on, more
//! when braking. A current loop that runs out of voltage by and by has a round knee: u (1 + |u/L|^(1/k))^-k below a limit L.
//!
//! Source: Hughes, Drury, "Electric Motors and Drives", 5th ed., ch. 3 (torque-speed line of a DC motor).

use super::{Effect, Entry, Instant, Kind, Parameter};

struct VoltageLimit {
    stall_nm: f64,
    per_no_load_s_rad: f64,
    knee_share: f64,
}

impl VoltageLimit {
    /// What is left of a torque below a limit, both at least zero.
    fn below(&self, limit_nm: f64, torque_nm: f64) -> f64 {
        let (lesser, greater) = (torque_nm.min(limit_nm), torque_nm.max(limit_nm));
        if self.knee_share <= 0.0 || lesser <= 0.0 {
            return lesser;
        }
        lesser * (1.0 + (lesser / greater).powf(1.0 / self.knee_share)).powf(-self.knee_share)
    }
}

impl Effect for VoltageLimit {
    fn actuator(&mut self, now: &Instant) -> f64 {
        if self.stall_nm <= 0.0 || self.per_no_load_s_rad <= 0.0 {
            return now.torque_nm;
        }
        let emf = now.motion.velocity_rad_s * self.per_no_load_s_rad;
        let along = emf * now.torque_nm.signum();
        let limit_nm = (self.stall_nm * (1.0 - along)).max(0.0);
        self.below(limit_nm, now.torque_nm.abs())
            .copysign(now.torque_nm)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "actuator.voltage_limit",
    model: "u within M (-1 - v/v_0) and M (1 - v/v_0), with a knee",
    parameters: &[
        Parameter::new(["no_load_rad_s", "no_load_m_s"], Kind::Limit, |scale| {
            [scale.top_speed_rad_s, 3.0 * scale.top_speed_rad_s]
        }),
        Parameter::new(["stall_nm", "stall_n"], Kind::Limit, |scale| {
            [scale.top_torque_nm, 5.0 * scale.top_torque_nm]
        }),
        Parameter::same("knee_share", Kind::Detail, |_| [0.0, 0.3]),
    ],
    build: |values, _| {
        let no_load = values[0].abs();
        Box::new(VoltageLimit {
            stall_nm: values[1].abs(),
            per_no_load_s_rad: if no_load > 0.0 { 1.0 / no_load } else { 0.0 },
            knee_share: values[2],
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::at;
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn acts_only_when_fast_and_loaded() {
        let mut effect = (ENTRY.build)(&[100.0, 2.0, 0.0], Unit::Rotary);
        let mut out = |v, torque_nm| {
            effect.actuator(&Instant {
                torque_nm,
                ..at(0.0, v)
            })
        };
        assert_eq!(out(0.0, 1.9), 1.9);
        assert_eq!(out(80.0, 0.3), 0.3);
        assert!((out(80.0, 1.0) - 0.4).abs() < 1e-15);
        assert!((out(-80.0, -1.0) + 0.4).abs() < 1e-15);
        assert_eq!(out(150.0, 1.0), 0.0);
        // Braking has all of it.
        assert_eq!(out(80.0, -1.5), -1.5);
    }

    #[test]
    fn its_knee_may_be_round() {
        let mut effect = (ENTRY.build)(&[100.0, 2.0, 0.1], Unit::Rotary);
        let mut out = |torque_nm| {
            effect.actuator(&Instant {
                torque_nm,
                ..at(0.0, 50.0)
            })
        };
        // At the limit of 1 N m 2^-k arrives; far from it on either side the knee is not there.
        assert!((out(1.0) - 0.5_f64.powf(0.1)).abs() < 1e-15);
        assert!((out(0.3) - 0.3).abs() < 1e-6);
        assert!((out(5.0) - 1.0).abs() < 1e-6);
    }
}
