//! What an answer is worth.

use super::*;

#[test]
fn a_single_effect_is_exact_tied_near_or_missed() {
    let truth = truth(Class::Single, &[COGGING]);
    let exact = scored(
        &truth,
        said("effect", &["actuator.cogging"], 0.9, &["actuator.cogging"]),
    );
    assert!(
        exact.exact
            && exact.right()
            && !exact.tied
            && exact.family
            && exact.top3
            && exact.block
            && !exact.accused
    );
    // 0.025 for 0.02; a wrong order does not count as a magnitude.
    assert!((exact.magnitude_error.unwrap() - 0.25).abs() < 1e-12);
    assert_eq!((exact.closed, exact.strength), (Some(0.97), "4x"));

    let tied = scored(
        &truth,
        said(
            "ambiguous",
            &["actuator.ripple", "actuator.cogging"],
            0.8,
            &["actuator.ripple"],
        ),
    );
    assert!(!tied.exact && tied.tied && tied.right() && tied.family && !tied.top3);
    let tied_elsewhere = scored(
        &truth,
        said("ambiguous", &["actuator.lag", "actuator.delay"], 0.8, &[]),
    );
    assert!(!tied_elsewhere.right() && !tied_elsewhere.family);

    let near = scored(
        &truth,
        said(
            "effect",
            &["actuator.ripple"],
            0.6,
            &["actuator.ripple", "actuator.lag", "actuator.cogging", "x"],
        ),
    );
    assert!(!near.right() && near.family && near.top3 && near.block);
    let fourth = scored(
        &truth,
        said(
            "effect",
            &["a.b"],
            0.6,
            &["a", "b", "c", "actuator.cogging"],
        ),
    );
    assert!(!fourth.top3 && !fourth.family && !fourth.block);
    // One too many is not exact.
    let more = scored(
        &truth,
        said(
            "effects",
            &["actuator.cogging", "mechanics.offset"],
            0.6,
            &["actuator.cogging"],
        ),
    );
    assert!(!more.right() && more.family);
    for kind in ["none", "parameters", "unknown", "insufficient"] {
        let none = scored(&truth, said(kind, &[], 0.6, &[]));
        assert!(!none.right() && !none.family && !none.accused);
    }
}

#[test]
fn pairs_unknown_clean_and_parameters() {
    let pair = truth(Class::Pair, &[COGGING, OFFSET]);
    let both = scored(
        &pair,
        said(
            "effects",
            &["mechanics.offset", "actuator.cogging"],
            0.9,
            &["mechanics.offset", "actuator.cogging"],
        ),
    );
    assert!(both.exact && both.found == 2 && both.top3);
    let one = scored(
        &pair,
        said("effect", &["mechanics.offset"], 0.9, &["mechanics.offset"]),
    );
    assert!(!one.exact && one.found == 1 && !one.top3 && one.family);

    let unknown = truth(Class::Unknown, &[("foreign.notches", "mechanics")]);
    assert!(scored(&unknown, said("unknown", &[], 0.9, &[])).exact);
    let impostor = scored(
        &unknown,
        said("effect", &["actuator.cogging"], 0.9, &["actuator.cogging"]),
    );
    assert!(!impostor.right() && !impostor.family && !impostor.top3 && !impostor.accused);

    let clean = truth(Class::Clean, &[]);
    assert!(scored(&clean, said("none", &[], 0.9, &[])).exact);
    let moved = scored(&clean, said("parameters", &[], 0.9, &[]));
    assert!(!moved.exact && !moved.accused);
    let wrong = truth(Class::Parameters, &[]);
    assert!(scored(&wrong, said("parameters", &[], 0.9, &[])).exact);
    for (kind, effects) in [
        ("effect", vec!["actuator.lag"]),
        ("effects", vec!["a", "b"]),
        ("ambiguous", vec!["a", "b"]),
        ("unknown", vec![]),
    ] {
        for truth in [&clean, &wrong] {
            assert!(
                scored(truth, said(kind, &effects, 0.9, &[])).accused,
                "{kind}"
            );
        }
    }
    // No answer, and one that is no contract, are wrong and not a panic.
    for answer in [
        Value::Null,
        json!({"verdict": 3, "candidates": {"a": []}}),
        json!([]),
    ] {
        let outcome = scored(&clean, answer);
        assert!(
            outcome.kind == "error"
                && !outcome.right()
                && !outcome.accused
                && outcome.probability.is_none()
        );
    }
}

#[test]
fn a_miss_has_its_reason_and_its_figures() {
    let single = truth(Class::Single, &[COGGING]);
    let pair = truth(Class::Pair, &[COGGING, OFFSET]);
    let unknown = truth(Class::Unknown, &[("foreign.notches", "mechanics")]);
    let (clean, wrong) = (truth(Class::Clean, &[]), truth(Class::Parameters, &[]));
    let cogging = ["actuator.cogging"];
    let ripple = ["actuator.ripple", "actuator.cogging"];
    let reason = |truth: &Truth, kind, named: &[&str], candidates: &[&str]| {
        let outcome = scored(truth, said(kind, named, 0.6, candidates));
        outcome.miss.map(|miss| miss.reason)
    };
    for (truth, kind, named, candidates, expected) in [
        (&single, "effect", &cogging[..], &cogging[..], None),
        (
            &single,
            "insufficient",
            &[],
            &cogging,
            Some(Reason::Undecided),
        ),
        (
            &single,
            "effect",
            &["a.b"],
            &["a.b"],
            Some(Reason::NotFitted),
        ),
        (&single, "parameters", &[], &cogging, Some(Reason::TooWeak)),
        (&single, "none", &[], &ripple, Some(Reason::TakenUp)),
        (
            &single,
            "effect",
            &ripple[..1],
            &ripple,
            Some(Reason::Other),
        ),
        (&single, "effects", &ripple, &ripple, Some(Reason::Beside)),
        (
            &single,
            "unknown",
            &[],
            &cogging,
            Some(Reason::Unrecognised),
        ),
        (&pair, "effect", &cogging, &cogging, Some(Reason::OneOfTwo)),
        (&pair, "effect", &ripple[..1], &ripple, Some(Reason::Other)),
        (
            &unknown,
            "effect",
            &cogging,
            &cogging,
            Some(Reason::Resembles),
        ),
        (&unknown, "parameters", &[], &cogging, Some(Reason::Unseen)),
        (&clean, "unknown", &[], &[], Some(Reason::Accused)),
        (&wrong, "none", &[], &[], Some(Reason::Moved)),
    ] {
        let found = reason(truth, kind, named, candidates);
        assert_eq!(found, expected, "{:?} {kind} {named:?}", truth.class);
    }
    let none = scored(&single, Value::Null).miss.unwrap();
    assert_eq!(none.reason, Reason::NoAnswer);

    let mut answer = said("parameters", &[], 0.3, &ripple);
    answer["candidates"][1]["gap_after"] = json!(0.012);
    answer["moved"] = json!([
        {"parameter": "inertia_kg_m2", "after": 1.1e-4},
        {"parameter": "coulomb_nm", "after": 0.01},
        {"parameter": "not_in_the_key", "after": 9.0},
    ]);
    let changed = |key: &str, truth| Changed {
        key: key.to_owned(),
        file: 1.0,
        truth,
    };
    let single = Truth {
        changed: vec![changed("inertia_kg_m2", 1e-4), changed("coulomb_nm", 0.02)],
        ..single
    };
    assert_eq!(
        scored(&single, answer).miss.unwrap().figures,
        "refit leaves 4.10, actuator.cogging (candidate 2) 1.20, coulomb_nm refitted to 0.500 of the truth"
    );
}
