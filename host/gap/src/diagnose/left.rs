//! What is left of the gap once what is accused, or the simulator alone, has explained what it can.

use super::accuse::{
    ACCUSES, EVENLY, IN_A_REGIME, LEAVES, LEAVES_MOMENTS, LEAVES_SLIDING, NOTHING, TONES, UNKNOWN,
    UNKNOWN_MOMENTS, UNKNOWN_SLIDING, UNKNOWN_SLIDING_USUALLY, explained,
};
use super::fitted_noise::left_once_fitted;
use super::hypothesis::Hypothesis;
use super::likelihood::Noise;
use super::own::Own;
use super::regime::{Regime, members};
use super::tone::toneless;
use super::tried::Search;
use std::cell::OnceCell;

/// What is left, in times of what is open; where that is anything, of what the model leaves over of its own records, where that is more.
pub(super) struct Left {
    /// Over all regimes; as a ratio of root-mean-squares in sliding, where that speaks for itself; as the mean over records in sliding.
    pub(super) times: [f64; 3],
    /// It is much, and no noise of the recorder.
    pub(super) much: bool,
    /// Ratio of root-mean-squares in motion, by which few moments count; nothing where it is noise of the recorder.
    pub(super) moments: f64,
    /// One regime of one record keeps what nothing leaves that is there.
    pub(super) fills_a_regime: bool,
}

impl Left {
    /// A rest of a hypothesis, N m at each node; what its model leaves over of its own records is found where it is asked for, once.
    pub(super) fn new(
        search: &Search,
        by: &Hypothesis,
        rest_nm: &[f64],
        own: &OnceCell<Own>,
    ) -> Self {
        let left = Self::beside(search, rest_nm, &search.noise);
        if !left.is_anything() && left.moments < LEAVES_MOMENTS.0 && !left.fills_a_regime {
            return left;
        }
        // What a model leaves over of its own records is no gap, though another one leaves less.
        let own = own.get_or_init(|| left_once_fitted(by, &search.judge(), &search.scale));
        Self::beside(search, rest_nm, &search.noise.clone().at_least(own))
    }

    /// Beside this noise.
    fn beside(search: &Search, rest: &[f64], noise: &Noise) -> Self {
        let nodes = &search.nodes;
        let sliding = &[Regime::Sliding];
        // Of few independent moments such a ratio is large by chance.
        let speaks = noise.nats_beyond_open(nodes, rest, sliding) > ACCUSES;
        let rms_sliding = if speaks {
            noise.rms_times_open(nodes, rest, sliding)
        } else {
            1.0
        };
        let times = [
            noise.times_open(nodes, rest),
            rms_sliding,
            noise.times_open_in(nodes, rest, sliding),
        ];
        // A tone goes on evenly, too.
        let is_tone = || {
            let calm = |place| members(nodes, rest, place, |of| of != Regime::Low);
            let toneless = toneless(&search.records, nodes, rest, calm);
            explained(times[0], noise.times_open(nodes, &toneless)) > TONES
        };
        let noise_alone = times[0] < EVENLY.1 && noise.is_even(nodes, rest, EVENLY.0) && !is_tone();
        let most = [UNKNOWN, UNKNOWN_SLIDING, UNKNOWN_SLIDING_USUALLY];
        Self {
            times,
            much: times.iter().zip(most).any(|(times, most)| *times > most) && !noise_alone,
            moments: if noise_alone {
                1.0
            } else {
                noise.rms_times_open(nodes, rest, &Regime::MOVING)
            },
            fills_a_regime: !noise_alone
                && IN_A_REGIME
                    .iter()
                    .any(|&(nats, times)| noise.most_times_open(nodes, rest, nats) > times),
        }
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

    /// Whether it is what no simulator leaves that nothing is missing from.
    pub(super) fn is_of_no_list(&self) -> bool {
        self.is_unexplained()
            || self.moments > UNKNOWN_MOMENTS
            || self.fills_a_regime
            || self.much && self.times[1] > UNKNOWN_SLIDING
    }

    /// Whether it is what no effect leaves that is there while the axis slides, of all or in most records.
    pub(super) fn is_unexplained_in_sliding(&self) -> bool {
        let [_, all, usually] = self.times;
        all > UNKNOWN_SLIDING || usually > LEAVES_SLIDING
    }
}
