//! A fit as an axis file: what was identified replaces what stood there, with its interval beside it and where it comes
//! from on top.

use super::fit::Joint;
use super::interval::Estimate;
use crate::axis_file::{AxisFile, EffectEntry, FrictionModel};
use crate::believed::Believed;
use crate::inverse::has_bristles;

/// Where a fit comes from.
pub struct Provenance {
    /// The command.
    pub command: String,
    /// Of the program.
    pub version: String,
    /// In UTC.
    pub date: String,
    /// Name and SHA-256 of each log.
    pub logs: Vec<(String, String)>,
}

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
    let bristles = has_bristles(joint.kind);
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

/// The file's text with provenance on top and intervals beside what was identified.
pub fn to_toml(file: &AxisFile, estimates: &[Estimate], provenance: &Provenance) -> String {
    let mut text = format!(
        "# Identified from logs by bristle {} on {}.\n# {}\n",
        provenance.version,
        provenance.date,
        one_line(&provenance.command)
    );
    for (name, hash) in &provenance.logs {
        text += &format!("# log {} sha256 {hash}\n", one_line(name));
    }
    text += "# Intervals are at 90 %.\n\n";
    let mut effect: Option<String> = None;
    for line in file.to_toml().lines() {
        if let Some((key, value)) = line.split_once(" = ") {
            if key == "id" {
                effect = Some(value.trim_matches('"').to_string());
            }
            let name = match &effect {
                Some(id) => format!("{id}.{key}"),
                None => key.to_string(),
            };
            if let Some(estimate) = estimates.iter().find(|estimate| estimate.name == name) {
                text += &format!("# {}\n", beside(estimate));
            }
        }
        text += line;
        text.push('\n');
    }
    text
}

fn beside(estimate: &Estimate) -> String {
    let end = |end: Option<f64>| end.map_or("open".to_string(), |x| format!("{x:.4e}"));
    let mut text = format!(
        "{} to {}, {}",
        end(estimate.low),
        end(estimate.high),
        estimate.verdict.name()
    );
    if let Some(advice) = &estimate.advice {
        text += &format!("; {advice}");
    }
    text
}

fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}
