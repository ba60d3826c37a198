//! A TOML file being read: values of the kind that is wanted, and every mistake with its line and character.

use std::ops::Range as Span;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use crate::axis_file::keys::Range;
use crate::error::{InputError, quoted};
use crate::input::{character_at, line_at};
use crate::names::nearest;

pub(crate) type Key<'a> = Spanned<DeString<'a>>;
pub(crate) type Value<'a> = Spanned<DeValue<'a>>;

/// The text being read, to say where in it something is wrong.
pub(crate) struct Source<'a> {
    path: &'a Path,
    text: &'a str,
}

impl<'a> Source<'a> {
    pub(crate) fn new(text: &'a str, path: &'a Path) -> Self {
        Self { path, text }
    }

    /// The text as TOML.
    pub(crate) fn document(&self) -> Result<Spanned<DeTable<'a>>, InputError> {
        DeTable::parse(self.text).map_err(|error| {
            let message = error.message().lines().collect::<Vec<_>>().join(", ");
            self.wrong(
                error.span().unwrap_or_default(),
                format!("not TOML: {message}"),
                "mend it; strings stand in quotes, a key stands once",
            )
        })
    }

    pub(crate) fn wrong(
        &self,
        span: Span<usize>,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        InputError::new(self.path, message, remedy)
            .at_line(line_at(self.text.as_bytes(), span.start))
            .at_character(character_at(self.text.as_bytes(), span.start))
    }

    pub(crate) fn table<'t, 'b>(
        &self,
        section: &str,
        value: &'t Value<'b>,
    ) -> Result<&'t DeTable<'b>, InputError> {
        value.get_ref().as_table().ok_or_else(|| {
            self.wrong(
                value.span(),
                format!("{section} is {}, not a section", kind(value)),
                format!("write [{section}] on a line of its own, its keys below it"),
            )
        })
    }

    pub(crate) fn number(
        &self,
        name: &str,
        value: &Value<'_>,
        range: Range,
    ) -> Result<f64, InputError> {
        let number = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            // From here to there as text: a whole number beyond 64 bits is still a fine float.
            DeValue::Integer(integer) if integer.radix() == 10 => integer.as_str().parse().ok(),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix())
                .ok()
                .map(|whole| whole as f64),
            _ => None,
        };
        match number {
            Some(number) if range.holds(number) => Ok(number),
            Some(number) => Err(self.wrong(
                value.span(),
                format!("{name} is {number:?}"),
                format!("it must be {}", range.rule()),
            )),
            None => Err(self.wrong(
                value.span(),
                format!("{name} is {}", kind(value)),
                format!("it must be {}", range.rule()),
            )),
        }
    }

    pub(crate) fn choice<T>(
        &self,
        key: &str,
        value: &Value<'_>,
        names: impl Iterator<Item = &'static str> + Clone,
        from_name: fn(&str) -> Option<T>,
    ) -> Result<T, InputError> {
        let all = names.clone().collect::<Vec<_>>().join(", ");
        let Some(text) = value.get_ref().as_str() else {
            return Err(self.wrong(
                value.span(),
                format!("{key} is {}", kind(value)),
                format!("it must be one of {all}, in quotes"),
            ));
        };
        from_name(text).ok_or_else(|| {
            self.wrong(
                value.span(),
                format!("unknown {key} {}", quoted(text)),
                match nearest(text, names) {
                    Some(near) => format!("did you mean \"{near}\"?"),
                    None => format!("it must be one of {all}"),
                },
            )
        })
    }
}

/// A value's kind, for messages.
pub(crate) fn kind(value: &Value<'_>) -> &'static str {
    match value.get_ref() {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}
