//! What is left of the gap once what is accused, or the simulator alone, has explained what it can.

use super::accuse::{EVENLY, UNKNOWN, UNKNOWN_SLIDING, UNKNOWN_SLIDING_USUALLY};
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
        let times = times_by(&search.noise);
        let noise_alone =
            times[0] < EVENLY.1 && search.noise.is_even(&search.nodes, rest, EVENLY.0);
        // What a model leaves over of its own records is no gap, though another one leaves less.
        let much = is_much(times) && !noise_alone && {
            let own = own_with_noise(1.0, &by.model, &by.fit.at, &search.records, &search.scale);
            is_much(times_by(&search.noise.clone().at_least(&own)))
        };
        Self { times, much }
    }

    /// Ratio of root-mean-squares in sliding.
    pub(super) fn rms_sliding(&self) -> f64 {
        self.times[1]
    }
}
