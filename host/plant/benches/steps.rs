//! Steps a second: elasto-plastic friction on a rigid axis in f64, the whole virtual axis, and both observers in f32.

use bristle_core::friction::{ElastoPlastic, Friction, Motion, elasto_plastic};
use bristle_core::observer::{Luenberger, TimeFree, luenberger, time_free};
use bristle_core::stribeck::{Shape, Stribeck, Table};
use bristle_plant::axis::{Axis, AxisConfig};
use bristle_plant::contact::contact;
use bristle_plant::drive::DriveConfig;
use bristle_plant::encoder::EncoderConfig;
use bristle_plant::mechanics::Mechanics;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

const STEPS: u64 = 1_000_000;
const COUNT: f64 = std::f64::consts::TAU / 16384.0;

fn friction() -> ElastoPlastic<f64, Stribeck<f64>> {
    let shape = Shape::Gaussian {
        velocity_rad_s: 0.3,
    };
    let curve = Stribeck::new(0.020, 0.026, shape).unwrap();
    ElastoPlastic::new(curve, 10.53, 0.076, 0.0029, 0.7).unwrap()
}

/// A square torque that keeps the axis going through stick, break-away, sliding and reversal.
fn torque(k: u64) -> f64 {
    if (k >> 13) & 1 == 0 { 0.035 } else { -0.035 }
}

fn rigid_axis<C: bristle_core::stribeck::Curve<f64>>(friction: &ElastoPlastic<f64, C>) -> f64 {
    let (mut v, mut q) = (0.0, 0.0);
    let mut state = elasto_plastic::State::default();
    let dt = 1e-5;
    let per_inertia = dt / 2.5246e-5;
    for k in 0..STEPS {
        let applied = torque(k);
        let motion = Motion {
            velocity_rad_s: v,
            applied_nm: applied,
            dt_s: dt,
        };
        let friction = friction.step(&mut state, motion);
        q += dt * v;
        v += per_inertia * (applied - friction);
    }
    q
}

/// The same with drive and encoder around it, ten steps a sample and no effects.
fn virtual_axis(friction: ElastoPlastic<f64, Stribeck<f64>>) -> f64 {
    let config = AxisConfig {
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
        steps: 10,
        seed: 1,
    };
    let mut axis = Axis::new(config, contact(friction), Vec::new());
    for k in 0..STEPS / 10 {
        axis.advance(torque(10 * k));
    }
    axis.truth().motion.position_rad
}

fn observers(
    luenberger: &Luenberger<f32, Table<f32>>,
    time_free: &TimeFree<f32, Table<f32>>,
    counts: &[i32],
) -> f32 {
    let mut a = luenberger::State::default();
    let mut b = time_free::State::default();
    for (k, &step) in counts.iter().enumerate() {
        let estimate = luenberger.step(&mut a, step, torque(k as u64) as f32);
        time_free.step(&mut b, step, estimate.velocity_rad_s);
    }
    a.estimate.z_rad + b.z_rad
}

/// Encoder steps of the axis under the same torque.
fn encoder_steps() -> Vec<i32> {
    let friction = friction();
    let (mut v, mut q) = (0.0, 0.0);
    let mut state = elasto_plastic::State::default();
    let mut last = 0_i64;
    (0..STEPS)
        .map(|k| {
            for _ in 0..10 {
                let motion = Motion {
                    velocity_rad_s: v,
                    applied_nm: 0.0,
                    dt_s: 1e-5,
                };
                q += 1e-5 * v;
                v += 1e-5 / 2.5246e-5 * (torque(k) - friction.step(&mut state, motion));
            }
            let now = (q / COUNT).floor() as i64;
            let step = (now - last) as i32;
            last = now;
            step
        })
        .collect()
}

fn benches(c: &mut Criterion) {
    let mut group = c.benchmark_group("steps");
    group.throughput(Throughput::Elements(STEPS));
    group.sample_size(20);
    let exact = friction();
    group.bench_function("elasto-plastic rigid axis f64, exact curve", |b| {
        b.iter(|| black_box(rigid_axis(black_box(&exact))));
    });
    group.bench_function("virtual axis", |b| {
        b.iter(|| black_box(virtual_axis(black_box(exact))));
    });
    let table: ElastoPlastic<f64, Table<f64>> = exact.tabulated(2.4).unwrap();
    group.bench_function("elasto-plastic rigid axis f64, table", |b| {
        b.iter(|| black_box(rigid_axis(black_box(&table))));
    });
    let single: ElastoPlastic<f32, Table<f32>> = exact.tabulated(2.4).unwrap();
    let settings = luenberger::Settings {
        inertia_kg_m2: 2.5246e-5_f32,
        rad_per_count: COUNT as f32,
        sample_time_s: 1e-4,
        l1_1_s: 1700.0,
        l2: 0.0,
        offset_nm: 0.0,
        max_speed_rad_s: 314.0,
        max_torque_nm: 1.0,
    };
    let luenberger = Luenberger::new(single, settings).unwrap();
    let time_free = TimeFree::new(single, COUNT as f32, 0.0314).unwrap();
    let counts = encoder_steps();
    group.bench_function("both observers f32", |b| {
        b.iter(|| black_box(observers(&luenberger, &time_free, black_box(&counts))));
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
