//! The noise of records beside a fitted model, and what the method leaves over of that model's own records.

use super::axis_at::axis_at;
use super::likelihood::Noise;
use super::own::Own;
use super::regime::{Node, nodes};
use crate::inverse::{Model, Record, twins};
use bristle_plant::effect::Scale;

/// Where friction is whatever holds, it is known to this part of itself while the axis hardly moves.
const HELD: f64 = 0.5;

/// The noise of records that a fitted model leaves this over of.
pub(super) fn noise_of(
    model: &Model,
    records: &[Record],
    nodes: &[Node],
    left_over: &[f64],
    own: &Own,
) -> Noise {
    let believed = &model.believed;
    let holds_nm = if believed.model.has_bristles() {
        0.0
    } else {
        HELD * believed.coulomb_nm
    };
    Noise::beside(
        records,
        nodes,
        left_over,
        believed.whole_inertia_kg_m2(),
        holds_nm,
        own,
    )
}

/// What the method leaves over of a model's own records without noise; nothing where it cannot be simulated.
pub(super) fn own_left_over(model: &Model, at: &[f64], records: &[Record], scale: &Scale) -> Own {
    own_with_noise(0.0, model, at, records, scale)
}

/// The same with so many times the noise on the rotor and of the measured effort; of the former what it does to bristles and loads.
pub(super) fn own_with_noise(
    times: f64,
    model: &Model,
    at: &[f64],
    records: &[Record],
    scale: &Scale,
) -> Own {
    let axis = axis_at(&model.at(at));
    twins(&axis, records, times, 0)
        .and_then(|twins| {
            let left_over = model.left_over(&twins, at)?;
            let nodes = nodes(&twins, scale.z_ss_rad);
            let white_nm = records
                .iter()
                .map(|record| times * rotor_noise_of_nodes_nm(record));
            Ok(Own::new(&nodes, &left_over, &white_nm.collect::<Vec<_>>()))
        })
        .unwrap_or_default()
}

/// What noise on the rotor makes of each node of a record, N m rms.
fn rotor_noise_of_nodes_nm(record: &Record) -> f64 {
    record.rotor_noise_nm * record.kernel.of_effort()
}
