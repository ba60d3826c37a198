//! Reading a log, and saying exactly what is wrong with one that cannot be read.

use std::path::Path;

use csv::ByteRecord;

use super::columns::{KNOWN, Known, Role, known};
use super::{Effort, EffortKind, Log, Position, PositionKind, Unknown};
use crate::error::{InputError, quoted};
use crate::input::{line_at, read_text};
use crate::names::nearest;
use bristle_plant::Unit;

impl Log {
    /// Reads a CSV log, plain or packed with gzip.
    ///
    /// # Errors
    /// Whatever keeps the file from being a log: one error with file, line and column.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::parse(&read_text(path)?, path)
    }

    /// Reads a log from text; errors name `path`.
    ///
    /// # Errors
    /// As [`Log::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, InputError> {
        Self::parse_needing(text, path.as_ref(), &NEEDED)
    }

    /// Reads the input of a simulation: a log that may lack the position, and the effort if it has a position reference.
    ///
    /// # Errors
    /// As [`Log::read`].
    pub fn read_input(path: impl AsRef<Path>) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::parse_needing(&read_text(path)?, path, &NEEDED_OF_INPUT)
    }

    fn parse_needing(text: &str, path: &Path, needed: &[Need]) -> Result<Self, InputError> {
        let source = Source {
            path,
            text: text.as_bytes(),
        };
        if text.trim().is_empty() {
            return Err(InputError::new(
                source.path,
                "the file is empty",
                "give a log with a header and at least two rows",
            )
            .at_line(1));
        }
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            // Rows of another length are caught below, with a message of our own.
            .flexible(true)
            .from_reader(source.text);
        let mut record = ByteRecord::new();
        source.next(&mut reader, &mut record)?;
        let names = source.names(&record)?;
        let header_line = source.line(&record);
        let unit = source
            .unit(&names)
            .map_err(|error| error.at_line(header_line))?;
        let mut columns = source
            .columns(&names, needed)
            .map_err(|error| error.at_line(header_line))?;
        let mut last_time_s = None;
        let mut rows = 0;
        while source.next(&mut reader, &mut record)? {
            if record.len() != names.len() {
                return Err(source.ragged(&record, &names));
            }
            for ((cell, column), name) in record.iter().zip(&mut columns).zip(&names) {
                let Some(known) = column.known else {
                    column.text.push(String::from_utf8_lossy(cell).into_owned());
                    continue;
                };
                let value = number(cell)
                    .and_then(|value| fits(known, value, cell, last_time_s))
                    .map_err(|(message, remedy)| {
                        InputError::new(source.path, message, remedy)
                            .at_line(source.line(&record))
                            .in_column(name)
                    })?;
                if known.role == Role::Time {
                    last_time_s = Some(value);
                }
                column.numbers.push(value);
            }
            rows += 1;
        }
        if rows < 2 {
            return Err(InputError::new(
                source.path,
                match rows {
                    0 => "only a header, no rows",
                    _ => "one row only",
                },
                "a log needs at least two rows",
            )
            .at_line(source.last_line()));
        }
        Ok(assemble(source.path, unit, names, columns))
    }
}

/// The text being read, to say where in it something is wrong.
struct Source<'a> {
    path: &'a Path,
    text: &'a [u8],
}

/// What one column has gathered.
#[derive(Default)]
struct Gathered {
    /// None: kept as text.
    known: Option<Known>,
    numbers: Vec<f64>,
    text: Vec<String>,
}

impl Source<'_> {
    /// Reads the next record; false at the end.
    fn next(
        &self,
        reader: &mut csv::Reader<&[u8]>,
        record: &mut ByteRecord,
    ) -> Result<bool, InputError> {
        reader.read_byte_record(record).map_err(|error| {
            InputError::new(
                self.path,
                format!("cannot be read as CSV: {error}"),
                "give comma-separated values",
            )
        })
    }

    /// Line on which a record starts. The reader's own count stops before blank lines and before the second half of
    /// a line end, so that it can be one short.
    fn line(&self, record: &ByteRecord) -> u64 {
        let start = record.position().map_or(0, |at| at.byte() as usize);
        let rest = self.text.get(start..).unwrap_or_default();
        let skipped = rest
            .iter()
            .take_while(|&&byte| matches!(byte, b'\r' | b'\n'))
            .count();
        line_at(self.text, start + skipped)
    }

    fn last_line(&self) -> u64 {
        line_at(self.text, self.text.trim_ascii_end().len())
    }

    /// The header's names, each there once.
    fn names(&self, record: &ByteRecord) -> Result<Vec<String>, InputError> {
        let line = self.line(record);
        let wrong = |message: String, remedy: &str| {
            InputError::new(self.path, message, remedy)
                .at_line(line)
                .at_character(1)
        };
        let names: Vec<String> = record
            .iter()
            .map(|name| String::from_utf8_lossy(name).trim().to_owned())
            .collect();
        let first = names.first().map_or("", String::as_str);
        if first.starts_with('#') {
            return Err(wrong(
                format!("{} is a comment, which a log cannot hold", quoted(first)),
                "delete the lines that start with #",
            ));
        }
        if let ([only], Some(separator)) = (
            &names[..],
            [';', '\t'].into_iter().find(|&c| first.contains(c)),
        ) {
            let what = if separator == ';' {
                "semicolons"
            } else {
                "tabs"
            };
            return Err(wrong(
                format!("the header {} is separated by {what}", quoted(only)),
                "separate columns by commas, and write numbers with a decimal point",
            ));
        }
        if names.iter().all(|name| number(name.as_bytes()).is_ok()) {
            return Err(wrong(
                "the first line holds numbers, not the names of columns".to_owned(),
                "put a header such as time_s,torque_nm,position_rad before it",
            ));
        }
        for (i, name) in names.iter().enumerate() {
            if name.is_empty() {
                return Err(wrong(
                    "has no name in the header".to_owned(),
                    "name it, or delete the column",
                )
                .in_column(format!("{}", i + 1)));
            }
            if names.iter().take(i).any(|earlier| earlier == name) {
                return Err(wrong(
                    "stands twice in the header".to_owned(),
                    "rename or delete one of the two",
                )
                .in_column(name));
            }
        }
        Ok(names)
    }

    /// Rotary or linear, if the names say so and agree.
    fn unit(&self, names: &[String]) -> Result<Option<Unit>, InputError> {
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
                self.path,
                format!("{name} is of a {other} axis, {first} of a {unit} one"),
                "use torque and rad for a rotary axis, force and m for a linear one",
            )
            .in_column(name)),
        }
    }

    /// One place to gather for each column, after a check that all that is needed is there.
    fn columns(&self, names: &[String], needed: &[Need]) -> Result<Vec<Gathered>, InputError> {
        let has = |wanted: fn(Role) -> bool| {
            names
                .iter()
                .any(|name| known(name).is_some_and(|known| wanted(known.role)))
        };
        let mut missing = Vec::new();
        for &(what, wanted) in needed {
            if !has(wanted) {
                missing.push((what, wanted));
            }
        }
        if missing.is_empty() {
            let rad_or_m = names.iter().any(|name| {
                known(name).is_some_and(|known| {
                    matches!(
                        known.role,
                        Role::Position(PositionKind::Rad | PositionKind::M)
                    )
                })
            });
            return Ok(names
                .iter()
                .map(|name| Gathered {
                    // Beside rad or m the counts say nothing more, and they would need the axis file.
                    known: known(name).filter(|known| {
                        !(rad_or_m && known.role == Role::Position(PositionKind::Counts))
                    }),
                    ..Gathered::default()
                })
                .collect());
        }
        let list: Vec<_> = missing.iter().map(|(what, _)| *what).collect();
        let plural = if list.len() == 1 { "column" } else { "columns" };
        Err(InputError::new(
            self.path,
            format!("missing {plural}: {}", list.join(", and ")),
            suggestion(names, &missing),
        ))
    }

    fn ragged(&self, record: &ByteRecord, names: &[String]) -> InputError {
        let found = record.len();
        let wanted = names.len();
        let line = self.line(record);
        if record.get(0).is_some_and(|cell| cell.starts_with(b"#")) {
            return InputError::new(
                self.path,
                "a comment, which a log cannot hold",
                "delete the lines that start with #",
            )
            .at_line(line);
        }
        let column = names
            .get(found)
            .cloned()
            .unwrap_or_else(|| format!("{}", wanted + 1));
        let cells = if found == 1 { "cell" } else { "cells" };
        InputError::new(
            self.path,
            format!("{found} {cells} where the header names {wanted} columns"),
            if record.iter().any(|cell| cell.contains(&b'\n')) {
                "close the quote that opens in this row"
            } else if found < wanted {
                "complete the row or delete it"
            } else {
                "delete what is too much; write numbers with a decimal point"
            },
        )
        .at_line(line)
        .in_column(column)
    }
}

/// What is needed, for messages, and the columns that serve.
type Need = (&'static str, fn(Role) -> bool);

/// What a log cannot do without.
const NEEDED: [Need; 3] = [
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
const NEEDED_OF_INPUT: [Need; 2] = [
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

fn number(cell: &[u8]) -> Result<f64, Wrong> {
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

fn assemble(path: &Path, unit: Option<Unit>, names: Vec<String>, columns: Vec<Gathered>) -> Log {
    let mut log = Log {
        file: path.to_path_buf(),
        unit,
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
    };
    for (name, column) in names.into_iter().zip(columns) {
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
