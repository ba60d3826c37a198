//! Reading a log, and saying exactly what is wrong with one that cannot be read.

use std::path::Path;

use csv::ByteRecord;

use super::gather::{Gather, NEEDED, NEEDED_OF_INPUT, Need, number};
use super::{Log, mcap};
use crate::capture::About;
use crate::error::{InputError, quoted};
use crate::input::{line_at, read_bytes, text_of};

impl Log {
    /// Reads a log: CSV, plain or packed with gzip, or MCAP as [`crate::capture::Recorder`] writes it. The first bytes
    /// decide, not the name.
    ///
    /// # Errors
    /// Whatever keeps the file from being a log: one error with file, line and column, or message and column.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        Self::read_needing(path.as_ref(), &NEEDED)
    }

    /// Reads the input of a simulation: a log that may lack the position, and the effort if it has a position reference.
    ///
    /// # Errors
    /// As [`Log::read`].
    pub fn read_input(path: impl AsRef<Path>) -> Result<Self, InputError> {
        Self::read_needing(path.as_ref(), &NEEDED_OF_INPUT)
    }

    /// Reads a CSV log from text; errors name `path`.
    ///
    /// # Errors
    /// As [`Log::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, InputError> {
        parse_needing(text, path.as_ref(), &NEEDED)
    }

    fn read_needing(path: &Path, needed: &[Need]) -> Result<Self, InputError> {
        let bytes = read_bytes(path)?;
        if bytes.starts_with(mcap::MAGIC) {
            mcap::read(path, &bytes, needed)
        } else {
            parse_needing(&text_of(path, bytes)?, path, needed)
        }
    }
}

fn parse_needing(text: &str, path: &Path, needed: &[Need]) -> Result<Log, InputError> {
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
    let mut gather =
        Gather::new(path, names, needed).map_err(|error| error.at_line(header_line))?;
    while source.next(&mut reader, &mut record)? {
        if record.len() != gather.names.len() {
            return Err(source.ragged(&record, &gather.names));
        }
        gather
            .row(record.iter())
            .map_err(|error| error.at_line(source.line(&record)))?;
    }
    if gather.rows < 2 {
        return Err(InputError::new(
            source.path,
            match gather.rows {
                0 => "only a header, no rows",
                _ => "one row only",
            },
            "a log needs at least two rows",
        )
        .at_line(source.last_line()));
    }
    Ok(gather.log(About::new()))
}

/// The text being read, to say where in it something is wrong.
struct Source<'a> {
    path: &'a Path,
    text: &'a [u8],
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
