//! Effects that only make noise: no model takes them away, but positions show them by themselves. A coarser grid than
//! believed is `sensor.quantization`, noise that grows with speed `sensor.jitter`.
//!
//! What such an effect explains is noise in the balance of torques: the inertia times the noise's second difference.

use super::hypothesis::Hypothesis;
use super::likelihood::Noise;
use super::regime::{Node, Regime};
use crate::inverse::{Added, Record};
use crate::sensor::Shown;
use bristle_plant::effect::{ALL, Entry, Kind, Scale};

/// A grid this much coarser than a count is no rounding of the file.
const COARSER: f64 = 1.2;
/// Every record must have room for this part of a jitter at its fastest motion.
const ALIKE: f64 = 0.5;
/// Part of the least usual size of an effect below which it is that of any axis, or a motion's own jerk: of opened cases at a low rate one without the
/// effect showed 0.54 of it.
const LEAST: f64 = 0.6;

/// The hypotheses that the positions themselves suggest, whatever may be accused.
pub fn hypotheses(
    base: &Hypothesis,
    records: &[Record],
    nodes: &[Node],
    noise: &Noise,
    scale: &Scale,
) -> Vec<Hypothesis> {
    let (inertia_kg_m2, believed) = (scale.inertia_kg_m2, scale.rad_per_count);
    let known = |id: &str| base.model.effects.iter().any(|added| added.entry.id == id);
    let entry = |id: &str| ALL.iter().find(|entry| entry.id == id && !known(id));
    let mut found = Vec::new();
    let mut coarser = false;
    if let Some(entry) = entry("sensor.quantization") {
        // One encoder: a record without the grid speaks against it, one that cannot show a grid does not.
        let grid = records
            .iter()
            .filter_map(|r| r.sensor.grid_rad)
            .fold(f64::INFINITY, f64::min);
        coarser = grid.is_finite() && grid > COARSER * believed;
        if coarser {
            let extra = |_: &Record, _: f64| (grid * grid - believed * believed) / 12.0;
            let of_balance = explains(
                base,
                records,
                nodes,
                noise,
                entry,
                grid,
                inertia_kg_m2,
                &extra,
            );
            found.extend(of_balance.map(|hypothesis| Hypothesis {
                score: hypothesis.score + of_positions(records.iter(), |shown| shown.grid_nats),
                ..hypothesis
            }));
        }
    }
    if let Some(entry) = entry("sensor.jitter") {
        // A coarser grid that a record cannot show is noise in it.
        let tells = |record: &&Record| !coarser || record.sensor.grid_rad.is_some();
        let telling: Vec<&Record> = records.iter().filter(tells).collect();
        let mut shown: Vec<f64> = telling.iter().map(|r| r.sensor.jitter_s).collect();
        shown.retain(|jitter_s| *jitter_s > 0.0);
        shown.sort_unstable_by(f64::total_cmp);
        let jitter = shown.get(shown.len() / 2).copied().unwrap_or_default();
        let has_room = |record: &&Record| record.sensor.most_jitter_s > ALIKE * jitter;
        if jitter > least(entry, scale) && telling.iter().all(has_room) {
            let extra = |_: &Record, v: f64| (jitter * v).powi(2);
            let of_balance = explains(
                base,
                records,
                nodes,
                noise,
                entry,
                jitter,
                inertia_kg_m2,
                &extra,
            );
            found.extend(of_balance.map(|hypothesis| Hypothesis {
                score: hypothesis.score + of_positions(telling.into_iter(), |s| s.jitter_nats),
                ..hypothesis
            }));
        }
    }
    found
}

/// What the positions of records say by themselves, nats.
fn of_positions<'a>(records: impl Iterator<Item = &'a Record>, nats: fn(&Shown) -> f64) -> f64 {
    records.map(|record| nats(&record.sensor)).sum()
}

/// The least size of an effect that is asked for; a clock jitters by less on every axis.
fn least(entry: &Entry, scale: &Scale) -> f64 {
    let size = entry.parameters.iter().find(|p| p.kind == Kind::Size);
    size.map_or(0.0, |size| LEAST * (size.range)(scale)[0])
}

/// The base with position noise of an extra variance at each node explained.
#[expect(
    clippy::too_many_arguments,
    reason = "what a hypothesis is scored with, used twice"
)]
fn explains(
    base: &Hypothesis,
    records: &[Record],
    nodes: &[Node],
    noise: &Noise,
    entry: &'static Entry,
    size: f64,
    inertia_kg_m2: f64,
    extra: &dyn Fn(&Record, f64) -> f64,
) -> Option<Hypothesis> {
    let (mut squares, mut kept, mut gain) = (0.0, 0.0, 0.0);
    for (node, r) in nodes.iter().zip(&base.held_out) {
        if node.excluded || node.regime == Regime::Rest {
            continue;
        }
        let record = &records[node.record];
        let v = node.velocity_rad_s(records);
        let per = inertia_kg_m2 / record.step_s.powi(2) * record.kernel.of_second_difference();
        let excess = per * per * extra(record, v) / record.averaged as f64;
        let group = noise.group(node);
        let spread = group.spread_nm.powi(2);
        // Variance with the extra noise over that without it: the evidence of a change of variance.
        let ratio = spread / (spread - excess).max(0.1 * spread);
        let share = group.independent / group.nodes.max(1) as f64;
        gain += 0.5 * share * (ratio - 1.0 - ratio.ln());
        squares += r * r;
        kept += (r * r - excess).max(0.1 * r * r);
    }
    if kept >= squares {
        return None;
    }
    let mut values = entry.defaults();
    let place = entry.parameters.iter().position(|p| p.kind == Kind::Size)?;
    values[place] = size;
    let mut hypothesis = base.clone();
    hypothesis.added.push(entry);
    hypothesis.model.effects.push(Added { entry, values });
    let less = f64::sqrt(kept / squares);
    for r in &mut hypothesis.held_out {
        *r *= less;
    }
    hypothesis.score += gain;
    Some(hypothesis)
}
