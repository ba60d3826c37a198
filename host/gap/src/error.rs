//! The one error of everything that reads or writes a user's file.

use std::fmt::{self, Write as _};
use std::path::{Path, PathBuf};

/// Place within a line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Column {
    /// Name of a CSV column.
    Name(String),
    /// Character of a line, from 1.
    Character(u64),
}

/// What is wrong with a file, where, and what to do about it.
///
/// Displays as one line whatever the file holds: control characters are escaped.
///
/// ```
/// use bristle_gap::InputError;
/// let error = InputError::new("log.csv", "`abc` is not a number", "write a decimal number")
///     .at_line(17)
///     .in_column("torque_nm");
/// assert_eq!(
///     error.to_string(),
///     "log.csv:17: column torque_nm: `abc` is not a number; write a decimal number"
/// );
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputError {
    /// The file as the user named it.
    pub file: PathBuf,
    /// Line from 1, where there is one.
    pub line: Option<u64>,
    /// Place within the line, where there is one.
    pub column: Option<Column>,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub remedy: String,
}

impl InputError {
    /// An error of the file as a whole.
    pub fn new(
        file: impl AsRef<Path>,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            file: file.as_ref().to_path_buf(),
            line: None,
            column: None,
            message: message.into(),
            remedy: remedy.into(),
        }
    }

    /// The same error at a line, from 1.
    #[must_use]
    pub fn at_line(mut self, line: u64) -> Self {
        self.line = Some(line);
        self
    }

    /// The same error in a named column of a CSV file.
    #[must_use]
    pub fn in_column(mut self, name: impl Into<String>) -> Self {
        self.column = Some(Column::Name(name.into()));
        self
    }

    /// The same error at a character of its line, from 1.
    #[must_use]
    pub fn at_character(mut self, character: u64) -> Self {
        self.column = Some(Column::Character(character));
        self
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        one_line(f, &self.file.to_string_lossy())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        match &self.column {
            Some(Column::Name(name)) => {
                f.write_str(": column ")?;
                one_line(f, name)?;
            }
            Some(Column::Character(character)) => write!(f, ":{character}")?,
            None => {}
        }
        f.write_str(": ")?;
        one_line(f, &self.message)?;
        f.write_str("; ")?;
        one_line(f, &self.remedy)
    }
}

impl std::error::Error for InputError {}

/// Text without control characters and line separators, so that a hostile cell cannot break the line or the terminal.
fn one_line(f: &mut fmt::Formatter<'_>, text: &str) -> fmt::Result {
    for c in text.chars() {
        if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}' | '\u{202a}'..='\u{202e}') {
            write!(f, "{}", c.escape_default())?;
        } else {
            f.write_char(c)?;
        }
    }
    Ok(())
}

/// A cell or name for a message: in back quotes, cut after 40 characters.
pub(crate) fn quoted(text: &str) -> String {
    let mut shown: String = text.chars().take(40).collect();
    if text.chars().nth(40).is_some() {
        shown.push_str("...");
    }
    format!("`{shown}`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_one_line_whatever_it_holds() {
        let error = InputError::new("a\nb.csv", "x\r\ny\u{1b}[2J", "z\u{2028}").at_line(3);
        assert_eq!(error.to_string(), r"a\nb.csv:3: x\r\ny\u{1b}[2J; z\u{2028}");
    }

    #[test]
    fn character_columns_follow_the_line() {
        let error = InputError::new("axis.toml", "wrong", "mend it")
            .at_line(3)
            .at_character(9);
        assert_eq!(error.to_string(), "axis.toml:3:9: wrong; mend it");
    }

    #[test]
    fn long_cells_are_cut() {
        assert_eq!(quoted("ab"), "`ab`");
        assert_eq!(quoted(&"x".repeat(41)), format!("`{}...`", "x".repeat(40)));
    }
}
