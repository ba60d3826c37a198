use super::*;
use crate::axis_file::FrictionModel;

fn wanted(effects: &[&'static str], share: f64) -> Wanted {
    Wanted {
        effects: effects.to_vec(),
        share,
        parameter_error: 0.1,
    }
}

fn drawn(seed: u64, effects: &[&'static str], share: f64) -> Trial {
    draw(seed, &wanted(effects, share)).unwrap().unwrap()
}

#[test]
fn the_same_seed_draws_the_same_trial() {
    let one = |seed| drawn(seed, &["actuator.cogging"], 4.0);
    let (a, b, c) = (one(1), one(1), one(2));
    assert_eq!((&a.axis, &a.truth, &a.logs), (&b.axis, &b.truth, &b.logs));
    assert_ne!(a.logs[0].efforts, c.logs[0].efforts);
}

#[test]
fn an_effect_makes_the_gap_that_was_wanted() {
    for (share, ids) in [
        (1.0, ["mechanics.offset", "friction.thermal"]),
        (4.0, ["actuator.lag", "sensor.eccentricity"]),
    ] {
        for id in ids {
            let trial = drawn(3, &[id], share);
            let reached = trial.gap_nm / trial.floor_nm;
            assert!((reached / share - 1.0).abs() <= WITHIN, "{id}: {reached}");
            assert_eq!(trial.truth.effects[0].id, id);
            assert!(trial.axis.effects.is_empty());
        }
    }
}

#[test]
fn two_effects_make_more_of_a_gap_than_one() {
    let trial = drawn(5, &["mechanics.offset", "actuator.cogging"], 4.0);
    // Each alone makes 4; where they do not depend on each other, both make 5.7.
    let reached = trial.gap_nm / trial.floor_nm;
    assert!((4.0..8.0).contains(&reached), "{reached}");
    assert_eq!(trial.truth.effects.len(), 2);
}

#[test]
fn a_set_is_of_two_to_five_experiments_and_the_length_asked_for() {
    let mut models = Vec::new();
    for seed in 0..12 {
        let trial = drawn(seed, &[], 1.0);
        let logs = &trial.logs;
        assert!((2..=5).contains(&logs.len()) && logs.len() == trial.experiments.len());
        let whole_s: f64 = logs.iter().map(|log| log.time_s[log.len() - 1]).sum();
        assert!((19.0..=60.0).contains(&whole_s), "{seed}: {whole_s} s");
        assert!(trial.floor_nm > 0.0 && trial.gap_nm == 0.0);
        models.push(trial.truth.friction.model);
        let believed = Believed::new(&trial.axis, &trial.path).unwrap();
        let rad_per_count = believed.rad_per_count();
        for log in logs {
            let q = log.position_rad(&trial.axis).unwrap();
            let far = |a: f64, b: &f64| a.max((b - q[0]).abs());
            let travel = q.iter().fold(0.0, far) / rad_per_count;
            // A log without motion would show nothing.
            assert!(travel > 10.0, "{seed}: {travel} counts in {:?}", log.file);
        }
    }
    assert!(models.contains(&Some(FrictionModel::ElastoPlastic)));
    assert!(models.contains(&Some(FrictionModel::Lugre)));
}

#[test]
fn the_axis_file_is_off_by_at_most_the_error() {
    for seed in 0..8 {
        let trial = drawn(seed, &[], 1.0);
        let (believed, truth) = (&trial.axis, &trial.truth);
        let off = |a: Option<f64>, b: Option<f64>| (a.unwrap() / b.unwrap() - 1.0).abs();
        let worst = [
            off(Some(believed.axis.inertia), Some(truth.axis.inertia)),
            off(believed.friction.coulomb, truth.friction.coulomb),
            off(believed.friction.viscous, truth.friction.viscous),
            off(believed.friction.stiffness, truth.friction.stiffness),
        ];
        assert!(worst.iter().all(|x| *x <= 0.1 + 1e-12), "{worst:?}");
        assert!(worst.iter().any(|x| *x > 0.01), "{worst:?}");
    }
}

#[test]
fn friction_lacks_what_the_effect_brings() {
    let presliding = drawn(2, &["friction.presliding"], 4.0);
    let model = presliding.axis.friction.model.unwrap();
    assert!(matches!(
        model,
        FrictionModel::CoulombViscous | FrictionModel::Stribeck
    ));
    let stribeck = drawn(2, &["friction.stribeck"], 4.0);
    assert_eq!(
        stribeck.axis.friction.stiction,
        stribeck.axis.friction.coulomb
    );
}

#[test]
fn says_what_cannot_be_drawn() {
    // No usual size of a constant torque is a thousand times the noise.
    assert_eq!(
        drawn_of(3, 1, &wanted(&["mechanics.offset"], 1e4))
            .unwrap()
            .map(|_| ()),
        None
    );
    let error = draw(1, &wanted(&["mechanics.ofset"], 4.0)).unwrap_err();
    assert!(error.to_string().contains("mechanics.ofset"), "{error}");
}
