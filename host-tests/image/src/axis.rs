//! The virtual axis behind the pins of the board, with what can go wrong on the way.
//!
//! Pins as in the table of the firmware's board module: torque on DAC1 with mid-scale for none, drive enable on PB0,
//! drive healthy on PC1, index on PB10.

use crate::pins::{Inputs, Outputs, World};
use bristle_core::friction::ElastoPlastic;
use bristle_core::parameters::{BENCH, Parameters};
use bristle_core::stribeck::{Shape, Stribeck};
use bristle_plant::axis::{Axis, AxisConfig, steps_for};
use bristle_plant::contact::contact;
use bristle_plant::drive::DriveConfig;
use bristle_plant::encoder::EncoderConfig;
use bristle_plant::mechanics::Mechanics;
use std::cell::RefCell;
use std::rc::Rc;

/// Length of a tick, s.
const TICK_S: f64 = 1e-4;
const PORT_B: usize = 1;
const PORT_C: usize = 2;
const ENABLE: u16 = 1;
const HEALTHY: u16 = 1 << 1;
/// Mid-scale of the converter, and what full scale is above it.
const MIDDLE: f64 = 2048.0;

/// What a test does to the axis, and what it sees of it.
#[derive(Clone, Debug)]
pub struct Knobs {
    /// The drive says it is well.
    pub healthy: bool,
    /// Counts that the counter has lost so far.
    pub lost_counts: i64,
    /// The counter stands still.
    pub stuck: bool,
    /// Both lines change at once in the next tick.
    pub illegal_transition: bool,
    /// The drive makes this torque while enabled, whatever is asked for, N m.
    pub runs_away_nm: Option<f64>,
    /// Ticks so far.
    pub ticks: u64,
    /// The drive is enabled, at the pin.
    pub enabled: bool,
    /// Torque at the converter's pin, N m.
    pub torque_nm: f64,
    /// The first tick after `watch_from` at whose end the drive was found disabled.
    pub disabled_at: Option<u64>,
    /// See `disabled_at`.
    pub watch_from: u64,
    /// Counts given to the encoder's timer, one a tick.
    pub counts: Vec<u32>,
}

/// The axis of the bench, driven by the image.
pub struct BenchAxis {
    axis: Axis,
    full_scale_nm: f64,
    counts_per_turn: i64,
    knobs: Rc<RefCell<Knobs>>,
    last: i64,
}

/// The simulated axis that the image's own parameters describe.
///
/// # Panics
/// The parameters are not those of an axis.
pub fn axis_of(parameters: &Parameters, delay_samples: usize) -> Axis {
    let p = |value: f32| f64::from(value);
    let shape = Shape::Gaussian {
        velocity_rad_s: p(parameters.stribeck_velocity_rad_s),
    };
    let curve = Stribeck::new(p(parameters.coulomb_nm), p(parameters.stiction_nm), shape)
        .expect("parameters of an axis");
    let friction = ElastoPlastic::new(
        curve,
        p(parameters.stiffness_nm_rad),
        p(parameters.damping_nm_s_rad),
        p(parameters.viscous_nm_s_rad),
        p(parameters.breakaway_ratio),
    )
    .expect("parameters of an axis");
    let rate = p(parameters.damping_nm_s_rad) / p(parameters.inertia_kg_m2);
    let config = AxisConfig {
        mechanics: Mechanics {
            inertia_kg_m2: p(parameters.inertia_kg_m2),
            load: None,
        },
        drive: DriveConfig {
            delay_samples,
            ..DriveConfig::default()
        },
        encoder: EncoderConfig {
            rad_per_count: std::f64::consts::TAU / p(parameters.counts_per_rev),
            counts_per_turn: Some(parameters.counts_per_rev as i64),
            noise_rad: 0.0,
        },
        torque_noise_nm: 0.0,
        sample_time_s: TICK_S,
        steps: steps_for(TICK_S, rate),
        seed: 1,
    };
    Axis::new(config, contact(friction), Vec::new())
}

impl BenchAxis {
    /// At rest. The delay of the output is in the emulated converter, so the drive has none.
    pub fn new() -> (Self, Rc<RefCell<Knobs>>) {
        let knobs = Rc::new(RefCell::new(Knobs {
            healthy: true,
            lost_counts: 0,
            stuck: false,
            illegal_transition: false,
            runs_away_nm: None,
            ticks: 0,
            enabled: false,
            torque_nm: 0.0,
            disabled_at: None,
            watch_from: u64::MAX,
            counts: Vec::new(),
        }));
        let world = Self {
            axis: axis_of(&BENCH, 0),
            full_scale_nm: f64::from(BENCH.full_scale_nm),
            counts_per_turn: BENCH.counts_per_rev as i64,
            knobs: Rc::clone(&knobs),
            last: 0,
        };
        (world, knobs)
    }
}

impl World for BenchAxis {
    fn advance(&mut self, outputs: &Outputs) -> Inputs {
        let mut knobs = self.knobs.borrow_mut();
        knobs.ticks += 1;
        knobs.enabled = outputs.ports[PORT_B] & ENABLE != 0;
        if !knobs.enabled && knobs.ticks > knobs.watch_from && knobs.disabled_at.is_none() {
            knobs.disabled_at = Some(knobs.ticks);
        }
        let code = outputs.dac.map_or(MIDDLE, f64::from);
        knobs.torque_nm = (code - MIDDLE) / MIDDLE * self.full_scale_nm;
        let torque_nm = match (knobs.enabled, knobs.runs_away_nm) {
            (false, _) => 0.0,
            (true, Some(torque_nm)) => torque_nm,
            (true, None) => knobs.torque_nm,
        };
        let reading = self.axis.advance(torque_nm);
        let seen = reading.counts - knobs.lost_counts;
        let counts = if knobs.stuck { self.last } else { seen };
        self.last = counts;
        // The edge is where the turn begins; the counter that has lost counts copies what it has.
        let index = reading.index.then(|| {
            let nearest = (reading.counts as f64 / self.counts_per_turn as f64).round();
            nearest as i64 * self.counts_per_turn - knobs.lost_counts
        });
        knobs.counts.push(counts as u32);
        let mut ports = [0; 7];
        if knobs.healthy {
            ports[PORT_C] |= HEALTHY;
        }
        Inputs {
            count: counts as u32,
            index: index.map(|at| at as u32),
            illegal_transition: std::mem::take(&mut knobs.illegal_transition),
            ports,
        }
    }
}
