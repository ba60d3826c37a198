//! A recorded log: time, effort, motor position and what else the drive gave, in SI.
//!
//! An effort value is the mean effort from its sample to the next. Vectors have one entry a sample.

mod cells;
mod columns;
mod gather;
mod mcap;
mod read;
mod timing;
mod write;

use std::borrow::Cow;
use std::path::PathBuf;

pub use cells::Cells;
pub use timing::Gap;

use crate::axis_file::AxisFile;
use crate::capture::About;
use crate::error::InputError;
use bristle_plant::Unit;
use columns::{Role, name_of};

/// Where an effort value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EffortKind {
    /// Measured torque, N m; on a linear axis force, N.
    TorqueMeasured,
    /// Commanded torque, N m; on a linear axis force, N.
    TorqueReference,
    /// Motor current, A.
    Current,
    /// Voltage that the drive turns into effort, V.
    Voltage,
}

/// One effort column.
#[derive(Clone, Debug, PartialEq)]
pub struct Effort {
    /// What the values are.
    pub kind: EffortKind,
    /// Mean from this sample to the next, in the unit of the kind.
    pub values: Vec<f64>,
}

/// Unit of the motor position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PositionKind {
    /// rad
    Rad,
    /// m
    M,
    /// Encoder counts: whole numbers.
    Counts,
}

/// The motor's position.
#[derive(Clone, Debug, PartialEq)]
pub struct Position {
    /// What the values are.
    pub kind: PositionKind,
    /// In the unit of the kind.
    pub values: Vec<f64>,
}

/// A column that nobody here reads, kept so that writing the log again loses nothing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unknown {
    /// Its header.
    pub name: String,
    /// Its cells as they stood.
    pub values: Cells,
}

/// A log. Where `unit` is linear, read m for rad in the optional columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Log {
    /// The file it came from, or is meant for: errors name it.
    pub file: PathBuf,
    /// What the column names say; none of them may (current and counts), then the axis file decides.
    pub unit: Option<Unit>,
    /// Strictly increasing, at least two.
    pub time_s: Vec<f64>,
    /// Every effort column, at least one.
    pub efforts: Vec<Effort>,
    /// Motor side.
    pub position: Position,
    /// Load side, rad or m.
    pub position_load: Option<Vec<f64>>,
    /// Commanded position, rad or m.
    pub position_ref: Option<Vec<f64>>,
    /// Measured velocity, rad/s or m/s.
    pub velocity: Option<Vec<f64>>,
    /// Temperature, degrees Celsius.
    pub temperature_c: Option<Vec<f64>>,
    /// Columns that are ignored.
    pub unknown: Vec<Unknown>,
    /// What an MCAP file says of itself; empty for CSV.
    pub about: About,
}

impl Position {
    /// In what an axis of this unit moves in: rad or m.
    pub fn of(unit: Unit, values: Vec<f64>) -> Self {
        let kind = match unit {
            Unit::Rotary => PositionKind::Rad,
            Unit::Linear => PositionKind::M,
        };
        Self { kind, values }
    }
}

impl Log {
    /// A log of these columns alone.
    pub fn new(
        file: impl Into<PathBuf>,
        unit: Unit,
        time_s: Vec<f64>,
        efforts: Vec<Effort>,
        position: Position,
    ) -> Self {
        Self {
            file: file.into(),
            unit: Some(unit),
            time_s,
            efforts,
            position,
            position_load: None,
            position_ref: None,
            velocity: None,
            temperature_c: None,
            unknown: Vec::new(),
            about: About::new(),
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Without samples; no log that was read is.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// The effort column of a kind.
    pub fn effort(&self, kind: EffortKind) -> Option<&Effort> {
        self.efforts.iter().find(|effort| effort.kind == kind)
    }

    /// Rotary or linear, as log and axis file agree.
    ///
    /// # Errors
    /// One is rotary, the other linear.
    pub fn unit_on(&self, axis: &AxisFile) -> Result<Unit, InputError> {
        match self.unit {
            Some(unit) if unit != axis.unit => Err(InputError::new(
                &self.file,
                format!("the log is of a {unit} axis, the axis file of a {} one", axis.unit),
                "give the axis file that belongs to the log (inertia_kg_m2 makes it rotary, mass_kg linear)",
            )
            .at_line(1)),
            _ => Ok(axis.unit),
        }
    }

    /// The best effort column: measured torque, then current, torque reference and voltage.
    ///
    /// Measured beats commanded. Current and voltage count only with their gain in the axis file; a gain given there
    /// says that the user trusts it, so a current beats the reference it follows.
    ///
    /// # Errors
    /// Only current or voltage are there and the axis file lacks the gain.
    pub fn best_effort(&self, axis: &AxisFile) -> Result<&Effort, InputError> {
        use EffortKind::{Current, TorqueMeasured, TorqueReference, Voltage};
        [TorqueMeasured, Current, TorqueReference, Voltage]
            .into_iter()
            .filter(|&kind| gain(kind, axis).is_some())
            .find_map(|kind| self.effort(kind))
            .ok_or_else(|| self.missing_gain(axis.unit))
    }

    /// The best effort in N m, or N on a linear axis.
    ///
    /// # Errors
    /// Log and axis file disagree on rotary and linear, or the gain of current or voltage is missing.
    pub fn effort_nm(&self, axis: &AxisFile) -> Result<Cow<'_, [f64]>, InputError> {
        self.unit_on(axis)?;
        let effort = self.best_effort(axis)?;
        Ok(match gain(effort.kind, axis) {
            None | Some(1.0) => Cow::Borrowed(&effort.values),
            Some(gain) => scaled(&effort.values, gain),
        })
    }

    /// The motor position in rad, or m on a linear axis.
    ///
    /// # Errors
    /// Log and axis file disagree on rotary and linear, or the position is in counts and the axis file does not say
    /// how many make a turn or a metre.
    pub fn position_rad(&self, axis: &AxisFile) -> Result<Cow<'_, [f64]>, InputError> {
        let unit = self.unit_on(axis)?;
        if self.position.kind != PositionKind::Counts {
            return Ok(Cow::Borrowed(&self.position.values));
        }
        let (turn, key) = match unit {
            Unit::Rotary => (std::f64::consts::TAU, "counts_per_rev"),
            Unit::Linear => (1.0, "counts_per_m"),
        };
        let counts = axis.axis.counts_per_turn.ok_or_else(|| {
            InputError::new(
                &self.file,
                format!("counts need {key}, which the axis file does not give"),
                format!("add `{key} = ...` to [axis] in the axis file"),
            )
            .at_line(1)
            .in_column("position_counts")
        })?;
        Ok(scaled(&self.position.values, turn / counts))
    }

    /// What a user should hear about a log that is otherwise fine, one line each.
    pub fn notices(&self) -> Vec<String> {
        let mut notices = Vec::new();
        if !self.unknown.is_empty() {
            notices.push(self.unknown_notice());
        }
        let gaps = self.gaps();
        if let Some(first) = gaps.first() {
            let lost_s: f64 = gaps.iter().map(|gap| gap.end_s - gap.start_s).sum();
            notices.push(format!(
                "{}: {} {} in time, {lost_s:.6} s in all, the first after {} s",
                self.file.display(),
                gaps.len(),
                if gaps.len() == 1 { "gap" } else { "gaps" },
                first.start_s,
            ));
        }
        notices.extend(self.recorded_notice());
        notices
    }

    /// What a file that says so was recorded with: when, by which firmware, and what was lost.
    fn recorded_notice(&self) -> Option<String> {
        let part = |words: &str, key: &str, most: usize| {
            let value: String = self.about.get(key)?.chars().take(most).collect();
            let value: String = value.escape_debug().collect();
            Some(format!("{words}{value}"))
        };
        let parts = [
            // To the second, and as many digits of a hash as tell images apart.
            part("recorded ", "started", 19),
            part("firmware ", "firmware_sha256", 12),
            part("samples lost: ", "lost", 20),
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        let file = self.file.display();
        (!parts.is_empty()).then(|| format!("{file}: {}", parts.join(", ")))
    }

    /// What a user should hear where the recording was made with another encoder than this axis file says.
    pub fn disagreement(&self, axis: &AxisFile) -> Option<String> {
        if self.position.kind != PositionKind::Counts {
            return None;
        }
        let of_firmware = || self.about.get("parameter counts_per_rev")?.parse().ok();
        let of_file = || {
            let text = self.about.get("axis_file")?;
            AxisFile::parse(text, &self.file).ok()?.axis.counts_per_turn
        };
        let then: f64 = of_firmware().or_else(of_file)?;
        let now = axis.axis.counts_per_turn?;
        (then != now).then(|| {
            format!(
                "{}: recorded with {then} counts a turn or metre, and the axis file says {now}: its counts are read by the \
                 axis file",
                self.file.display()
            )
        })
    }

    fn unknown_notice(&self) -> String {
        let names: Vec<_> = self
            .unknown
            .iter()
            .map(|column| {
                let name: String = column.name.escape_debug().collect();
                let near = columns::KNOWN.iter().map(|known| known.name);
                match crate::names::nearest(&column.name, near) {
                    Some(known) if known != column.name => format!("{name} (not {known})"),
                    _ => name,
                }
            })
            .collect();
        format!(
            "{}: ignored columns: {}",
            self.file.display(),
            names.join(", ")
        )
    }

    fn missing_gain(&self, unit: Unit) -> InputError {
        let (kind, key) = match (self.effort(EffortKind::Current), unit) {
            (Some(_), Unit::Rotary) => (EffortKind::Current, "torque_constant_nm_a"),
            (Some(_), Unit::Linear) => (EffortKind::Current, "force_constant_n_a"),
            (None, Unit::Rotary) => (EffortKind::Voltage, "torque_per_volt_nm_v"),
            (None, Unit::Linear) => (EffortKind::Voltage, "force_per_volt_n_v"),
        };
        let column = name_of(Role::Effort(kind), unit);
        InputError::new(
            &self.file,
            format!("{column} needs {key}, which the axis file does not give"),
            format!("add `{key} = ...` to [axis] in the axis file"),
        )
        .at_line(1)
        .in_column(column)
    }
}

/// Effort per value of a column, where the axis file gives it.
fn gain(kind: EffortKind, axis: &AxisFile) -> Option<f64> {
    match kind {
        EffortKind::TorqueMeasured | EffortKind::TorqueReference => Some(1.0),
        EffortKind::Current => axis.axis.torque_constant,
        EffortKind::Voltage => axis.axis.torque_per_volt,
    }
}

fn scaled(values: &[f64], gain: f64) -> Cow<'_, [f64]> {
    Cow::Owned(values.iter().map(|value| value * gain).collect())
}
