//! Writing an axis file, so that it reads back equal.

use std::fmt::Write as _;
use std::path::Path;

use super::AxisFile;
use super::keys::{KEYS, MODEL, SECTIONS, STRIBECK_SHAPE};
use crate::error::InputError;
use crate::output::write_atomically;

impl AxisFile {
    /// Writes the file, whole or not at all, and only if it can be read again.
    ///
    /// # Errors
    /// The path cannot be written, or a value is out of its range: a fit that went astray leaves no file behind.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), InputError> {
        self.write_under(&[], path)
    }

    /// The same with lines of comment above it.
    ///
    /// # Errors
    /// As [`AxisFile::write`].
    pub fn write_under(&self, head: &[String], path: impl AsRef<Path>) -> Result<(), InputError> {
        let mut text = String::new();
        for line in head.iter().flat_map(|words| words.lines()) {
            // TOML allows no control characters in a comment.
            text += &format!("# {}\n", line.replace(char::is_control, " "));
        }
        if !text.is_empty() {
            text.push('\n');
        }
        text += &self.to_toml();
        Self::parse(&text, &path)?;
        write_atomically(path, |writer| writer.write_all(text.as_bytes()))
    }

    /// The file's text.
    ///
    /// ```
    /// use bristle_gap::{AxisFile, Unit};
    /// let mut file = AxisFile::new(Unit::Linear, 95.11);
    /// file.friction.coulomb = Some(20.39);
    /// assert_eq!(file.to_toml(), "[axis]\nmass_kg = 95.11\n\n[friction]\ncoulomb_n = 20.39\n");
    /// ```
    pub fn to_toml(&self) -> String {
        let mut sections: Vec<String> = Vec::new();
        for section in SECTIONS {
            let mut lines = String::new();
            if section == "friction" {
                let named = [
                    (MODEL, self.friction.model.map(|model| model.name())),
                    (
                        STRIBECK_SHAPE,
                        self.friction.stribeck_shape.map(|shape| shape.name()),
                    ),
                ];
                for (key, name) in named {
                    if let Some(name) = name {
                        lines += &format!("{key} = \"{name}\"\n");
                    }
                }
            }
            for key in KEYS.iter().filter(|key| key.section == section) {
                if let Some(value) = (key.get)(self) {
                    lines += &format!("{} = {}\n", key.name(self.unit), number(value));
                }
            }
            if !lines.is_empty() {
                sections.push(format!("[{section}]\n{lines}"));
            }
        }
        for effect in &self.effects {
            let mut lines = format!("[[effect]]\nid = {}\n", quoted(&effect.id));
            for (name, value) in &effect.parameters {
                lines += &format!("{} = {}\n", key(name), number(*value));
            }
            sections.push(lines);
        }
        sections.join("\n")
    }
}

/// The shortest form that reads back equal; without a point where the number is whole and short.
pub(crate) fn number(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e9 && value.is_sign_positive() {
        format!("{value}")
    } else {
        // TOML spells NaN in small letters.
        format!("{value:?}").to_lowercase()
    }
}

/// A name as a key: bare where TOML lets it be.
fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) {
        name.to_owned()
    } else {
        quoted(name)
    }
}

/// A TOML basic string.
pub(crate) fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                // Writing into a String does not fail.
                let _ = write!(quoted, "\\u{:04X}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}
