//! From effects that a controller can cancel to the feed-forward table of `core`, and its file.
//!
//! The table is made by asking each effect what it does at each position in each direction; no effect is spelt out here.
//! What depends on time, load or the past is not in it.

use crate::axis_file::EffectEntry;
use crate::believed::Believed;
use crate::error::InputError;
use crate::input::{character_at, line_at};
use crate::output::write_atomically;
use bristle_core::feed_forward::{FeedForward, POINTS, Span};
use bristle_plant::Unit;
use bristle_plant::contact::Levels;
use bristle_plant::effect::{self, Effect, Instant, Plain};
use serde::Deserialize;
use std::f64::consts::TAU;
use std::path::Path;

/// Effects that a torque by position and direction cancels.
pub const CANCELLED: [&str; 6] = [
    "actuator.cogging",
    "friction.asymmetry",
    "friction.position",
    "mechanics.offset",
    "mechanics.spring",
    "mechanics.unbalance",
];
/// The effect that is undone by a jump.
const DEAD_ZONE: &str = "actuator.deadzone";

/// A table with its numbers in double precision. A linear axis reads m for rad and N for N m.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Where it begins and how far it reaches, rad.
    pub span: Span<f64>,
    /// Torque to add in forward motion, N m.
    pub forward_nm: [f64; POINTS],
    /// Torque to add in backward motion, N m.
    pub backward_nm: [f64; POINTS],
    /// Below this speed the two are blended, rad/s.
    pub speed_band_rad_s: f64,
    /// Half width of the dead zone, N m.
    pub dead_zone_nm: f64,
    /// Ids of the effects in it; a file does not say them.
    pub effects: Vec<String>,
}

/// The file of a table, as [`Table::write`] writes it; the other names are those of a linear axis.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    feed_forward: Section,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    points: usize,
    #[serde(alias = "period_m")]
    period_rad: Option<f64>,
    #[serde(alias = "from_m")]
    from_rad: Option<f64>,
    #[serde(alias = "to_m")]
    to_rad: Option<f64>,
    #[serde(alias = "speed_band_m_s")]
    speed_band_rad_s: f64,
    #[serde(alias = "dead_zone_n")]
    dead_zone_nm: f64,
    #[serde(alias = "forward_n")]
    forward_nm: Vec<f64>,
    #[serde(alias = "backward_n")]
    backward_nm: Vec<f64>,
}

impl Table {
    /// Reads what [`Self::write`] has written.
    ///
    /// # Errors
    /// A file that cannot be read or is no table.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let text = std::fs::read_to_string(path).map_err(|error| {
            InputError::new(
                path,
                format!("cannot be read: {error}"),
                "give the table that `bristle diagnose --feed-forward` writes",
            )
        })?;
        Self::parse(&text, path)
    }

    fn parse(text: &str, path: &Path) -> Result<Self, InputError> {
        let file: File = toml::from_str(text).map_err(|error| {
            let message = error.message().lines().collect::<Vec<_>>().join(", ");
            let place = error.span().unwrap_or_default().start;
            InputError::new(
                path,
                message,
                "give the table that `bristle diagnose --feed-forward` writes",
            )
            .at_line(line_at(text.as_bytes(), place))
            .at_character(character_at(text.as_bytes(), place))
        })?;
        let wrong = |message: String| {
            InputError::new(
                path,
                message,
                "have `bristle diagnose --feed-forward` write it anew",
            )
        };
        let section = file.feed_forward;
        let span = match (section.period_rad, section.from_rad, section.to_rad) {
            (Some(period), None, None) => Span::Period(period),
            (None, Some(from), Some(to)) => Span::Stroke(from, to),
            _ => return Err(wrong("has neither a period nor from and to".to_owned())),
        };
        let points = |name: &str, values: Vec<f64>| {
            let count = values.len();
            <[f64; POINTS]>::try_from(values)
                .map_err(|_| wrong(format!("{name} has {count} points, not {POINTS}")))
        };
        if section.points != POINTS {
            return Err(wrong(format!("points = {}, not {POINTS}", section.points)));
        }
        let table = Self {
            span,
            forward_nm: points("forward", section.forward_nm)?,
            backward_nm: points("backward", section.backward_nm)?,
            speed_band_rad_s: section.speed_band_rad_s,
            dead_zone_nm: section.dead_zone_nm,
            effects: Vec::new(),
        };
        table
            .for_control()
            .map_err(|error| wrong(error.to_string()))?;
        Ok(table)
    }

    /// The table that cancels what can be cancelled of the effects of an axis, over a turn or a linear stroke; none where
    /// there is nothing to cancel.
    ///
    /// # Errors
    /// An effect or a friction model that does not take its parameters.
    pub fn new(axis: &Believed, stroke_rad: [f64; 2]) -> Result<Option<Self>, InputError> {
        let (mut effects, mut ids, mut dead_zone_nm) = (Vec::new(), Vec::new(), 0.0);
        let mut turns = true;
        for entry in &axis.effects {
            if CANCELLED.contains(&entry.id.as_str()) {
                effects.push(build(axis, entry)?);
            } else if entry.id == DEAD_ZONE {
                let [width, jump] = ["width_nm", "jump_share"].map(|name| {
                    let linear = if name == "width_nm" { "width_n" } else { name };
                    let value = entry.parameter(name).or(entry.parameter(linear));
                    value.unwrap_or(0.0)
                });
                dead_zone_nm += (1.0 - jump) * width.abs();
            } else {
                continue;
            }
            // What grows along the travel does not repeat with the turn.
            let slope = |name: &str| entry.parameter(name).is_some_and(|x| x != 0.0);
            turns &= entry.id != "mechanics.spring" && !slope("slope_1_rad");
            ids.push(entry.id.clone());
        }
        if ids.is_empty() {
            return Ok(None);
        }
        let span = if axis.unit == Unit::Rotary && turns {
            Span::Period(TAU)
        } else {
            Span::Stroke(stroke_rad[0], stroke_rad[1])
        };
        let contact = axis.contact(axis.model)?;
        let plain = Plain {
            inertia_kg_m2: axis.whole_inertia_kg_m2(),
            levels: Levels::of(contact.as_ref()),
        };
        for effect in &mut effects {
            effect.begin(&plain);
        }
        // Fast enough to slide, slow enough for viscous friction not to matter.
        let speed_rad_s = 3.0 * axis.stribeck_velocity_rad_s;
        let coulomb_nm = plain.levels.coulomb_nm;
        let mut along = |sign: f64| {
            std::array::from_fn(|i| {
                let position_rad = match span {
                    Span::Period(period) => period * i as f64 / POINTS as f64,
                    Span::Stroke(from, to) => from + (to - from) * i as f64 / (POINTS - 1) as f64,
                };
                let mut now = Instant {
                    step_s: 1.0 / axis.rate_hz,
                    ..Instant::default()
                };
                now.motion.position_rad = position_rad;
                now.motion.load_position_rad = position_rad;
                now.motion.velocity_rad_s = sign * speed_rad_s;
                now.motion.load_velocity_rad_s = sign * speed_rad_s;
                let mut friction = sign * coulomb_nm;
                let mut given = 0.0;
                for effect in &mut effects {
                    now.torque_nm = effect.actuator(&now);
                    given += effect.mechanics(&now);
                    friction = effect.friction(&now, friction);
                }
                friction - sign * coulomb_nm - given - now.torque_nm
            })
        };
        let (forward_nm, backward_nm) = (along(1.0), along(-1.0));
        Ok(Some(Self {
            span,
            forward_nm,
            backward_nm,
            // Bristles have taken their sliding load within some z_ss, or 10 ms of it.
            speed_band_rad_s: (axis.coulomb_nm / axis.stiffness_nm_rad / 0.01)
                .min(axis.stribeck_velocity_rad_s),
            dead_zone_nm,
            effects: ids,
        }))
    }

    /// As the controller holds it.
    ///
    /// # Errors
    /// A number out of range.
    pub fn for_control(&self) -> Result<FeedForward<f64>, InputError> {
        FeedForward::new(
            self.span,
            self.forward_nm,
            self.backward_nm,
            self.speed_band_rad_s,
            self.dead_zone_nm,
        )
        .map_err(|error| {
            InputError::new(
                "feed-forward table",
                error.to_string(),
                "give the axis a speed and a stroke",
            )
        })
    }

    /// Writes the table as TOML, with lines of comment above it.
    ///
    /// # Errors
    /// The path cannot be written, or a number is out of range.
    pub fn write(&self, head: &[String], unit: Unit, path: &Path) -> Result<(), InputError> {
        self.for_control()?;
        let (effort, position) = match unit {
            Unit::Rotary => ("nm", "rad"),
            Unit::Linear => ("n", "m"),
        };
        let mut text: String = head.iter().map(|line| format!("# {line}\n")).collect();
        text += &format!("\n[feed_forward]\npoints = {POINTS}\n");
        match self.span {
            Span::Period(period) => text += &format!("period_{position} = {period:?}\n"),
            Span::Stroke(from, to) => {
                text += &format!("from_{position} = {from:?}\nto_{position} = {to:?}\n");
            }
        }
        text += &format!(
            "speed_band_{position}_s = {:?}\ndead_zone_{effort} = {:?}\n",
            self.speed_band_rad_s, self.dead_zone_nm
        );
        for (name, values) in [
            ("forward", &self.forward_nm),
            ("backward", &self.backward_nm),
        ] {
            let values: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
            text += &format!("{name}_{effort} = [{}]\n", values.join(", "));
        }
        write_atomically(path, |writer| writer.write_all(text.as_bytes()))
    }
}

fn build(axis: &Believed, entry: &EffectEntry) -> Result<Box<dyn Effect>, InputError> {
    effect::build(
        &entry.id,
        &entry.parameters.iter().cloned().collect(),
        axis.unit,
    )
    .map_err(|error| axis.refused_effect(&error))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(span: Span<f64>) -> Table {
        Table {
            span,
            forward_nm: std::array::from_fn(|i| 1e-3 * i as f64),
            backward_nm: [-0.5; POINTS],
            speed_band_rad_s: 0.1,
            dead_zone_nm: 0.0,
            effects: Vec::new(),
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.toml");
        for unit in [Unit::Rotary, Unit::Linear] {
            for span in [Span::Period(6.25), Span::Stroke(-1.0, 2.0)] {
                let table = table(span);
                table.write(&["of a test".to_owned()], unit, &path).unwrap();
                assert_eq!(Table::read(&path), Ok(table));
            }
        }
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_place() {
        let path = Path::new("table.toml");
        let folder = tempfile::tempdir().unwrap();
        let written = folder.path().join("table.toml");
        table(Span::Period(1.0))
            .write(&[], Unit::Rotary, &written)
            .unwrap();
        let good = std::fs::read_to_string(written).unwrap();
        for (from, to, word) in [
            ("points = 512", "points = 511", "points = 511"),
            ("points = 512", "pionts = 512", "table.toml:3:1"),
            ("period_rad = 1.0", "from_rad = 1.0", "neither a period"),
            ("period_rad = 1.0", "period_rad = 0.0", "period_rad"),
            (
                "speed_band_rad_s = 0.1",
                "speed_band_rad_s = -0.1",
                "speed_band",
            ),
            ("[0.0, ", "[", "511 points"),
        ] {
            assert!(good.contains(from), "{from}");
            let error = Table::parse(&good.replacen(from, to, 1), path).unwrap_err();
            assert!(error.to_string().contains(word), "{error}");
        }
    }
}
