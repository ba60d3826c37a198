//! Friction that grows with the square of speed: churning lubricant, air, a fan.
//!
//! F + c v |v|.
//!
//! Source: White, "Fluid Mechanics", McGraw-Hill, ch. 7 (drag in turbulent flow).

use super::{Effect, Entry, Instant, Kind, Parameter};

struct Quadratic {
    drag_nm_s2_rad2: f64,
}

impl Effect for Quadratic {
    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let v = now.motion.load_velocity_rad_s;
        friction_nm + self.drag_nm_s2_rad2 * v * v.abs()
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "friction.quadratic",
    model: "F + c v |v|",
    parameters: &[Parameter::new(
        ["drag_nm_s2_rad2", "drag_n_s2_m2"],
        Kind::Size,
        |scale| {
            // As much as Coulomb friction at the top speed; less than none where a lubricant thins by shear.
            let most = scale.coulomb_nm / scale.top_speed_rad_s.powi(2);
            [-0.5 * most, most]
        },
    )],
    build: |values, _| {
        Box::new(Quadratic {
            drag_nm_s2_rad2: values[0],
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::at;
    use super::*;
    use crate::unit::Unit;

    #[test]
    fn curves_with_speed_against_motion() {
        let mut effect = (ENTRY.build)(&[1e-3], Unit::Rotary);
        let mut added = |v| effect.friction(&at(0.0, v), 0.0);
        assert!((added(2.0) - 4e-3).abs() < 1e-15);
        assert!((added(-4.0) + 16e-3).abs() < 1e-15);
    }
}
