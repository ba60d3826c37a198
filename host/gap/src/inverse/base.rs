//! What of the simulator itself may move, and how far it is believed.

use super::free::{Free, Own, Owner};
use super::model::{Added, Model};
use super::record::Record;
use crate::axis_file::FrictionModel;
use crate::believed::Believed;
use crate::error::InputError;
use bristle_plant::effect::{self, Kind, Scale};

/// Deflections below so many counts cannot be seen: the stiffness then stays as it is believed.
const COUNTS_TO_SEE_PRESLIDING: f64 = 2.0;
/// The recorder's effort and position may lie apart by this part of a sample; more is a delay of the axis.
const MOST_SKEW_SAMPLES: f64 = 0.1;
/// Where an axis file knows no fall of friction with speed, one is looked for about this part of the top speed.
const FALLS_AT: f64 = 0.02;

impl Model {
    /// The simulator with its own parameters free, about what is believed. `doubt` is the standard deviation of a
    /// parameter that the axis file gives, as a share of it.
    ///
    /// # Errors
    /// An effect of the axis file that does not exist.
    pub fn base(believed: &Believed, records: &[Record], doubt: f64) -> Result<Self, InputError> {
        let effects = believed
            .effects
            .iter()
            .map(|entry| {
                let values = entry.parameters.iter().cloned().collect();
                let (entry, values) = effect::values(&entry.id, &values, believed.unit)
                    .map_err(|error| believed.refused_effect(&error))?;
                Ok(Added { entry, values })
            })
            .collect::<Result<Vec<_>, InputError>>()?;
        let scale = scale(believed, records);
        let mut free = own(believed, records, &scale, doubt);
        for (place, added) in effects.iter().enumerate() {
            for (i, parameter) in added.entry.parameters.iter().enumerate() {
                if parameter.kind != Kind::Size {
                    continue;
                }
                let value = added.values[i];
                let [low, high] = (parameter.range)(&scale);
                let width = (high - low).abs();
                free.push(Free::linear(
                    Owner::Effect(place, i),
                    parameter.name(believed.unit),
                    value,
                    doubt * value.abs() + 0.1 * width,
                    [low.min(value) - width, high.max(value) + width],
                ));
            }
        }
        Ok(Self {
            believed: believed.clone(),
            effects,
            free,
            scales_effort: false,
            corrects: None,
            arrives: None,
        })
    }
}

fn own(believed: &Believed, records: &[Record], scale: &Scale, doubt: f64) -> Vec<Free> {
    let unit = believed.unit;
    let mut free = Vec::new();
    let mut about = |own: Own, start: f64, relative: f64, range: [f64; 2]| {
        free.push(Free::about(
            Owner::Own(own),
            own.name(unit),
            start,
            relative,
            range,
        ));
    };
    let wide = |x: f64| [0.02 * x, 50.0 * x];
    let inertia = believed.whole_inertia_kg_m2();
    about(Own::Inertia, inertia, doubt, wide(inertia));
    about(
        Own::Coulomb,
        believed.coulomb_nm,
        doubt,
        wide(believed.coulomb_nm),
    );
    let falls = believed.stiction_nm > believed.coulomb_nm
        && !matches!(
            believed.model,
            FrictionModel::Coulomb | FrictionModel::CoulombViscous | FrictionModel::Dahl
        );
    if falls {
        let excess = believed.stiction_nm / believed.coulomb_nm - 1.0;
        about(
            Own::StictionExcess,
            excess,
            2.0 * doubt,
            [0.01 * excess, 4.0],
        );
        let v = believed.stribeck_velocity_rad_s;
        about(Own::StribeckVelocity, v, 2.0 * doubt, [0.1 * v, 10.0 * v]);
    }
    let visible = sees_bristles(believed, records);
    if visible {
        let stiffness = believed.stiffness_nm_rad;
        about(Own::Stiffness, stiffness, 2.0 * doubt, wide(stiffness));
        if believed.damping_nm_s_rad > 0.0 {
            let damping = believed.damping_nm_s_rad;
            about(Own::Damping, damping, 2.0 * doubt, wide(damping));
        }
    }
    let commanded = records.iter().any(|record| record.commanded);
    if commanded && believed.drive.lag_s > 0.0 {
        about(
            Own::DriveLag,
            believed.drive.lag_s,
            doubt,
            wide(believed.drive.lag_s),
        );
    }
    if believed.model == FrictionModel::ElastoPlastic && visible {
        free.push(Free::linear(
            Owner::Own(Own::BreakawayRatio),
            Own::BreakawayRatio.name(unit),
            believed.breakaway_ratio,
            0.2,
            [0.0, 0.98],
        ));
    }
    let viscous = believed.viscous_nm_s_rad;
    let at_top = believed.coulomb_nm / scale.top_speed_rad_s.max(1e-9);
    free.push(Free::linear(
        Owner::Own(Own::Viscous),
        Own::Viscous.name(unit),
        viscous,
        doubt * viscous + 0.3 * at_top,
        [0.0, 10.0 * viscous + 10.0 * at_top],
    ));
    let step_s = records
        .iter()
        .map(|r| r.step_s)
        .fold(f64::INFINITY, f64::min);
    free.push(Free::linear(
        Owner::Own(Own::Skew),
        Own::Skew.name(unit),
        0.0,
        // A value is the mean until the next sample; a thirtieth of one is doubt enough.
        0.03 * step_s,
        [-MOST_SKEW_SAMPLES * step_s, MOST_SKEW_SAMPLES * step_s],
    ));
    free
}

/// Whether the simulator has bristles and every record shows how they bend.
pub fn sees_bristles(believed: &Believed, records: &[Record]) -> bool {
    let z_ss_rad = believed.coulomb_nm / believed.stiffness_nm_rad;
    let shows = |record: &Record| z_ss_rad > COUNTS_TO_SEE_PRESLIDING * record.rad_per_count;
    believed.model.has_bristles() && records.iter().all(shows)
}

/// The size of an axis and its records, for the usual ranges of effects.
pub fn scale(believed: &Believed, records: &[Record]) -> Scale {
    let stretches = || records.iter().flat_map(|record| &record.stretches);
    let most = |values: fn(&super::Stretch) -> &Vec<f64>| {
        stretches()
            .flat_map(move |stretch| values(stretch).iter())
            .fold(0.0, |most: f64, x| most.max(x.abs()))
    };
    let positions = || stretches().flat_map(|stretch| stretch.position_rad.iter().copied());
    let top_speed_rad_s = most(|stretch| &stretch.velocity_rad_s);
    Scale {
        unit: believed.unit,
        coulomb_nm: believed.coulomb_nm,
        inertia_kg_m2: believed.whole_inertia_kg_m2(),
        stribeck_velocity_rad_s: if believed.stiction_nm > believed.coulomb_nm {
            believed.stribeck_velocity_rad_s
        } else {
            FALLS_AT * top_speed_rad_s
        },
        z_ss_rad: believed.coulomb_nm / believed.stiffness_nm_rad,
        top_speed_rad_s,
        top_torque_nm: most(|stretch| &stretch.effort_nm),
        lowest_rad: positions().fold(f64::INFINITY, f64::min),
        highest_rad: positions().fold(f64::NEG_INFINITY, f64::max),
        duration_s: stretches()
            .map(|stretch| stretch.effort_nm.len())
            .zip(
                records
                    .iter()
                    .flat_map(|r| r.stretches.iter().map(|_| r.step_s)),
            )
            .fold(0.0, |longest, (samples, step)| {
                longest.max(samples as f64 * step)
            }),
        sample_time_s: records
            .iter()
            .map(|r| r.step_s)
            .fold(f64::INFINITY, f64::min),
        rad_per_count: believed.rad_per_count(),
    }
}
