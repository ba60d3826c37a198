//! Where in an effect's parameters a fit should start: values over the usual ranges, waves from the spectrum of the rest.

use super::candidate::{Background, Start, hard_range, size_before, sort};
use super::coupling::{COUPLING, couplings};
use super::screen::WORTH_A_FIT;
use super::spectrum;
use super::sudden::{has_moment, step_as_tried, sudden, take_best};
use bristle_plant::Unit;
use bristle_plant::effect::{Entry, Kind};
use nalgebra::DVector;
use rayon::prelude::*;

/// A size that is never zero is tried at so many values over its range at most: as many as are in proportion to each other.
pub(super) const SIZES: usize = 4;
/// A shape at so many.
pub(super) const SHAPES: usize = 3;
/// A limit at so many, from the least that is physical on: where it cuts a controller asks for ever more.
const LEVELS_OF_LIMIT: usize = 14;
/// And so close to the greatest effort, as parts of it: of one that cuts a few peaks alone a level further down would cut far more.
const LEVELS_AT_PEAKS: [f64; 5] = [0.88, 0.91, 0.94, 0.965, 0.985];
/// Starts of an effect with several shape parameters are cut to so many.
const MOST_STARTS: usize = 45;
/// A size that is never zero is not in proportion to its change far from where it was tried.
pub(super) const IN_PROPORTION: f64 = 3.0;
/// A gain as tried is preferred to one in proportion if it is this part of it.
const CERTAIN: f64 = 0.5;
/// So many starts of an effect are tried as they are before it is believed what they promise.
const CONFIRMED: usize = 5;
/// An effect of two forms of which its grid has one is tried in that, and from so many of its best starts in the other.
const OTHER_FORM: usize = 12;
/// The smallest size of an effect that is never zero says in which direction it goes; a fit gets there by this part of
/// what that promises.
const PROMISES: f64 = 0.25;

/// Effect whose wave shows with acceleration, and with the square of speed.
const VARIES_INERTIA: &str = "mechanics.inertia_change";

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
        let lowest = |form: usize| (entry.parameters[form].range)(self.scale)[0];
        let other_form = place(Kind::Form)
            .map(|form| (form, lowest(form)))
            .filter(|&(form, other)| grid.iter().all(|values| values[form] != other));
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
        sort(&mut starts);
        if let Some((form, other)) = other_form {
            let of_other = |start: &Start| {
                let mut values = start.values.clone();
                values[form] = other;
                values
            };
            let best = starts.iter().take(OTHER_FORM).map(of_other).collect();
            starts.extend(tried(best));
            sort(&mut starts);
        }
        self.confirm(entry, &mut starts, scales);
        if let Some(best) = starts.first_mut() {
            self.settle_sudden(entry, best, scales);
            if best.gain > WORTH_A_FIT {
                self.add_sudden(entry, best, scales);
                if let (Some(order), Some(phase)) = (place(Kind::Order), phase) {
                    self.add_wave(entry, order, phase, best, scales);
                }
            }
        }
        starts
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
        sort(starts);
    }

    /// An effect as it came out elsewhere, and what it promises here.
    pub(super) fn as_it_came_out(&self, entry: &'static Entry, values: Vec<f64>) -> Start {
        Start {
            gain: self.gain(entry, &values, self.scales_effort(entry, &values)),
            ..Start::at(values)
        }
    }

    /// Fall of squares by an effect of these values.
    pub(super) fn gain(&self, entry: &'static Entry, values: &[f64], scales: bool) -> f64 {
        let change = self.change(entry, values, scales);
        change.map_or(f64::NEG_INFINITY, |change| {
            let change = self.beyond(&change);
            -2.0 * change.dot(&self.rest()) - change.norm_squared()
        })
    }

    /// Values over the usual range: one size at a time, every combination of a few shapes; of a coupling and of two limits
    /// their own.
    fn grid(&self, entry: &'static Entry) -> Vec<Vec<f64>> {
        if entry.id == COUPLING {
            return couplings(entry, self.scale);
        }
        if let Some(limits) = self.two_limits(entry) {
            return limits;
        }
        let parameters = entry.parameters;
        let range = |i: usize| (parameters[i].range)(self.scale);
        let of = |kind: Kind| (0..parameters.len()).filter(move |&i| parameters[i].kind == kind);
        let mut none = entry.defaults();
        for size in of(Kind::Size) {
            none[size] = 0.0;
        }
        for form in of(Kind::Form) {
            none[form] = range(form)[1];
        }
        let mut grid: Vec<Vec<f64>> = of(Kind::Size)
            .flat_map(|size| {
                let [low, high] = range(size);
                let most = if high.abs() >= low.abs() { high } else { low };
                let sizes: Vec<f64> = if has_moment(entry, size) {
                    vec![step_as_tried([low, high])]
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
        let shapes: Vec<usize> = of(Kind::Side)
            .chain(of(Kind::Limit))
            .chain((0..parameters.len()).filter(|&i| parameters[i].kind.is_shape()))
            .collect();
        for shape in shapes {
            let [low, high] = range(shape);
            let tried: Vec<f64> = match parameters[shape].kind {
                Kind::Side => vec![low, high],
                Kind::Limit => levels([hard_range([low, high])[0], high], LEVELS_OF_LIMIT)
                    .chain(LEVELS_AT_PEAKS.map(|part| part * high))
                    .collect(),
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

    /// The effect at these values, its size scaled to what fits best; an effect without a size as it is.
    pub(super) fn scaled(
        &self,
        entry: &'static Entry,
        mut values: Vec<f64>,
        scales: bool,
    ) -> Option<Start> {
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
    fn with_phase(&self, entry: &'static Entry, values: Vec<f64>, phase: usize) -> Option<Start> {
        let size = entry
            .parameters
            .iter()
            .enumerate()
            .position(|(i, p)| p.kind == Kind::Size && values[i] != 0.0)?;
        let change = |values: &[f64]| {
            self.change(entry, values, false)
                .map(|change| self.beyond(&change))
        };
        self.with_phase_of(entry, values, [size, phase], &self.rest(), change)
    }

    /// The same of the wave of this size and phase, which makes this change to a rest.
    fn with_phase_of(
        &self,
        entry: &'static Entry,
        mut values: Vec<f64>,
        [size, phase]: [usize; 2],
        rest: &DVector<f64>,
        change: impl Fn(&[f64]) -> Option<DVector<f64>>,
    ) -> Option<Start> {
        let at = |angle: f64| {
            let mut values = values.clone();
            values[phase] = angle;
            change(&values)
        };
        let (sine, cosine) = (at(0.0)?, at(std::f64::consts::FRAC_PI_2)?);
        let (a, b, gain) = spectrum::two_columns(&sine, &cosine, rest)?;
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
        let values = self.wave_as_tried(entry, size, phase);
        let lines = self.lines(entry, &values, line, in_time, &self.rest());
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

    /// Adds to the best start the wave over angle that the effect has beside what that does, where it does better.
    fn add_wave(
        &self,
        entry: &'static Entry,
        order: usize,
        phase: usize,
        best: &mut Start,
        scales: bool,
    ) {
        let Some(size) = size_before(entry, phase).filter(|&size| best.values[size] == 0.0) else {
            return;
        };
        let Some([so_far, rest]) = self.with_start(entry, best, scales) else {
            return;
        };
        let alone = self.wave_as_tried(entry, size, phase);
        let lines = self.lines(entry, &alone, order, false, &rest);
        let waves = lines.into_par_iter().filter_map(|line| {
            let mut values = best.values.clone();
            (values[size], values[order]) = (alone[size], line);
            let beside = |values: &[f64]| {
                let change = self.change(entry, values, scales)?;
                Some(self.beyond(&change) - &so_far)
            };
            let with = self.with_phase_of(entry, values, [size, phase], &rest, beside)?;
            let gain = self.gain(entry, &with.values, scales);
            Some(Start { gain, ..with })
        });
        let waves: Vec<Start> = waves.collect();
        take_best(best, waves);
    }

    /// What a start does beyond what the model's own parameters can, and the weighted rest with it.
    pub(super) fn with_start(
        &self,
        entry: &'static Entry,
        start: &Start,
        scales: bool,
    ) -> Option<[DVector<f64>; 2]> {
        let does = self.beyond(&self.change(entry, &start.values, scales)?);
        let rest = self.rest() + &does;
        Some([does, rest])
    }

    /// A wave of no line yet, as large as it is tried.
    fn wave_as_tried(&self, entry: &'static Entry, size: usize, phase: usize) -> Vec<f64> {
        let mut values = entry.defaults();
        let usual = (entry.parameters[size].range)(self.scale);
        values[size] = 0.3 * usual[1].abs().max(usual[0].abs());
        values[phase] = std::f64::consts::FRAC_PI_2;
        values
    }

    /// The lines of a weighted rest at which a wave [as tried](Self::wave_as_tried) may be.
    fn lines(
        &self,
        entry: &'static Entry,
        as_tried: &[f64],
        line: usize,
        in_time: bool,
        rest: &DVector<f64>,
    ) -> Vec<f64> {
        let [mut low, high] = (entry.parameters[line].range)(self.scale);
        if in_time || self.scale.unit == Unit::Linear {
            low = low.max(self.least_line(entry, entry.parameters[line].kind));
        }
        let mut values = as_tried.to_vec();
        values[line] = 0.0;
        let of_sensor = entry.block() == "sensor";
        let mut stills = Vec::new();
        if !of_sensor {
            stills.extend(self.change(entry, &values, false));
        }
        // A wave of the sensor shows through acceleration: with the square of speed.
        if of_sensor || entry.id == VARIES_INERTIA {
            stills.push(self.weighted(&self.squared_speeds()));
        }
        let mut lines: Vec<f64> = Vec::new();
        for still in &stills {
            let found = if in_time {
                spectrum::in_time(self, rest, still, [low, high])
            } else {
                spectrum::in_angle(self, rest, still, [low, high])
            };
            for line in found {
                if !lines.contains(&line) {
                    lines.push(line);
                }
            }
        }
        lines
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

pub(super) fn levels([low, high]: [f64; 2], count: usize) -> impl Iterator<Item = f64> {
    (0..count).map(move |i| {
        let part = (i as f64 + 0.5) / count as f64;
        if low > 0.0 {
            low * (high / low).powf(part)
        } else {
            low + (high - low) * part
        }
    })
}
