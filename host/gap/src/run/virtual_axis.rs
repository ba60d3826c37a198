//! The virtual axis as a bench: the whole of the control interrupt, supervisor and all, in closed loop with it.

use super::{Bench, Phase, Seen, Take};
use crate::believed::{Believed, Noise};
use crate::capture::Sample;
use crate::error::InputError;
use bristle_core::controller::{Controller, Input};
use bristle_core::experiment::{Bounds, Experiment};
use bristle_core::feed_forward::FeedForward;
use bristle_core::order::Order;
use bristle_core::parameters::Config;
use bristle_core::supervisor::{Limits, Request};
use bristle_plant::axis::{Axis, Truth};

/// Controller and axis.
pub struct Virtual {
    believed: Believed,
    config: Config,
    table: Option<Box<FeedForward<f32>>>,
    controller: Controller,
    axis: Axis,
    /// What the wiring does that the axis file does not say: 1 or -1.
    encoder_sign: i64,
    torque_sign: f64,
    /// Most that a hand can do.
    hand_nm: f64,
    counts: i64,
    ticks: u64,
}

/// Friction that a hand is worth, of that which the axis file believes in.
const HAND: f64 = 20.0;
/// Speed of a hand, turns or metres a second.
const HAND_SPEED: f64 = 0.5;
/// Natural frequency of the axis in a hand, rad/s: friction then keeps it within some hundredths of a turn.
const GRIP_RAD_S: f64 = 200.0;

impl Virtual {
    /// Armed and at rest. The controller knows the axis as `believed`; the axis is as `real`, which may have effects that
    /// nobody believes in.
    ///
    /// # Errors
    /// A parameter out of range, or an effect that does not exist.
    pub fn new(
        believed: &Believed,
        real: &Believed,
        noise: Noise,
        seed: u64,
    ) -> Result<Self, InputError> {
        let tick_s = 1.0 / believed.rate_hz;
        let mut axis = real.axis(real.model, tick_s, noise, seed)?;
        let config = config(believed, tick_s)?;
        let sign = |reversed: bool, believed: bool| if reversed == believed { 1 } else { -1 };
        let (its, said) = (real.wiring, believed.wiring);
        let encoder_sign = sign(its.encoder_reversed, said.encoder_reversed);
        let counts = encoder_sign * axis.reading().counts;
        let mut bench = Self {
            controller: Controller::new(&config, raw(counts), false),
            believed: real.clone(),
            config,
            table: None,
            encoder_sign,
            torque_sign: sign(its.torque_reversed, said.torque_reversed) as f64,
            hand_nm: HAND * believed.stiction_nm,
            counts,
            axis,
            ticks: 0,
        };
        for _ in 0..=bench.config.limits.boot_ticks {
            bench.tick(None)?;
        }
        bench.tick(Some(Order::Request(Request::Arm)))?;
        Ok(bench)
    }

    /// The supervisor has the limits of another belief from now on, before the first experiment.
    ///
    /// # Errors
    /// A limit out of range.
    pub fn limits_of(&mut self, axis: &Believed) -> Result<(), InputError> {
        self.config.limits = limits(axis, f64::from(self.config.tick_s))?;
        Ok(())
    }

    /// The controller adds a feed-forward table from now on.
    pub fn use_table(&mut self, table: FeedForward<f32>) {
        self.table = Some(Box::new(table));
    }

    /// The same without a guess of break-away: torque without a count is no fault.
    #[must_use]
    pub fn without_break_away(mut self) -> Self {
        self.config.limits.stuck_nm = self.config.limits.torque_nm;
        self.controller.take_over(&self.config);
        self
    }

    fn tick(&mut self, order: Option<Order>) -> Result<(Sample, Truth), InputError> {
        self.tick_under(order, None)
    }

    /// A tick, or one in which a hand has the axis and the controller's torque goes nowhere.
    fn tick_under(
        &mut self,
        order: Option<Order>,
        hand_nm: Option<f64>,
    ) -> Result<(Sample, Truth), InputError> {
        let truth = self.axis.truth();
        if !truth.motion.position_rad.is_finite() {
            return Err(self.believed.diverged(truth.time_s));
        }
        let counts = self.encoder_sign * self.axis.reading().counts;
        let input = Input {
            raw: raw(counts),
            ..Input::default()
        };
        if let Some(order) = order {
            self.controller.obey(&self.config, &order);
        }
        let output = self
            .controller
            .step_with(&self.config, self.table.as_deref(), &input);
        let torque_nm = hand_nm.unwrap_or(self.torque_sign * f64::from(output.torque_nm));
        self.counts = self.encoder_sign * self.axis.advance(torque_nm).counts;
        let sample = Sample {
            time_s: self.ticks as f64 / self.believed.rate_hz,
            counts,
            record: output.record,
        };
        self.ticks += 1;
        Ok((sample, truth))
    }
}

impl Bench for Virtual {
    fn play(
        &mut self,
        experiment: &Experiment<f32>,
        bounds: &Bounds<f32>,
        take: &mut Take<'_>,
    ) -> Result<Seen, InputError> {
        let refused = |why: &str| {
            InputError::new(
                "virtual axis",
                format!("the experiment {why}"),
                "make it smaller, or raise the bound or the axis's limit",
            )
        };
        bounds
            .admit(experiment, &self.config.limits, self.config.tick_s)
            .map_err(|refusal| refused(refusal.text()))?;
        let mut seen = Seen::default();
        let mut order = Some(self.config.play(*experiment, bounds));
        let mut stops = false;
        loop {
            let (sample, truth) = self.tick(order.take())?;
            match seen.sample(&sample, self.believed.rate_hz) {
                Phase::Before => return Err(refused("does not begin: the axis is not armed")),
                Phase::Over => return Ok(seen),
                Phase::Plays => {
                    let goes_on = take(&sample, Some(&truth))?;
                    if !goes_on && !stops {
                        stops = true;
                        order = Some(Order::Request(Request::Stop));
                    }
                }
            }
        }
    }

    fn rest(&mut self, ticks: u32, go_on: &dyn Fn() -> bool) -> Result<(), InputError> {
        for _ in 0..ticks {
            if !go_on() {
                break;
            }
            self.tick(None)?;
        }
        Ok(())
    }

    fn turned_by_hand(
        &mut self,
        turns: f64,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Option<i64>, InputError> {
        let axis = &self.believed;
        let (inertia, turn) = (axis.whole_inertia_kg_m2(), axis.turn_rad());
        let (stiffness, damping) = (
            inertia * GRIP_RAD_S * GRIP_RAD_S,
            2.0 * inertia * GRIP_RAD_S,
        );
        let step_rad = HAND_SPEED * turn / axis.rate_hz;
        let ticks = (turns.abs() * turn / step_rad).ceil() as u64;
        let settles = (0.5 * axis.rate_hz) as u64;
        let (from, begun) = (self.counts, self.axis.truth().motion.position_rad);
        for tick in 0..ticks + settles {
            if !go_on() {
                break;
            }
            let target = begun + turns.signum() * (step_rad * tick.min(ticks) as f64);
            let motion = self.axis.truth().motion;
            let pull = stiffness * (target - motion.position_rad) - damping * motion.velocity_rad_s;
            self.tick_under(None, Some(pull.clamp(-self.hand_nm, self.hand_nm)))?;
        }
        Ok(Some(self.counts - from))
    }

    fn counts(&self) -> i64 {
        self.counts
    }
}

/// The hardware's counter, 32 bits of the count.
fn raw(counts: i64) -> u32 {
    (counts.cast_unsigned() & u64::from(u32::MAX)) as u32
}

/// What the interrupt would run on for this axis.
fn config(axis: &Believed, tick_s: f64) -> Result<Config, InputError> {
    let torque_nm = axis.torque_limit_nm();
    Ok(Config {
        tick: axis.tick(tick_s)?,
        limits: limits(axis, tick_s)?,
        tick_s: tick_s as f32,
        full_scale_nm: torque_nm as f32,
        deflection_1_nm: 1.0 / torque_nm as f32,
    })
}

/// The supervisor's limits for this axis. Those that the axis file does not know are wide.
fn limits(axis: &Believed, tick_s: f64) -> Result<Limits, InputError> {
    let torque_nm = axis.torque_limit_nm();
    let ticks = |seconds: f64| (seconds / tick_s).round().max(1.0) as u32;
    let stuck_nm = 1.2 * axis.stiction_nm + axis.offset_nm().abs();
    // The torque beyond stiction makes four counts in this time.
    let counts_s =
        (8.0 * axis.rad_per_count() * axis.whole_inertia_kg_m2() / (0.2 * axis.stiction_nm)).sqrt();
    let limits = Limits {
        torque_nm: torque_nm as f32,
        // From one end to the other in a tick.
        slew_nm: (2.0 * torque_nm) as f32,
        // Ten times stiction to zero in 0.1 s.
        ramp_nm: (torque_nm.min(10.0 * axis.stiction_nm) * 10.0 * tick_s) as f32,
        speed_rad_s: axis.speed_limit_rad_s as f32,
        limit_ticks: ticks(0.5),
        // Its host is always there.
        command_ticks: u32::MAX,
        stuck_nm: stuck_nm as f32,
        stuck_ticks: ticks(counts_s.max(0.05)),
        counts_per_turn: axis.counts_per_turn.round() as i32,
        index_counts: 0,
        boot_ticks: ticks(0.01),
    };
    limits.checked().map_err(|error| {
        InputError::new(
            "axis file",
            error.to_string(),
            "correct it, or leave it out",
        )
    })
}
