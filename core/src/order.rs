//! What commands ask of the tick, made ready outside of it.

use crate::experiment::{Bounds, Experiment, Guard, Player, Reference};
use crate::supervisor::Request;

/// What a command asks of the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Of the supervisor.
    Request(Request),
    /// Plays a signal within its bounds, if armed: its first reference, what plays the others, and the bounds. All were
    /// made outside the tick, which has no time for divisions.
    Play(Reference<f32>, Player<f32>, Guard),
}

impl Order {
    /// To play an experiment within bounds.
    pub fn play(
        experiment: Experiment<f32>,
        bounds: &Bounds<f32>,
        tick_s: f32,
        rad_per_count: f32,
    ) -> Self {
        let mut player = Player::new(experiment, tick_s);
        let first = player.next_tick();
        Self::Play(first, player, Guard::new(bounds, rad_per_count))
    }
}
