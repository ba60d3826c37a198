//! Writing a plan, so that it reads back equal.

use super::fields::{Bound, Place, Time, fields};
use super::{Plan, Step};
use crate::axis_file::write::{number, quoted};
use crate::believed::Believed;
use crate::error::InputError;
use crate::output::write_atomically;
use crate::report::short;
use std::path::Path;

impl Plan {
    /// Writes the file, whole or not at all, and only if it holds against the axis's limits.
    ///
    /// # Errors
    /// The path cannot be written, or [`Plan::check`] refuses the plan.
    pub fn write(&self, path: impl AsRef<Path>, axis: &Believed) -> Result<(), InputError> {
        let text = self.to_toml(axis);
        Self::parse(&text, &path, axis)?;
        write_atomically(path, |writer| writer.write_all(text.as_bytes()))
    }

    /// The file's text, every number written out.
    pub fn to_toml(&self, axis: &Believed) -> String {
        let mut text = format!("[plan]\n{} = {}\n", Time::MOST, number(self.most_s));
        for step in &self.steps {
            text += &to_toml(step, axis);
        }
        text
    }
}

impl Step {
    /// The numbers of its signal in words, under the names that a plan file has for them.
    pub fn size(&self, axis: &Believed) -> String {
        let words: Vec<String> = fields(&mut self.experiment.clone())
            .iter()
            .map(|field| {
                let value = match &field.place {
                    Place::Value(value) => **value,
                    Place::Ticks(ticks) => f64::from(**ticks) / axis.rate_hz,
                    Place::Whole(whole) => f64::from(**whole),
                };
                format!("{} {}", field.name(axis.unit), short(value))
            })
            .collect();
        words.join(", ")
    }
}

fn to_toml(step: &Step, axis: &Believed) -> String {
    let mut text = format!("\n[[experiment]]\nkind = {}\n", quoted(step.name()));
    let mut line = |key: &str, value: String| text += &format!("{key} = {value}\n");
    if !step.why.is_empty() {
        line("why", quoted(&step.why));
    }
    let (plays_s, rests_s) = step.seconds(axis);
    line(Time::PLAYS, number(plays_s));
    line(Time::REST, number(rests_s));
    for field in fields(&mut step.experiment.clone()) {
        let value = match &field.place {
            Place::Value(value) => number(**value),
            Place::Ticks(ticks) => number(f64::from(**ticks) / axis.rate_hz),
            Place::Whole(whole) => whole.to_string(),
        };
        line(field.name(axis.unit), value);
    }
    let bounds = &step.bounds;
    let values = [bounds.travel_rad, bounds.speed_rad_s, bounds.torque_nm];
    for (bound, value) in Bound::ALL.into_iter().zip(values) {
        line(bound.names(axis.unit).0, number(value));
    }
    text
}
