//! Where a joint fit starts: inertia, Coulomb and viscous friction and offset by linear least squares over what slides,
//! torque = J a + F_C sgn(v) + F_v v - offset; the axis file's values only where the logs say nothing.

use super::Usable;
use crate::axis_file::{AxisFile, EffectEntry, FrictionModel};
use crate::believed::Believed;
use crate::error::InputError;
use crate::inverse::{OFFSET, Record, Stretch};
use crate::signal::rms;
use bristle_plant::Unit;
use nalgebra::{DMatrix, DVector};
use std::path::Path;

/// Fewest sliding nodes that a regression over four columns is trusted with.
const ENOUGH_NODES: usize = 40;
/// Slower than this part of the top speed an axis may creep on its bristles, at any friction up to the whole.
const CREEPS: f64 = 0.05;
/// A column that another explains to this part says nothing of its own.
const SINGULAR: f64 = 1e-4;
/// A log without a stiffness starts from a bristle deflection of so much, rad or m.
const Z_SS: [f64; 2] = [1e-3, 1e-5];

/// What the linear regression gives. A linear axis reads m for rad and N for N m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rough {
    /// J.
    pub inertia_kg_m2: f64,
    /// F_C.
    pub coulomb_nm: f64,
    /// sigma2.
    pub viscous_nm_s_rad: f64,
    /// Constant torque on the axis.
    pub offset_nm: f64,
}

/// An axis file from which a fit of `model` can start, completed from the logs; and the logs prepared with it.
///
/// # Errors
/// Logs and axis file do not fit, or no log has a stretch that is long enough.
pub fn prepare(
    logs: &[Usable],
    axis: &AxisFile,
    path: &Path,
) -> Result<(AxisFile, Vec<Record>), InputError> {
    let mut file = axis.clone();
    let mut most_nm: f64 = 0.0;
    let mut size_nm: f64 = 0.0;
    for Usable { log, .. } in logs {
        let effort = log.effort_nm(axis)?;
        most_nm = effort.iter().fold(most_nm, |most, u| most.max(u.abs()));
        size_nm = size_nm.max(rms(effort.iter().copied()));
    }
    if most_nm == 0.0 {
        return Err(InputError::new(
            &logs[0].log.file,
            "the effort is zero throughout",
            "record the effort that moves the axis",
        ));
    }
    // Only the size matters here: how far the records are smoothed follows from it.
    file.friction.coulomb = Some(0.3 * size_nm);
    file.friction.stiction = None;
    let mut records = records(logs, axis, &believed(&file, path)?)?;
    if let Some(rough) = regression(&records) {
        file.axis.inertia = without_load(axis, rough.inertia_kg_m2);
        file.friction.coulomb = Some(rough.coulomb_nm);
        file.friction.viscous = Some(rough.viscous_nm_s_rad);
        set_offset(&mut file, rough.offset_nm);
        records = self::records(logs, axis, &believed(&file, path)?)?;
        if let Some(rough) = regression(&records) {
            file.axis.inertia = without_load(axis, rough.inertia_kg_m2);
            file.friction.coulomb = Some(rough.coulomb_nm);
            file.friction.viscous = Some(rough.viscous_nm_s_rad);
            set_offset(&mut file, rough.offset_nm);
        }
    } else {
        // Nothing slides: what holds the axis is at least the largest effort, unless the file knows better.
        file.friction.coulomb = axis.friction.coulomb.or(Some(1.5 * most_nm));
        set_offset(&mut file, 0.0);
    }
    Ok((file, records))
}

fn without_load(axis: &AxisFile, whole_kg_m2: f64) -> f64 {
    let load = axis.axis.load_inertia.unwrap_or(0.0);
    whole_kg_m2 * axis.axis.inertia / (axis.axis.inertia + load)
}

/// The file with start values for a friction model: a fall from stiction of `excess` at `stribeck_velocity_rad_s`, and a
/// bristle deflection of `z_ss_rad`.
pub fn shaped(
    file: &AxisFile,
    model: FrictionModel,
    excess: f64,
    stribeck_velocity_rad_s: f64,
    z_ss_rad: f64,
) -> AxisFile {
    let mut file = file.clone();
    let coulomb = file.friction.coulomb.unwrap_or(0.0);
    file.friction.model = Some(model);
    let falls = matches!(
        model,
        FrictionModel::Stribeck | FrictionModel::Lugre | FrictionModel::ElastoPlastic
    );
    file.friction.stiction = Some(if falls {
        coulomb * (1.0 + excess)
    } else {
        coulomb
    });
    file.friction.stribeck_velocity = Some(stribeck_velocity_rad_s);
    let stiffness = coulomb / z_ss_rad;
    file.friction.stiffness = Some(stiffness);
    // Half of critical damping in stick.
    let whole = file.axis.inertia + file.axis.load_inertia.unwrap_or(0.0);
    file.friction.damping = Some((stiffness * whole).sqrt());
    if model == FrictionModel::Dahl {
        file.friction.damping = Some(0.0);
    }
    file.friction.breakaway_ratio = Some(file.friction.breakaway_ratio.unwrap_or(0.7));
    file
}

/// Completes a start without the stiffness being known.
pub fn believed(file: &AxisFile, path: &Path) -> Result<Believed, InputError> {
    let mut file = file.clone();
    let coulomb = file.friction.coulomb.unwrap_or(0.0);
    let z_ss = Z_SS[usize::from(file.unit == Unit::Linear)];
    file.friction.stiffness.get_or_insert(coulomb / z_ss);
    Believed::new(&file, path)
}

/// Prepares the logs.
///
/// # Errors
/// See [`Record::new`].
pub fn records(
    logs: &[Usable],
    axis: &AxisFile,
    believed: &Believed,
) -> Result<Vec<Record>, InputError> {
    logs.iter()
        .map(|usable| Record::new(&usable.log, axis, believed, &usable.excluded))
        .collect()
}

fn set_offset(file: &mut AxisFile, offset_nm: f64) {
    let name = if file.unit == Unit::Linear {
        "force_n"
    } else {
        "torque_nm"
    };
    let parameters = vec![(name.to_string(), offset_nm)];
    match file.effects.iter_mut().find(|effect| effect.id == OFFSET) {
        Some(effect) => effect.parameters = parameters,
        None => file.effects.push(EffectEntry {
            id: OFFSET.to_string(),
            parameters,
        }),
    }
}

/// A row of the regression: torque, then acceleration, direction, velocity and one.
type Row = [f64; 5];

/// Least squares over the nodes that slide fast, or else all that slide; none where they are too few or do not excite every
/// column.
fn regression(records: &[Record]) -> Option<Rough> {
    let mut rows: Vec<Row> = Vec::new();
    for record in records {
        for stretch in &record.stretches {
            sliding_rows(record, stretch, &mut rows);
        }
    }
    let top_rad_s = rows.iter().fold(0.0, |top: f64, row| top.max(row[3].abs()));
    let fast: Vec<Row> = rows
        .iter()
        .filter(|row| row[3].abs() > CREEPS * top_rad_s)
        .copied()
        .collect();
    solved(&fast).or_else(|| solved(&rows))
}

/// Least squares over these rows.
fn solved(rows: &[Row]) -> Option<Rough> {
    if rows.len() < ENOUGH_NODES {
        return None;
    }
    let mut columns = DMatrix::from_fn(rows.len(), 4, |row, column| rows[row][column + 1]);
    let sizes: Vec<f64> = columns.column_iter().map(|column| column.norm()).collect();
    if sizes.contains(&0.0) {
        return None;
    }
    for (mut column, size) in columns.column_iter_mut().zip(&sizes) {
        column /= *size;
    }
    let torque = DVector::from_iterator(rows.len(), rows.iter().map(|row| row[0]));
    let svd = columns.svd(true, true);
    if svd.singular_values.min() < SINGULAR * svd.singular_values.max() {
        return None;
    }
    let solved = svd.solve(&torque, 0.0).ok()?;
    let [inertia, coulomb, viscous, constant] = std::array::from_fn(|i| solved[i] / sizes[i]);
    let fits = inertia > 0.0 && coulomb > 0.0;
    fits.then_some(Rough {
        inertia_kg_m2: inertia,
        coulomb_nm: coulomb,
        viscous_nm_s_rad: viscous.max(0.0),
        offset_nm: -constant,
    })
}

fn sliding_rows(record: &Record, stretch: &Stretch, rows: &mut Vec<Row>) {
    let v = &stretch.velocity_rad_s;
    let q = &stretch.position_rad;
    let inner = 1..q.len() - 1;
    let through = |values: Vec<f64>| {
        let mut values = values;
        let mut out = Vec::new();
        record.kernel.apply(&mut values, &mut out);
        out
    };
    let per = record.step_s.powi(-2);
    let effort = &stretch.effort_nm;
    let torque = through(
        inner
            .clone()
            .map(|k| 0.5 * (effort[k - 1] + effort[k]))
            .collect(),
    );
    let acceleration = through(
        inner
            .clone()
            .map(|k| per * (q[k + 1] - 2.0 * q[k] + q[k - 1]))
            .collect(),
    );
    let velocity = through(inner.map(|k| v[k]).collect());
    let reach = record.kernel.reach() + 1;
    let rest = 3.0 * record.rest_velocity_rad_s();
    for node in 0..record.nodes_of(stretch) {
        let middle = record.middle(node);
        let around = middle.saturating_sub(reach)..(middle + reach + 1).min(v.len());
        let direction = v[middle].signum();
        let slides = v[around.clone()].iter().all(|v| v * direction > rest);
        if slides && !stretch.excluded[around].contains(&true) {
            rows.push([
                torque[node],
                acceleration[node],
                direction,
                velocity[node],
                1.0,
            ]);
        }
    }
}
