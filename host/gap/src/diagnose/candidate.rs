//! An effect as a hypothesis: the simulator with the effect added.
//!
//! Screening is cheap: the change that the effect makes to the rest, less what the simulator's own parameters can do as
//! well, is laid against the rest. Only the best starts are then fitted.

use super::regime::Node;
use super::starts::IN_PROPORTION;
use crate::error::InputError;
use crate::inverse::{
    Added, Fit, Free, Model, Own, Owner, Record, Rubbing, STANDS_STILL, coarser, fit_near_until,
};
use bristle_plant::Unit;
use bristle_plant::effect::{Entry, Kind, Parameter, Scale};
use nalgebra::{DMatrix, DVector};
use std::borrow::Cow;

/// Effect with bristles in series with those of the simulator.
const IN_SERIES: &str = "friction.presliding";
/// Fewest waves of torque over the stroke of a linear axis, or the longest stretch of time: less stands for any smooth curve,
/// an offset, a spring.
const LEAST_WAVES: f64 = 1.0;
/// Fewest waves of what friction, inertia or the sensor is multiplied by: half a one is a slope.
const LEAST_WAVES_OF_A_FACTOR: f64 = 0.5;
/// Effects whose wave is a torque by itself.
pub(super) const TORQUE_WAVES: [&str; 3] = [
    "actuator.cogging",
    "disturbance.periodic",
    "mechanics.unbalance",
];
/// With it the simulator's own start so many times stiffer.
const MAKES_ROOM: f64 = 4.0;

/// Part of the effort by which an effect changes how much of it arrives.
const CHANGES_GAIN: f64 = 0.01;

/// A place to start a fit from, and how much of the weighted rest it should take away.
#[derive(Clone, Debug)]
pub struct Start {
    /// Values of the effect's parameters.
    pub values: Vec<f64>,
    /// Phases on each record, where the effect repeats in time.
    pub phases: Vec<f64>,
    /// Expected fall of the sum of squares.
    pub gain: f64,
    /// Expected in proportion to what another size does.
    pub guessed: bool,
}

impl Start {
    /// At these values, whatever they promise.
    pub(crate) fn at(values: Vec<f64>) -> Self {
        Self {
            values,
            phases: Vec::new(),
            gain: 0.0,
            guessed: false,
        }
    }

    /// Whether another start of the effect is in another form: no fit leads from the one to the other.
    pub(super) fn is_of_another_form(&self, other: &Self, entry: &Entry) -> bool {
        let place = entry.parameters.iter().position(|p| p.kind == Kind::Form);
        place.is_some_and(|form| self.values[form] != other.values[form])
    }

    /// Whether another start of the effect is in another form, or so far from this one that a fit may come out elsewhere.
    pub(super) fn leads_elsewhere(&self, other: &Self, entry: &Entry) -> bool {
        let pairs = self.values.iter().zip(&other.values);
        entry
            .parameters
            .iter()
            .zip(pairs)
            .any(|(parameter, (x, y))| match parameter.kind {
                Kind::Size => !(1.0 / IN_PROPORTION..=IN_PROPORTION).contains(&(x / y)) && x != y,
                Kind::Phase => false,
                _ => x != y,
            })
    }
}

/// Sorts by what they promise, most first.
pub(super) fn sort(starts: &mut [Start]) {
    starts.sort_by(|a, b| b.gain.total_cmp(&a.gain));
}

/// An effect, and where to start from, best first.
pub(super) type Screened = (&'static Entry, Vec<Start>);

/// What all candidates are laid against: a fitted model and its weighted rest.
pub struct Background<'a> {
    /// The model without the effect.
    pub model: &'a Model,
    /// Its records.
    pub records: &'a [Record],
    /// Their nodes.
    pub nodes: &'a [Node],
    /// Size of axis and records.
    pub scale: &'a Scale,
    /// Weight of each node.
    pub weights: &'a [f64],
    /// The fit.
    pub fit: &'a Fit,
    basis: DMatrix<f64>,
    /// Part of each record's effort that arrives.
    arrives: Vec<f64>,
    fine: Followed<'a>,
    /// In samples as long as their nodes allow, where that is longer.
    coarse: Option<Followed<'a>>,
}

/// Records that the model was taken along.
struct Followed<'a> {
    records: Cow<'a, [Record]>,
    /// Friction of the model's contact along their motion, N m.
    friction_nm: Vec<f64>,
}

impl<'a> Followed<'a> {
    /// The records, and what the model leaves over of them, N m.
    fn new(model: &Model, at: &[f64], records: Cow<'a, [Record]>) -> (Self, Vec<f64>) {
        let mut friction_nm = Model::places(&records);
        let rubbing = Rubbing::Kept(&mut friction_nm);
        // It could be followed when it was fitted.
        let left_over_nm = model.left_over_rubbing(&records, at, rubbing);
        let followed = Self {
            records,
            friction_nm,
        };
        (followed, left_over_nm.unwrap_or_default())
    }
}

impl<'a> Background<'a> {
    /// Makes the basis of what the model's own parameters can do.
    pub fn new(
        model: &'a Model,
        records: &'a [Record],
        nodes: &'a [Node],
        scale: &'a Scale,
        weights: &'a [f64],
        fit: &'a Fit,
    ) -> Self {
        let (rows, columns) = fit.jacobian.shape();
        let mut stacked = DMatrix::zeros(rows + columns, columns);
        stacked.rows_mut(0, rows).copy_from(&fit.jacobian);
        for (i, free) in model.free.iter().enumerate() {
            stacked[(rows + i, i)] = 1.0 / free.spread;
        }
        let (fine, _) = Followed::new(model, &fit.at, Cow::Borrowed(records));
        let coarse = coarser(records).map(|coarse| {
            let (mut followed, left_over_nm) = Followed::new(model, &fit.at, Cow::Owned(coarse));
            let lacks = fit.left_over.iter().zip(left_over_nm).map(|(f, c)| f - c);
            let mut lacks = lacks.collect::<Vec<_>>().into_iter();
            for record in followed.records.to_mut() {
                record.lacks_nm = lacks.by_ref().take(record.nodes()).collect();
            }
            followed
        });
        let without = || vec![1.0; records.len()];
        let arrives = if model.effects.is_empty() {
            without()
        } else {
            let followed = coarse.as_ref().unwrap_or(&fine);
            let arrives = model.gains(&followed.records, &fit.at);
            arrives.unwrap_or_else(|_| without())
        };
        Self {
            model,
            records,
            nodes,
            scale,
            weights,
            fit,
            basis: stacked.qr().q().rows(0, rows).into_owned(),
            arrives,
            fine,
            coarse,
        }
    }

    /// The weighted rest.
    pub fn rest(&self) -> DVector<f64> {
        self.weighted(&self.fit.left_over)
    }

    pub(super) fn weighted(&self, values: &[f64]) -> DVector<f64> {
        DVector::from_iterator(
            values.len(),
            values.iter().zip(self.weights).map(|(x, w)| x * w),
        )
    }

    /// Whether an effect has a size that cannot be zero.
    pub fn never_zero(&self, entry: &Entry) -> bool {
        let above = |p: &Parameter| p.kind == Kind::Size && (p.range)(self.scale)[0] > 0.0;
        entry.parameters.iter().any(above)
    }

    /// What is left of a change once the model's own parameters have done what they can.
    pub fn beyond(&self, change: &DVector<f64>) -> DVector<f64> {
        change - &self.basis * (self.basis.tr_mul(change))
    }

    /// What the model's own parameters can do at these nodes, a column each.
    pub(super) fn own_at(&self, nodes: &[usize]) -> DMatrix<f64> {
        self.basis.select_rows(nodes).transpose()
    }

    fn with_values(&self, entry: &'static Entry, values: &[f64]) -> Model {
        let mut model = self.model.clone();
        model.effects.push(Added {
            entry,
            values: values.to_vec(),
        });
        model
    }

    /// Whether an effect changes how much of the effort arrives. Its change is then judged by the effort that was recorded: letting nothing
    /// through it would explain everything.
    pub(super) fn scales_effort(&self, entry: &'static Entry, values: &[f64]) -> bool {
        let model = self.with_values(entry, values);
        self.changes_gain(entry, &model, &self.fit.at)
            .unwrap_or_default()
    }

    /// Whether `entry`, the last effect of a model, changes at a point how much of the effort arrives, as the first record
    /// tells. What a limit cuts does not arrive at all, and its range keeps it from cutting everything.
    fn changes_gain(&self, entry: &Entry, model: &Model, at: &[f64]) -> Result<bool, InputError> {
        if entry.cuts() {
            return Ok(false);
        }
        let gains = model.gains(&self.longest().records[..1], at)?;
        Ok((gains[0] - self.arrives[0]).abs() > CHANGES_GAIN)
    }

    /// The records in the longest samples.
    fn longest(&self) -> &Followed<'a> {
        self.coarse.as_ref().unwrap_or(&self.fine)
    }

    /// What an effect is followed along until it is fitted to the end.
    fn followed(&self, entry: &Entry) -> &Followed<'a> {
        if entry.acts_in_moments() {
            &self.fine
        } else {
            self.longest()
        }
    }

    /// Change of the weighted rest that an effect makes.
    pub(super) fn change(
        &self,
        entry: &'static Entry,
        values: &[f64],
        scales_effort: bool,
    ) -> Option<DVector<f64>> {
        let mut model = self.with_values(entry, values);
        // What it does not change is known.
        if model.scales_effort && !scales_effort {
            model.arrives = Some(self.arrives.clone());
        }
        model.scales_effort |= scales_effort;
        let followed = self.followed(entry);
        let rubbing = Rubbing::Known(&followed.friction_nm);
        let rest = model
            .left_over_rubbing(&followed.records, &self.fit.at, rubbing)
            .ok()?;
        let change: Vec<f64> = rest
            .iter()
            .zip(&self.fit.left_over)
            .map(|(a, b)| a - b)
            .collect();
        let weighted = self.weighted(&change);
        weighted.iter().all(|x| x.is_finite()).then_some(weighted)
    }

    /// The model with an effect added, free about a start.
    pub fn with(&self, entry: &'static Entry, start: &Start) -> Model {
        let mut model = self.model.clone();
        let place = model.effects.len();
        model.effects.push(Added {
            entry,
            values: start.values.clone(),
        });
        let unit = self.scale.unit;
        let held = no_wave(entry, &start.values);
        for (i, parameter) in entry.parameters.iter().enumerate() {
            if held.contains(&Some(i)) {
                continue;
            }
            let value = start.values[i];
            let [low, high] = (parameter.range)(self.scale);
            let owner = Owner::Effect(place, i);
            let name = parameter.name(unit);
            let logarithmic = low > 0.0;
            let hard = hard_range([low, high]);
            match parameter.kind {
                Kind::Size => {
                    let spread = low.abs().max(high.abs());
                    let mut free = Free::linear(owner, name, value, spread, hard);
                    free.center = 0.0;
                    model.free.push(free);
                }
                Kind::Order if unit == Unit::Rotary => {}
                Kind::Order | Kind::Frequency => {
                    let least = self.least_line(entry, parameter.kind);
                    let near = 0.5 / self.span(parameter.kind);
                    model.free.push(Free::linear(
                        owner,
                        name,
                        value,
                        near,
                        [(value - 3.0 * near).max(least), value + 3.0 * near],
                    ));
                }
                Kind::Phase if !start.phases.is_empty() => {
                    for (record, &value) in start.phases.iter().enumerate() {
                        let owner = Owner::OnRecord(place, i, record);
                        model
                            .free
                            .push(Free::linear(owner, name, value, 3.0, [-20.0, 20.0]));
                    }
                }
                Kind::Phase => {
                    model
                        .free
                        .push(Free::linear(owner, name, value, 3.0, [-20.0, 20.0]))
                }
                // The slope of a jump says nothing: a fit that counted on it would go nowhere.
                Kind::Event | Kind::Place => {}
                Kind::Form | Kind::Side | Kind::Seed | Kind::Detail => {}
                _ if logarithmic => {
                    let mut free = Free::about(owner, name, value, 0.25 * (high / low).ln(), hard);
                    free.center = 0.5 * (low.ln() + high.ln());
                    model.free.push(free);
                }
                _ if high > low => {
                    let mut free = Free::linear(owner, name, value, 0.4 * (high - low), hard);
                    free.center = 0.5 * (low + high);
                    model.free.push(free);
                }
                _ => {}
            }
        }
        model
    }

    /// Fewest waves a metre or a second of an effect that are told from any smooth curve.
    pub(super) fn least_line(&self, entry: &Entry, kind: Kind) -> f64 {
        let waves = if TORQUE_WAVES.contains(&entry.id) {
            LEAST_WAVES
        } else {
            LEAST_WAVES_OF_A_FACTOR
        };
        waves / self.span(kind)
    }

    /// Travel that an order, or time that a frequency is seen over, m or s.
    fn span(&self, kind: Kind) -> f64 {
        let span = match kind {
            Kind::Frequency => self.scale.duration_s,
            _ => self.scale.stroke_rad(),
        };
        span.max(1e-9)
    }

    /// Fits the model with an effect from its best starts.
    ///
    /// # Errors
    /// The friction model refuses the parameters of every start.
    pub fn try_effect(
        &self,
        entry: &'static Entry,
        starts: &[Start],
    ) -> Result<Option<(Model, Fit)>, InputError> {
        let mut best: Option<(Model, Fit)> = None;
        for start in starts {
            let fitted = self.fitted(STANDS_STILL, entry, start)?;
            if best
                .as_ref()
                .is_none_or(|(_, other)| fitted.1.cost < other.cost)
            {
                best = Some(fitted);
            }
        }
        Ok(best)
    }

    /// The same from one start, until the cost changes by less than this part of itself; along longer samples where it only shows what it promises.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    pub(super) fn fitted(
        &self,
        cost_stands_still: f64,
        entry: &'static Entry,
        start: &Start,
    ) -> Result<(Model, Fit), InputError> {
        let mut model = self.with(entry, start);
        let mut from = self.fit.at.clone();
        from.extend(model.start().into_iter().skip(from.len()));
        // Its bristles are in series with the simulator's, which have to make room.
        if entry.id == IN_SERIES
            && let Some(stiffness) = model.free.iter().position(is_stiffness)
        {
            from[stiffness] += MAKES_ROOM.ln();
        }
        model.scales_effort |= self.changes_gain(entry, &model, &from)?;
        let records = if cost_stands_still > STANDS_STILL {
            &self.followed(entry).records
        } else {
            self.records
        };
        let near = |model: &Model, from: Vec<f64>| {
            let known = &self.fit.jacobian;
            fit_near_until(cost_stands_still, model, records, self.weights, from, known)
        };
        let mut fit = near(&model, from)?;
        // Where it came out it may, where it started not.
        if !model.scales_effort && self.changes_gain(entry, &model, &fit.at)? {
            model.scales_effort = true;
            fit = near(&model, fit.at)?;
        }
        if let Some(elsewhere) = self.onset_elsewhere(records, &model, &fit) {
            let other = near(&model, elsewhere)?;
            if other.cost < fit.cost {
                fit = other;
            }
        }
        Ok((model, fit))
    }
}

fn is_stiffness(free: &Free) -> bool {
    free.owner == Owner::Own(Own::Stiffness)
}

/// Size, order or frequency, and phase of the wave that an effect has at these values but not in any size: freed from a
/// wave that was not looked for they follow any smooth curve.
fn no_wave(entry: &Entry, values: &[f64]) -> [Option<usize>; 3] {
    let of = |kind: Kind| entry.parameters.iter().position(|p| p.kind == kind);
    let Some(phase) = of(Kind::Phase) else {
        return [None; 3];
    };
    match size_before(entry, phase) {
        Some(size) if values[size] == 0.0 => {
            let line = of(Kind::Order).or_else(|| of(Kind::Frequency));
            [Some(size), line, Some(phase)]
        }
        _ => [None; 3],
    }
}

/// The size that a phase, a moment or a place belongs to: the last one before it.
pub(super) fn size_before(entry: &Entry, parameter: usize) -> Option<usize> {
    entry.parameters[..parameter]
        .iter()
        .rposition(|p| p.kind == Kind::Size)
}

/// A usual range, widened to what is still physical: three times as far, on the same side of zero.
pub(super) fn hard_range([low, high]: [f64; 2]) -> [f64; 2] {
    let widen = |x: f64, inner: bool| if inner { x / 3.0 } else { 3.0 * x };
    [widen(low, low > 0.0), widen(high, high < 0.0)]
}
