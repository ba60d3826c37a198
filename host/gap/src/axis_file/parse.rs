//! Reading an axis file: every mistake is named with its line and character.

use std::ops::Range as Span;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeString, DeTable, DeValue};

use super::keys::{INERTIA, KEYS, MODEL, Range, SECTIONS, STRIBECK_SHAPE, canonical, find};
use super::{AxisFile, EffectEntry, FrictionModel, StribeckShape};
use crate::error::{InputError, quoted};
use crate::input::{character_at, line_at, read_text};
use crate::names::nearest;
use bristle_plant::Unit;

const EFFECT: &str = "effect";

impl AxisFile {
    /// Reads an axis file.
    ///
    /// # Errors
    /// The file cannot be read, is no TOML, or holds a key or value that means nothing: one error with its place.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        let path = path.as_ref();
        Self::parse(&read_text(path)?, path)
    }

    /// Reads an axis file from text; errors name `path`.
    ///
    /// # Errors
    /// As [`AxisFile::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, InputError> {
        let source = Source {
            path: path.as_ref(),
            text,
        };
        let document = DeTable::parse(text).map_err(|error| {
            let message = error.message().lines().collect::<Vec<_>>().join(", ");
            source.wrong(
                error.span().unwrap_or_default(),
                format!("not TOML: {message}"),
                "mend it; strings stand in quotes, a key stands once",
            )
        })?;
        source.file(document.get_ref())
    }
}

type Key<'a> = Spanned<DeString<'a>>;
type Value<'a> = Spanned<DeValue<'a>>;

/// The text being read, to say where in it something is wrong.
struct Source<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Source<'_> {
    fn wrong(
        &self,
        span: Span<usize>,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        InputError::new(self.path, message, remedy)
            .at_line(line_at(self.text.as_bytes(), span.start))
            .at_character(character_at(self.text.as_bytes(), span.start))
    }

    fn file(&self, document: &DeTable<'_>) -> Result<AxisFile, InputError> {
        let mut file = self.inertia(document)?;
        for (name, value) in document {
            let section = name.get_ref().as_ref();
            if section == EFFECT {
                file.effects = self.effects(value)?;
            } else if SECTIONS.contains(&section) {
                let table = self.table(section, value)?;
                for (key, value) in table {
                    self.key(&mut file, section, key, value)?;
                }
                if section == "friction" {
                    self.stiction(&file, table)?;
                }
            } else {
                return Err(self.unknown_section(name));
            }
        }
        Ok(file)
    }

    /// The axis with its inertia, which decides between rotary and linear and so comes first.
    fn inertia(&self, document: &DeTable<'_>) -> Result<AxisFile, InputError> {
        let missing = |span, message: &str| {
            self.wrong(
                span,
                message,
                format!(
                    "add `{} = ...` (rotary) or `{} = ...` (linear) to [axis]",
                    INERTIA.0, INERTIA.1
                ),
            )
        };
        let Some((section, value)) = document.get_key_value("axis") else {
            // A slip in the section's name is the likelier cause, and more useful to hear of.
            if let Some(name) = document
                .keys()
                .find(|name| !SECTIONS.contains(&name.as_ref().as_ref()) && name.as_ref() != EFFECT)
            {
                return Err(self.unknown_section(name));
            }
            return Err(missing(0..0, "the section [axis] is missing"));
        };
        let table = self.table("axis", value)?;
        match (
            table.get_key_value(INERTIA.0),
            table.get_key_value(INERTIA.1),
        ) {
            (Some(_), None) => Ok(AxisFile::new(Unit::Rotary, 0.0)),
            (None, Some(_)) => Ok(AxisFile::new(Unit::Linear, 0.0)),
            (Some(_), Some((mass, _))) => Err(self.wrong(
                mass.span(),
                format!("{} stands beside {}", INERTIA.1, INERTIA.0),
                "keep the first for a linear axis, the second for a rotary one",
            )),
            (None, None) => {
                if let Some(name) = table
                    .keys()
                    .find(|name| find("axis", name.as_ref()).is_none())
                {
                    return Err(self.unknown_key("axis", name, None));
                }
                Err(missing(section.span(), "the inertia is missing"))
            }
        }
    }

    fn table<'a, 'b>(
        &self,
        section: &str,
        value: &'a Value<'b>,
    ) -> Result<&'a DeTable<'b>, InputError> {
        value.get_ref().as_table().ok_or_else(|| {
            self.wrong(
                value.span(),
                format!("{section} is {}, not a section", kind(value)),
                format!("write [{section}] on a line of its own, its keys below it"),
            )
        })
    }

    fn key(
        &self,
        file: &mut AxisFile,
        section: &str,
        name: &Key<'_>,
        value: &Value<'_>,
    ) -> Result<(), InputError> {
        match (section, name.get_ref().as_ref()) {
            ("friction", MODEL) => {
                let all = FrictionModel::ALL.iter().map(|model| model.name());
                let model = self.choice(MODEL, value, all, FrictionModel::from_name)?;
                file.friction.model = Some(model);
            }
            ("friction", STRIBECK_SHAPE) => {
                let all = StribeckShape::ALL.iter().map(|shape| shape.name());
                let shape = self.choice(STRIBECK_SHAPE, value, all, StribeckShape::from_name)?;
                file.friction.stribeck_shape = Some(shape);
            }
            (_, text) => {
                let text = canonical(text);
                let Some(key) = find(section, text) else {
                    return Err(self.unknown_key(section, name, Some(file.unit)));
                };
                let right = key.name(file.unit);
                if right != text {
                    let (other, decides) = match file.unit {
                        Unit::Rotary => (Unit::Linear, INERTIA.0),
                        Unit::Linear => (Unit::Rotary, INERTIA.1),
                    };
                    return Err(self.wrong(
                        name.span(),
                        format!(
                            "{text} is for a {other} axis, and {decides} makes this one {}",
                            file.unit
                        ),
                        format!("use {right}"),
                    ));
                }
                (key.set)(file, self.number(text, value, key.range)?);
            }
        }
        Ok(())
    }

    fn number(&self, name: &str, value: &Value<'_>, range: Range) -> Result<f64, InputError> {
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

    fn choice<T>(
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

    /// Static friction below Coulomb friction has no meaning in any of the models.
    fn stiction(&self, file: &AxisFile, table: &DeTable<'_>) -> Result<(), InputError> {
        let friction = &file.friction;
        let (Some(stiction), Some(coulomb)) = (friction.stiction, friction.coulomb) else {
            return Ok(());
        };
        if stiction >= coulomb {
            return Ok(());
        }
        let name = |rotary| find("friction", rotary).map_or("", |key| key.name(file.unit));
        let (stiction_name, coulomb_name) = (name("stiction_nm"), name("coulomb_nm"));
        let span = table.get(stiction_name).map(Spanned::span);
        Err(self.wrong(
            span.unwrap_or_default(),
            format!("{stiction_name} is {stiction:?}, below {coulomb_name} = {coulomb:?}"),
            format!("it must be at least {coulomb_name}"),
        ))
    }

    fn effects(&self, value: &Value<'_>) -> Result<Vec<EffectEntry>, InputError> {
        let wrong_form = |value: &Value<'_>| {
            self.wrong(
                value.span(),
                format!("{EFFECT} is {}, not a list of effects", kind(value)),
                "write [[effect]] in double brackets, id = \"...\" and parameters below it",
            )
        };
        let list = value.get_ref().as_array();
        list.ok_or_else(|| wrong_form(value))?
            .iter()
            .map(|entry| match entry.get_ref().as_table() {
                Some(table) => self.effect(entry.span(), table),
                None => Err(wrong_form(entry)),
            })
            .collect()
    }

    fn effect(&self, span: Span<usize>, table: &DeTable<'_>) -> Result<EffectEntry, InputError> {
        let remedy = "give it an id such as id = \"mechanics.offset\"";
        let mut effect = EffectEntry::default();
        for (name, value) in table {
            let name = name.get_ref().as_ref();
            if name == "id" {
                match value.get_ref().as_str() {
                    Some(id) if !id.trim().is_empty() => effect.id = id.to_owned(),
                    _ => {
                        return Err(self.wrong(
                            value.span(),
                            "the id of an effect is not a name",
                            remedy,
                        ));
                    }
                }
            } else {
                let number = self.number(name, value, Range::Any)?;
                effect.parameters.push((name.to_owned(), number));
            }
        }
        if effect.id.is_empty() {
            return Err(self.wrong(span, "an effect without id", remedy));
        }
        Ok(effect)
    }

    fn unknown_section(&self, name: &Key<'_>) -> InputError {
        let text = name.get_ref().as_ref();
        let remedy = if let Some(key) = KEYS
            .iter()
            .find(|key| key.rotary == text || key.linear == text)
        {
            format!("{text} belongs below [{}]", key.section)
        } else {
            let all = SECTIONS.iter().copied().chain([EFFECT]);
            match nearest(text, all) {
                Some(EFFECT) => "did you mean [[effect]]?".to_owned(),
                Some(near) => format!("did you mean [{near}]?"),
                None => format!(
                    "the sections are [{}] and [[effect]]",
                    SECTIONS.join("], [")
                ),
            }
        };
        self.wrong(
            name.span(),
            format!("unknown section {}", quoted(text)),
            remedy,
        )
    }

    /// `unit` is None while it is not known: then both names of a key are offered.
    fn unknown_key(&self, section: &str, name: &Key<'_>, unit: Option<Unit>) -> InputError {
        let text = name.get_ref().as_ref();
        let named = [MODEL, STRIBECK_SHAPE]
            .into_iter()
            .filter(|_| section == "friction");
        let here = KEYS.iter().filter(|key| key.section == section);
        let names: Vec<&str> = here
            .flat_map(|key| match unit {
                Some(unit) => vec![key.name(unit)],
                None => vec![key.rotary, key.linear],
            })
            .chain(named)
            .collect();
        let elsewhere = KEYS
            .iter()
            .find(|key| key.rotary == text || key.linear == text);
        let remedy = match (elsewhere, nearest(text, names.iter().copied())) {
            (Some(key), _) => format!("it belongs below [{}]", key.section),
            (None, Some(near)) => format!("did you mean {near}?"),
            (None, None) => format!("the keys are {}", names.join(", ")),
        };
        self.wrong(
            name.span(),
            format!("unknown key {} in [{section}]", quoted(text)),
            remedy,
        )
    }
}

/// A value's kind, for messages.
fn kind(value: &Value<'_>) -> &'static str {
    match value.get_ref() {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}
