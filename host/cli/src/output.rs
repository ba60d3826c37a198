//! What every subcommand shows: tables, progress, JSON and reports.

use bristle_gap::InputError;
use bristle_gap::output::write_atomically;
pub use bristle_gap::report::short;
use bristle_gap::report::{Report, Table};
use comfy_table::{CellAlignment, presets};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use std::io::Write;
use std::path::Path;

/// Writes to standard output. A reader that has gone away is no fault of the program.
pub fn print(text: &str) {
    let _ = std::io::stdout().lock().write_all(text.as_bytes());
}

/// Prints a table of numbers: the first column to the left, the others to the right.
pub fn print_table(table: &Table) {
    show(table, CellAlignment::Right);
}

/// Prints a table of words.
pub fn print_words(table: &Table) {
    show(table, CellAlignment::Left);
}

fn show(table: &Table, alignment: CellAlignment) {
    let mut shown = comfy_table::Table::new();
    shown
        .load_style(presets::ASCII_MARKDOWN)
        .set_content_arrangement(comfy_table::ContentArrangement::Dynamic)
        .set_header(&table.header);
    for row in &table.rows {
        shown.add_row(row);
    }
    for column in shown.column_iter_mut().skip(1) {
        column.set_cell_alignment(alignment);
    }
    print(&format!("{}\n{shown}\n", table.caption));
}

/// A bar from 0 to 1 on standard error, where that is a terminal.
pub struct Progress(ProgressBar);

impl Progress {
    /// Starts a bar.
    pub fn new(what: &'static str) -> Self {
        let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent} % {eta}") {
            bar.set_style(style);
        }
        bar.set_message(what);
        Self(bar)
    }

    /// Starts a line for what has no known end.
    pub fn counting(what: &'static str) -> Self {
        let line = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{prefix} {spinner} {msg} {elapsed}") {
            line.set_style(style);
        }
        line.set_prefix(what);
        Self(line)
    }

    /// Says how far it has come.
    pub fn say(&self, text: &str) {
        self.0.set_message(text.to_owned());
        self.0.tick();
    }

    /// Moves it to a share.
    pub fn set(&self, share: f64) {
        self.0.set_position((share * 1000.0) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// Writes a result as JSON to a file, or to standard output where the file is `-`.
pub fn write_json(path: Option<&Path>, result: &impl Serialize) -> Result<(), InputError> {
    let Some(path) = path else {
        return Ok(());
    };
    let text = serde_json::to_string_pretty(result).map_err(|error| {
        InputError::new(
            path,
            format!("cannot be written: {error}"),
            "report this as a fault",
        )
    })?;
    if path == Path::new("-") {
        print(&format!("{text}\n"));
        return Ok(());
    }
    write_atomically(path, |writer| writeln!(writer, "{text}"))
}

/// Whether a result goes to standard output as JSON, which then takes nothing else.
pub fn json_on_stdout(path: Option<&Path>) -> bool {
    path == Some(Path::new("-"))
}

/// Writes a report and says where it is.
pub fn write_report(path: &Path, report: &Report, quiet: bool) -> Result<(), InputError> {
    write_atomically(path, |writer| writer.write_all(report.to_html().as_bytes()))?;
    if !quiet {
        let whole = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        print(&format!("report: {}\n", whole.display()));
    }
    Ok(())
}

/// Prints lines that a user should hear, on standard error.
pub fn notices<'a>(lines: impl IntoIterator<Item = &'a String>) {
    for line in lines {
        eprintln!("note: {line}");
    }
}

/// The command as the user gave it, for a report.
pub fn command_line() -> String {
    let words: Vec<String> = std::env::args().skip(1).collect();
    format!("bristle {}", words.join(" "))
}

/// Parses a number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    bounded(text, |x| x > 0.0, "above zero")
}

/// Parses a number of zero or more.
pub fn not_negative(text: &str) -> Result<f64, String> {
    bounded(text, |x| x >= 0.0, "zero or more")
}

fn bounded(text: &str, holds: fn(f64) -> bool, rule: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && holds(value) => Ok(value),
        _ => Err(format!("give a number {rule}")),
    }
}
