use super::*;

fn wanted(effects: &[&'static str], share: f64) -> Wanted {
    Wanted {
        effects: effects.to_vec(),
        share,
        parameter_error: 0.1,
    }
}

#[test]
fn the_same_seed_draws_the_same_trial() {
    let one = |seed| {
        draw(seed, &wanted(&["actuator.cogging"], 4.0))
            .unwrap()
            .unwrap()
    };
    let (a, b, c) = (one(1), one(1), one(2));
    assert_eq!((&a.axis, &a.truth, &a.logs), (&b.axis, &b.truth, &b.logs));
    assert_ne!(a.logs[0].efforts, c.logs[0].efforts);
}
