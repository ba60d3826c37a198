//! What a hypothesis leaves over beside what it would leave over were it true: of records of its own, with the noise that
//! the quiet moments of these show. The noise that a fit is weighed by is told from what it leaves over, too, and takes what varies as fast as
//! nodes for noise; in quiet moments there is little of what a wrong effect leaves.

use super::fitted_noise::of_itself;
use super::hypothesis::Hypothesis;
use super::own::Own;
use super::quiet::quiet_noise;
use super::regime::{Node, Regime, nodes};
use super::tried::Search;
use crate::inverse::Record;

/// Nodes so far apart share no sample of the kernel.
const SHARE_NOTHING: usize = 3;

/// How many times that its rest is: the geometric mean over all that is independent and moves. Once where it cannot be simulated.
pub(super) fn times_its_own(search: &Search, by: &Hypothesis) -> f64 {
    let Ok((twins, left_over)) = of_itself(1.0, &by.model, &by.fit.at, &search.records) else {
        return 1.0;
    };
    let twin_nodes = nodes(&twins, search.scale.z_ss_rad);
    let own = Own::new(&twins, &twin_nodes, &left_over);
    let beyond: Vec<Option<f64>> = search
        .records
        .iter()
        .zip(&twins)
        .enumerate()
        .map(|(place, (record, twin))| {
            let shown = quiet(record, place, &search.nodes, &by.held_out)?;
            let of_twin = quiet(twin, place, &twin_nodes, &left_over)?;
            Some((shown * shown - of_twin * of_twin).max(0.0).sqrt())
        })
        .collect();
    // The axis is the same where a record has no quiet moments.
    let least = beyond.iter().flatten().copied().reduce(f64::min);
    let expected = |place: usize, regime| {
        let beyond = beyond[place].or(least).unwrap_or(0.0);
        own.rms_nm(place, regime).hypot(beyond)
    };
    let noise = search.noise.clone().opening(expected);
    noise.times_open(&search.nodes, &by.held_out)
}

/// Noise of a record in the quiet moments of sliding, N m rms.
fn quiet(record: &Record, place: usize, nodes: &[Node], left_over: &[f64]) -> Option<f64> {
    let slides =
        |node: &Node| node.record == place && node.regime == Regime::Sliding && !node.excluded;
    let all = nodes.iter().zip(left_over).enumerate();
    let sliding: Vec<(usize, f64)> = all
        .filter(|(_, (node, _))| slides(node))
        .map(|(at, (_, &r))| (at, r))
        .collect();
    quiet_noise(record.node_s(), &sliding, SHARE_NOTHING)
}
