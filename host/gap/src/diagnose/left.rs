//! What is left of the gap once what is accused, or the simulator alone, has explained what it can.

use super::accuse::{EVENLY, LEAVES, UNKNOWN, UNKNOWN_SLIDING, UNKNOWN_SLIDING_USUALLY};
use super::fitted_noise::own_with_noise;
use super::hypothesis::Hypothesis;
use super::likelihood::Noise;
use super::regime::Regime;
use super::tried::Search;

/// What is left, in times of what is open.
pub(super) struct Left {
    /// Over all regimes; as a ratio of root-mean-squares in sliding; as the mean over records in sliding.
    pub(super) times: [f64; 3],
    /// It is much: neither noise of the recorder nor what the model leaves over of its own records.
    pub(super) much: bool,
    /// It is more than what an effect leaves in few moments that is there, and not what the model leaves over of its own records.
    pub(super) something: bool,
}

impl Left {
    /// By a hypothesis.
    pub(super) fn new(search: &Search, by: &Hypothesis) -> Self {
        let rest = &by.held_out;
        let times_by = |noise: &Noise| {
            let sliding = &[Regime::Sliding];
            [
                noise.times_open(&search.nodes, rest),
                noise.rms_times_open(&search.nodes, rest, sliding),
                noise.times_open_in(&search.nodes, rest, sliding),
            ]
        };
        let is_much = |times: [f64; 3]| {
            let most = [UNKNOWN, UNKNOWN_SLIDING, UNKNOWN_SLIDING_USUALLY];
            times.iter().zip(most).any(|(times, most)| *times > most)
        };
        let is_something =
            |noise: &Noise| noise.rms_times_open(&search.nodes, rest, &Regime::MOVING) > LEAVES.0;
        let times = times_by(&search.noise);
        let noise_alone =
            times[0] < EVENLY.1 && search.noise.is_even(&search.nodes, rest, EVENLY.0);
        let much = is_much(times) && !noise_alone;
        let something = is_something(&search.noise) && !noise_alone;
        if !much && !something {
            return Self {
                times,
                much,
                something,
            };
        }
        // What a model leaves over of its own records is no gap, though another one leaves less.
        let own = own_with_noise(1.0, &by.model, &by.fit.at, &search.records, &search.scale);
        let beside_own = search.noise.clone().at_least(&own);
        Self {
            times,
            much: much && is_much(times_by(&beside_own)),
            something: something && is_something(&beside_own),
        }
    }

    /// Ratio of root-mean-squares in sliding.
    pub(super) fn rms_sliding(&self) -> f64 {
        self.times[1]
    }
}
