//! Pieces of the control tick, each as a function of its own. The emulator calls `kernel_setup` once and then each
//! piece with the inputs of a recorded run; numbers travel as their bits in core registers.
#![no_std]
#![no_main]

// The firmware's own queue.
#[path = "../../../../firmware/src/ring.rs"]
mod ring;

use bristle_core::controller::{Controller, Input};
use bristle_core::experiment::{Bounds, Experiment};
use bristle_core::friction::elasto_plastic_fixed::{self, ElastoPlasticFixed, Scaling};
use bristle_core::friction::{ElastoPlastic, Friction, Motion, elasto_plastic};
use bristle_core::observer::reduced_order::{self, System};
use bristle_core::observer::{
    Luenberger, ReducedOrder, TimeFree, TimeFreeFixed, luenberger, time_free, time_free_fixed,
};
use bristle_core::order::Order;
use bristle_core::parameters::{BENCH, Config};
use bristle_core::stribeck::{Shape, Stribeck, Table};
use bristle_core::supervisor::Request;
use bristle_core::trace::Record;
use core::hint::black_box;
use core::ptr::addr_of_mut;
use fixed::types::I16F16;
use panic_halt as _;
use ring::{Putter, Ring, Taker};

/// Length of a tick, s.
const TICK_S: f32 = 1e-4;
/// Samples that the queue of the firmware holds.
const QUEUE: usize = 512;

struct Bench {
    config: Config,
    controller: Controller,
    /// As a command makes it, outside the tick.
    play: Order,
    friction: ElastoPlastic<f32, Table<f32>>,
    friction_state: elasto_plastic::State<f32>,
    luenberger: Luenberger<f32, Table<f32>>,
    luenberger_state: luenberger::State<f32>,
    time_free: TimeFree<f32, Table<f32>>,
    time_free_state: time_free::State<f32>,
    reduced: ReducedOrder<f32, 1>,
    reduced_state: reduced_order::State<f32, 1>,
    fixed: ElastoPlasticFixed,
    fixed_state: elasto_plastic_fixed::State,
    time_free_fixed: TimeFreeFixed,
    time_free_fixed_state: time_free_fixed::State,
    samples_in: Putter<Record, QUEUE>,
    samples_out: Taker<Record, QUEUE>,
}

static mut BENCH_STATE: Option<Bench> = None;
static SAMPLES: Ring<Record, QUEUE> = Ring::new();

fn bench() -> &'static mut Bench {
    // SAFETY: one thread of execution, and no kernel calls another; `kernel_setup` has filled it.
    unsafe { (*addr_of_mut!(BENCH_STATE)).as_mut().unwrap_unchecked() }
}

fn build() -> Option<Bench> {
    let config = BENCH.build(TICK_S, 1).ok()?;
    let tick = config.tick;
    let friction = *tick.luenberger.friction();
    let damping = BENCH.damping_nm_s_rad + BENCH.viscous_nm_s_rad;
    let system = System::rigid_axis(BENCH.inertia_kg_m2, BENCH.stiffness_nm_rad, damping);
    let shape = Shape::Gaussian {
        velocity_rad_s: f64::from(BENCH.stribeck_velocity_rad_s),
    };
    let curve = Stribeck::new(
        f64::from(BENCH.coulomb_nm),
        f64::from(BENCH.stiction_nm),
        shape,
    );
    let exact = ElastoPlastic::new(
        curve.ok()?,
        f64::from(BENCH.stiffness_nm_rad),
        f64::from(BENCH.damping_nm_s_rad),
        f64::from(BENCH.viscous_nm_s_rad),
        f64::from(BENCH.breakaway_ratio),
    );
    let scaling = Scaling {
        rad_per_count: core::f64::consts::TAU / f64::from(BENCH.counts_per_rev),
        sample_time_s: f64::from(TICK_S),
        full_scale_nm: f64::from(BENCH.full_scale_nm),
        // As far as the table of the float model reaches.
        top_speed_rad_s: 8.0 * f64::from(BENCH.stribeck_velocity_rad_s),
    };
    let fixed = ElastoPlasticFixed::new(&exact.ok()?, &scaling).ok()?;
    let sine = Experiment::Sine {
        amplitude_nm: 0.035,
        period_ticks: 10_000,
    };
    // SAFETY: earlier ends are gone when this one is built.
    let (samples_in, samples_out) = unsafe { (SAMPLES.putter(), SAMPLES.taker()) };
    Some(Bench {
        samples_in,
        samples_out,
        controller: Controller::new(&config, 0, false),
        play: config.play(sine, &Bounds::open(u32::MAX)),
        friction,
        friction_state: Default::default(),
        luenberger: tick.luenberger,
        luenberger_state: Default::default(),
        time_free: tick.time_free(),
        time_free_state: Default::default(),
        reduced: ReducedOrder::new(system, [1700.0], TICK_S).ok()?,
        reduced_state: Default::default(),
        fixed,
        fixed_state: Default::default(),
        time_free_fixed: TimeFreeFixed::new(fixed, 1000).ok()?,
        time_free_fixed_state: Default::default(),
        config,
    })
}

/// Fills the state; 1 if all went well.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_setup() -> u32 {
    let built = build();
    let well = built.is_some();
    // SAFETY: one thread of execution.
    unsafe { *addr_of_mut!(BENCH_STATE) = built };
    u32::from(well)
}

/// Velocity: one step of the friction model.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_elasto_plastic(velocity: u32, _: u32) -> u32 {
    let bench = bench();
    let motion = Motion {
        velocity_rad_s: f32::from_bits(velocity),
        applied_nm: 0.0,
        dt_s: TICK_S,
    };
    bench
        .friction
        .step(&mut bench.friction_state, motion)
        .to_bits()
}

/// Displacement in counts: one step of the friction model in fixed point.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_elasto_plastic_fixed(displacement: u32, _: u32) -> u32 {
    let bench = bench();
    let counts = I16F16::from_bits(displacement.cast_signed());
    let torque = bench.fixed.step(&mut bench.fixed_state, counts);
    torque.to_bits().cast_unsigned()
}

/// Step in counts, torque.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_luenberger(step: u32, torque: u32) -> u32 {
    let bench = bench();
    let torque = f32::from_bits(torque);
    let state = &mut bench.luenberger_state;
    let estimate = bench.luenberger.step(state, step.cast_signed(), torque);
    estimate.velocity_rad_s.to_bits()
}

/// Step in counts, velocity.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_time_free(step: u32, velocity: u32) -> u32 {
    let bench = bench();
    let velocity = f32::from_bits(velocity);
    let state = &mut bench.time_free_state;
    let z = bench.time_free.step(state, step.cast_signed(), velocity);
    z.to_bits()
}

/// Step in counts, speed in counts a sample.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_time_free_fixed(step: u32, speed: u32) -> u32 {
    let bench = bench();
    let speed = I16F16::from_bits(speed.cast_signed());
    let state = &mut bench.time_free_fixed_state;
    let z = bench.time_free_fixed.step(state, step.cast_signed(), speed);
    z.to_bits().cast_unsigned()
}

/// Step in rad, torque: the reduced-order observer of one state.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_reduced_order(step: u32, torque: u32) -> u32 {
    let bench = bench();
    let (step, torque) = (f32::from_bits(step), f32::from_bits(torque));
    let state = &mut bench.reduced_state;
    let [v] = bench.reduced.step(state, 0.0, step, torque);
    v.to_bits()
}

/// Counter, and an order: 0 none, 1 arm, 2 the sine experiment, 3 keep alive. The tick without its registers.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_controller(raw: u32, order: u32) -> u32 {
    let bench = bench();
    match order {
        1 => bench
            .controller
            .obey(&bench.config, &Order::Request(Request::Arm)),
        2 => bench.controller.obey(&bench.config, &bench.play),
        3 => bench
            .controller
            .obey(&bench.config, &Order::Request(Request::KeepAlive)),
        _ => {}
    }
    let input = Input {
        raw,
        ..Input::default()
    };
    let output = bench.controller.step(&bench.config, &input);
    output.torque_nm.to_bits()
}

/// Puts a sample into the queue; 1 if it fitted.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_push(tick: u32, _: u32) -> u32 {
    let record = Record {
        tick,
        ..Record::default()
    };
    u32::from(bench().samples_in.put(record))
}

/// Takes a sample out of the queue.
#[unsafe(no_mangle)]
#[inline(never)]
pub extern "C" fn kernel_pop(_: u32, _: u32) -> u32 {
    bench().samples_out.take().map_or(0, |record| record.tick)
}

#[cortex_m_rt::entry]
fn main() -> ! {
    // Keeps the linker from dropping what nobody calls.
    let kernels: [extern "C" fn(u32, u32) -> u32; 9] = [
        kernel_elasto_plastic,
        kernel_elasto_plastic_fixed,
        kernel_luenberger,
        kernel_time_free,
        kernel_time_free_fixed,
        kernel_reduced_order,
        kernel_controller,
        kernel_push,
        kernel_pop,
    ];
    black_box(kernel_setup());
    for kernel in black_box(kernels) {
        black_box(kernel(0, 0));
    }
    loop {
        core::hint::spin_loop();
    }
}
