//! What is left of the gap once what is accused, or the simulator alone, has explained what it can.

use super::accuse::{
    EVENLY, LEAVES, LEAVES_MOMENTS, LEAVES_OF_LITTLE, NOTHING, UNKNOWN, UNKNOWN_SLIDING,
    UNKNOWN_SLIDING_USUALLY,
};
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
    /// Ratio of root-mean-squares in motion, by which few moments count; neither of noise of the recorder nor, where it tells, of what
    /// the model leaves over of its own records.
    pub(super) moments: f64,
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
        let moments_by = |noise: &Noise| noise.rms_times_open(&search.nodes, rest, &Regime::MOVING);
        let times = times_by(&search.noise);
        let noise_alone =
            times[0] < EVENLY.1 && search.noise.is_even(&search.nodes, rest, EVENLY.0);
        let mut left = Self {
            times,
            much: is_much(times) && !noise_alone,
            moments: if noise_alone {
                1.0
            } else {
                moments_by(&search.noise)
            },
        };
        if left.much || left.moments > LEAVES_MOMENTS.0 || left.is_beyond(LEAVES_OF_LITTLE.0) {
            // What a model leaves over of its own records is no gap, though another one leaves less.
            let own = own_with_noise(1.0, &by.model, &by.fit.at, &search.records, &search.scale);
            let beside_own = search.noise.clone().at_least(&own);
            left.much &= is_much(times_by(&beside_own));
            left.moments = left.moments.min(moments_by(&beside_own));
        }
        left
    }

    /// Whether it is anything.
    pub(super) fn is_anything(&self) -> bool {
        self.times
            .iter()
            .zip(NOTHING)
            .any(|(times, most)| *times > most)
    }

    /// Whether it is what neither an effect that is there leaves nor the simulator where nothing is missing, of all.
    pub(super) fn is_unexplained(&self) -> bool {
        self.is_beyond(LEAVES[0])
    }

    /// Whether it is more times what is open, and anything in few moments.
    pub(super) fn is_beyond(&self, times: f64) -> bool {
        self.times[0] > times && self.moments > LEAVES[1]
    }

    /// Ratio of root-mean-squares in sliding.
    pub(super) fn rms_sliding(&self) -> f64 {
        self.times[1]
    }
}
