//! The virtual axis as a bench: the whole of the control interrupt, supervisor and all, in closed loop with it.

use super::{Bench, Phase, Seen, Take};
use crate::believed::{Believed, Noise};
use crate::capture::Sample;
use crate::error::InputError;
use bristle_core::controller::{Controller, Input, Order};
use bristle_core::experiment::{Bounds, Experiment};
use bristle_core::feed_forward::FeedForward;
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
    counts: i64,
    ticks: u64,
}

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
        let mut bench = Self {
            controller: Controller::new(&config, axis.reading().raw(), false),
            believed: real.clone(),
            config,
            table: None,
            counts: axis.reading().counts,
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

    fn tick(&mut self, order: Option<Order>) -> Result<(Sample, Truth), InputError> {
        let truth = self.axis.truth();
        if !truth.motion.position_rad.is_finite() {
            return Err(self.believed.diverged(truth.time_s));
        }
        let reading = self.axis.reading();
        let input = Input {
            raw: reading.raw(),
            ..Input::default()
        };
        if let Some(order) = order {
            self.controller.obey(&self.config, &order);
        }
        let output = self
            .controller
            .step_with(&self.config, self.table.as_deref(), &input);
        self.counts = self.axis.advance(f64::from(output.torque_nm)).counts;
        let sample = Sample {
            time_s: self.ticks as f64 / self.believed.rate_hz,
            counts: reading.counts,
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

    fn counts(&self) -> i64 {
        self.counts
    }
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
