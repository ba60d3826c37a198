//! The parameters in the firmware's image are those of the example axis file.

use bristle_core::parameters::BENCH;
use bristle_gap::{AxisFile, Believed};
use std::path::Path;

#[test]
fn the_image_holds_the_bench_axis() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../axes/bench.toml");
    let file = AxisFile::read(&path).unwrap();
    let axis = Believed::new(&file, &path).unwrap();
    let pairs = [
        (BENCH.inertia_kg_m2, axis.inertia_kg_m2),
        (BENCH.counts_per_rev, axis.counts_per_turn),
        (BENCH.coulomb_nm, axis.coulomb_nm),
        (BENCH.stiction_nm, axis.stiction_nm),
        (BENCH.stribeck_velocity_rad_s, axis.stribeck_velocity_rad_s),
        (BENCH.stiffness_nm_rad, axis.stiffness_nm_rad),
        (BENCH.damping_nm_s_rad, axis.damping_nm_s_rad),
        (BENCH.viscous_nm_s_rad, axis.viscous_nm_s_rad),
        (BENCH.breakaway_ratio, axis.breakaway_ratio),
        (BENCH.l1_1_s, axis.l1_1_s.unwrap()),
        (BENCH.l2, axis.l2),
        (BENCH.offset_nm, axis.offset_nm()),
        (BENCH.drive_lag_s, axis.drive.lag_s),
        (BENCH.max_speed_rad_s, axis.speed_limit_rad_s),
    ];
    for (i, (image, file)) in pairs.into_iter().enumerate() {
        assert_eq!(image, file as f32, "pair {i}");
    }
}
