//! Which friction model: those that say anything the logs can check, compared on data that took no part in the fit.

use super::fit::{Data, Joint};
use crate::axis_file::FrictionModel;
use crate::diagnose::held_out;

/// The models that are compared, the simplest first.
pub const MODELS: [FrictionModel; 5] = [
    FrictionModel::CoulombViscous,
    FrictionModel::Stribeck,
    FrictionModel::Dahl,
    FrictionModel::Lugre,
    FrictionModel::ElastoPlastic,
];

/// A model on held-out data.
#[derive(Clone, Debug, PartialEq)]
pub struct Compared {
    /// Which.
    pub kind: FrictionModel,
    /// Logarithm of the density of what it leaves over on data that took no part, less that of the best.
    pub score: f64,
    /// Standard error of that difference, over blocks of time.
    pub error: f64,
    /// What it leaves over there, N m rms.
    pub rms_nm: f64,
}

/// Compares fits that share data and weights. The place of the chosen one is the second: the simplest whose score is
/// within a standard error of the best.
pub fn compare(data: &Data, fits: &[Joint]) -> (Vec<Compared>, usize) {
    let rests: Vec<Vec<f64>> = fits
        .iter()
        .map(|joint| held_out(&joint.model, &joint.fit, &data.weights, &data.nodes))
        .collect();
    let scores: Vec<Vec<f64>> = rests.iter().map(|rest| by_block(data, rest)).collect();
    let total = |scores: &[f64]| scores.iter().sum::<f64>();
    let best = (0..fits.len())
        .max_by(|&a, &b| total(&scores[a]).total_cmp(&total(&scores[b])))
        .unwrap_or(0);
    let compared: Vec<Compared> = fits
        .iter()
        .zip(&scores)
        .zip(&rests)
        .map(|((joint, score), rest)| {
            let apart: Vec<f64> = score
                .iter()
                .zip(&scores[best])
                .map(|(a, b)| a - b)
                .collect();
            let blocks = apart.len() as f64;
            let mean = total(&apart) / blocks;
            let square: f64 = apart.iter().map(|d| (d - mean).powi(2)).sum();
            Compared {
                kind: joint.kind,
                score: total(&apart),
                error: (square * blocks / (blocks - 1.0).max(1.0)).sqrt(),
                rms_nm: data.noise.rms(&data.nodes, rest).1,
            }
        })
        .collect();
    let chosen = compared
        .iter()
        .position(|model| model.score >= -model.error)
        .unwrap_or(best);
    (compared, chosen)
}

/// Logarithm of the density of a rest in each block of time, each regime with its own best spread above the floor.
fn by_block(data: &Data, rest: &[f64]) -> Vec<f64> {
    const BLOCK_S: f64 = 0.5;
    let key = |i: usize| (data.nodes[i].record, data.nodes[i].regime as usize);
    let mut squares = std::collections::BTreeMap::<(usize, usize), (f64, f64)>::new();
    for (i, r) in rest.iter().enumerate() {
        if data.weights[i] > 0.0 {
            let sums = squares.entry(key(i)).or_default();
            sums.0 += r * r;
            sums.1 += 1.0;
        }
    }
    let mut blocks = std::collections::BTreeMap::<(usize, usize, usize), f64>::new();
    for (i, r) in rest.iter().enumerate() {
        if data.weights[i] == 0.0 {
            continue;
        }
        let node = &data.nodes[i];
        let group = data.noise.group(node);
        let (square, count) = squares[&key(i)];
        let spread = (square / count).max(0.5 * group.floor_nm.powi(2));
        let density =
            -0.5 * (spread.ln() + r * r / spread) * group.independent / group.nodes as f64;
        let block = (node.sample as f64 * data.records[node.record].step_s / BLOCK_S) as usize;
        *blocks
            .entry((node.record, node.stretch, block))
            .or_default() += density;
    }
    blocks.into_values().collect()
}
