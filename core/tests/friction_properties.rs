//! What the friction models promise, for random parameters and random motion.
//!
//! Dissipation is tested where it is proven: the Coulomb family at any velocity, Karnopp outside
//! its band (inside it no model of torque alone can promise it), Dahl for every exponent,
//! Bliman-Sorine from rest, LuGre under its passivity condition. For Armstrong's model the
//! literature proves nothing; the choices made in its file make it hold, and that is what is
//! tested. The bristle model loses energy by construction as bonds snap: the test holds its step to
//! that.

#[path = "common/draw.rs"]
mod draw;

use std::cell::Cell;

use bristle_core::Real;
use bristle_core::friction::armstrong::Armstrong;
use bristle_core::friction::bliman_sorine::BlimanSorine;
use bristle_core::friction::bristle::Bristle;
use bristle_core::friction::coulomb::{Coulomb, CoulombViscous};
use bristle_core::friction::dahl::Dahl;
use bristle_core::friction::karnopp::Karnopp;
use bristle_core::friction::lugre::{Damping, LuGre, LuGreState};
use bristle_core::friction::stiction::{GeneralStatic, Stiction};
use bristle_core::friction::{Friction, Motion};
use bristle_core::stribeck::{Shape, Stribeck};
use draw::even;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

/// No file of past failures: an integration test has no place for one that proptest finds.
fn cases(count: u32) -> Config {
    Config {
        failure_persistence: None,
        ..Config::with_cases(count)
    }
}

/// One velocity held for some steps.
type Run = (f32, f32, usize);

/// Motion as an axis makes it: slow, fast, at rest, and with reversals.
fn sane() -> impl Strategy<Value = Vec<Run>> {
    let velocity = prop_oneof![
        4 => even(-0.05..0.05),
        3 => even(-1.0..1.0),
        1 => even(-50.0..50.0),
        1 => Just(0.0_f32),
    ];
    let step = prop_oneof![Just(1e-5_f32), Just(1e-4), Just(1e-3)];
    prop::collection::vec((velocity, step, 1..20_usize), 1..40)
}

/// The same with steps that no axis makes.
fn absurd() -> impl Strategy<Value = Vec<Run>> {
    let wild = (
        prop_oneof![
            Just(1e30_f32),
            Just(-1e30),
            Just(1e-40),
            Just(f32::NAN),
            Just(f32::NEG_INFINITY),
            even(-1e6..1e6)
        ],
        prop_oneof![
            Just(0.0_f32),
            Just(1e-40),
            Just(1e6),
            Just(f32::INFINITY),
            even(0.0..10.0)
        ],
        1..3_usize,
    );
    (sane(), prop::collection::vec(wild, 1..20)).prop_map(|(sane, wild)| {
        let mut mixed = Vec::new();
        let mut wild = wild.into_iter();
        for run in sane {
            mixed.push(run);
            mixed.extend(wild.next());
        }
        mixed
    })
}

fn motions<T: Real>(runs: &[Run]) -> impl Iterator<Item = Motion<T>> + '_ {
    runs.iter().flat_map(|&(v, dt, count)| {
        let motion = Motion {
            velocity_rad_s: T::of(f64::from(v)),
            // For the models at rest: sometimes below, sometimes beyond their stiction.
            applied_nm: T::of(f64::from(dt) * 300.0 - 0.03),
            dt_s: T::of(f64::from(dt)),
        };
        std::iter::repeat_n(motion, count)
    })
}

fn usable(m: &Motion<f64>) -> bool {
    m.is_usable()
}

fn stribeck(coulomb: f64, ratio: f64, velocity_rad_s: f64, kind: u8) -> Stribeck<f64> {
    let shape = match kind % 4 {
        0 => Shape::Gaussian { velocity_rad_s },
        1 => Shape::Lorentzian { velocity_rad_s },
        2 => Shape::Exponential { velocity_rad_s },
        _ => Shape::PiecewiseLinear {
            slope_nm_s_rad: coulomb / velocity_rad_s,
        },
    };
    Stribeck::new(coulomb, coulomb * ratio, shape).unwrap()
}

/// Every torque within `limit_nm(v)`, up to four roundings of it, and finite.
fn bounded<M: Friction<f64>>(
    model: &M,
    runs: &[Run],
    limit_nm: impl Fn(f64) -> f64,
    z_max: f64,
) -> Result<(), TestCaseError> {
    let mut state = M::State::default();
    for motion in motions::<f64>(runs) {
        let torque = model.step(&mut state, motion);
        let limit = limit_nm(if usable(&motion) {
            motion.velocity_rad_s.abs()
        } else {
            0.0
        });
        prop_assert!(
            torque.abs() <= limit * (1.0 + 4.0 * f64::EPSILON),
            "|{torque:e}| > {limit:e} at {motion:?}"
        );
        let z = model.deflection_rad(&state);
        prop_assert!(z.abs() <= z_max, "z = {z:e} at {motion:?}");
    }
    Ok(())
}

/// Work taken in is at least what is stored, after every step; `roundings` of epsilon are allowed
/// to each step, of its work and of the largest stored energy.
fn dissipates<M: Friction<f64>>(
    model: &M,
    start: M::State,
    runs: &[Run],
    stored: impl Fn(&M::State) -> f64,
    most_stored: f64,
    roundings: f64,
) -> Result<(), TestCaseError> {
    let mut state = start;
    let first = stored(&state);
    let (mut work, mut slack) = (0.0, 0.0);
    for motion in motions::<f64>(runs).filter(usable) {
        let torque = model.step(&mut state, motion);
        let done = torque * (motion.velocity_rad_s * motion.dt_s);
        work += done;
        slack += roundings * f64::EPSILON * (done.abs() + work.abs() + most_stored);
        let gain = stored(&state) - first;
        prop_assert!(
            work >= gain - slack,
            "work {work:e}, stored {gain:e}, slack {slack:e} at {motion:?}"
        );
    }
    Ok(())
}

/// Friction after a slide of 60 `z_max` and `time_s`, against the steady state, at several speeds
/// and step sizes.
fn settles<M: Friction<f64>>(name: &str, model: &M, z_max: f64, time_s: f64, limit: f64) {
    let mut worst = 0.0_f64;
    for v in [1e-3, 0.3, -2.0, 40.0_f64] {
        for per_step in [0.01, 0.3, 7.0, 1e5] {
            let dt_s = per_step * z_max / v.abs();
            // An implicit step of 7 deflections leaves one part in 8 of an error, not e^-7: 24 of
            // them for 1e-21.
            let steps = (60.0 / per_step).max(24.0).ceil() + (time_s / dt_s).ceil();
            let motion = Motion {
                velocity_rad_s: v,
                applied_nm: 0.0,
                dt_s,
            };
            let mut state = M::State::default();
            let torque = (0..steps as u32).fold(0.0, |_, _| model.step(&mut state, motion));
            let steady = model.steady_state_nm(v);
            worst = worst.max((torque / steady - 1.0).abs());
        }
    }
    println!("steady state of {name}: measured {worst:.1e}, limit {limit:.1e} (relative)");
    assert!(worst <= limit, "{name}: {worst:e}");
}

proptest! {
    #![proptest_config(cases(512))]

    #[test]
    fn static_models_are_bounded_and_never_drive(
        coulomb in 1e-3..1.0_f64, ratio in 1.0..3.0_f64, viscous in 0.0..0.1_f64,
        v_s in 1e-3..1.0_f64, kind in 0..4_u8, runs in absurd(),
    ) {
        let most = coulomb * ratio;
        let curve = stribeck(coulomb, ratio, v_s, kind);
        let general = GeneralStatic::new(curve, viscous).unwrap();
        let plain = Coulomb::new(coulomb).unwrap();
        let with_viscous = CoulombViscous::new(coulomb, viscous).unwrap();
        let stiction = Stiction::new(coulomb, most).unwrap();
        bounded(&plain, &runs, |_| coulomb, 0.0)?;
        bounded(&with_viscous, &runs, |v| coulomb + viscous * v, 0.0)?;
        bounded(&stiction, &runs, |v| if v == 0.0 { most } else { coulomb }, 0.0)?;
        bounded(&general, &runs, |v| most + viscous * v, 0.0)?;
        // No state and no sum: not one rounding can turn the sign.
        dissipates(&plain, (), &runs, |()| 0.0, 0.0, 0.0)?;
        dissipates(&with_viscous, (), &runs, |()| 0.0, 0.0, 0.0)?;
        dissipates(&stiction, (), &runs, |()| 0.0, 0.0, 0.0)?;
        dissipates(&general, (), &runs, |()| 0.0, 0.0, 0.0)?;
    }

    #[test]
    fn karnopp_balances_in_its_band_and_brakes_outside(
        coulomb in 1e-3..1.0_f64, ratio in 1.0..3.0_f64, viscous in 0.0..0.1_f64,
        band in 1e-3..0.1_f64, runs in absurd(),
    ) {
        let model = Karnopp::new(coulomb, coulomb * ratio, viscous, band).unwrap();
        bounded(&model, &runs, |v| coulomb * ratio + viscous * v, 0.0)?;
        for motion in motions::<f64>(&runs).filter(usable) {
            let torque = model.step(&mut (), motion);
            if motion.velocity_rad_s.abs() < band {
                let left = motion.applied_nm - torque;
                prop_assert!(left == 0.0 || torque.abs() == coulomb * ratio);
                prop_assert!(left * motion.applied_nm >= 0.0, "friction drives at {motion:?}");
            } else {
                prop_assert!(torque * motion.velocity_rad_s > 0.0);
            }
        }
    }

    #[test]
    fn dahl_is_bounded_and_dissipates(
        stiffness in 0.1..1e3_f64, coulomb in 1e-3..1.0_f64,
        exponent in prop_oneof![
            Just(0.0), Just(0.5), Just(1.0), Just(2.0), 0.0..0.9_f64, 1.1..8.0_f64
        ],
        runs in absurd(), plain in sane(),
    ) {
        let model = Dahl::new(stiffness, coulomb, exponent).unwrap();
        bounded(&model, &runs, |_| coulomb, coulomb / stiffness)?;
        for runs in [&runs, &plain] {
            let stored = |s: &_| stiffness / 2.0 * model.deflection_rad(s).powi(2);
            // The root 1/(1 - a) of a power, at most 1/0.1, carries its rounding into u; a few more
            // around it.
            let most = coulomb * coulomb / stiffness;
            dissipates(&model, Default::default(), runs, stored, most, 32.0)?;
        }
    }

    #[test]
    fn bliman_sorine_is_bounded_and_dissipates(
        fast in 1e-3..1.0_f64, part in 0.0..0.98_f64, eta in 0.01..0.95_f64,
        distance in 1e-4..0.1_f64, runs in absurd(), plain in sane(),
    ) {
        let second = BlimanSorine::second_order(fast, fast * part, eta, distance).unwrap();
        let first = BlimanSorine::first_order(fast, distance).unwrap();
        // The peak is a difference of branches of f1 each, with some ten roundings on the way.
        let limit = second.largest_nm() + 32.0 * f64::EPSILON * fast;
        bounded(&second, &runs, |_| limit, 0.0)?;
        bounded(&first, &runs, |_| fast, 0.0)?;
        for runs in [&runs, &plain] {
            // From rest; the series and its sums round some ten times.
            let most = fast * distance;
            dissipates(&second, Default::default(), runs, |_| 0.0, most, 32.0)?;
            dissipates(&first, Default::default(), runs, |_| 0.0, most, 32.0)?;
        }
    }

    #[test]
    fn lugre_is_bounded_and_dissipates_under_its_condition(
        coulomb in 1e-3..1.0_f64, ratio in 1.0..2.5_f64, v_s in 1e-3..1.0_f64, kind in 0..4_u8,
        stiffness in 0.1..1e3_f64, damping in 0.0..1.0_f64, margin in 0.0..0.5_f64,
        falls in any::<bool>(), runs in absurd(), plain in sane(),
    ) {
        let curve = stribeck(coulomb, ratio, v_s, kind);
        let choice = if falls {
            Damping::Falling { nm_s_rad: damping, velocity_rad_s: v_s }
        } else {
            Damping::Constant { nm_s_rad: damping }
        };
        // 1e-12 above the condition: at equality its own rounding would decide.
        let viscous = damping * (ratio - 1.0) * (1.0 + margin + 1e-12) + 1e-12;
        let model = LuGre::new(curve, stiffness, choice, viscous).unwrap();
        prop_assert!(model.is_passive());
        let most = coulomb * ratio;
        bounded(
            &model, &runs, |v| most + (damping * (1.0 + ratio) + viscous) * v, model.z_max_rad(),
        )?;
        for runs in [&runs, &plain] {
            let stored = |s: &_| stiffness / 2.0 * model.deflection_rad(s).powi(2);
            // Sum, product and quotient of z, each on both sides of the balance, and three terms of
            // F.
            dissipates(&model, Default::default(), runs, stored, most * most / stiffness, 16.0)?;
        }
    }

    #[test]
    fn armstrong_is_bounded_and_dissipates(
        stiffness in 0.1..1e3_f64, coulomb in 1e-3..1.0_f64, viscous in 0.0..0.1_f64,
        rise in 0.0..1.0_f64, v_s in 1e-3..1.0_f64, lag in prop_oneof![Just(0.0), 1e-4..0.05_f64],
        dwell in prop_oneof![Just(0.0), 1e-3..1.0_f64], runs in absurd(), plain in sane(),
    ) {
        let model =
            Armstrong::<f64, 12>::new(stiffness, coulomb, viscous, rise, v_s, lag, dwell).unwrap();
        let most = coulomb + rise;
        let z_max = most / stiffness;
        bounded(&model, &runs, |v| most + viscous * v, z_max)?;
        for runs in [&runs, &plain] {
            // A handful of products and sums a step.
            let stored = |s: &_| model.stored_j(s);
            dissipates(&model, Default::default(), runs, stored, most * z_max, 16.0)?;
        }
    }

    #[test]
    fn bristles_are_bounded_and_dissipate(
        stiffness in 0.1..1e3_f64, reach in 1e-5..1e-2_f64, seed in any::<u32>(),
        runs in absurd(), plain in sane(),
    ) {
        let model = Bristle::<f64, 20>::new(stiffness, reach, seed).unwrap();
        bounded(&model, &runs, |_| model.largest_nm(), reach)?;
        for runs in [&runs, &plain] {
            // Twenty sums of up to 64 parts, each below the largest bend.
            let stored = |s: &_| model.stored_j(s);
            let most = model.largest_nm() * reach;
            dissipates(&model, model.placed(), runs, stored, most, 64.0)?;
        }
    }
}

#[test]
fn lugre_returns_more_than_it_stored_when_its_condition_fails() {
    let shape = Shape::Gaussian {
        velocity_rad_s: 0.3,
    };
    let g = Stribeck::new(0.020, 0.026, shape).unwrap();
    let model = LuGre::new(g, 10.53, Damping::Constant { nm_s_rad: 0.076 }, 0.0029).unwrap();
    assert!(!model.is_passive());
    let mut state = LuGreState::default();
    let slow = Motion {
        velocity_rad_s: 1e-3,
        applied_nm: 0.0,
        dt_s: 0.1,
    };
    for _ in 0..1000 {
        model.step(&mut state, slow);
    }
    let stored = |s: &_| 10.53 / 2.0 * f64::powi(model.deflection_rad(s), 2);
    let before = stored(&state);
    let fast = Motion {
        velocity_rad_s: 100.0,
        dt_s: 1e-9,
        ..slow
    };
    let work = model.step(&mut state, fast) * 100.0 * 1e-9;
    // By 200 times what the bristles give back: far from rounding.
    assert!(work < 10.0 * (stored(&state) - before) && work < 0.0);
}

#[test]
fn long_slides_end_in_the_steady_state() {
    let shape = Shape::Gaussian {
        velocity_rad_s: 0.3,
    };
    let g = Stribeck::new(0.020, 0.026, shape).unwrap();
    let constant = Damping::Constant { nm_s_rad: 0.076 };
    let falling = Damping::Falling {
        nm_s_rad: 0.076,
        velocity_rad_s: 0.1,
    };
    let z = 0.026 / 10.0;
    // Nothing of the start is left. A step of 0.01 deflections rounds a few times and takes back
    // one part in 100 of the error: a few hundred epsilon.
    let rounding = 1e-13;
    for damping in [constant, falling] {
        let model = LuGre::new(g, 10.0, damping, 0.0029).unwrap();
        // The damping term multiplies that by sigma1 v = 3 N m against 0.14 N m of friction.
        settles("LuGre", &model, z, 0.0, 22.0 * rounding);
    }
    for exponent in [0.0, 0.5, 1.0] {
        settles(
            "Dahl",
            &Dahl::new(10.0, 0.02, exponent).unwrap(),
            0.002,
            0.0,
            rounding,
        );
    }
    // For a = 2 the approach is algebraic: 1/(1 + 60) is left.
    settles(
        "Dahl, a = 2",
        &Dahl::new(10.0, 0.02, 2.0).unwrap(),
        0.002,
        0.0,
        1.0 / 60.0,
    );
    let second = BlimanSorine::second_order(0.03, 0.01, 0.2, z).unwrap();
    // The mean over a step counts the way to the steady state, which is behind it after the first
    // steps.
    settles("Bliman-Sorine", &second, z, 0.0, rounding);
    let armstrong = Armstrong::<f64, 16>::new(10.0, 0.020, 0.0029, 0.006, 0.3, 0.02, 1.0).unwrap();
    settles("Armstrong", &armstrong, z, 0.05, rounding);
    settles(
        "general static",
        &GeneralStatic::new(g, 0.0029).unwrap(),
        z,
        0.0,
        rounding,
    );
    // Inside the band there is no steady friction: 1e-3 rad/s lies outside this one.
    let karnopp = Karnopp::new(0.020, 0.026, 0.0029, 1e-4).unwrap();
    settles("Karnopp", &karnopp, z, 0.0, rounding);
}

/// Bristles settle to a mean only: over 2000 reaches, at several speeds and steps.
#[test]
fn bristles_slide_at_their_mean() {
    let model = Bristle::<f64, 25>::new(2.0, 1e-3, 11).unwrap();
    let mut worst = 0.0_f64;
    for v in [1e-3, -1.0, 30.0_f64] {
        for per_step in [0.02, 0.5, 5.0] {
            let motion = Motion {
                velocity_rad_s: v,
                applied_nm: 0.0,
                dt_s: per_step * 1e-3 / v.abs(),
            };
            let steps = (2000.0 / per_step) as u32;
            let mut state = model.placed();
            let sum: f64 = (0..steps).map(|_| model.step(&mut state, motion)).sum();
            let mean = sum / f64::from(steps);
            worst = worst.max((mean / model.steady_state_nm(v) - 1.0).abs());
        }
    }
    // Scatter sqrt(2/25) over some 2000 independent samples is 0.6 %; four times that.
    println!("steady mean of the bristles: measured {worst:.1e}, limit 2.5e-2 (relative)");
    assert!(worst < 0.025, "{worst:e}");
}

/// A parameter that f32 and f64 hold alike, so that only the arithmetic differs.
fn p<T: Real>(value: f32) -> T {
    T::of(f64::from(value))
}

fn curve<T: Real>() -> Stribeck<T> {
    let shape = Shape::Gaussian {
        velocity_rad_s: p(0.3),
    };
    Stribeck::new(p(0.020), p(0.026), shape).unwrap()
}

/// Largest difference of torque over random motion, as a part of `scale_nm` plus `per_speed` |v|,
/// in roundings of f32 for each step made.
///
/// A step rounds its state a few times and does not enlarge what was there, so errors add up to a
/// few epsilon a step at worst. `spared` steps a run may differ by more: those where one precision
/// breaks away and the other not yet.
fn compare<A: Friction<f32>, B: Friction<f64>>(
    name: &str,
    single: &A,
    double: &B,
    scale_nm: f64,
    per_speed: f64,
    limit: f64,
) {
    let worst = Cell::new(0.0_f64);
    let mut runner = TestRunner::new_with_rng(
        cases(64),
        proptest::test_runner::TestRng::deterministic_rng(
            proptest::test_runner::RngAlgorithm::ChaCha,
        ),
    );
    runner
        .run(&sane(), |runs| {
            let (mut a, mut b) = (A::State::default(), B::State::default());
            let pairs = motions::<f32>(&runs).zip(motions::<f64>(&runs));
            for (i, (m32, m64)) in pairs.enumerate() {
                // The applied torque is rounded; the rest is the same number in both.
                let torque = f64::from(single.step(&mut a, m32));
                let error = (torque - double.step(&mut b, m64)).abs();
                let scale = scale_nm + per_speed * m64.velocity_rad_s.abs();
                let roundings = error / scale / f64::from(f32::EPSILON) / (i + 1) as f64;
                worst.set(worst.get().max(roundings));
                prop_assert!(roundings <= limit, "{name}: {roundings:.2} at {m64:?}");
            }
            Ok(())
        })
        .unwrap();
    let measured = worst.get();
    println!("f32 of {name}: measured {measured:.2}, limit {limit} (epsilon a step)");
}

#[test]
fn f32_follows_f64() {
    fn lugre<T: Real>() -> LuGre<T, Stribeck<T>> {
        let damping = Damping::Constant { nm_s_rad: p(0.076) };
        LuGre::new(curve(), p(10.53), damping, p(0.0029)).unwrap()
    }
    fn dahl<T: Real>(exponent: f32) -> Dahl<T> {
        Dahl::new(p(10.53), p(0.02), p(exponent)).unwrap()
    }
    fn second<T: Real>() -> BlimanSorine<T> {
        BlimanSorine::second_order(p(0.03), p(0.01), p(0.2), p(2e-3)).unwrap()
    }
    fn general<T: Real>() -> GeneralStatic<T, Stribeck<T>> {
        GeneralStatic::new(curve(), p(0.0029)).unwrap()
    }
    fn karnopp<T: Real>() -> Karnopp<T> {
        Karnopp::new(p(0.020), p(0.026), p(0.0029), p(0.01)).unwrap()
    }
    // z rounds three times, z_ss twice and the sum three times, eight in all if every one had the
    // same sign; of random sign and half an epsilon each they leave about 0.5 sqrt(8) = 1.4.
    compare("LuGre", &lugre(), &lugre(), 0.026, 0.076 + 0.0029, 2.0);
    for a in [0.0, 0.5, 1.0, 2.0] {
        // As many, with the power.
        compare(&format!("Dahl {a}"), &dahl(a), &dahl(a), 0.02, 0.0, 2.0);
    }
    // Two branches of 0.04 N m together; of the series only the last terms round at full size.
    compare("Bliman-Sorine", &second(), &second(), 0.04, 0.0, 2.0);
    // No state: a few roundings in the first step, and the same ever after.
    compare("general static", &general(), &general(), 0.026, 0.0029, 2.0);
    compare("Karnopp", &karnopp(), &karnopp(), 0.026, 0.0029, 2.0);
}

/// Armstrong's model jumps, and each precision may break away one step apart: a planned motion, and
/// those steps left out.
#[test]
fn f32_armstrong_follows_f64_but_for_its_break_aways() {
    fn model<T: Real>() -> Armstrong<T, 16> {
        Armstrong::new(
            p(10.53),
            p(0.02),
            p(0.0029),
            p(0.006),
            p(0.3),
            p(0.005),
            p(0.5),
        )
        .unwrap()
    }
    let (single, double) = (model::<f32>(), model::<f64>());
    let (mut a, mut b) = (Default::default(), Default::default());
    let (mut worst, mut apart, mut slips) = (0.0_f64, 0, 0);
    for i in 0..20_000_u16 {
        // A triangle of velocity, 4 s long, the same numbers in both precisions.
        let phase = f32::from(i % 4000);
        let v = (if phase < 2000.0 {
            phase - 1000.0
        } else {
            3000.0 - phase
        }) / 1024.0;
        let dt = 1e-3;
        let torque = single.step(
            &mut a,
            Motion {
                velocity_rad_s: v,
                applied_nm: 0.0,
                dt_s: dt,
            },
        );
        let before = b;
        let exact = double.step(
            &mut b,
            Motion {
                velocity_rad_s: f64::from(v),
                applied_nm: 0.0,
                dt_s: f64::from(dt),
            },
        );
        slips += u32::from(b.slips() && !before.slips());
        if a.slips() == b.slips() {
            worst = worst.max((f64::from(torque) - exact).abs());
        } else {
            apart += 1;
        }
    }
    // A stick lasts some ten steps here, and the spring rounds twice in each; sliding keeps no sum
    // but the phase of the delay, which turns into torque by the small slope of the curve only.
    let limit = 20.0 * 0.026 * f64::from(f32::EPSILON);
    println!(
        "f32 of Armstrong: measured {worst:.1e}, limit {limit:.1e} N m; {apart} of {slips} apart"
    );
    assert!(slips >= 9 && apart <= slips, "{apart} of {slips}");
    assert!(worst < limit, "{worst:e}");
}
