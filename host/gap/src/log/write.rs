//! Writing a log, so that it reads back equal.

use std::path::Path;

use super::columns::{Role, name_of};
use super::{Log, PositionKind};
use crate::error::InputError;
use crate::output::{Values, write_columns};
use bristle_plant::Unit;

impl Log {
    /// Writes the log as CSV, packed where the name ends in `.gz`, whole or not at all.
    ///
    /// # Errors
    /// The path cannot be written, the vectors differ in length, or a value is NaN or infinite: what is written can be
    /// read again.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), InputError> {
        // Without a unit no column is present whose name depends on it.
        let unit = self.unit.unwrap_or(Unit::Rotary);
        let mut columns = vec![(name_of(Role::Time, unit), Values::Numbers(&self.time_s))];
        for effort in &self.efforts {
            columns.push((
                name_of(Role::Effort(effort.kind), unit),
                Values::Numbers(&effort.values),
            ));
        }
        columns.push((
            name_of(Role::Position(self.position.kind), unit),
            match self.position.kind {
                PositionKind::Counts => Values::Whole(&self.position.values),
                _ => Values::Numbers(&self.position.values),
            },
        ));
        for (role, values) in [
            (Role::PositionLoad, &self.position_load),
            (Role::PositionRef, &self.position_ref),
            (Role::Velocity, &self.velocity),
            (Role::Temperature, &self.temperature_c),
        ] {
            if let Some(values) = values {
                columns.push((name_of(role, unit), Values::Numbers(values)));
            }
        }
        for (name, values) in &columns {
            let (Values::Numbers(numbers) | Values::Whole(numbers)) = values else {
                continue;
            };
            if let Some(row) = numbers.iter().position(|number| !number.is_finite()) {
                return Err(InputError::new(
                    path,
                    format!("would hold {}", numbers[row]),
                    "nothing was written; a simulation that diverges needs a finer step",
                )
                // The header is line 1.
                .at_line(row as u64 + 2)
                .in_column(*name));
            }
        }
        for column in &self.unknown {
            columns.push((&column.name, Values::Text(&column.values)));
        }
        write_columns(path, &columns)
    }
}
