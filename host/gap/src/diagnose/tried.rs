//! All that a search tried: what a verdict and every page of a report are drawn from.

use super::accuse::{ACCUSES, NULLS_VARY};
use super::hypothesis::{Hypothesis, Judge};
use super::likelihood::Noise;
use super::own::Own;
use super::regime::Node;
use crate::inverse::Record;
use crate::signal::weighted_squares;
use bristle_plant::effect::{Entry, Scale};
use std::sync::Arc;

/// All that was tried.
#[derive(Clone)]
pub struct Search {
    /// The prepared logs.
    pub records: Arc<[Record]>,
    /// Their nodes.
    pub nodes: Vec<Node>,
    /// Size of axis and records.
    pub scale: Scale,
    /// Noise by record and regime.
    pub noise: Noise,
    /// Weight of each node.
    pub weights: Vec<f64>,
    /// What the simulator as it stands leaves over, N m.
    pub as_given: Vec<f64>,
    /// What the method leaves over of the simulator as it stands on records of its own.
    pub own_as_given: Own,
    /// The same of the refitted simulator, or of the best effect where that is less.
    pub own: Own,
    /// The simulator with its own parameters refitted.
    pub base: Hypothesis,
    /// With one effect, best first.
    pub single: Vec<Hypothesis>,
    /// With several, best first.
    pub several: Vec<Hypothesis>,
    /// What the best effects gain on records of the refitted simulator without them.
    pub nulls: Vec<Null>,
    /// The effect that positions showed by themselves: whatever else is named, it is.
    pub shown: Option<&'static str>,
    /// Nats that speak in the positions for an effect of the sensor that may not be accused.
    pub unlisted_nats: f64,
    /// The best effect leaves something though it leaves no room for a second one, so that all pairs were looked for.
    pub leaves_another: bool,
    /// Every effect and the fall of squares that screening expects of it.
    pub screened: Vec<(&'static Entry, f64)>,
}

impl Search {
    /// What its hypotheses are judged by.
    pub(super) fn judge(&self) -> Judge<'_> {
        Judge {
            records: &self.records,
            nodes: &self.nodes,
            weights: &self.weights,
            noise: &self.noise,
        }
    }

    /// The hypothesis of an effect alone.
    pub(super) fn alone(&self, id: &str) -> Option<&Hypothesis> {
        self.single.iter().find(|h| h.added[0].id == id)
    }

    /// Squares of what a hypothesis leaves over of data that took no part, as a fit weighs them.
    pub(super) fn weighted_squares(&self, hypothesis: &Hypothesis) -> f64 {
        weighted_squares(&hypothesis.held_out, &self.weights)
    }

    /// The score of a hypothesis where a rest below what is open counts, too.
    pub(super) fn score_of_all(&self, hypothesis: &Hypothesis) -> f64 {
        hypothesis.score_of_all(&self.noise, &self.nodes)
    }

    /// What a hypothesis gains so beyond the simulator alone, nats.
    pub(super) fn gain_of_all(&self, hypothesis: &Hypothesis) -> f64 {
        self.score_of_all(hypothesis) - self.score_of_all(&self.base)
    }

    /// Whether positions show an effect of the sensor that may not be accused.
    pub(super) fn is_unlisted(&self) -> bool {
        self.unlisted_nats > ACCUSES
    }

    /// What an effect gains where it is not, if that was asked.
    pub(super) fn null(&self, id: &str) -> Option<&Null> {
        self.nulls.iter().find(|null| null.id == id)
    }
}

/// What an effect takes away where it is not.
#[derive(Clone, Copy, Debug)]
pub struct Null {
    /// Which effect.
    pub id: &'static str,
    /// Gain of the held-out score, nats.
    pub nats: f64,
    /// The same where a rest below what is open counts, too.
    pub nats_of_all: f64,
    /// Times of what is open that are left without and with it.
    pub times: [f64; 2],
}

impl Null {
    /// Nats that the effect may gain where it is not.
    pub(super) fn may_gain(&self) -> f64 {
        NULLS_VARY * self.nats.max(0.0)
    }

    /// The same where a rest below what is open counts, too.
    pub(super) fn may_gain_of_all(&self) -> f64 {
        NULLS_VARY * self.nats_of_all.max(0.0)
    }
}
