//! Where two limits are looked for that cut effort together: where one of them would cut little. A grid of both meets that hardly ever; what cuts ten
//! times too many samples promises nothing.

use super::candidate::Background;
use super::starts::levels;
use bristle_plant::effect::{Entry, Instant, Kind};
use bristle_plant::mechanics::Motion;

/// The first limit is tried at so many levels.
const LEVELS: usize = 8;
/// The second one where both cut these parts of all nodes.
const CUT: [f64; 5] = [0.0005, 0.002, 0.008, 0.03, 0.1];
/// Times that the range of a limit is halved to find where it cuts a node: to a thousandth.
const HALVINGS: usize = 10;

impl Background<'_> {
    /// Values of an effect of two limits that are tried; none where it is of another kind.
    pub(super) fn two_limits(&self, entry: &Entry) -> Option<Vec<Vec<f64>>> {
        let mut limits = (0..entry.parameters.len())
            .filter(|&place| entry.parameters[place].kind == Kind::Limit);
        let (first, second) = (limits.next()?, limits.next()?);
        let range = |place: usize| (entry.parameters[place].range)(self.scale);
        let at_first = |at: f64| {
            let with = move |other: f64| {
                let mut values = entry.defaults();
                (values[first], values[second]) = (at, other);
                values
            };
            let passes = |now: &Instant, at: f64| {
                (entry.build)(&with(at), self.scale.unit).actuator(now) == now.torque_nm
            };
            let mut from: Vec<f64> = self
                .instants()
                .map(|now| {
                    let [mut low, mut high] = range(second);
                    for _ in 0..HALVINGS {
                        let middle = (low * high).sqrt();
                        if passes(&now, middle) {
                            high = middle;
                        } else {
                            low = middle;
                        }
                    }
                    low
                })
                .collect();
            from.sort_unstable_by(|a, b| b.total_cmp(a));
            let mut cut: Vec<f64> = CUT
                .iter()
                .filter_map(|part| from.get((part * from.len() as f64) as usize).copied())
                .collect();
            cut.dedup();
            cut.into_iter().map(with)
        };
        let all = levels(range(first), LEVELS).flat_map(at_first);
        Some(all.collect())
    }

    /// The motion and effort at each node.
    fn instants(&self) -> impl Iterator<Item = Instant> {
        self.nodes.iter().map(|node| {
            let motion = Motion {
                velocity_rad_s: node.velocity_rad_s(self.records),
                ..Motion::default()
            };
            Instant {
                motion,
                torque_nm: node.effort_nm(self.records),
                ..Instant::default()
            }
        })
    }
}
