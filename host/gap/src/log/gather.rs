//! Rows of cells into the columns of a log, whatever file they come from.

use std::path::Path;

use super::columns::{KNOWN, Known, Role, known};
use super::{Cells, Effort, EffortKind, Log, Position, PositionKind, Unknown};
use crate::capture::About;
use crate::error::{InputError, quoted};
use crate::names::nearest;
use bristle_plant::Unit;

/// A log on its way.
pub(super) struct Gather<'a> {
    path: &'a Path,
    /// Of the columns.
    pub names: Vec<String>,
    unit: Option<Unit>,
    columns: Vec<Gathered>,
    last_time_s: Option<f64>,
    /// Rows so far.
    pub rows: usize,
}

/// What one column has gathered.
#[derive(Default)]
struct Gathered {
    /// None: kept as text.
    known: Option<Known>,
    numbers: Vec<f64>,
    text: Cells,
}

impl<'a> Gather<'a> {
    /// One place for each column, after a check that all that is needed is there.
    pub fn new(path: &'a Path, names: Vec<String>, needed: &[Need]) -> Result<Self, InputError> {
        let unit = unit(path, &names)?;
        check(path, &names, needed)?;
        let rad_or_m = names.iter().filter_map(|name| known(name)).any(|known| {
            matches!(
                known.role,
                Role::Position(PositionKind::Rad | PositionKind::M)
            )
        });
        let columns = names.iter().map(|name| Gathered {
            // Beside rad or m the counts say nothing more, and they would need the axis file.
            known: known(name)
                .filter(|known| !(rad_or_m && known.role == Role::Position(PositionKind::Counts))),
            ..Gathered::default()
        });
        Ok(Self {
            path,
            columns: columns.collect(),
            names,
            unit,
            last_time_s: None,
            rows: 0,
        })
    }

    /// Adds a row, of as many cells as there are columns. An error names the column.
    pub fn row<'c>(&mut self, cells: impl Iterator<Item = &'c [u8]>) -> Result<(), InputError> {
        for ((cell, column), name) in cells.zip(&mut self.columns).zip(&self.names) {
            let Some(known) = column.known else {
                column.text.push(&String::from_utf8_lossy(cell));
                continue;
            };
            let value = number(cell)
                .and_then(|value| fits(known, value, cell, self.last_time_s))
                .map_err(|(message, remedy)| {
                    InputError::new(self.path, message, remedy).in_column(name)
                })?;
            if known.role == Role::Time {
                self.last_time_s = Some(value);
            }
            column.numbers.push(value);
        }
        self.rows += 1;
        Ok(())
    }

    /// The log; `about` is what the file says of itself.
    pub fn log(self, about: About) -> Log {
        let mut log = Log {
            file: self.path.to_path_buf(),
            unit: self.unit,
            time_s: Vec::new(),
            efforts: Vec::new(),
            position: Position {
                kind: PositionKind::Counts,
                values: Vec::new(),
            },
            position_load: None,
            position_ref: None,
            velocity: None,
            temperature_c: None,
            unknown: Vec::new(),
            about,
        };
        for (name, column) in self.names.into_iter().zip(self.columns) {
            let values = column.numbers;
            match column.known.map(|known| known.role) {
                None => log.unknown.push(Unknown {
                    name,
                    values: column.text,
                }),
                Some(Role::Time) => log.time_s = values,
                Some(Role::Effort(kind)) => log.efforts.push(Effort { kind, values }),
                Some(Role::Position(kind)) => log.position = Position { kind, values },
                Some(Role::PositionLoad) => log.position_load = Some(values),
                Some(Role::PositionRef) => log.position_ref = Some(values),
                Some(Role::Velocity) => log.velocity = Some(values),
                Some(Role::Temperature) => log.temperature_c = Some(values),
            }
        }
        log.efforts.sort_by_key(|effort| match effort.kind {
            EffortKind::TorqueMeasured => 0,
            EffortKind::TorqueReference => 1,
            EffortKind::Current => 2,
            EffortKind::Voltage => 3,
        });
        log
    }
}

/// Rotary or linear, if the names say so and agree.
fn unit(path: &Path, names: &[String]) -> Result<Option<Unit>, InputError> {
    let mut said = names
        .iter()
        .filter_map(|name| known(name))
        .filter_map(|known| known.unit.map(|unit| (known.name, unit)));
    let Some((first, unit)) = said.next() else {
        return Ok(None);
    };
    match said.find(|(_, other)| *other != unit) {
        None => Ok(Some(unit)),
        Some((name, other)) => Err(InputError::new(
            path,
            format!("{name} is of a {other} axis, {first} of a {unit} one"),
            "use torque and rad for a rotary axis, force and m for a linear one",
        )
        .in_column(name)),
    }
}

/// Refuses names that lack a column which is needed.
fn check(path: &Path, names: &[String], needed: &[Need]) -> Result<(), InputError> {
    let has = |wanted: fn(Role) -> bool| {
        names
            .iter()
            .any(|name| known(name).is_some_and(|known| wanted(known.role)))
    };
    let missing: Vec<Need> = needed
        .iter()
        .copied()
        .filter(|&(_, wanted)| !has(wanted))
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let list: Vec<_> = missing.iter().map(|(what, _)| *what).collect();
    let plural = if list.len() == 1 { "column" } else { "columns" };
    Err(InputError::new(
        path,
        format!("missing {plural}: {}", list.join(", and ")),
        suggestion(names, &missing),
    ))
}

/// What is needed, for messages, and the columns that serve.
pub(super) type Need = (&'static str, fn(Role) -> bool);

/// What a log cannot do without.
pub(super) const NEEDED: [Need; 3] = [
    ("time_s", |role| role == Role::Time),
    (
        "an effort (torque_nm, force_n, torque_ref_nm, force_ref_n, current_a or voltage_v)",
        |role| matches!(role, Role::Effort(_)),
    ),
    (
        "a position (position_rad, position_m or position_counts)",
        |role| matches!(role, Role::Position(_)),
    ),
];

/// What the input of a simulation cannot do without.
pub(super) const NEEDED_OF_INPUT: [Need; 2] = [
    NEEDED[0],
    (
        "an effort (torque_nm, force_n, torque_ref_nm, force_ref_n, current_a or voltage_v) or a position reference",
        |role| matches!(role, Role::Effort(_) | Role::PositionRef),
    ),
];

/// Names present that look like a missing one.
fn suggestion(names: &[String], missing: &[Need]) -> String {
    let mut hints = Vec::new();
    for name in names.iter().filter(|name| known(name).is_none()) {
        let wanted = KNOWN
            .iter()
            .filter(|known| missing.iter().any(|(_, wanted)| wanted(known.role)))
            .map(|known| known.name);
        if let Some(near) = nearest(name, wanted) {
            let symbol = known(near).map_or("", |known| known.symbol);
            hints.push(format!(
                "{near} (in {symbol}) where it says {}",
                quoted(name)
            ));
        }
    }
    if hints.is_empty() {
        let there: Vec<_> = names.iter().take(12).map(|name| quoted(name)).collect();
        format!("the header has {}", there.join(", "))
    } else {
        format!("did you mean {}?", hints.join(", "))
    }
}

/// What is wrong with a cell, and the remedy.
type Wrong = (String, &'static str);

pub(super) fn number(cell: &[u8]) -> Result<f64, Wrong> {
    let cell = cell.trim_ascii();
    let value: Option<f64> = fast_float2::parse(cell).ok();
    match value {
        Some(value) if value.is_finite() => Ok(value),
        Some(value) if value.is_nan() => Err((
            "is not a number (NaN)".to_owned(),
            "delete the row; a gap in time is allowed",
        )),
        Some(_) => Err((
            format!("{} is infinite", quoted(&String::from_utf8_lossy(cell))),
            "delete the row; a gap in time is allowed",
        )),
        None if cell.is_empty() => Err((
            "the cell is empty".to_owned(),
            "fill it or delete the row; a gap in time is allowed",
        )),
        None => Err((
            format!("{} is not a number", quoted(&String::from_utf8_lossy(cell))),
            "write a number with a decimal point and without its unit",
        )),
    }
}

/// Checks that go beyond being a number.
fn fits(known: Known, value: f64, cell: &[u8], last_time_s: Option<f64>) -> Result<f64, Wrong> {
    // Above 2^53 neighbouring counts are no longer distinct.
    const MOST_COUNTS: f64 = 9_007_199_254_740_992.0;
    let shown = || quoted(String::from_utf8_lossy(cell).trim());
    match (known.role, last_time_s) {
        (Role::Time, Some(last)) if value == last => Err((
            format!("time {} stands twice in a row", shown()),
            "delete the duplicate row, or print time with more digits",
        )),
        (Role::Time, Some(last)) if value < last => Err((
            format!("time goes back from {last:?} to {}", shown()),
            "sort the rows by time, or give one record a file",
        )),
        (Role::Position(PositionKind::Counts), _)
            if value.fract() != 0.0 || value.abs() > MOST_COUNTS =>
        {
            Err((
                format!("{} is not a whole number of counts within 2^53", shown()),
                "give encoder counts, or name the column position_rad or position_m",
            ))
        }
        _ => Ok(value),
    }
}
