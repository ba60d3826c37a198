//! Where in an effect's parameters a fit should start: values over the usual ranges, waves from the spectrum of the rest,
//! moments and places where the rest is largest.

use super::candidate::{Background, Start, hard_range, size_before};
use super::regime::Node;
use super::screen::WORTH_A_FIT;
use super::spectrum;
use bristle_plant::Unit;
use bristle_plant::effect::{Entry, Kind, Parameter};
use nalgebra::DVector;
use rayon::prelude::*;

/// A size that is never zero is tried at so many values over its range at most: as many as are in proportion to each other.
const SIZES: usize = 4;
/// A shape at so many.
const SHAPES: usize = 3;
/// Each of two limits at so many: they show only where they cut.
const LIMITS: usize = 8;
/// A single one, from the least that is physical on: where it cuts a controller asks for ever more.
const LEVELS_OF_LIMIT: usize = 14;
/// Starts of an effect with several shape parameters are cut to so many.
const MOST_STARTS: usize = 45;
/// A size that is never zero is not in proportion to its change far from where it was tried.
const IN_PROPORTION: f64 = 3.0;
/// A gain as tried is preferred to one in proportion if it is this part of it.
const CERTAIN: f64 = 0.5;
/// So many starts of an effect are tried as they are before it is believed what they promise.
const CONFIRMED: usize = 5;
/// An effect of two forms is tried in one, and from so many of its best starts in the other.
const OTHER_FORM: usize = 12;
/// Moments from which something may be different for good; a fit cannot move them.
const STARTS_OF_CHANGE: usize = 16;
/// The smallest size of an effect that is never zero says in which direction it goes; a fit gets there by this part of
/// what that promises.
const PROMISES: f64 = 0.25;
/// A stop lies inside the travel by these parts of it: what it gives way by.
const INSIDE: [f64; 3] = [0.002, 0.015, 0.06];
/// Times that the distance from one that was tried is halved: to some 10 ms in a record of 20 s.
const HALVINGS: usize = 6;
/// Moments or places of a sudden change that are tried, so many nodes apart.
const MOMENTS: usize = 3;
const NODES_APART: f64 = 4.0;
/// Each at these parts of a node from it: a step of the position is seen through a test function of few nodes, in which one that is half a
/// node off is another shape.
const BESIDE_NODE: [f64; 4] = [-0.75, -0.25, 0.25, 0.75];

impl Background<'_> {
    /// The best starts of an effect, best first.
    pub fn starts(&self, entry: &'static Entry) -> Vec<Start> {
        let place = |kind: Kind| entry.parameters.iter().position(|p| p.kind == kind);
        let phase = place(Kind::Phase);
        let mut starts = match (place(Kind::Order), place(Kind::Frequency), phase) {
            (Some(order), _, Some(phase)) => self.waves(entry, order, phase, false),
            (_, Some(frequency), Some(phase)) => self.waves(entry, frequency, phase, true),
            _ => Vec::new(),
        };
        let mut grid = self.grid(entry);
        if !starts.is_empty() {
            // What has a wave has been tried with it; here are the sizes beside.
            let waved = phase.and_then(|phase| size_before(entry, phase));
            grid.retain(|values| waved.is_none_or(|size| values[size] == 0.0));
        }
        let zero = place(Kind::Zero);
        let scales = grid
            .last()
            .is_some_and(|values| self.scales_effort(entry, values));
        let tried = |grid: Vec<Vec<f64>>| -> Vec<Start> {
            let tried = grid.into_par_iter().filter_map(|values| {
                phase
                    .and_then(|phase| self.with_phase(entry, values.clone(), phase))
                    .or_else(|| self.with_zero(entry, values.clone(), zero?))
                    .or_else(|| self.scaled(entry, values, scales))
            });
            tried.collect()
        };
        starts.extend(tried(grid));
        starts.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        if let Some(form) = place(Kind::Form) {
            let [other, _] = (entry.parameters[form].range)(self.scale);
            let of_other = |start: &Start| {
                let mut values = start.values.clone();
                values[form] = other;
                values
            };
            let best = starts.iter().take(OTHER_FORM).map(of_other).collect();
            starts.extend(tried(best));
            starts.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        }
        self.confirm(entry, &mut starts, scales);
        if let Some(best) = starts.first_mut() {
            self.settle_sudden(entry, best, scales);
            if best.gain > WORTH_A_FIT {
                self.add_sudden(entry, best, scales);
            }
        }
        starts
    }

    /// Moves the moment or place of a sudden change to where it fits best, and tries there the shapes that were too many for the
    /// grid.
    fn settle_sudden(&self, entry: &'static Entry, best: &mut Start, scales: bool) {
        let sudden = |(place, parameter): (usize, &Parameter)| {
            Some((place, self.between_moments(parameter.kind)?))
        };
        let sudden: Vec<(usize, f64)> = entry
            .parameters
            .iter()
            .enumerate()
            .filter_map(sudden)
            .collect();
        for &(place, reach) in &sudden {
            self.settle(entry, best, place, reach, scales);
            for (shape, parameter) in entry.parameters.iter().enumerate() {
                if parameter.kind == Kind::Shape {
                    let tried = levels((parameter.range)(self.scale), SHAPES);
                    self.take_better(entry, best, scales, tried.map(|x| (shape, x)).collect());
                    self.settle(entry, best, place, reach, scales);
                }
            }
        }
    }

    /// Adds to the best start what else of the effect has a moment or place of its own, where that does better.
    fn add_sudden(&self, entry: &'static Entry, best: &mut Start, scales: bool) {
        for (moment, parameter) in entry.parameters.iter().enumerate() {
            let Some(size) = sudden(entry, moment).filter(|&size| best.values[size] == 0.0) else {
                continue;
            };
            let Some(so_far) = self.change(entry, &best.values, scales) else {
                return;
            };
            let so_far = self.beyond(&so_far);
            let rest = self.rest() + &so_far;
            let usual = (entry.parameters[size].range)(self.scale);
            let range = hard_range(usual);
            let places = self.moments(parameter.kind, &rest).unwrap_or_default();
            let added = places.into_par_iter().filter_map(|at| {
                let mut values = best.values.clone();
                values[moment] = at;
                values[size] = levels(usual, SIZES).last()?;
                let change = self.beyond(&self.change(entry, &values, scales)?) - &so_far;
                values[size] *= -change.dot(&rest) / change.norm_squared();
                values[size] = values[size].clamp(range[0], range[1]);
                let gain = self.gain(entry, &values, scales);
                Some(Start {
                    gain,
                    ..Start::at(values)
                })
            });
            let added: Vec<Start> = added.collect();
            if let Some(better) = added.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain))
                && better.gain > best.gain
            {
                *best = better;
                let reach = self.between_moments(parameter.kind).unwrap_or_default();
                self.settle(entry, best, moment, reach, scales);
            }
        }
    }

    /// Takes the best of these values of single parameters, if it does better than what is there.
    fn take_better(
        &self,
        entry: &'static Entry,
        best: &mut Start,
        scales: bool,
        tried: Vec<(usize, f64)>,
    ) {
        let starts = tried.into_par_iter().filter_map(|(place, value)| {
            let mut values = best.values.clone();
            values[place] = value;
            self.scaled(entry, values, scales)
        });
        let found: Vec<Start> = starts.collect();
        if let Some(better) = found.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain))
            && better.gain > best.gain
        {
            *best = better;
        }
    }

    /// Takes the best starts that were scaled to a guess at what they do as they are, and sorts anew.
    fn confirm(&self, entry: &'static Entry, starts: &mut [Start], scales: bool) {
        let most = starts.len().min(CONFIRMED);
        starts[..most].par_iter_mut().for_each(|start| {
            if start.guessed {
                start.gain = self.gain(entry, &start.values, scales);
                start.guessed = false;
            }
        });
        starts.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    }

    /// An effect as it came out elsewhere, and what it promises here.
    pub(super) fn as_it_came_out(&self, entry: &'static Entry, values: Vec<f64>) -> Start {
        Start {
            gain: self.gain(entry, &values, self.scales_effort(entry, &values)),
            ..Start::at(values)
        }
    }

    /// Fall of squares by an effect of these values.
    fn gain(&self, entry: &'static Entry, values: &[f64], scales: bool) -> f64 {
        let change = self.change(entry, values, scales);
        change.map_or(f64::NEG_INFINITY, |change| {
            let change = self.beyond(&change);
            -2.0 * change.dot(&self.rest()) - change.norm_squared()
        })
    }

    /// How far from one that was tried the moment or place of a sudden change may lie; a fit cannot move it.
    fn between_moments(&self, kind: Kind) -> Option<f64> {
        let node_s = self
            .records
            .iter()
            .fold(0.0, |longest: f64, record| longest.max(record.node_s()));
        match kind {
            Kind::Onset => Some(0.5 * self.scale.duration_s / STARTS_OF_CHANGE as f64),
            Kind::Event => Some(node_s),
            Kind::Place => Some(node_s * self.scale.top_speed_rad_s),
            Kind::Stop => Some(0.02 * (self.scale.highest_rad - self.scale.lowest_rad)),
            _ => None,
        }
    }

    /// Moves the moment or place of a sudden change to where it fits best.
    fn settle(
        &self,
        entry: &'static Entry,
        best: &mut Start,
        moment: usize,
        mut reach: f64,
        scales: bool,
    ) {
        for _ in 0..HALVINGS {
            let beside = [-reach, reach].map(|by| (moment, best.values[moment] + by));
            self.take_better(entry, best, scales, beside.to_vec());
            reach *= 0.5;
        }
    }

    /// Values over the usual range: one size at a time, every combination of a few shapes.
    fn grid(&self, entry: &'static Entry) -> Vec<Vec<f64>> {
        let parameters = entry.parameters;
        let range = |i: usize| (parameters[i].range)(self.scale);
        let of = |kind: Kind| (0..parameters.len()).filter(move |&i| parameters[i].kind == kind);
        let mut none = entry.defaults();
        for size in of(Kind::Size) {
            none[size] = 0.0;
        }
        let mut grid: Vec<Vec<f64>> = of(Kind::Size)
            .flat_map(|size| {
                let [low, high] = range(size);
                let most = if high.abs() >= low.abs() { high } else { low };
                let sizes: Vec<f64> = if has_moment(entry, size) {
                    levels([low, high], SIZES).skip(SIZES - 1).collect()
                } else if low > 0.0 {
                    let sizes = ((high / low).ln() / IN_PROPORTION.ln()).ceil() as usize;
                    std::iter::once(low)
                        .chain(levels([low, high], sizes.min(SIZES)))
                        .collect()
                } else {
                    vec![0.15 * most, 0.6 * most]
                };
                let none = &none;
                sizes.into_iter().map(move |x| {
                    let mut values = none.clone();
                    values[size] = x;
                    values
                })
            })
            .collect();
        if grid.is_empty() {
            grid.push(none);
        }
        let shapes: Vec<usize> = of(Kind::Form)
            .chain(of(Kind::Side))
            .chain(of(Kind::Limit))
            .chain((0..parameters.len()).filter(|&i| parameters[i].kind.is_shape()))
            .collect();
        for shape in shapes {
            let [low, high] = range(shape);
            let tried: Vec<f64> = match parameters[shape].kind {
                Kind::Form => vec![high],
                Kind::Side => vec![low, high],
                Kind::Limit if of(Kind::Limit).count() > 1 => levels([low, high], LIMITS).collect(),
                Kind::Limit => {
                    levels([hard_range([low, high])[0], high], LEVELS_OF_LIMIT).collect()
                }
                _ => self
                    .moments(parameters[shape].kind, &self.rest())
                    .unwrap_or_else(|| levels([low, high], SHAPES).collect()),
            };
            // The moment or place of a size is nothing to the other sizes.
            let owner = sudden(entry, shape);
            let (shaped, others): (Vec<_>, Vec<_>) = grid
                .iter()
                .cloned()
                .partition(|values| owner.is_none_or(|size| values[size] != 0.0));
            if others.len() + shaped.len() * tried.len() > MOST_STARTS * 2 || high <= low {
                continue;
            }
            let shaped = shaped.iter().flat_map(|values| {
                tried.iter().map(move |&x| {
                    let mut values = values.clone();
                    values[shape] = x;
                    values
                })
            });
            grid = others.into_iter().chain(shaped).collect();
        }
        grid
    }

    /// Where a sudden change may lie, for a parameter that is a moment or a place of one: where a weighted rest is largest.
    fn moments(&self, kind: Kind, rest: &DVector<f64>) -> Option<Vec<f64>> {
        if kind == Kind::Onset {
            return Some(levels([0.0, self.scale.duration_s], STARTS_OF_CHANGE).collect());
        }
        if kind == Kind::Stop {
            let (low, high) = (self.scale.lowest_rad, self.scale.highest_rad);
            let inside = |part: &f64| [low + part * (high - low), high - part * (high - low)];
            return Some(INSIDE.iter().flat_map(inside).collect());
        }
        // Where a node is, and how far from it the next one.
        let of = |node: &Node| {
            let node_s = self.records[node.record].node_s();
            match kind {
                Kind::Event => Some((node.time_s(self.records), node_s)),
                Kind::Place => {
                    let q = node.position_rad(self.records);
                    let turn = std::f64::consts::TAU;
                    let at = match self.scale.unit {
                        Unit::Rotary => q - turn * (q / turn).round(),
                        Unit::Linear => q,
                    };
                    Some((at, node_s * node.velocity_rad_s(self.records).abs()))
                }
                _ => None,
            }
        };
        let mut largest: Vec<usize> = (0..self.nodes.len()).collect();
        largest.sort_by(|&a, &b| rest[b].abs().total_cmp(&rest[a].abs()));
        let mut found: Vec<(f64, f64)> = Vec::new();
        for i in largest.into_iter().take(10 * MOMENTS) {
            let (at, node) = of(&self.nodes[i])?;
            if found
                .iter()
                .all(|other| (other.0 - at).abs() > NODES_APART * node)
            {
                found.push((at, node));
            }
        }
        found.truncate(MOMENTS);
        let beside = |(at, node): (f64, f64)| BESIDE_NODE.map(|part| at + part * node);
        Some(found.into_iter().flat_map(beside).collect())
    }

    /// The effect at these values, its size scaled to what fits best; an effect without a size as it is.
    fn scaled(&self, entry: &'static Entry, mut values: Vec<f64>, scales: bool) -> Option<Start> {
        let change = self.beyond(&self.change(entry, &values, scales)?);
        let slope = change.dot(&self.rest());
        let square = change.norm_squared();
        if square < 1e-9 {
            return None;
        }
        let size =
            (0..values.len()).find(|&i| entry.parameters[i].kind == Kind::Size && values[i] != 0.0);
        let gain = |factor: f64| -factor * (2.0 * slope + factor * square);
        let (mut factor, mut promised) = (1.0, f64::NEG_INFINITY);
        if let Some(size) = size {
            let usual = (entry.parameters[size].range)(self.scale);
            if usual[0] > 0.0 && values[size] <= usual[0] && slope < 0.0 {
                promised = PROMISES * slope * slope / square;
            }
            let range = hard_range(usual);
            let mut best = -slope / square;
            if usual[0] > 0.0 && !has_moment(entry, size) {
                best = best.clamp(1.0 / IN_PROPORTION, IN_PROPORTION);
            }
            let scaled = (best * values[size]).clamp(range[0], range[1]);
            // As it was tried is certain; in proportion is a guess.
            if usual[0] <= 0.0 || gain(1.0) < CERTAIN * gain(scaled / values[size]) {
                factor = scaled / values[size];
                values[size] = scaled;
            }
        }
        let gain = gain(factor);
        Some(Start {
            values,
            phases: Vec::new(),
            gain: gain.max(promised),
            guessed: factor != 1.0 && gain > promised,
        })
    }

    /// The effect with the phase and size that fit best, both at once.
    fn with_phase(
        &self,
        entry: &'static Entry,
        mut values: Vec<f64>,
        phase: usize,
    ) -> Option<Start> {
        let size = entry
            .parameters
            .iter()
            .enumerate()
            .position(|(i, p)| p.kind == Kind::Size && values[i] != 0.0)?;
        let at = |angle: f64| {
            let mut values = values.clone();
            values[phase] = angle;
            self.change(entry, &values, false)
                .map(|change| self.beyond(&change))
        };
        let (sine, cosine) = (at(0.0)?, at(std::f64::consts::FRAC_PI_2)?);
        let (a, b, gain) = spectrum::two_columns(&sine, &cosine, &self.rest())?;
        values[size] *= a.hypot(b);
        values[phase] = b.atan2(a);
        let range = hard_range((entry.parameters[size].range)(self.scale));
        values[size] = values[size].clamp(range[0], range[1]);
        Some(Start {
            values,
            phases: Vec::new(),
            gain,
            guessed: false,
        })
    }

    /// The effect with the size and the place of its zero that fit best, both at once: it lies between what it is with its zero
    /// at either end of the usual range, or beyond. Not with a size that it cannot have.
    fn with_zero(&self, entry: &'static Entry, mut values: Vec<f64>, zero: usize) -> Option<Start> {
        let parameters = entry.parameters;
        let range = |i: usize| (parameters[i].range)(self.scale);
        let size = parameters.iter().position(|p| p.kind == Kind::Size)?;
        let ends = range(zero);
        let at = |end: f64| {
            let mut values = values.clone();
            values[zero] = end;
            self.change(entry, &values, false)
                .map(|change| self.beyond(&change))
        };
        let (low, high) = (at(ends[0])?, at(ends[1])?);
        let (a, b, gain) = spectrum::two_columns(&low, &high, &self.rest())?;
        let usual = hard_range(range(size));
        let (sized, placed) = (
            (a + b) * values[size],
            (a * ends[0] + b * ends[1]) / (a + b),
        );
        if !(usual[0]..=usual[1]).contains(&sized) || !placed.is_finite() {
            return None;
        }
        (values[size], values[zero]) = (sized, placed);
        Some(Start {
            values,
            phases: Vec::new(),
            gain,
            guessed: false,
        })
    }

    /// Waves over angle or time: the whole spectrum at once, then the best lines one by one.
    fn waves(&self, entry: &'static Entry, line: usize, phase: usize, in_time: bool) -> Vec<Start> {
        let Some(size) = size_before(entry, phase) else {
            return Vec::new();
        };
        let [mut low, high] = (entry.parameters[line].range)(self.scale);
        if in_time || self.scale.unit == Unit::Linear {
            low = low.max(self.least_line(entry, entry.parameters[line].kind));
        }
        let mut values = entry.defaults();
        let usual = (entry.parameters[size].range)(self.scale);
        values[size] = 0.3 * usual[1].abs().max(usual[0].abs());
        values[line] = 0.0;
        values[phase] = std::f64::consts::FRAC_PI_2;
        let still = if entry.block() == "sensor" {
            // A wave of the sensor shows through acceleration: with the square of speed.
            Some(self.weighted(&self.squared_speeds()))
        } else {
            self.change(entry, &values, false)
        };
        let Some(still) = still else {
            return Vec::new();
        };
        let lines = if in_time {
            spectrum::in_time(self, &still, [low, high])
        } else {
            spectrum::in_angle(self, &still, [low, high])
        };
        lines
            .into_iter()
            .filter_map(|found| {
                let mut values = values.clone();
                values[line] = found;
                if in_time {
                    return self.with_phases(entry, values, size, phase);
                }
                self.with_phase(entry, values, phase)
            })
            .collect()
    }

    fn squared_speeds(&self) -> Vec<f64> {
        self.nodes
            .iter()
            .map(|node| {
                let stretch = &self.records[node.record].stretches[node.stretch];
                stretch.velocity_rad_s[node.sample].powi(2)
            })
            .collect()
    }

    /// A wave over time with a phase of its own on each record; the size is the mean over records.
    fn with_phases(
        &self,
        entry: &'static Entry,
        mut values: Vec<f64>,
        size: usize,
        phase: usize,
    ) -> Option<Start> {
        let at = |angle: f64| {
            let mut values = values.clone();
            values[phase] = angle;
            self.change(entry, &values, false)
        };
        let (sine, cosine) = (at(0.0)?, at(std::f64::consts::FRAC_PI_2)?);
        let rest = self.rest();
        let (mut sizes, mut phases, mut gain) = (0.0, Vec::new(), 0.0);
        for place in 0..self.records.len() {
            let of = |x: &DVector<f64>| {
                let only = DVector::from_iterator(
                    x.len(),
                    x.iter().zip(self.nodes).map(
                        |(x, node)| {
                            if node.record == place { *x } else { 0.0 }
                        },
                    ),
                );
                self.beyond(&only)
            };
            let (a, b, part) = spectrum::two_columns(&of(&sine), &of(&cosine), &rest)?;
            sizes += a.hypot(b);
            phases.push(b.atan2(a));
            gain += part;
        }
        values[size] *= sizes / self.records.len() as f64;
        Some(Start {
            values,
            phases,
            gain,
            guessed: false,
        })
    }
}

/// Whether a size has a moment or place of its own: then it is a step of the position, in proportion to what it does.
fn has_moment(entry: &Entry, size: usize) -> bool {
    (0..entry.parameters.len()).any(|i| sudden(entry, i) == Some(size))
}

/// The size whose moment or place of a sudden change a parameter is.
fn sudden(entry: &Entry, parameter: usize) -> Option<usize> {
    let kind = entry.parameters[parameter].kind;
    let sudden = matches!(kind, Kind::Event | Kind::Place);
    sudden.then(|| size_before(entry, parameter)).flatten()
}

fn levels([low, high]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| {
        let part = (i as f64 + 0.5) / count as f64;
        if low > 0.0 {
            low * (high / low).powf(part)
        } else {
            low + (high - low) * part
        }
    })
}
