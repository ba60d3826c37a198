//! The control tick of `core` on the virtual axis: what the interrupt and the hardware do together.

use crate::axis::{Axis, Truth};
use bristle_core::experiment::{Experiment, Player};
use bristle_core::real::Real;
use bristle_core::stribeck::Curve;
use bristle_core::tick::{Sample, State, Tick};

/// A controller and its axis.
pub struct Rig<T, C> {
    tick: Tick<T, C>,
    state: State<T>,
    player: Player<T>,
    axis: Axis,
}

/// A tick, and what the axis truly did up to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record<T> {
    /// What the controller saw and decided.
    pub sample: Sample<T>,
    /// The counts that the controller cannot hold, since it only sees them wrapped.
    pub counts: i64,
    /// What only a simulation knows.
    pub truth: Truth,
}

impl<T: Real, C: Curve<T>> Rig<T, C> {
    /// Both at rest.
    pub fn new(tick: Tick<T, C>, axis: Axis, experiment: Experiment<T>) -> Self {
        let tick_s = T::of(axis.config().sample_time_s);
        Self {
            state: tick.start(axis.reading().raw()),
            tick,
            player: Player::new(experiment, tick_s),
            axis,
        }
    }

    /// The controller's state.
    pub fn state(&self) -> &State<T> {
        &self.state
    }

    /// One tick, then the axis up to the next one.
    pub fn advance(&mut self) -> Record<T> {
        let truth = self.axis.truth();
        let reading = self.axis.reading();
        let sample = self
            .tick
            .run(&mut self.state, reading.raw(), &mut self.player);
        self.axis.advance(sample.torque_ref_nm.to_f64());
        Record {
            sample,
            counts: reading.counts,
            truth,
        }
    }
}

impl<T: Real, C: Curve<T>> Iterator for Rig<T, C> {
    type Item = Record<T>;

    fn next(&mut self) -> Option<Record<T>> {
        Some(self.advance())
    }
}
