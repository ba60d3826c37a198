//! Fixed point and f32 against f64 of the same law, on the bench axis under the experiments that the observers are for.
//!
//! The virtual axis under the f64 tick gives counts, torque and velocity; every pair then gets the same inputs and the
//! same parameters, those that f32 holds, so that only the arithmetic differs. Each figure is printed as
//! measured/limit; z as a share of z_ss at speed, which is 5 counts.
//!
//! Limits take roundings as independent: each is even within half a last place either way, so n of them leave
//! sqrt(n/12) places rms; the largest of 40 000 samples stays within four times that. Cuts, which all fall the same way,
//! are counted in full.

mod common;

use bristle_core::experiment::Experiment;
use bristle_core::friction::elasto_plastic::{self, ElastoPlastic};
use bristle_core::friction::elasto_plastic_fixed::{self, ElastoPlasticFixed, Scaling};
use bristle_core::friction::{Friction, Motion};
use bristle_core::observer::luenberger::{self, Luenberger, Settings};
use bristle_core::observer::time_free::{self, TimeFree};
use bristle_core::observer::time_free_fixed::{self, TimeFreeFixed};
use bristle_core::real::Real;
use bristle_core::stribeck::{Curve, Table};
use bristle_gap::axis_file::FrictionModel;
use bristle_gap::believed::Noise;
use bristle_plant::Rig;
use common::{T, axis};
use fixed::types::I16F16;

/// One rounding of f32, rms, as a share of what is rounded.
const ROUNDING: f64 = 0.289 * f32::EPSILON as f64;
/// What the largest of all samples is to their rms.
const PEAK: f64 = 4.0;
/// A bit of I16F16, counts or counts a sample.
const BIT: f64 = 1.0 / 65536.0;
/// Top of the Stribeck table, 8 v_s, rad/s.
const TOP: f64 = 2.4;
const FULL_SCALE_NM: f64 = 0.1;

/// What a sample gave to the models and observers.
#[derive(Clone, Copy)]
struct Input {
    step_counts: i32,
    /// On the rotor during the sample.
    torque_nm: f32,
    /// Of the axis itself.
    velocity_rad_s: f32,
    /// As the interrupt estimates it.
    estimate_rad_s: f32,
}

/// The experiments by name, 4 s of each.
fn records() -> Vec<(&'static str, Vec<Input>)> {
    let bench = axis("bench.toml");
    let play = |experiment| {
        let plant = bench
            .axis(FrictionModel::ElastoPlastic, T, Noise::default(), 1)
            .unwrap();
        let rig = Rig::new(bench.tick::<f64>(T).unwrap(), plant, experiment);
        let inputs: Vec<Input> = rig
            .take(40_000)
            .map(|record| Input {
                step_counts: record.sample.step_counts,
                torque_nm: record.truth.torque_nm as f32,
                velocity_rad_s: record.truth.motion.velocity_rad_s as f32,
                estimate_rad_s: record.sample.luenberger.velocity_rad_s as f32,
            })
            .collect();
        // It moves both ways, or nothing would be compared.
        assert!(inputs.iter().any(|i| i.velocity_rad_s > 0.3));
        assert!(inputs.iter().any(|i| i.velocity_rad_s < -0.3));
        inputs
    };
    vec![
        (
            "sine",
            play(Experiment::Sine {
                amplitude_nm: 0.035,
                period_ticks: 10_000,
            }),
        ),
        (
            "reversals",
            play(Experiment::Reversals {
                amplitude_rad: 0.3,
                period_ticks: 5_000,
            }),
        ),
        (
            "break-away",
            play(Experiment::RestAndBreakAway {
                peak_nm: 0.04,
                ramp_ticks: 4_000,
                dwell_ticks: 1_000,
            }),
        ),
    ]
}

type Model<T> = ElastoPlastic<T, Table<T>>;

/// The model of the interrupt, and the same numbers in f64.
fn models() -> (Model<f32>, Model<f64>) {
    let single: Model<f32> = axis("bench.toml")
        .elasto_plastic()
        .unwrap()
        .tabulated(TOP)
        .unwrap();
    let double = single.curve().cast::<f64>();
    let double = ElastoPlastic::new(
        double,
        single.stiffness_nm_rad().into(),
        single.damping_nm_s_rad().into(),
        single.viscous_nm_s_rad().into(),
        single.breakaway_ratio().into(),
    )
    .unwrap();
    (single, double)
}

fn z_ss(model: &Model<f64>) -> f64 {
    model.curve().coulomb_nm() / model.stiffness_nm_rad()
}

/// Largest and mean-square difference.
#[derive(Default)]
struct Difference {
    most: f64,
    squares: f64,
    samples: u32,
}

impl Difference {
    fn see(&mut self, a: f64, b: f64) {
        let difference = (a - b).abs();
        // Not `max`, which would drop a NaN.
        if difference > self.most || difference.is_nan() {
            self.most = difference;
        }
        self.squares += difference * difference;
        self.samples += 1;
    }

    /// Both below their limits; what they are of, and their unit, go into the printed line.
    fn within(&self, name: &str, unit: &str, most: f64, rms: f64) {
        let root = (self.squares / f64::from(self.samples)).sqrt();
        println!(
            "{name}: most {:.1e}/{most:.1e}, rms {root:.1e}/{rms:.1e} {unit}",
            self.most
        );
        assert!(
            self.samples == 40_000 && self.most <= most && root <= rms,
            "{name}"
        );
    }
}

/// How long rounding of z may add up before sliding forgets it: the longest stretch between samples of steady sliding,
/// and the fastest that the axis is in one.
#[derive(Default)]
struct Memory {
    now: u32,
    longest: u32,
    fastest_rad_s: f64,
}

impl Memory {
    fn see(&mut self, z: f64, z_ss: f64, speed_rad_s: f64) {
        // At 0.99 z_ss alpha is 1 to 3e-3, and what is off decays with every z_ss of travel.
        if z.abs() > 0.99 * z_ss {
            self.now = 0;
        } else {
            self.now += 1;
            self.fastest_rad_s = self.fastest_rad_s.max(speed_rad_s);
        }
        self.longest = self.longest.max(self.now);
    }

    fn samples(&self) -> f64 {
        f64::from(self.longest)
    }

    /// Torque by the share of z_ss that z is off: sigma0, and sigma1 v as long as it is not forgotten.
    fn torque_by_z_nm(&self) -> f64 {
        0.020 + 0.076 * self.fastest_rad_s
    }
}

fn motion<T: Real>(velocity: T, dt: T) -> Motion<T> {
    Motion {
        velocity_rad_s: velocity,
        applied_nm: T::ZERO,
        dt_s: dt,
    }
}

#[test]
fn f32_model() {
    let (single, double) = models();
    for (name, record) in records() {
        let (mut a, mut b) = Default::default();
        let (mut z, mut torque, mut memory) = (
            Difference::default(),
            Difference::default(),
            Memory::default(),
        );
        let mut fastest = 0.0_f64;
        for input in record {
            let v = f64::from(input.velocity_rad_s);
            let single_nm = single.step(&mut a, motion(input.velocity_rad_s, T as f32));
            let double_nm = double.step(&mut b, motion(v, f64::from(T as f32)));
            let b: &elasto_plastic::State<f64> = &b;
            z.see(f64::from(a.z_rad) / z_ss(&double), b.z_rad / z_ss(&double));
            torque.see(f64::from(single_nm), double_nm);
            memory.see(b.z_rad, double.z_ss_rad(v.abs()), v.abs());
            fastest = fastest.max(v.abs());
        }
        // A step rounds z and dq, of F_S/F_C = 1.3 z_ss at most.
        let rms = 1.3 * ROUNDING * (2.0 * memory.samples()).sqrt();
        z.within(&format!("{name}: f32 model, z"), "z_ss", PEAK * rms, rms);
        // And while it slides, sigma1 v and sigma1 v times the plastic share, a quotient and a product, are each rounded.
        let per_z = memory.torque_by_z_nm();
        let rounds = 2.0 * ROUNDING * (0.026 + 0.0789 * fastest);
        torque.within(
            &format!("{name}: f32 model, torque"),
            "N m",
            PEAK * (per_z * rms + rounds),
            per_z * rms + rounds,
        );
    }
}

#[test]
fn fixed_point_model() {
    let (_, double) = models();
    let count = axis("bench.toml").rad_per_count();
    let scaling = Scaling {
        rad_per_count: count,
        sample_time_s: T,
        full_scale_nm: FULL_SCALE_NM,
        top_speed_rad_s: TOP,
    };
    let fixed = ElastoPlasticFixed::new(&double, &scaling).unwrap();
    let z_ss_counts = z_ss(&double) / count;
    for (name, record) in records() {
        let mut a = elasto_plastic_fixed::State::default();
        let mut b = elasto_plastic::State::<f64>::default();
        let (mut z, mut torque, mut memory) = (
            Difference::default(),
            Difference::default(),
            Memory::default(),
        );
        for input in record {
            let displacement = I16F16::from_num(f64::from(input.velocity_rad_s) * T / count);
            // What the fixed-point model was given, exactly.
            let v = displacement.to_num::<f64>() * count / T;
            let fixed_nm = fixed.step(&mut a, displacement).to_num::<f64>() * FULL_SCALE_NM;
            let double_nm = double.step(&mut b, motion(v, T));
            z.see(
                a.z_counts.to_num::<f64>() / z_ss_counts,
                b.z_rad / z_ss(&double),
            );
            torque.see(fixed_nm, double_nm);
            memory.see(b.z_rad, double.z_ss_rad(v.abs()), v.abs());
        }
        // An elastic step is exact. Others round z to a bit, and decay and its inverse are cut three times to 24 bits:
        // at most all of the stretch that remembers.
        let steps = memory.samples();
        let cuts = 3.0 * 2.0_f64.powi(-24) * steps;
        let rounds = 0.289 * BIT / z_ss_counts * steps.sqrt();
        let (most, rms) = (PEAK * rounds + cuts, rounds + cuts);
        z.within(&format!("{name}: fixed model, z"), "z_ss", most, rms);
        // dz is known to the rounding of two z, half a bit each, and sigma1/T makes torque of it. Coefficients of 24 bits
        // add 2^-25 full scales for each count of z and dz, eight at most.
        let bit_nm = 0.076 / T * count * BIT;
        let coefficients = 3.0 * 8.0 * FULL_SCALE_NM * 2.0_f64.powi(-25);
        let per_z = memory.torque_by_z_nm();
        torque.within(
            &format!("{name}: fixed model, torque"),
            "N m",
            per_z * most + bit_nm + coefficients,
            per_z * rms + 0.289 * 1.42 * bit_nm + coefficients,
        );
    }
}

#[test]
fn time_free_observer() {
    let (single, double) = models();
    let bench = axis("bench.toml");
    let count = f64::from(bench.rad_per_count() as f32);
    let scaling = Scaling {
        rad_per_count: count,
        sample_time_s: T,
        full_scale_nm: FULL_SCALE_NM,
        top_speed_rad_s: TOP,
    };
    let fixed = ElastoPlasticFixed::new(&double, &scaling).unwrap();
    let z_ss_counts = z_ss(&double) / count;
    let in_f32 = TimeFree::new(single, count as f32, 1.0).unwrap();
    let in_f64 = TimeFree::new(double, count, 1.0).unwrap();
    let in_fixed = TimeFreeFixed::new(fixed, 1000).unwrap();
    for (name, record) in records() {
        let mut a = time_free::State::<f32>::default();
        let (mut b, mut b_fixed) = (time_free::State::<f64>::default(), Default::default());
        let mut c = time_free_fixed::State::default();
        let (mut z, mut z_fixed) = (Difference::default(), Difference::default());
        // Here only samples with a step round.
        let mut memory = Memory::default();
        for input in record {
            let v = input.estimate_rad_s;
            in_f32.step(&mut a, input.step_counts, v);
            let exact = in_f64.step(&mut b, input.step_counts, v.into());
            z.see(f64::from(a.z_rad) / z_ss(&double), exact / z_ss(&double));

            let speed = I16F16::from_num(f64::from(v).abs() * T / count);
            let v = speed.to_num::<f64>() * count / T;
            in_fixed.step(&mut c, input.step_counts, speed);
            let exact: f64 = in_f64.step(&mut b_fixed, input.step_counts, v);
            z_fixed.see(
                c.z_counts.to_num::<f64>() / z_ss_counts,
                exact / z_ss(&double),
            );
            if input.step_counts != 0 {
                memory.see(exact, double.z_ss_rad(v), v);
            }
        }
        assert_eq!((a.rejected, b.rejected, c.rejected), (0, 0, 0));
        let steps = memory.samples();
        // Product, alpha's share and sum round at every step, of 1.3 z_ss at most; z_ss itself, from the table, thrice.
        let rms = 1.3 * ROUNDING * (3.0 * steps + 3.0).sqrt();
        z.within(
            &format!("{name}: f32 time-free, z"),
            "z_ss",
            PEAK * rms,
            rms,
        );
        // A count is exact. z_ss is off by half a bit of its table and the bit that interpolation cuts; a plastic step is
        // cut by a bit, and five of them are z_ss, after which sliding has made it good. Between moves z stands still
        // with what it has, one such cut at a time, so that its rms is not far below that.
        let bit = BIT / z_ss_counts;
        z_fixed.within(
            &format!("{name}: fixed time-free, z"),
            "z_ss",
            bit * (1.5 + 5.0),
            bit * (1.5 + 1.0),
        );
    }
}

#[test]
fn f32_luenberger() {
    let (single, double) = models();
    let bench = axis("bench.toml");
    let settings: Settings<f64> = bench.observer_settings(T);
    let l1 = settings.l1_1_s;
    let inertia = settings.inertia_kg_m2;
    let single_settings: Settings<f32> = settings.cast();
    let double_settings: Settings<f64> = single_settings.cast();
    let in_f32 = Luenberger::new(single, single_settings).unwrap();
    let in_f64 = Luenberger::new(double, double_settings).unwrap();
    for (name, record) in records() {
        let mut a = luenberger::State::<f32>::default();
        let mut b = luenberger::State::<f64>::default();
        let (mut z, mut velocity) = (Difference::default(), Difference::default());
        let mut fastest = 0.0_f64;
        for input in record {
            in_f32.step(&mut a, input.step_counts, input.torque_nm);
            in_f64.step(&mut b, input.step_counts, input.torque_nm.into());
            z.see(
                f64::from(a.estimate.z_rad) / z_ss(&double),
                b.estimate.z_rad / z_ss(&double),
            );
            velocity.see(a.estimate.velocity_rad_s.into(), b.estimate.velocity_rad_s);
            fastest = fastest.max(b.estimate.velocity_rad_s.abs());
        }
        assert_eq!((a.rejected, b.rejected), (0, 0));
        // One sample rounds v at its own size thrice (two sums and T v), and turns the rounding of dz, one of z, into
        // sigma1/J of velocity. An error lasts longest in the fall of the curve: there J l1 + sigma2 + g' holds it, and g'
        // is -0.0172 at its steepest.
        let z_ss = z_ss(&double);
        let once = ROUNDING * (3.0_f64.sqrt() * fastest).hypot(0.076 / inertia * 1.3 * z_ss);
        let lasts = inertia / (T * (inertia * l1 + 0.0029 - 0.0172));
        let rms = once * lasts.sqrt();
        velocity.within(
            &format!("{name}: f32 Luenberger, velocity"),
            "rad/s",
            PEAK * rms,
            rms,
        );
        // In stick an error of v lasts J/(sigma1 + sigma2 + J l1) and z sums T times it, besides its own rounding; z
        // forgets by sigma0/(sigma1 + sigma2 + J l1).
        let damping = 0.0789 + inertia * l1;
        let z_once = (1.3 * ROUNDING).hypot(T * once * inertia / (T * damping) / z_ss);
        let z_rms = z_once * (damping / 10.53 / T).sqrt();
        z.within(
            &format!("{name}: f32 Luenberger, z"),
            "z_ss",
            PEAK * z_rms,
            z_rms,
        );
    }
}
