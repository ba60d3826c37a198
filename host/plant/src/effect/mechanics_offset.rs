//! A constant torque: gravity, or an amplifier that is off zero.
//!
//! tau + torque_nm.
//!
//! Source: Janot, Gautier, Brunot, "Data Set and Reference Models of EMPS", 2019, eq. 2 (the offset of its force).

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Offset {
    torque_nm: f64,
}

impl Effect for Offset {
    fn mechanics(&mut self, _: &Instant) -> f64 {
        self.torque_nm
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "mechanics.offset",
    model: "tau + torque",
    parameters: &[Parameter::new(
        ["torque_nm", "force_n"],
        Kind::Size,
        |scale| [-0.6 * scale.coulomb_nm, 0.6 * scale.coulomb_nm],
    )],
    build: |values, _| {
        Box::new(Offset {
            torque_nm: values[0],
        })
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn is_the_same_everywhere() {
        let mut effect = (ENTRY.build)(&[0.3], Unit::Rotary);
        let moving = Instant {
            time_s: 5.0,
            ..Instant::default()
        };
        assert_eq!(effect.mechanics(&Instant::default()), 0.3);
        assert_eq!(effect.mechanics(&moving), 0.3);
    }
}
