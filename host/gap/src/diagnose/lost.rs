//! Counts that the encoder lost: steps of the position that the axis cannot have made. Found in the positions, they are
//! taken out before anything is fitted. What they would leave over speaks for the effect, and every other effect is
//! judged beside it.

use super::accuse::ACCUSES;
use super::beside::BESIDE;
use super::hypothesis::{Hypothesis, of_noise, sort};
use super::regime::nodes;

use super::tried::Search;
use crate::error::InputError;
use crate::hygiene::Jump;
use crate::inverse::{Added, Record};
use crate::log::{Log, PositionKind};
use crate::signal::extent;
use bristle_plant::Unit;
use bristle_plant::effect::{ALL, Effect, Entry, Instant, Kind};
use std::f64::consts::TAU;

/// Its id.
pub(super) const LOST_COUNTS: &str = "sensor.lost_counts";
/// A step of this part of a turn, or of a linear axis's travel, is a counter that wraps.
const WRAPS: f64 = 0.25;
/// What moves an axis is beyond every doubt at so many standard deviations.
const BEYOND: f64 = 3.0;
/// Samples before a step that say which way the axis went.
const BEFORE: usize = 8;

/// A log whose position goes on without its steps.
pub(super) fn mended(log: &Log, jumps: &[Jump], rad_per_count: f64) -> Log {
    let mut mended = log.clone();
    for jump in jumps {
        let size = match log.position.kind {
            PositionKind::Counts => (jump.size_rad / rad_per_count).round(),
            PositionKind::Rad | PositionKind::M => jump.size_rad,
        };
        for value in &mut mended.position.values[jump.sample..] {
            *value -= size;
        }
    }
    mended
}

/// A step of a log.
struct Step {
    /// Which log.
    log: usize,
    /// Where the axis was before it and behind it, had nothing been lost in this log, rad.
    passes_rad: [f64; 2],
    /// What is missing behind it for one who goes upward, rad.
    lost_rad: f64,
    upward: bool,
}

/// The steps of all logs.
#[derive(Default)]
pub(super) struct Steps {
    lost: Vec<Step>,
    /// Positions of each log that has steps, without them, rad.
    mended_rad: Vec<Vec<f64>>,
    /// Farthest travel of a log, rad.
    travel_rad: f64,
    /// Records with their steps; none of a log without.
    as_recorded: Vec<Option<Record>>,
    nats: f64,
}

impl Steps {
    /// Those of a log of these positions; the record is as it was, steps and all.
    pub(super) fn add(&mut self, position_rad: &[f64], jumps: &[Jump], as_recorded: Record) {
        let mut mended_rad = position_rad.to_vec();
        for jump in jumps {
            let upward = position_rad[jump.sample.saturating_sub(1)]
                >= position_rad[jump.sample.saturating_sub(BEFORE + 1)];
            for q in &mut mended_rad[jump.sample..] {
                *q -= jump.size_rad;
            }
            let before = jump.sample.saturating_sub(1);
            self.lost.push(Step {
                log: self.as_recorded.len(),
                passes_rad: [mended_rad[before], mended_rad[jump.sample]],
                lost_rad: if upward {
                    -jump.size_rad
                } else {
                    jump.size_rad
                },
                upward,
            });
            let deviations = BEYOND * jump.size_rad / jump.allowed_rad;
            self.nats += 0.5 * deviations * deviations;
        }
        let (low, high) = extent(&mended_rad);
        self.travel_rad = self.travel_rad.max(high - low);
        self.mended_rad.push(mended_rad);
        self.as_recorded.push(Some(as_recorded));
    }

    /// A log without any.
    pub(super) fn none(&mut self) {
        self.as_recorded.push(None);
    }

    /// What was lost; none where nothing was, or a counter wraps.
    pub(super) fn lost(self, unit: Unit) -> Option<Lost> {
        let entry = ALL.iter().find(|entry| entry.id == LOST_COUNTS)?;
        let whole_rad = match unit {
            Unit::Rotary => TAU,
            Unit::Linear => self.travel_rad,
        };
        let mut sizes: Vec<f64> = self.lost.iter().map(|step| step.lost_rad).collect();
        sizes.sort_unstable_by(|a, b| a.abs().total_cmp(&b.abs()));
        let size_rad = *sizes.get(sizes.len() / 2)?;
        if sizes[sizes.len() - 1].abs() > WRAPS * whole_rad {
            return None;
        }
        // The slowest pass tells the place best.
        let width = |step: &&Step| (step.passes_rad[1] - step.passes_rad[0]).abs();
        let slowest = self
            .lost
            .iter()
            .min_by(|a, b| width(a).total_cmp(&width(b)))?;
        let place_rad = unit.place_rad(0.5 * slowest.passes_rad.iter().sum::<f64>());
        let mut values = entry.defaults();
        let [size, place, form] = [Kind::Size, Kind::Place, Kind::Form]
            .map(|kind| entry.parameters.iter().position(|p| p.kind == kind));
        values[size?] = 1.0;
        values[place?] = place_rad;
        // Counts given back one at a time say how often the place was passed.
        let passes_downward = |q: &Vec<f64>| {
            let mut counts = (entry.build)(&values, unit);
            let passed = q.iter().map(|&q| (q - read(counts.as_mut(), q)).round());
            let passed: Vec<f64> = passed.collect();
            passed.windows(2).any(|pair| pair[1] < pair[0])
        };
        let given_back = !self.lost.iter().all(|step| step.upward)
            || !self.mended_rad.iter().any(passes_downward);
        values[size?] = size_rad;
        values[form?] = f64::from(u8::from(given_back));
        let turn_rad = (unit == Unit::Rotary).then_some(TAU);
        Some(Lost {
            added: Added { entry, values },
            nats: self.nats + self.nats_of_place(size_rad, turn_rad),
            as_recorded: self.as_recorded,
        })
    }

    /// How much more probable it is that what makes the steps lies at one place than that each log's lie there by chance, nats; none where
    /// they do not.
    fn nats_of_place(&self, size_rad: f64, turn_rad: Option<f64>) -> f64 {
        let whole_rad = turn_rad.map_or(self.travel_rad, |turn| turn.min(self.travel_rad));
        // What is lost shifts what lies behind, by a little more or less than is taken out.
        let middle = |step: &Step| 0.5 * step.passes_rad.iter().sum::<f64>();
        let width = |step: &Step| (step.passes_rad[1] - step.passes_rad[0]).abs() + size_rad.abs();
        let mut nats = 0.0;
        for steps in self.lost.chunk_by(|a, b| a.log == b.log) {
            let first = &steps[0];
            for step in &steps[1..] {
                let apart = middle(step) - middle(first);
                let turns = turn_rad.map_or(0.0, |turn| turn * (apart / turn).round());
                let wide = width(step) + width(first);
                if (apart - turns).abs() > 0.5 * wide {
                    return 0.0;
                }
                nats += (whole_rad / wide).ln().max(0.0);
            }
        }
        nats
    }
}

/// What a sensor with an effect reads at a position, rad.
fn read(sensor: &mut dyn Effect, position_rad: f64) -> f64 {
    let mut now = Instant::default();
    now.motion.position_rad = position_rad;
    sensor.sensor(&now)
}

/// Counts that were lost.
pub(super) struct Lost {
    /// The effect, with what the steps say of it.
    pub(super) added: Added,
    as_recorded: Vec<Option<Record>>,
    /// How much more probable its steps are as lost counts than as motion, nats.
    nats: f64,
}

impl Lost {
    /// Whether its steps speak for it by themselves.
    pub(super) fn is_shown(&self) -> bool {
        self.nats > ACCUSES
    }

    /// Records with their steps in place of those without.
    pub(super) fn as_recorded(&self, mended: &[Record]) -> Vec<Record> {
        let both = self.as_recorded.iter().zip(mended);
        both.map(|(as_recorded, mended)| as_recorded.as_ref().unwrap_or(mended).clone())
            .collect()
    }

    /// Sets the effect beside all that was tried on positions without the steps, where `catalogue` has it.
    ///
    /// # Errors
    /// The friction model refuses the parameters of the axis file.
    pub(super) fn accuse(
        &self,
        search: &mut Search,
        catalogue: &[&'static Entry],
    ) -> Result<(), InputError> {
        if catalogue.iter().all(|entry| entry.id != LOST_COUNTS) {
            search.unlisted_nats = search.unlisted_nats.max(self.nats);
            return Ok(());
        }
        let records = self.as_recorded(&search.records);
        let model = &search.base.model;
        let with_steps = model.left_over(&records, &search.base.fit.at)?;
        let given = model.left_over(&records, &model.start())?;
        let steps: Vec<usize> = nodes(&records, search.scale.z_ss_rad)
            .iter()
            .zip(&search.nodes)
            .enumerate()
            .filter(|(_, (recorded, mended))| mended.excluded && !recorded.excluded)
            .map(|(place, _)| place)
            .collect();
        let usual = |h: &Hypothesis| search.noise.usual(&search.nodes, &h.held_out);
        let mut found = vec![(self.beside(&search.base), usual(&search.base))];
        for single in search.single.iter().filter(|h| !of_noise(h)).take(BESIDE) {
            found.push((self.beside(single), usual(single)));
        }
        for &place in &steps {
            search.nodes[place].excluded = false;
            search.as_given[place] = given[place];
        }
        let weights = search.noise.weights(&search.nodes);
        for &place in &steps {
            search.weights[place] = weights[place];
        }
        let leaves = |hypothesis: &mut Hypothesis, rest: &[f64]| {
            for &place in &steps {
                hypothesis.held_out[place] = rest[place];
                hypothesis.fit.left_over[place] = rest[place];
            }
            hypothesis.scored(&search.noise, &search.nodes);
        };
        let without = std::iter::once(&mut search.base)
            .chain(&mut search.single)
            .chain(&mut search.several);
        for hypothesis in without {
            leaves(hypothesis, &with_steps);
            hypothesis.score -= self.nats;
        }
        for (hypothesis, usual) in &mut found {
            leaves(hypothesis, usual);
        }
        let mut found = found.into_iter().map(|(hypothesis, _)| hypothesis);
        search.shown = self.is_shown().then_some(LOST_COUNTS);
        search.single.extend(found.next());
        search.several.extend(found);
        for list in [&mut search.single, &mut search.several] {
            sort(list);
        }
        Ok(())
    }

    fn beside(&self, hypothesis: &Hypothesis) -> Hypothesis {
        let mut both = hypothesis.clone();
        both.added.insert(0, self.added.entry);
        both.model.effects.push(self.added.clone());
        both
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of 0.01 rad of logs, each passed from 0.01 rad before a place to as far behind it.
    fn steps(of_log: &[(usize, f64)]) -> Steps {
        let step = |&(log, at_rad): &(usize, f64)| Step {
            log,
            passes_rad: [at_rad - 0.01, at_rad + 0.01],
            lost_rad: -0.01,
            upward: true,
        };
        Steps {
            lost: of_log.iter().map(step).collect(),
            travel_rad: 40.0,
            ..Steps::default()
        }
    }

    #[test]
    fn steps_at_one_place_of_the_turn_speak_for_lost_counts() {
        let nats = |of_log: &[(usize, f64)]| steps(of_log).nats_of_place(0.01, Some(TAU));
        // Two that chance puts anywhere in a turn are within 0.03 rad of each other.
        let each = (TAU / 0.06).ln();
        assert!((nats(&[(0, 1.0), (0, 1.0 + TAU), (0, 1.01)]) - 2.0 * each).abs() < 1e-12);
        // Two logs may have begun at different counts.
        assert!((nats(&[(0, 1.0), (0, 1.0), (1, 3.0), (1, 3.0)]) - 2.0 * each).abs() < 1e-12);
        assert_eq!(nats(&[(0, 1.0), (0, 1.0), (0, 2.0)]), 0.0);
        assert_eq!(nats(&[(0, 1.0)]), 0.0);
    }
}
