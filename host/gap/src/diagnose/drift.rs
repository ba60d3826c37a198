//! Torque noise on the rotor that coarse positions hide, as bristles tell of it that drift under it.

use super::regime::{Node, Regime};
use crate::error::InputError;
use crate::inverse::{Model, Record};

/// Noise that is tried, as parts of Coulomb friction in samples of [`SAMPLE_S`], each twice the one before.
const LEAST: f64 = 1e-3;
const LEVELS: i32 = 6;
/// Then beside the best one, by these factors and their inverses.
const FINER: [f64; 2] = [1.4, 1.2];
const SAMPLE_S: f64 = 1e-3;
/// Part of the squares of slow nodes that it leaves at most. Where bristles drift it leaves 0.07; of what effects and wrong parameters leave a fifth and more.
const LEAVES: f64 = 0.15;

/// Puts the noise into records with which the model leaves least of slow nodes, where its bristles drift and that takes nearly all of them. It is the
/// axis's, so it is the same in all of them. Says whether there is any.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn put_drift(
    records: &mut [Record],
    model: &Model,
    at: &[f64],
    nodes: &[Node],
) -> Result<bool, InputError> {
    if !model.believed.model.drifts() {
        return Ok(false);
    }
    let squares = |records: &[Record]| -> Result<f64, InputError> {
        let left_over = model.left_over(records, at)?;
        let slow = |node: &Node| node.regime != Regime::Sliding;
        let slow = nodes.iter().zip(&left_over).filter(|(node, _)| slow(node));
        Ok(slow.map(|(_, rest)| rest.powi(2)).sum())
    };
    let without = squares(records)?;
    let coulomb_nm = model.believed.coulomb_nm;
    let mut with = |share: f64| -> Result<(f64, f64), InputError> {
        put(records, share * coulomb_nm);
        Ok((squares(records)?, share))
    };
    let mut best = (f64::INFINITY, 0.0);
    for level in 0..LEVELS {
        best = least(best, with(LEAST * 2.0_f64.powi(level))?);
    }
    for factor in FINER {
        let share = best.1;
        for share in [share / factor, share * factor] {
            best = least(best, with(share)?);
        }
    }
    let (left, share) = best;
    let is_drift = left < LEAVES * without;
    put(records, if is_drift { share * coulomb_nm } else { 0.0 });
    for record in records.iter_mut().filter(|_| is_drift) {
        record.rotor_noise_nm = record.shakes_nm;
    }
    Ok(is_drift)
}

/// So much noise in samples of [`SAMPLE_S`].
fn put(records: &mut [Record], torque_nm: f64) {
    for record in records {
        record.shakes_nm = torque_nm * (SAMPLE_S / record.step_s).sqrt();
    }
}

fn least(one: (f64, f64), other: (f64, f64)) -> (f64, f64) {
    if other.0 < one.0 { other } else { one }
}

#[cfg(test)]
mod tests {
    use super::super::regime::nodes;
    use super::super::testing::record;
    use super::*;
    use crate::axis_file::{AxisFile, FrictionModel};
    use crate::believed::Believed;
    use crate::experiments::Named;
    use crate::inverse::scale;
    use bristle_plant::Unit;
    use std::path::Path;

    /// What is found of an axis with so much, N m rms a sample of a millisecond.
    fn found(friction: FrictionModel, experiments: &[Named], torque_nm: f64) -> f64 {
        let mut file = AxisFile::new(Unit::Rotary, 2e-4);
        file.axis.counts_per_turn = Some(65536.0);
        file.friction.model = Some(friction);
        file.friction.coulomb = Some(0.05);
        file.friction.stiffness = Some(30.0);
        file.friction.damping = Some(0.05);
        let believed = Believed::new(&file, Path::new("axis.toml")).unwrap();
        let record = |&named: &Named| record(named, 10.0, &file, &believed, torque_nm);
        let mut records: Vec<Record> = experiments.iter().map(record).collect();
        let model = Model::base(&believed, &records, 0.15).unwrap();
        let scale = scale(&believed, &records);
        let nodes = nodes(&records, scale.z_ss_rad);
        put_drift(&mut records, &model, &model.start(), &nodes).unwrap();
        records[0].shakes_nm * (records[0].step_s / SAMPLE_S).sqrt()
    }

    #[test]
    fn it_is_what_holding_lets_go_by() {
        // As white noise that bristles drift by alike: they are no springs, and the controller shakes them, too.
        let found_nm = found(FrictionModel::Lugre, &[Named::Moves, Named::Ladder], 5e-4);
        assert!((2.5e-4..1e-3).contains(&found_nm), "{found_nm}");
    }

    #[test]
    fn nothing_is_put_where_nothing_drifts() {
        let of = |friction, named| found(friction, &[named], 5e-4);
        assert_eq!(of(FrictionModel::Lugre, Named::Sine), 0.0);
        assert_eq!(of(FrictionModel::ElastoPlastic, Named::Moves), 0.0);
    }
}
