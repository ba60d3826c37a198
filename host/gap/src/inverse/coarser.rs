//! A record in longer samples, for screening: the nodes see nothing that is shorter than a running mean of their kernel.

use super::kernel::Kernel;
use super::record::{Record, Stretch};
use crate::signal::{interpolate, means};

/// Samples of a running mean that are left.
const LENGTH: usize = 3;

/// The records in as long samples as leave each node where it is; nothing where all are as long as that.
pub fn coarser(records: &[Record]) -> Option<Vec<Record>> {
    let longer = records.iter().any(|record| record.kernel.length > LENGTH);
    longer.then(|| records.iter().map(coarser_one).collect())
}

fn coarser_one(record: &Record) -> Record {
    if record.kernel.length <= LENGTH {
        return record.clone();
    }
    let times = record.kernel.length as f64 / LENGTH as f64;
    let coarse = Record {
        step_s: times * record.step_s,
        stretches: record
            .stretches
            .iter()
            .map(|stretch| resampled(stretch, record.step_s, times, record.nodes_of(stretch)))
            .collect(),
        ..record.clone()
    };
    coarse.seen_through(Kernel { length: LENGTH })
}

/// A stretch in samples so many times as long, as many as give it these nodes: they lie where they lay if it begins by half of what the
/// outermost sample of a node has grown later.
fn resampled(stretch: &Stretch, step_s: f64, times: f64, nodes: usize) -> Stretch {
    let later_s = 0.5 * (times - 1.0) * step_s;
    let coarse_s = times * step_s;
    let samples = LENGTH * nodes + 2 * Kernel { length: LENGTH }.reach();
    let at_s: Vec<f64> = (0..samples)
        .map(|k| later_s + k as f64 * coarse_s)
        .collect();
    let times_s: Vec<f64> = (0..stretch.effort_nm.len())
        .map(|k| k as f64 * step_s)
        .collect();
    let at = |values: &[f64]| interpolate(&times_s, values, &at_s);
    let sample_at = |k: usize| ((k as f64 * step_s - later_s) / coarse_s).max(0.0) as usize;
    Stretch {
        start_s: stretch.start_s + later_s,
        effort_nm: means(&times_s, &stretch.effort_nm, &at_s, coarse_s),
        position_rad: at(&stretch.position_rad),
        smooth_rad: at(&stretch.smooth_rad),
        velocity_rad_s: at(&stretch.velocity_rad_s),
        excluded: at_s
            .iter()
            .map(|at| stretch.excluded[((at / step_s) as usize).min(stretch.excluded.len() - 1)])
            .collect(),
        jumps: stretch.jumps.iter().map(|&k| sample_at(k)).collect(),
        effort_nodes_nm: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis_file::AxisFile;
    use crate::believed::Believed;
    use crate::log::{Effort, EffortKind, Log, Position};
    use bristle_plant::Unit;

    #[test]
    fn nodes_stay_where_they_are() {
        let mut file = AxisFile::new(Unit::Rotary, 2.5e-5);
        file.friction.coulomb = Some(0.02);
        let believed = Believed::new(&file, "axis.toml".as_ref()).unwrap();
        for samples in 2000..2010 {
            let time_s: Vec<f64> = (0..samples).map(|k| f64::from(k) * 1e-3).collect();
            let waves = |size: f64| time_s.iter().map(|t| size * (6.0 * t).sin()).collect();
            let log = Log::new(
                std::path::PathBuf::from("log.csv"),
                Unit::Rotary,
                time_s.clone(),
                vec![Effort {
                    kind: EffortKind::TorqueMeasured,
                    values: waves(0.01),
                }],
                Position::of(Unit::Rotary, waves(3.0)),
            );
            let record = Record::new(&log, &file, &believed, &[]).unwrap();
            for length in [3, 5, 7, 9] {
                let fine = [record.clone().seen_through(Kernel { length })];
                let coarse = coarser(&fine).unwrap_or_else(|| fine.to_vec());
                assert_eq!(coarse[0].nodes(), fine[0].nodes());
                let [before, after] = [&fine[0], &coarse[0]].map(|r| &r.stretches[0]);
                assert_eq!(after.effort_nodes_nm.len(), before.effort_nodes_nm.len());
                for (a, b) in before.effort_nodes_nm.iter().zip(&after.effort_nodes_nm) {
                    // 6 rad/s over a sample of 1 ms would be 6e-5 N m.
                    assert!((a - b).abs() < 1e-6, "{length} {samples}: {a} {b}");
                }
                for (k, q) in after.smooth_rad.iter().enumerate() {
                    let at_s = after.start_s + k as f64 * coarse[0].step_s;
                    // Of 108 rad/s^2, an eighth of which times 1 ms squared lies between samples: 1.4e-5 rad.
                    assert!((q - 3.0 * (6.0 * at_s).sin()).abs() < 2e-5, "{q}");
                }
            }
        }
    }
}
