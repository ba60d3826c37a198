//! Cases that run on the microcontroller's instruction set and on the host, in f32 and fixed point: every friction
//! model, every observer, the experiments, and the whole controller. Each gives a stream of bits.

use bristle_core::Real;
use bristle_core::controller::{Controller, Input};
use bristle_core::experiment::{Bounds, Experiment, Player, Reference, sine_of_turns};
use bristle_core::friction::armstrong::Armstrong;
use bristle_core::friction::bliman_sorine::BlimanSorine;
use bristle_core::friction::bristle::Bristle;
use bristle_core::friction::coulomb::{Coulomb, CoulombViscous};
use bristle_core::friction::dahl::Dahl;
use bristle_core::friction::elasto_plastic::half_sine;
use bristle_core::friction::elasto_plastic_fixed::{self, ElastoPlasticFixed, Scaling};
use bristle_core::friction::karnopp::Karnopp;
use bristle_core::friction::lugre::{Damping, LuGre};
use bristle_core::friction::stiction::{GeneralStatic, Stiction};
use bristle_core::friction::{ElastoPlastic, Friction, Motion};
use bristle_core::observer::reduced_order::{self, System};
use bristle_core::observer::{ReducedOrder, TimeFreeFixed, luenberger, time_free, time_free_fixed};
use bristle_core::order::Order;
use bristle_core::parameters::BENCH;
use bristle_core::stribeck::{Curve, Shape, Stribeck, Table};
use bristle_core::supervisor::Request;
use fixed::types::I16F16;

/// Results in a sum.
pub const STRETCH: u32 = 64;
/// Steps of a case.
const STEPS: u32 = 4096;
/// s
const T: f32 = 1e-4;

/// Takes the name of a case and a result.
pub type Sink<'a> = &'a mut dyn FnMut(&'static str, u32);

/// Sums of stretches of results (FNV-1a), so that a difference shows where it begins.
#[derive(Default)]
pub struct Sums {
    case: &'static str,
    stretch: u32,
    count: u32,
    sum: u32,
}

impl Sums {
    /// Takes a result; gives case, number and sum of a stretch that it ends or that ended before it.
    pub fn take(&mut self, case: &'static str, bits: u32) -> Option<(&'static str, u32, u32)> {
        let ended = if case == self.case && self.count < STRETCH {
            None
        } else {
            self.end()
        };
        if case != self.case {
            self.case = case;
            self.stretch = 0;
        }
        if self.count == 0 {
            self.sum = 0x811c_9dc5;
        }
        self.count += 1;
        for byte in bits.to_le_bytes() {
            self.sum = (self.sum ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
        ended
    }

    /// Ends a stretch that has begun.
    pub fn end(&mut self) -> Option<(&'static str, u32, u32)> {
        (core::mem::take(&mut self.count) > 0).then(|| {
            self.stretch += 1;
            (self.case, self.stretch - 1, self.sum)
        })
    }
}

/// Numbers without pattern, the same everywhere.
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// From -1 to 1.
    fn unit(&mut self) -> f32 {
        (self.next() >> 8) as f32 / 8_388_608.0 - 1.0
    }

    /// A speed of any size that matters, rad/s: from a crawl to far beyond the Stribeck curve.
    fn speed(&mut self) -> f32 {
        let size = [1e-6, 1e-3, 0.03, 0.3, 3.0, 300.0][(self.next() % 6) as usize];
        size * self.unit()
    }
}

fn friction<F: Friction<f32>>(name: &'static str, model: &F, sink: Sink<'_>) {
    let mut random = Random(1);
    let mut state = F::State::default();
    let mut speed = 0.0;
    for k in 0..STEPS {
        // A speed holds for a while, so that the model gets somewhere.
        if k % 16 == 0 {
            speed = random.speed();
        }
        let motion = Motion {
            velocity_rad_s: if k % 256 < 8 { 0.0 } else { speed },
            applied_nm: 0.05 * random.unit(),
            dt_s: T,
        };
        sink(name, model.step(&mut state, motion).to_bits());
        sink(name, model.deflection_rad(&state).to_bits());
    }
    for _ in 0..64 {
        sink(name, model.steady_state_nm(random.speed()).to_bits());
    }
}

fn models(sink: Sink<'_>) {
    let v = 0.3;
    let gaussian = Shape::Gaussian { velocity_rad_s: v };
    let curve = Stribeck::new(0.020, 0.026, gaussian).expect("a curve");
    let table = Table::new(&curve, 2.4).expect("a table");
    let ok = "parameters of a model";
    friction("coulomb", &Coulomb::new(0.02).expect(ok), sink);
    friction(
        "coulomb-viscous",
        &CoulombViscous::new(0.02, 0.003).expect(ok),
        sink,
    );
    friction("stiction", &Stiction::new(0.02, 0.026).expect(ok), sink);
    friction(
        "general static",
        &GeneralStatic::new(curve, 0.003).expect(ok),
        sink,
    );
    friction(
        "karnopp",
        &Karnopp::new(0.02, 0.026, 0.003, 0.01).expect(ok),
        sink,
    );
    for (name, exponent) in [("dahl 1", 1.0), ("dahl 2", 2.0), ("dahl 0.5", 0.5)] {
        friction(name, &Dahl::new(10.5, 0.02, exponent).expect(ok), sink);
    }
    let damping = Damping::Constant { nm_s_rad: 0.05 };
    friction(
        "lugre",
        &LuGre::new(curve, 10.5, damping, 0.003).expect(ok),
        sink,
    );
    let falling = Damping::Falling {
        nm_s_rad: 0.05,
        velocity_rad_s: 0.1,
    };
    friction(
        "lugre, falling damping, table",
        &LuGre::new(table, 10.5, falling, 0.003).expect(ok),
        sink,
    );
    friction(
        "elasto-plastic",
        &ElastoPlastic::new(curve, 10.53, 0.076, 0.0029, 0.7).expect(ok),
        sink,
    );
    friction(
        "elasto-plastic, table",
        &ElastoPlastic::new(table, 10.53, 0.076, 0.0029, 0.7).expect(ok),
        sink,
    );
    friction(
        "bristle",
        &Bristle::<f32, 20>::new(1.0, 1e-3, 7).expect(ok),
        sink,
    );
    let armstrong = Armstrong::<f32, 64>::new(10.5, 0.02, 0.003, 0.006, 0.3, 1e-3, 1.0);
    friction("armstrong", &armstrong.expect(ok), sink);
    let first = BlimanSorine::first_order(0.02, 1e-3);
    friction("bliman-sorine, first order", &first.expect(ok), sink);
}

fn curves(sink: Sink<'_>) {
    let v = 0.3;
    let shapes = [
        Shape::Constant,
        Shape::PiecewiseLinear {
            slope_nm_s_rad: 0.01,
        },
        Shape::Exponential { velocity_rad_s: v },
        Shape::Gaussian { velocity_rad_s: v },
        Shape::GeneralisedExponential {
            rate: 3.0,
            exponent: 1.3,
        },
        Shape::Lorentzian { velocity_rad_s: v },
    ];
    for shape in shapes {
        let mut random = Random(3);
        let curve = Stribeck::new(0.020_f32, 0.026, shape).expect("a curve");
        let table = Table::new(&curve, 2.4).expect("a table");
        for _ in 0..256 {
            let speed = random.speed().abs();
            sink("stribeck", curve.level_nm(speed).to_bits());
            sink("stribeck table", table.level_nm(speed).to_bits());
        }
    }
}

fn fixed_point(sink: Sink<'_>) {
    // Built in f64 on both, so the table's integers are compared, too.
    let curve = Stribeck::new(
        0.020,
        0.026,
        Shape::Gaussian {
            velocity_rad_s: 0.3,
        },
    )
    .expect("a curve");
    let model = ElastoPlastic::new(curve, 10.53_f64, 0.076, 0.0029, 0.7).expect("a model");
    let scaling = Scaling {
        rad_per_count: core::f64::consts::TAU / 16384.0,
        sample_time_s: 1e-4,
        full_scale_nm: 0.1,
        top_speed_rad_s: 2.4,
    };
    let fixed = ElastoPlasticFixed::new(&model, &scaling).expect("a model");
    let observer = TimeFreeFixed::new(fixed, 1000).expect("an observer");
    let mut observer_state = time_free_fixed::State::default();
    let mut state = elasto_plastic_fixed::State::default();
    let mut random = Random(5);
    for _ in 0..STEPS {
        let shift = random.next() % 16;
        let bits = random.next().cast_signed() >> (8 + shift);
        let torque = fixed.step(&mut state, I16F16::from_bits(bits));
        sink(
            "elasto-plastic, fixed point",
            torque.to_bits().cast_unsigned(),
        );
        sink(
            "elasto-plastic, fixed point",
            state.z_counts.to_bits().cast_unsigned(),
        );
        // Steps and speeds of all sizes, some of them past belief.
        let step = random.next().cast_signed() >> (18 + random.next() % 14);
        let speed = I16F16::from_bits(bits);
        let z = observer.step(&mut observer_state, step, speed);
        sink("time-free, fixed point", z.to_bits().cast_unsigned());
    }
    sink("time-free, fixed point", observer_state.rejected);
}

/// Elementary functions that core takes from its library, over any bits at all: infinities, NaN and denormals too.
fn functions(sink: Sink<'_>) {
    let mut random = Random(13);
    // The sign and payload of a NaN are nobody's promise.
    let narrow = |x: f32| if x.is_nan() { 0x7fc0_0000 } else { x.to_bits() };
    for _ in 0..STEPS {
        let [x, y] = [random.next(), random.next()].map(f32::from_bits);
        sink("sqrt", narrow(Real::sqrt(x)));
        sink("exp", narrow(Real::exp(x)));
        sink("exp", narrow(Real::exp(-10.0 * random.unit())));
        sink("pow", narrow(Real::powf(x, y)));
        sink(
            "pow",
            narrow(Real::powf(3.0 * random.unit().abs(), 2.0 * random.unit())),
        );
        let turns = 2.0 * random.unit().abs();
        sink("sine", sine_of_turns(turns).to_bits());
    }
    // Tables and parameters are built in f64, which the processor has no instructions for.
    let mut wide = |name, x: f64| {
        let bits = x.to_bits();
        sink(name, bits as u32);
        sink(name, (bits >> 32) as u32);
    };
    for _ in 0..STEPS / 4 {
        let x = f64::from(random.unit()) + f64::from(random.unit()) * 1e-8;
        wide("sqrt, f64", Real::sqrt(x.abs()));
        wide("exp, f64", Real::exp(-10.0 * x));
        wide("pow, f64", Real::powf(x.abs(), 1.3));
        wide("sine, f64", sine_of_turns(x.abs()));
        wide("half sine, f64", half_sine(x));
    }
}

fn observers(sink: Sink<'_>) {
    let tick = BENCH.build(T, 1).expect("parameters of the image").tick;
    let mut random = Random(9);
    let mut luenberger_state = luenberger::State::default();
    let mut time_free_state = time_free::State::default();
    let damping = BENCH.damping_nm_s_rad + BENCH.viscous_nm_s_rad;
    let system = System::rigid_axis(BENCH.inertia_kg_m2, BENCH.stiffness_nm_rad, damping);
    let reduced = ReducedOrder::new(system, [1700.0], T).expect("a stable gain");
    let mut reduced_state = reduced_order::State::default();
    for k in 0..STEPS {
        let slow = [0, 0, 0, 1, -1, 2][(random.next() % 6) as usize];
        // Now and then what cannot be, which must be refused the same way.
        let step = if k % 512 == 511 { i32::MIN } else { slow };
        let torque = 0.05 * random.unit();
        let e = tick.luenberger.step(&mut luenberger_state, step, torque);
        sink("luenberger", e.velocity_rad_s.to_bits());
        sink("luenberger", e.z_rad.to_bits());
        let z = tick
            .time_free()
            .step(&mut time_free_state, step, e.velocity_rad_s);
        sink("time-free", z.to_bits());
        let [w] = reduced.step(&mut reduced_state, 0.0, slow as f32 * 3.8e-4, torque);
        sink("reduced order", w.to_bits());
    }
    sink("luenberger", luenberger_state.rejected);
    sink("time-free", time_free_state.rejected);
}

const EXPERIMENTS: [Experiment<f32>; 6] = [
    Experiment::Sine {
        amplitude_nm: 0.035,
        period_ticks: 1000,
    },
    Experiment::Reversals {
        amplitude_rad: 2.0,
        period_ticks: 777,
    },
    Experiment::Prbs {
        amplitude_nm: 0.01,
        clock_ticks: 3,
    },
    Experiment::DahlRamp {
        amplitude_rad: 1.0,
        period_ticks: 999,
    },
    Experiment::Multisine {
        amplitude_nm: 0.03,
        period_ticks: 1024,
    },
    Experiment::Moves {
        length_rad: 1.0,
        move_ticks: 300,
        pause_ticks: 20,
        pauses: 3,
    },
];

fn experiments(sink: Sink<'_>) {
    for experiment in EXPERIMENTS {
        let mut player = Player::new(experiment, T);
        for _ in 0..STEPS {
            let (a, b) = match player.next_tick() {
                Reference::Torque(x) | Reference::Velocity(x) => (x, 0.0),
                Reference::Position {
                    position_rad,
                    velocity_rad_s,
                } => (position_rad, velocity_rad_s),
            };
            sink("experiments", a.to_bits());
            sink("experiments", b.to_bits());
        }
    }
}

/// The whole tick, armed and playing, on counts that wander, into an overspeed and out of it.
fn controller(sink: Sink<'_>) {
    let config = BENCH.build(T, 1).expect("parameters of the image");
    for experiment in EXPERIMENTS {
        let mut controller = Controller::new(&config, 0, false);
        let mut random = Random(11);
        let mut raw = 0_u32;
        for k in 0..STEPS {
            let order = match k {
                200 | 3200 => Some(Order::Request(Request::Arm)),
                201 | 3201 => Some(config.play(experiment, &Bounds::open(2500))),
                3100 => Some(Order::Request(Request::ClearFault)),
                _ if k % 500 == 0 => Some(Order::Request(Request::KeepAlive)),
                _ => None,
            };
            raw = raw.wrapping_add_signed([0, 0, 1, 1, -1][(random.next() % 5) as usize]);
            if k == 3000 {
                raw = raw.wrapping_add(100_000);
            }
            if let Some(order) = order {
                controller.obey(&config, &order);
            }
            let input = Input {
                raw,
                ..Input::default()
            };
            let r = controller.step(&config, &input).record;
            for value in [
                r.z_luenberger_rad,
                r.z_time_free_rad,
                r.velocity_rad_s,
                r.torque_ref_nm,
            ] {
                sink("controller", value.to_bits());
            }
            sink("controller", r.status.0);
        }
    }
}

/// All cases.
pub fn all(sink: Sink<'_>) {
    models(sink);
    curves(sink);
    fixed_point(sink);
    functions(sink);
    observers(sink);
    experiments(sink);
    controller(sink);
}
