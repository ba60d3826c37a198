//! A torque limit below the one that is believed.
//!
//! u within +-limit.
//!
//! Source: the drive's data sheet; Ellis, "Control System Design Guide", 4th ed., ch. 12.

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Saturation {
    limit_nm: f64,
}

impl Effect for Saturation {
    fn actuator(&mut self, now: &Instant) -> f64 {
        now.torque_nm.clamp(-self.limit_nm, self.limit_nm)
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "actuator.saturation",
    model: "u within -limit and limit",
    parameters: &[Parameter::new(
        ["limit_nm", "limit_n"],
        Kind::Limit,
        // What a limit cuts a controller may ask for without end; what the axis moves with is more than friction.
        |scale| {
            let high = scale.top_torque_nm;
            [0.3 * high.min(10.0 * scale.coulomb_nm), high]
        },
    )],
    build: |values, _| {
        Box::new(Saturation {
            limit_nm: if values[0] == 0.0 {
                f64::INFINITY
            } else {
                values[0].abs()
            },
        })
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn cuts_only_peaks() {
        let mut effect = (ENTRY.build)(&[0.5], Unit::Rotary);
        let mut out = |torque_nm| {
            effect.actuator(&Instant {
                torque_nm,
                ..Instant::default()
            })
        };
        assert_eq!([out(0.49), out(0.7), out(-3.0)], [0.49, 0.5, -0.5]);
    }
}
