//! The virtual axis against closed forms and against itself.

use bristle_core::friction::ElastoPlastic;
use bristle_core::friction::coulomb::Coulomb;
use bristle_core::stribeck::{Shape, Stribeck};
use bristle_plant::Unit;
use bristle_plant::axis::{Axis, AxisConfig, steps_for};
use bristle_plant::contact::{Contact, contact};
use bristle_plant::drive::DriveConfig;
use bristle_plant::effect;
use bristle_plant::encoder::EncoderConfig;
use bristle_plant::mechanics::{Load, Mechanics};
use std::collections::BTreeMap;

const COUNT: f64 = std::f64::consts::TAU / 16384.0;

fn config(steps: u32) -> AxisConfig {
    AxisConfig {
        mechanics: Mechanics {
            inertia_kg_m2: 2.5246e-5,
            load: None,
        },
        drive: DriveConfig::default(),
        encoder: EncoderConfig {
            rad_per_count: COUNT,
            counts_per_turn: Some(16384),
            noise_rad: 0.0,
        },
        torque_noise_nm: 0.0,
        sample_time_s: 1e-4,
        steps,
        seed: 1,
    }
}

fn bench_friction() -> Box<dyn Contact> {
    let shape = Shape::Gaussian {
        velocity_rad_s: 0.3,
    };
    let curve = Stribeck::new(0.020, 0.026, shape).unwrap();
    contact(ElastoPlastic::new(curve, 10.53, 0.076, 0.0029, 0.7).unwrap())
}

/// Positions over 2 s of the thesis's sine.
fn sine(config: AxisConfig) -> Vec<f64> {
    let mut axis = Axis::new(config, bench_friction(), Vec::new());
    (0..20_000)
        .map(|k| {
            axis.advance(0.035 * (std::f64::consts::TAU * f64::from(k) * 1e-4).sin());
            axis.truth().motion.position_rad
        })
        .collect()
}

#[test]
fn halving_the_step() {
    let steps = steps_for(1e-4, 0.0789 / 2.5246e-5);
    let coarse = sine(config(steps));
    let fine = sine(config(2 * steps));
    let travel = fine.iter().copied().fold(0.0, f64::max);
    let worst = coarse
        .iter()
        .zip(&fine)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    // Stated for the axis: a hundredth of a percent of the travel.
    let limit = 1e-4 * travel;
    println!("halving {steps} steps: {worst:.2e}/{limit:.2e} rad of {travel:.2} rad");
    assert!(worst < limit);
    let finer = sine(config(4 * steps));
    let next = fine
        .iter()
        .zip(&finer)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    // First order: halving halves it.
    assert!((1.7..2.3).contains(&(worst / next)), "{}", worst / next);
}

#[test]
fn in_fewer_steps_a_stiff_spring_turns_at_its_own_pace() {
    // 10^4 rad/s at 1 kHz asks for 500 steps; in 50 a step turns it by a fifth of a rad.
    let values = [("stiffness_nm_rad", 2.5246e-5 * 1e8), ("rest_rad", 0.0)];
    let values: BTreeMap<String, f64> = values.map(|(n, x)| (n.to_string(), x)).into();
    let swings = |most: u32| {
        let spring = effect::build("mechanics.spring", &values, Unit::Rotary).unwrap();
        let curve = Stribeck::constant(1e-12).unwrap();
        let free = contact(ElastoPlastic::new(curve, 1e-6, 0.0, 0.0, 0.5).unwrap());
        let slow = AxisConfig {
            sample_time_s: 1e-3,
            ..config(4)
        };
        let mut axis = Axis::new(slow, free, vec![spring])
            .in_at_most(most)
            .starting_at(1e-3, 0.0);
        let positions_rad: Vec<f64> = (0..200)
            .map(|_| {
                axis.advance(0.0);
                axis.truth().motion.position_rad
            })
            .collect();
        (axis.config().steps, positions_rad)
    };
    let ((many, fine), (few, coarse)) = (swings(1000), swings(50));
    assert_eq!((many, few), (500, 50));
    // Symplectic: the swing of 1 mrad keeps its size to a quarter of the square of a fifth.
    let largest = |swing: &[f64]| swing.iter().fold(0.0, |most: f64, q| most.max(q.abs()));
    assert!((largest(&fine) - 1e-3).abs() < 1e-5);
    assert!((largest(&coarse) - 1e-3).abs() < 1e-5 + 1e-3 * 0.25 * 0.04);
}

#[test]
fn positions_lag_no_torque_however_few_the_steps() {
    let curve = Stribeck::constant(1e-12).unwrap();
    let free = || contact(ElastoPlastic::new(curve, 1e-6, 0.0, 0.0, 0.5).unwrap());
    for steps in [1, 7] {
        let mut axis = Axis::new(config(steps), free(), Vec::new());
        let (mut q, mut v) = (0.0, 0.0);
        for k in 0..1000 {
            let torque_nm = 1e-3 * (0.1 * f64::from(k)).sin();
            axis.advance(torque_nm);
            // Constant acceleration over a sample.
            let changes = 1e-4 * torque_nm / 2.5246e-5;
            q += 1e-4 * (v + 0.5 * changes);
            v += changes;
            let lags = axis.truth().motion.position_rad - q;
            // 1 pN m of friction over 0.1 s.
            assert!(lags.abs() < 1e-9, "{steps} steps, sample {k}: {lags:e} rad");
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let noisy = |seed| AxisConfig {
        torque_noise_nm: 1e-4,
        seed,
        ..config(4)
    };
    assert_eq!(sine(noisy(7)), sine(noisy(7)));
    assert_ne!(sine(noisy(7)), sine(noisy(8)));
}

#[test]
fn two_inertias_ring_at_their_own_frequency() {
    let (motor, load, k) = (2e-5, 3e-5, 10.0);
    let mut config = config(50);
    config.mechanics = Mechanics {
        inertia_kg_m2: motor,
        load: Some(Load {
            inertia_kg_m2: load,
            stiffness_nm_rad: k,
            damping_nm_s_rad: 0.0,
            gap_rad: 0.0,
            friction_on_motor: false,
        }),
    };
    let curve = Stribeck::constant(1e-12).unwrap();
    let free = ElastoPlastic::new(curve, 1e-6, 0.0, 0.0, 0.5).unwrap();
    let mut axis = Axis::new(config, contact(free), Vec::new());
    axis.advance(0.1);
    let mut last = 0.0;
    let mut crossings = Vec::new();
    for i in 0..10_000 {
        axis.advance(0.0);
        let motion = axis.truth().motion;
        let twist = motion.position_rad - motion.load_position_rad;
        if last < 0.0 && twist >= 0.0 {
            crossings.push(f64::from(i) - twist / (twist - last));
        }
        last = twist;
    }
    let periods = (crossings.len() - 1) as f64;
    let hz = periods / (1e-4 * (crossings.last().unwrap() - crossings[0]));
    let expected = (k * (1.0 / motor + 1.0 / load)).sqrt() / std::f64::consts::TAU;
    // Symplectic Euler is off by (w h)^2/24, here 1e-7; the linear interpolation of crossings by a few 1e-5.
    assert!((hz / expected - 1.0).abs() < 1e-4, "{hz} {expected}");
}

#[test]
fn friction_of_the_load_holds_a_rigid_limit() {
    // A coupling a hundred times stiffer than the bristles makes two inertias behave as their sum.
    let mut split = config(400);
    split.mechanics = Mechanics {
        inertia_kg_m2: 1.2623e-5,
        load: Some(Load {
            inertia_kg_m2: 1.2623e-5,
            stiffness_nm_rad: 1e4,
            damping_nm_s_rad: 0.2,
            gap_rad: 0.0,
            friction_on_motor: false,
        }),
    };
    let (two, one) = (sine(split), sine(config(400)));
    let worst = two
        .iter()
        .zip(&one)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    // Twist under 0.035 N m of 1e4 N m/rad is 3.5e-6 rad; a count is 3.8e-4.
    assert!(worst < COUNT, "{worst:e}");
}

#[test]
fn effects_on_friction_let_a_static_axis_rest() {
    // Torque below break-away, raised or lowered by effects that act on friction: nothing may creep.
    for (id, name, value) in [
        ("friction.asymmetry", "share", 0.3),
        ("friction.asymmetry", "share", -0.3),
        ("friction.position", "slope_1_rad", 0.2),
        ("friction.dwell", "rise_share", 0.5),
        ("friction.load", "share", 0.2),
    ] {
        let values = BTreeMap::from([(name.to_string(), value)]);
        let effect = effect::build(id, &values, Unit::Rotary).unwrap();
        let friction = contact(Coulomb::new(0.020).unwrap());
        let mut axis = Axis::new(config(10), friction, vec![effect]);
        for k in 0..2000 {
            axis.advance(if k < 1000 { 0.013 } else { -0.013 });
        }
        assert_eq!(axis.truth().motion.position_rad, 0.0, "{id} {value}");
    }
}

#[test]
fn friction_that_grows_with_load_does_not_shake_damped_bristles() {
    // mu sigma1/sigma0 of half a millisecond and of two.
    for damping_nm_s_rad in [0.16, 0.6] {
        let curve = Stribeck::constant(0.2).unwrap();
        let bristles = ElastoPlastic::new(curve, 60.0, damping_nm_s_rad, 7e-3, 0.6).unwrap();
        let entry = effect::ALL
            .iter()
            .find(|entry| entry.id == "friction.load")
            .unwrap();
        let mut config = config(20);
        config.mechanics.inertia_kg_m2 = 1e-3;
        let load = (entry.build)(&[0.2, 8e-4], Unit::Rotary);
        let mut axis = Axis::new(config, contact(bristles), vec![load]);
        let torque_nm = 0.4;
        let friction_nm: Vec<f64> = (0..30_000)
            .map(|_| {
                axis.advance(torque_nm);
                axis.truth().friction_nm
            })
            .collect();
        // Its time constant is 0.14 s: after two seconds all of the torque goes into friction.
        for friction_nm in &friction_nm[20_000..] {
            assert!((friction_nm - torque_nm).abs() < 1e-5, "{friction_nm}");
        }
        let velocity_rad_s = axis.truth().motion.velocity_rad_s;
        // 0.2 + 0.2 of the torque + 7e-3 v.
        assert!(
            (velocity_rad_s - 0.12 / 7e-3).abs() < 1e-3,
            "{velocity_rad_s}"
        );
    }
}
