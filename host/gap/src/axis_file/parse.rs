//! Reading an axis file: every mistake is named with its line and character.

use std::ops::Range as Span;
use std::path::Path;

use toml::Spanned;
use toml::de::DeTable;

use super::keys::{INERTIA, KEYS, MODEL, Range, SECTIONS, STRIBECK_SHAPE, canonical, find};
use super::{AxisFile, EffectEntry, FrictionModel, StribeckShape};
use crate::error::{InputError, quoted};
use crate::input::read_text;
use crate::names::nearest;
use crate::toml_text::{Key, Source, Value, kind};
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
        let source = Source::new(text, path.as_ref());
        let document = source.document()?;
        source.file(document.get_ref())
    }
}

/// What an axis file needs of its text.
impl Source<'_> {
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
