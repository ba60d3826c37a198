//! Reading a plan: every mistake is named with its line and character.

use super::fields::{Bound, Place, Time, fields};
use super::{MOST_S, MOST_STEPS, Plan, Step};
use crate::axis_file::keys::Range;
use crate::believed::Believed;
use crate::error::{InputError, quoted};
use crate::experiments::Named;
use crate::input::read_text;
use crate::names::nearest;
use crate::toml_text::{Key, Source, Value, kind};
use bristle_plant::Unit;
use std::path::Path;
use toml::Spanned;
use toml::de::DeTable;

const PLAN: &str = "plan";
const EXPERIMENT: &str = "experiment";
const KIND: &str = "kind";
const WHY: &str = "why";

impl Plan {
    /// Reads a plan for an axis, and holds it against the axis's limits.
    ///
    /// # Errors
    /// The file cannot be read, is no TOML, holds a key or value that means nothing, or asks for more than the axis
    /// allows: one error with its place.
    pub fn read(path: impl AsRef<Path>, axis: &Believed) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::parse(&read_text(path)?, path, axis)
    }

    /// Reads a plan from text; errors name `path`.
    ///
    /// # Errors
    /// As [`Plan::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>, axis: &Believed) -> Result<Self, InputError> {
        let source = Source::new(text, path.as_ref());
        let document = source.document()?;
        Reader {
            source: &source,
            axis,
        }
        .plan(document.get_ref())
    }
}

struct Reader<'a> {
    source: &'a Source<'a>,
    axis: &'a Believed,
}

impl Reader<'_> {
    fn plan(&self, document: &DeTable<'_>) -> Result<Plan, InputError> {
        let mut plan = Plan {
            most_s: MOST_S,
            steps: Vec::new(),
        };
        let mut rest_ticks = None;
        let mut most = 0..0;
        for (name, value) in document {
            match name.get_ref().as_ref() {
                PLAN => {
                    for (key, value) in self.source.table(PLAN, value)? {
                        match key.get_ref().as_ref() {
                            Time::MOST => {
                                plan.most_s =
                                    self.source.number(Time::MOST, value, Range::Positive)?;
                                most = value.span();
                            }
                            Time::REST => rest_ticks = Some(self.ticks(Time::REST, value, true)?),
                            _ => {
                                return Err(self.unknown(key, "[plan]", &[Time::MOST, Time::REST]));
                            }
                        }
                    }
                }
                EXPERIMENT => {}
                _ => return Err(self.unknown(name, "a plan", &[PLAN, EXPERIMENT])),
            }
        }
        let form = |span| {
            self.source.wrong(
                span,
                "a plan has a list of experiments",
                "write [[experiment]] in double brackets, kind = \"...\" below it",
            )
        };
        let Some(list) = document.get(EXPERIMENT) else {
            return Err(form(0..0));
        };
        let entries = list.get_ref().as_array().ok_or_else(|| form(list.span()))?;
        if entries.is_empty() || entries.len() > MOST_STEPS {
            return Err(self.source.wrong(
                list.span(),
                format!("{} experiments", entries.len()),
                format!("give 1 to {MOST_STEPS}"),
            ));
        }
        for entry in entries.iter() {
            let table = entry.get_ref().as_table();
            let table = table.ok_or_else(|| form(entry.span()))?;
            plan.steps.push(self.step(entry.span(), table, rest_ticks)?);
        }
        plan.duration(self.axis)
            .map_err(|(message, remedy)| self.source.wrong(most, message, remedy))?;
        Ok(plan)
    }

    fn step(
        &self,
        span: std::ops::Range<usize>,
        table: &DeTable<'_>,
        rest_ticks: Option<u32>,
    ) -> Result<Step, InputError> {
        let Some(value) = table.get(KIND) else {
            return Err(self.source.wrong(
                span,
                "an experiment without kind",
                format!("add kind = \"...\", one of {}", names()),
            ));
        };
        let all = Named::ALL.into_iter().map(Named::name);
        let named = self.source.choice(KIND, value, all, Named::from_name)?;
        let mut step = Step::new(named, self.axis);
        step.rest_ticks = rest_ticks.unwrap_or(step.rest_ticks);
        for (key, value) in table {
            self.key(&mut step, key, value)?;
        }
        match step.fault(self.axis) {
            None => Ok(step),
            Some(fault) => {
                // A bound that the file leaves out is the axis's own and cannot be the culprit alone.
                let place = table.get(fault.key).map_or(span, Spanned::span);
                Err(self.source.wrong(place, fault.message, fault.remedy))
            }
        }
    }

    fn key(&self, step: &mut Step, key: &Key<'_>, value: &Value<'_>) -> Result<(), InputError> {
        let name = key.get_ref().as_ref();
        let unit = self.axis.unit;
        match name {
            KIND => return Ok(()),
            WHY => {
                let text = value.get_ref().as_str().ok_or_else(|| {
                    let message = format!("{WHY} is {}", kind(value));
                    self.source
                        .wrong(value.span(), message, "write it in quotes")
                })?;
                step.why = text.to_owned();
                return Ok(());
            }
            Time::PLAYS => {
                step.bounds.ticks = self.ticks(name, value, false)?;
                return Ok(());
            }
            Time::REST => {
                step.rest_ticks = self.ticks(name, value, true)?;
                return Ok(());
            }
            _ => {}
        }
        let bounds = &mut step.bounds;
        let places = [
            &mut bounds.travel_rad,
            &mut bounds.speed_rad_s,
            &mut bounds.torque_nm,
        ];
        for (bound, place) in Bound::ALL.into_iter().zip(places) {
            if bound.names(unit).0 == name {
                *place = self.source.number(name, value, Range::Positive)?;
                return Ok(());
            }
        }
        for field in fields(&mut step.experiment) {
            if field.name(unit) == name {
                match field.place {
                    Place::Value(place) => {
                        *place = self.source.number(name, value, Range::Any)?;
                    }
                    Place::Ticks(place) => *place = self.ticks(name, value, false)?,
                    Place::Whole(place) => {
                        let whole = self.source.number(name, value, Range::Whole)?;
                        *place = whole as u32;
                    }
                }
                return Ok(());
            }
        }
        Err(self.unknown_of(step, key))
    }

    /// Seconds as ticks; none only where that is allowed.
    fn ticks(&self, name: &str, value: &Value<'_>, may_be_none: bool) -> Result<u32, InputError> {
        let seconds = self.source.number(name, value, Range::NotNegative)?;
        let ticks = (seconds * self.axis.rate_hz).round();
        let least = if may_be_none { 0.0 } else { 1.0 };
        if (least..=f64::from(u32::MAX)).contains(&ticks) {
            return Ok(ticks as u32);
        }
        Err(self.source.wrong(
            value.span(),
            format!("{name} is {seconds:?}"),
            format!(
                "it must be from {} to {} s at this axis's rate of {} Hz",
                least / self.axis.rate_hz,
                f64::from(u32::MAX) / self.axis.rate_hz,
                self.axis.rate_hz
            ),
        ))
    }

    fn unknown(&self, key: &Key<'_>, place: &str, known: &[&str]) -> InputError {
        let text = key.get_ref().as_ref();
        let remedy = match nearest(text, known.iter().copied()) {
            Some(near) => format!("did you mean {near}?"),
            None => format!("the keys are {}", known.join(", ")),
        };
        self.source.wrong(
            key.span(),
            format!("unknown key {} in {place}", quoted(text)),
            remedy,
        )
    }

    fn unknown_of(&self, step: &mut Step, key: &Key<'_>) -> InputError {
        let text = key.get_ref().as_ref();
        let name = step.name();
        let of_unit = |unit: Unit, step: &mut Step| -> Vec<&'static str> {
            let numbers = fields(&mut step.experiment);
            let numbers = numbers.iter().map(|field| field.name(unit));
            let bounds = Bound::ALL.into_iter().map(|bound| bound.names(unit).0);
            let others = [KIND, WHY, Time::PLAYS, Time::REST];
            others.into_iter().chain(numbers).chain(bounds).collect()
        };
        let unit = self.axis.unit;
        let (own, other) = match unit {
            Unit::Rotary => (Unit::Rotary, Unit::Linear),
            Unit::Linear => (Unit::Linear, Unit::Rotary),
        };
        let known = of_unit(own, step);
        if let Some(place) = of_unit(other, step).iter().position(|its| *its == text) {
            return self.source.wrong(
                key.span(),
                format!("{text} is for a {other} axis, and this one is {own}"),
                format!("use {}", known[place]),
            );
        }
        self.unknown(key, &format!("the experiment {name}"), &known)
    }
}

fn names() -> String {
    Named::ALL.map(Named::name).join(", ")
}
