//! Torque noise on the rotor that no effort shows: under it bristles creep and a load bounces otherwise than the motion tells.

use super::fitted_noise::twins_of;
use super::regime::{Node, Regime, members};
use super::tone::toneless;
use super::white_noise::quiet_noise;
use crate::inverse::{EFFORT, Kernel, Model, Record};
use bristle_plant::effect::Scale;
use std::f64::consts::PI;

/// Frequencies that the power of a node is summed over: more than it has nodes in common with others.
const FREQUENCIES: usize = 16;

/// Puts it into records, of which the model leaves this over: what nodes of sliding that follow each other have in quiet moments,
/// beyond the noise of the effort and what they have on the model's own records. It is the axis's, so the record with
/// the least of it tells.
pub(super) fn put_rotor_noise(
    records: &mut [Record],
    model: &Model,
    of_records: &[Node],
    left_over: &[f64],
    scale: &Scale,
) {
    let at = model.start();
    let twins = twins_of(model, &at, records, scale);
    let of_twins = twins.and_then(|(twins, nodes)| {
        let left_over = model.left_over(&twins, &at)?;
        Ok(quiet(&twins, &nodes, &left_over))
    });
    let Ok(of_twins) = of_twins else {
        return;
    };
    let found = quiet(records, of_records, left_over);
    let of_effort = |record: &Record| record.effort_noise_nm.powi(2) * record.step_s;
    let of_effort = records.iter().map(of_effort).fold(f64::INFINITY, f64::min);
    let told = records.iter().zip(found).zip(of_twins);
    let told = told.filter_map(|((record, found), of_twin)| {
        let square = found?.powi(2) - of_twin.unwrap_or(0.0).powi(2);
        Some(square / second_difference(record.kernel) * record.step_s - of_effort)
    });
    let density = told.reduce(f64::min).unwrap_or(0.0).max(0.0);
    for record in records {
        record.rotor_noise_nm = (density / record.step_s).sqrt();
    }
}

/// The records with no more white noise than a model leaves over of them. A stiff control makes the effort alternate, too, which the axis follows; and what
/// was found on the rotor is of a model whose parameters were off.
pub(super) fn as_quiet_as(records: &[Record], nodes: &[Node], left_over: &[f64]) -> Vec<Record> {
    let found = quiet(records, nodes, left_over);
    let density = |(record, found): (&Record, Option<f64>)| {
        Some(found?.powi(2) / second_difference(record.kernel) * record.step_s)
    };
    let found: Vec<Option<f64>> = records.iter().zip(found).map(density).collect();
    // A record without quiet moments has the noise of the others: recorder and rotor are the same.
    let least = found.iter().flatten().copied().reduce(f64::min);
    let quieted = |(record, found): (&Record, Option<f64>)| {
        let mut record = record.clone();
        if let Some(most) = found.or(least) {
            let most = most / record.step_s;
            let of_effort = record.effort_noise_nm.powi(2).min(most);
            record.effort_noise_nm = of_effort.sqrt();
            // What bristles drift by they tell themselves.
            if record.shakes_nm == 0.0 {
                record.rotor_noise_nm = record.rotor_noise_nm.min((most - of_effort).sqrt());
            }
        }
        record
    };
    records.iter().zip(found).map(quieted).collect()
}

/// What nodes of sliding have in quiet moments of each record by their second differences, N m.
fn quiet(records: &[Record], nodes: &[Node], left_over: &[f64]) -> Vec<Option<f64>> {
    let slides = |place: usize, values: &[f64]| -> Vec<(usize, f64)> {
        members(nodes, values, place, |of| of == Regime::Sliding)
    };
    let toneless = toneless(records, nodes, left_over, |place| slides(place, left_over));
    let of =
        |(place, record): (usize, &Record)| quiet_noise(&slides(place, &toneless), record.node_s());
    records.iter().enumerate().map(of).collect()
}

/// A sixth of the mean square of the second differences of nodes where samples of effort have white noise of 1.
fn second_difference(kernel: Kernel) -> f64 {
    let of = |k: usize| {
        let waves = k as f64 / FREQUENCIES as f64;
        (2.0 * (PI * waves).sin()).powi(4) * kernel.power(&EFFORT, waves)
    };
    (0..FREQUENCIES).map(of).sum::<f64>() / (6 * FREQUENCIES) as f64
}

#[cfg(test)]
mod tests {
    use super::super::regime::nodes;
    use super::super::testing::record;
    use super::*;
    use crate::axis_file::AxisFile;
    use crate::believed::Believed;
    use crate::experiments::Named;
    use crate::inverse::scale;
    use bristle_plant::Unit;
    use std::path::Path;

    /// Two records of an axis with so much, N m rms a sample of its log, and what its model leaves over of them.
    fn seen(torque_nm: f64) -> (Vec<Record>, Model, Vec<Node>, Vec<f64>, Scale) {
        let mut file = AxisFile::new(Unit::Rotary, 4.9e-5);
        file.friction.coulomb = Some(0.03);
        file.friction.viscous = Some(1e-4);
        let believed = Believed::new(&file, Path::new("axis.toml")).unwrap();
        let record = |named: Named| record(named, 30.0, &file, &believed, torque_nm);
        let records = vec![record(Named::Sine), record(Named::Ladder)];
        let model = Model::base(&believed, &records, 0.15).unwrap();
        let scale = scale(&believed, &records);
        let nodes = nodes(&records, scale.z_ss_rad);
        let left_over = model.left_over(&records, &model.start()).unwrap();
        (records, model, nodes, left_over, scale)
    }

    /// What is found of it, N m rms a sample of the log.
    fn found(torque_nm: f64) -> f64 {
        let (mut records, model, nodes, left_over, scale) = seen(torque_nm);
        put_rotor_noise(&mut records, &model, &nodes, &left_over, &scale);
        records[0].rotor_noise_nm * (records[0].averaged as f64).sqrt()
    }

    #[test]
    fn noise_is_no_more_than_what_is_left_over() {
        let (mut records, _, nodes, left_over, _) = seen(3e-4);
        for record in &mut records {
            record.rotor_noise_nm = 1e-2;
            record.effort_noise_nm = 1e-2;
        }
        for record in as_quiet_as(&records, &nodes, &left_over) {
            let noise_nm = record.effort_noise_nm.hypot(record.rotor_noise_nm);
            let of_log_nm = noise_nm * (record.averaged as f64).sqrt();
            // Noise of positions comes on top.
            assert!((2.5e-4..6e-4).contains(&of_log_nm), "{of_log_nm}");
        }
    }

    #[test]
    fn it_is_found_beside_the_noise_of_positions() {
        // Of 1e-4, 3e-4 and 1e-3 N m it found a fifth to a quarter more: near enough for what bristles do under it.
        let found_nm = found(3e-4);
        assert!((2e-4..4e-4).contains(&found_nm), "{found_nm}");
        // Coarse positions alone leave what the twin's leave.
        let without_nm = found(0.0);
        assert!(without_nm < 0.2 * found_nm, "{without_nm}");
    }
}
