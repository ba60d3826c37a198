//! A fit as an axis: what was identified replaces what stood there.

use super::fit::Joint;
use crate::axis_file::{AxisFile, EffectEntry, FrictionModel};
use crate::believed::Believed;

/// Whether a model has a fall from stiction to Coulomb friction.
fn falls(kind: FrictionModel) -> bool {
    matches!(
        kind,
        FrictionModel::Stribeck | FrictionModel::Lugre | FrictionModel::ElastoPlastic
    )
}

/// The axis file that a fit makes; what the fit does not concern stays as in `given`.
pub fn axis_file(joint: &Joint, given: &AxisFile) -> AxisFile {
    let point = joint.point();
    let believed = point.believed();
    let mut file = given.clone();
    file.axis.inertia = believed.inertia_kg_m2;
    file.axis.load_inertia = believed.load.map(|load| load.inertia_kg_m2);
    let friction = &mut file.friction;
    friction.model = Some(joint.kind);
    friction.coulomb = Some(believed.coulomb_nm);
    friction.viscous = (joint.kind != FrictionModel::Dahl).then_some(believed.viscous_nm_s_rad);
    let fall = falls(joint.kind);
    friction.stiction = fall.then_some(believed.stiction_nm);
    friction.stribeck_velocity = fall.then_some(believed.stribeck_velocity_rad_s);
    let bristles = joint.kind.has_bristles();
    friction.stiffness = bristles.then_some(believed.stiffness_nm_rad);
    let damped = bristles && joint.kind != FrictionModel::Dahl;
    friction.damping = damped.then_some(believed.damping_nm_s_rad);
    let plastic = joint.kind == FrictionModel::ElastoPlastic;
    friction.breakaway_ratio = plastic.then_some(believed.breakaway_ratio);
    if given.drive.lag_s.is_some() {
        file.drive.lag_s = Some(believed.drive.lag_s);
    }
    file.effects = point
        .effects()
        .iter()
        .map(|added| EffectEntry {
            id: added.entry.id.to_string(),
            parameters: added
                .entry
                .parameters
                .iter()
                .zip(&added.values)
                .map(|(parameter, &value)| (parameter.name(believed.unit).to_string(), value))
                .collect(),
        })
        .collect();
    file
}

/// The fitted axis with its effects, ready to be simulated.
pub fn simulated(joint: &Joint) -> Believed {
    let mut believed = joint.believed();
    believed.effects = axis_file(joint, &AxisFile::new(believed.unit, 1.0)).effects;
    believed
}
