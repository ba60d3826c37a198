//! The control tick of `core` on the virtual axis: what the interrupt and the hardware do together.

use crate::axis::{Axis, Truth};
use bristle_core::experiment::{Experiment, Player};
use bristle_core::feed_forward::FeedForward;
use bristle_core::real::Real;
use bristle_core::stribeck::Curve;
use bristle_core::tick::{Sample, State, Tick};

/// A controller and its axis.
pub struct Rig<T, C> {
    tick: Tick<T, C>,
    state: State<T>,
    player: Player<T>,
    axis: Axis,
    feed_forward: Option<Box<FeedForward<T>>>,
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
    pub fn new(tick: Tick<T, C>, mut axis: Axis, experiment: Experiment<T>) -> Self {
        let tick_s = T::of(axis.config().sample_time_s);
        Self {
            state: tick.start(axis.reading().raw()),
            tick,
            player: Player::new(experiment, tick_s),
            axis,
            feed_forward: None,
        }
    }

    /// The same with a torque added to every reference on its way to the drive. It cancels what the axis has beside its
    /// model, so the observers are not told of it.
    #[must_use]
    pub fn with_feed_forward(mut self, table: FeedForward<T>) -> Self {
        self.feed_forward = Some(Box::new(table));
        self
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
        let torque_nm = match &self.feed_forward {
            None => sample.torque_ref_nm,
            Some(table) => {
                let position_rad = reading.counts as f64 * self.axis.config().encoder.rad_per_count;
                table.apply(
                    sample.torque_ref_nm,
                    T::of(position_rad),
                    sample.luenberger.velocity_rad_s,
                )
            }
        };
        self.axis.advance(torque_nm.to_f64());
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
