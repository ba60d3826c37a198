//! The size of an axis before there is a record of it.

use crate::believed::Believed;
use bristle_plant::Unit;
use bristle_plant::effect::Scale;
use std::f64::consts::PI;

/// From the axis file alone: up to its limits, else three times stiction; a turn or half a metre of travel in 10 s.
pub fn without_record(believed: &Believed) -> Scale {
    let [lowest_rad, highest_rad] = match believed.unit {
        Unit::Rotary => [-PI, PI],
        Unit::Linear => [0.0, 0.5],
    };
    Scale {
        unit: believed.unit,
        coulomb_nm: believed.coulomb_nm,
        inertia_kg_m2: believed.whole_inertia_kg_m2(),
        stribeck_velocity_rad_s: believed.stribeck_velocity_rad_s,
        z_ss_rad: believed.coulomb_nm / believed.stiffness_nm_rad,
        top_speed_rad_s: believed.speed_limit_rad_s,
        top_torque_nm: believed
            .drive
            .torque_limit_nm
            .unwrap_or(3.0 * believed.stiction_nm),
        lowest_rad,
        highest_rad,
        duration_s: 10.0,
        sample_time_s: 1.0 / believed.rate_hz,
        rad_per_count: believed.rad_per_count(),
    }
}
