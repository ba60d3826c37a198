//! Tests of what a file is completed to.

use super::*;

fn bench() -> (AxisFile, PathBuf) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes/bench.toml");
    (AxisFile::read(&path).unwrap(), path)
}

#[test]
fn every_model_runs_on_the_axis() {
    let (file, path) = bench();
    let believed = Believed::new(&file, &path).unwrap();
    assert!(believed.assumed.is_empty(), "{:?}", believed.assumed);
    for &model in FrictionModel::ALL {
        let mut axis = believed.axis(model, 1e-4, Noise::default(), 1).unwrap();
        for _ in 0..2000 {
            axis.advance(0.05);
        }
        let moving = axis.truth();
        // 0.05 N m is above stiction: after 0.2 s every model slides, and none is faster than without friction.
        let free = 0.05 / 2.5246e-5 * 0.2;
        let v = moving.motion.velocity_rad_s;
        assert!(v > 1.0 && v < free, "{model:?}: {v} rad/s");
        assert!(moving.friction_nm > 0.015, "{model:?}: {moving:?}");
    }
}

#[test]
fn bliman_sorine_breaks_away_at_stiction() {
    let (file, path) = bench();
    let believed = Believed::new(&file, &path).unwrap();
    let model = believed.bliman_sorine().unwrap();
    assert!((model.break_away_nm() - 0.026).abs() < 1e-9);
    assert!((model.coulomb_nm() - 0.020).abs() < 1e-12);
}

#[test]
fn says_what_it_assumed() {
    let path = Path::new("axis.toml");
    let text = "[axis]\ninertia_kg_m2 = 1e-4\n[friction]\ncoulomb_nm = 0.05\n";
    let believed = Believed::new(&AxisFile::parse(text, path).unwrap(), path).unwrap();
    assert_eq!(believed.assumed.len(), 4, "{:?}", believed.assumed);
    assert!(believed.tick::<f32>(1e-4).is_ok());
    let bare = "[axis]\ninertia_kg_m2 = 1e-4\n";
    let error = Believed::new(&AxisFile::parse(bare, path).unwrap(), path).unwrap_err();
    assert!(error.to_string().contains("coulomb_nm"), "{error}");
}

#[test]
fn refuses_gains_with_the_nearest_that_pass() {
    let (mut file, path) = bench();
    file.observer.l1_1_s = Some(500.0);
    let believed = Believed::new(&file, &path).unwrap();
    let error = believed.tick::<f32>(1e-4).unwrap_err().to_string();
    assert!(
        error.contains("the nearest value that passes is 5"),
        "{error}"
    );
}

#[test]
fn a_gain_that_nobody_gave_is_one_that_holds() {
    // At 1 kHz a tenth of the rate does not: the slip of this axis is faster.
    let text = "[axis]\ninertia_kg_m2 = 3.1e-4\ncounts_per_rev = 16384\n[friction]\ncoulomb_nm = 0.08\nstiction_nm = \
                0.10\nstribeck_velocity_rad_s = 0.5\nstiffness_nm_rad = 30.0\ndamping_nm_s_rad = \
                0.05\nviscous_nm_s_rad = 0.002\n";
    let path = Path::new("axis.toml");
    let mut file = AxisFile::parse(text, path).unwrap();
    assert!(
        Believed::new(&file, path)
            .unwrap()
            .tick::<f32>(1e-3)
            .is_ok()
    );
    file.observer.l1_1_s = Some(100.0);
    assert!(
        Believed::new(&file, path)
            .unwrap()
            .tick::<f32>(1e-3)
            .is_err()
    );
}
