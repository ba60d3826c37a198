//! Where the elasto-plastic model and the observers built on it settle: the right steady state, and no drift below
//! break-away.

mod common;

use bristle_core::Real;
use bristle_core::friction::elasto_plastic::State;
use bristle_core::friction::elasto_plastic_fixed::{self, ElastoPlasticFixed, Scaling};
use bristle_core::friction::{Friction, Motion};
use bristle_core::observer::luenberger::{self, Luenberger, Settings};
use bristle_core::observer::time_free::{self, TimeFree};
use bristle_core::observer::time_free_fixed::{self, TimeFreeFixed};
use bristle_core::stribeck::Curve;
use common::{BENCH, Parameters};
use fixed::types::I16F16;

const INERTIA: f64 = 2.5246e-5;
const COUNT: f64 = core::f64::consts::TAU / 16384.0;
const SPEEDS: [f64; 5] = [1e-2, 0.1, -0.3, 2.0, -40.0];
const SAMPLE_TIMES_S: [f64; 3] = [1e-5, 1e-4, 3e-4];

/// Sliding on for sixty deflections and at least so many steps that their implicit decay leaves nothing of the start.
fn steps_to_settle(travel_per_step: f64, z_max: f64) -> u32 {
    (60.0 * z_max / travel_per_step).ceil().max(40.0) as u32
}

/// What rounding leaves of a steady z, as a share of it: a step rounds sum, denominator, quotient and product by half an
/// epsilon each, and its decay takes back dq/z of what is off. In f32 that is where a slow slide stops short of z_ss.
fn rounding_of_z(epsilon: f64, travel_per_step: f64) -> f64 {
    4.0 * 0.5 * epsilon * (0.026 / 10.53 / travel_per_step).max(1.0) + 4.0 * epsilon
}

/// Keeps the largest share that a measured figure takes of its limit, for the line that says so.
#[derive(Default)]
struct Worst {
    share: f64,
    measured: f64,
    limit: f64,
}

impl Worst {
    fn see(&mut self, measured: f64, limit: f64) {
        let share = measured / limit;
        // A NaN is the worst of all.
        if share > self.share || share.is_nan() {
            (self.share, self.measured, self.limit) = (share, measured, limit);
        }
    }

    fn within(&self, name: &str) {
        println!(
            "{name}: measured {:.1e}, limit {:.1e}",
            self.measured, self.limit
        );
        assert!(
            self.share <= 1.0,
            "{name}: {:e}/{:e}",
            self.measured,
            self.limit
        );
    }
}

fn model_in<T: Real>(name: &str) {
    let model = BENCH.model::<T>();
    let z_max = model.z_max_rad().to_f64();
    let (mut worst_f, mut worst_z) = (Worst::default(), Worst::default());
    for v in SPEEDS {
        for dt in SAMPLE_TIMES_S {
            let motion = Motion {
                velocity_rad_s: T::of(v),
                applied_nm: T::ZERO,
                dt_s: T::of(dt),
            };
            let mut state = State::default();
            let torque = (0..steps_to_settle(v.abs() * dt, z_max))
                .fold(T::ZERO, |_, _| model.step(&mut state, motion))
                .to_f64();
            // f_ss with its viscous part, written out from the bench's numbers.
            let level = 0.020 + 0.006 * (-(v / 0.3) * (v / 0.3)).exp();
            let f_ss = level * v.signum() + 0.0029 * v;
            let limit = rounding_of_z(T::EPSILON.to_f64(), v.abs() * dt);
            // z through sigma0 and, by the share of z_ss, through sigma1; the viscous part rounds twice more.
            let scale = level + (0.076 + 0.0029) * v.abs();
            worst_f.see((torque - f_ss).abs() / scale, limit);
            worst_z.see(
                (state.z_rad.to_f64() * 10.53 / (level * v.signum()) - 1.0).abs(),
                limit,
            );
        }
    }
    worst_f.within(&format!("{name}, steady torque (share)"));
    worst_z.within(&format!("{name}, steady z (share)"));
}

#[test]
fn the_model_slides_at_f_ss() {
    model_in::<f64>("f64");
    model_in::<f32>("f32");
}

fn observers_in<T: Real>(name: &str) {
    let model = BENCH.model::<T>();
    let z_max = model.z_max_rad().to_f64();
    let epsilon = T::EPSILON.to_f64();
    let l1 = 1700.0;
    let mut worst = [Worst::default(), Worst::default(), Worst::default()];
    for v in SPEEDS {
        for sample_time_s in SAMPLE_TIMES_S {
            // An encoder of which every sample sees three counts: without quantisation the steady state is exact.
            let count = v.abs() * sample_time_s / 3.0;
            let counts = if v < 0.0 { -3 } else { 3 };
            let z_ss = model.z_ss_rad(T::of(v.abs())).to_f64() * v.signum();
            let steps = steps_to_settle(v.abs() * sample_time_s, z_max);
            let limit = rounding_of_z(epsilon, v.abs() * sample_time_s);

            let time_free = TimeFree::new(model, T::of(count), T::of(1.0)).unwrap();
            let mut state = time_free::State::default();
            for _ in 0..steps {
                time_free.step(&mut state, counts, T::of(v));
            }
            worst[0].see((state.z_rad.to_f64() / z_ss - 1.0).abs(), limit);

            let settings = Settings {
                inertia_kg_m2: T::of(INERTIA),
                rad_per_count: T::of(count),
                sample_time_s: T::of(sample_time_s),
                l1_1_s: T::of(l1),
                l2: T::ZERO,
                offset_nm: T::ZERO,
                max_speed_rad_s: T::of(314.0),
                max_torque_nm: T::of(1.0),
            };
            let luenberger = Luenberger::new(model, settings).unwrap();
            let torque = model.steady_state_nm(T::of(v));
            let mut state = luenberger::State::default();
            // And half a second for the slowest mode of the observer itself, in the fall of the curve.
            for _ in 0..steps + (0.5 / sample_time_s) as u32 {
                luenberger.step(&mut state, counts, torque);
            }
            assert_eq!(state.rejected, 0);
            let estimate = state.estimate;
            // A torque that is off moves the velocity by 1/(J l1 + sigma2 + g'), g' being -0.0172 where it is steepest:
            // sigma0 z by the share above, sigma1/T dz by the rounding of two z, the rest by their own.
            let off_nm = 0.026 * limit
                + 0.076 / sample_time_s * 2.0 * epsilon * z_max
                + 4.0 * epsilon * (0.026 + 0.0029 * v.abs());
            let off_v = off_nm / (INERTIA * l1 + 0.0029 - 0.0172) + 4.0 * epsilon * v.abs();
            worst[1].see((estimate.velocity_rad_s.to_f64() - v).abs(), off_v);
            // And where z_ss falls with velocity, it is off with it.
            let off_z = limit + 0.0172 / 0.020 * off_v;
            worst[2].see((estimate.z_rad.to_f64() / z_ss - 1.0).abs(), off_z);
        }
    }
    worst[0].within(&format!("{name}, z of time-free (share)"));
    worst[1].within(&format!("{name}, velocity of Luenberger, rad/s"));
    worst[2].within(&format!("{name}, z of Luenberger (share)"));
}

#[test]
fn both_observers_slide_at_z_ss() {
    observers_in::<f64>("f64");
    observers_in::<f32>("f32");
}

const SCALING: Scaling = Scaling {
    rad_per_count: COUNT,
    sample_time_s: 1e-4,
    full_scale_nm: 0.1,
    top_speed_rad_s: 2.4,
};

#[test]
fn fixed_point_slides_at_f_ss() {
    let model = BENCH.model::<f64>();
    let fixed = ElastoPlasticFixed::new(&model, &SCALING).unwrap();
    let observer = TimeFreeFixed::new(fixed, 1000).unwrap();
    let (mut worst_z, mut worst_observed, mut worst_f) = (0.0_f64, 0.0_f64, 0.0_f64);
    // Counts a sample: 0.08 to 20 rad/s, on the nodes of the table and off them.
    for speed in [0.02, 0.05, 0.3, 0.625, 5.0] {
        for sign in [1.0, -1.0] {
            let displacement = I16F16::from_num(sign * speed);
            let mut state = elasto_plastic_fixed::State::default();
            let mut torque = 0.0;
            for _ in 0..steps_to_settle(speed, 6.5) {
                torque = fixed.step(&mut state, displacement).to_num::<f64>() * 0.1;
            }
            let v = displacement.to_num::<f64>() * COUNT / 1e-4;
            let z_ss = sign * model.z_ss_rad(v.abs()) / COUNT;
            worst_z = worst_z.max((state.z_counts.to_num::<f64>() - z_ss).abs());
            worst_f = worst_f.max((torque - model.steady_state_nm(v)).abs());
            let mut observed = time_free_fixed::State::default();
            for _ in 0..100 {
                observer.step(&mut observed, sign as i32, displacement);
            }
            worst_observed = worst_observed.max((observed.z_counts.to_num::<f64>() - z_ss).abs());
        }
    }
    // The table is linear between its points, off by h^2/8 max|g''| = (2.4/64)^2/8 2 0.006/0.3^2 N m. A step of 0.02
    // count rounds z by half a bit and takes back 0.02/6.5 of what it is off.
    let table_nm = (2.4_f64 / 64.0).powi(2) / 8.0 * 2.0 * 0.006 / 0.09;
    let limit_z = table_nm / 10.53 / COUNT + 6.5 / 0.02 * 2.0_f64.powi(-17);
    // dz of a step is known to a bit of z, which sigma1/T turns into torque.
    let limit_f = limit_z * 10.53 * COUNT + 0.076 * COUNT / 1e-4 * 2.0_f64.powi(-16);
    println!(
        "fixed: z of the model {worst_z:.1e}/{limit_z:.1e} count, of time-free {worst_observed:.1e}/{limit_z:.1e} count, \
         torque {worst_f:.1e}/{limit_f:.1e} N m"
    );
    assert!(worst_z <= limit_z && worst_observed <= limit_z && worst_f <= limit_f);
}

/// w = q - z over a million steps of an axis under a load that swings between 0.3 and 0.65 F_S, as the share of z_ss
/// that it moved by; `breakaway` decides whether that is below break-away.
fn drift_under_load<T: Real>(breakaway: f64) -> f64 {
    let p = Parameters { breakaway, ..BENCH };
    let model = p.model::<T>();
    let dt = T::of(1e-5);
    let per_inertia = T::of(1e-5 / INERTIA);
    let mut state = State::<T>::default();
    let mut v = T::ZERO;
    // Position in f64: what is measured is the model, not the sum of its displacements.
    let mut q = 0.0_f64;
    let mut start = 0.0;
    for k in 0..1_000_000 {
        if k == 10_000 {
            start = q - state.z_rad.to_f64();
        }
        // 200 periods of 5000 steps; the load sets in over the first one.
        let t = f64::from(k) / 5000.0;
        let load = 0.026 * (0.475 + 0.175 * (core::f64::consts::TAU * t).sin()) * t.min(1.0);
        q += (v * dt).to_f64();
        let motion = Motion {
            velocity_rad_s: v,
            applied_nm: T::ZERO,
            dt_s: dt,
        };
        let friction = model.step(&mut state, motion);
        v += per_inertia * (T::of(load) - friction);
    }
    (q - state.z_rad.to_f64() - start).abs() * 10.53 / 0.020
}

#[test]
fn nothing_drifts_below_break_away() {
    // Below break-away a step is one sum, so w moves by its rounding, half an epsilon of z at most. The load swings to
    // and fro, so their signs are as good as random: sqrt(1e6) of them, four times over.
    for (name, drift, epsilon) in [
        ("f64", drift_under_load::<f64>(0.7), f64::EPSILON),
        ("f32", drift_under_load::<f32>(0.7), f64::from(f32::EPSILON)),
    ] {
        let limit = 4.0 * 1e3 * 0.5 * 1.3 * epsilon;
        println!("{name}: w drifts {drift:.1e}/{limit:.1e} z_ss in 1e6 steps under load");
        assert!(drift <= limit, "{name}: {drift:e}");
    }
    // The same load on the same axis without an elastic range, which is LuGre, and it walks off.
    let walked = drift_under_load::<f64>(0.0);
    println!("without an elastic range: {walked:.1e} z_ss");
    assert!(walked > 0.1, "{walked:e}");
}

#[test]
fn observers_do_not_drift_below_break_away() {
    // z_ba is 0.7 z_ss(0) = 4.5 counts at rest; a walk within 4 counts of the middle stays elastic.
    let model = BENCH.model::<f64>();
    let fixed = ElastoPlasticFixed::new(&model, &SCALING).unwrap();
    let exact = TimeFreeFixed::new(fixed, 1000).unwrap();
    let single = TimeFree::new(BENCH.model::<f32>(), COUNT as f32, 1.0).unwrap();
    let double = TimeFree::new(model, COUNT, 1.0).unwrap();
    let mut states = (
        time_free_fixed::State::default(),
        time_free::State::<f32>::default(),
        time_free::State::<f64>::default(),
        elasto_plastic_fixed::State::default(),
    );
    let (mut q, mut bits) = (0_i32, 1_u32);
    let (mut worst_single, mut worst_double) = (0.0_f64, 0.0_f64);
    for _ in 0..1_000_000 {
        bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let step = if bits >> 31 == 0 { 1 } else { -1 };
        if (q + step).abs() > 4 {
            continue;
        }
        q += step;
        exact.step(&mut states.0, step, I16F16::ZERO);
        single.step(&mut states.1, step, 0.0);
        double.step(&mut states.2, step, 0.0);
        // The model sees a hundredth of that as its displacement: slow enough to be at rest on the curve.
        let part = I16F16::from_num(f64::from(step) * 0.01);
        fixed.step(&mut states.3, part);
        // Not a bit: a count is a whole number here.
        assert_eq!(states.0.z_counts, I16F16::from_num(q));
        assert_eq!(states.3.z_counts, I16F16::from_num(0.01) * q);
        let angle = f64::from(q) * COUNT;
        let off = |z: f64| (z - angle).abs() * 10.53 / 0.020;
        worst_single = worst_single.max(off(f64::from(states.1.z_rad)));
        worst_double = worst_double.max(off(states.2.z_rad));
    }
    // A random walk of sums, half an epsilon of z each at worst: sqrt(1e6) of them, four times over.
    let limit = |epsilon: f64| 4.0 * 1e3 * 0.5 * epsilon;
    let (limit_single, limit_double) = (limit(f64::from(f32::EPSILON)), limit(f64::EPSILON));
    println!(
        "time-free w: f32 {worst_single:.1e}/{limit_single:.1e}, f64 {worst_double:.1e}/{limit_double:.1e} z_ss, fixed 0/0"
    );
    assert!(worst_single <= limit_single && worst_double <= limit_double);
    assert!(BENCH.curve::<f64>().stiction_nm() * 0.7 / 10.53 > 4.0 * COUNT);
}
