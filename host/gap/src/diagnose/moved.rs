//! Which of the simulator's own parameters a refit moved.

use super::held_out::spreads;
use super::tried::Search;
use crate::inverse::{Own, Owner};
use serde::Serialize;

/// A parameter moved if it moved by so many of its standard deviations and by this part of itself.
const MOVED: (f64, f64) = (4.0, 0.02);
/// Part of itself by which one that sliding tells moved: of 220 opened axes without an effect one had its inertia 0.025 off where the refit gained
/// as many nats as accuse, the others none by a hundredth.
const BY_SLIDING: f64 = 0.03;

/// A parameter of the simulator that moved.
#[derive(Clone, Debug, Serialize)]
pub struct Moved {
    /// Its name in the axis file.
    pub parameter: String,
    /// As the axis file has it.
    pub before: f64,
    /// As refitted.
    pub after: f64,
    /// Standard deviation of that.
    pub deviation: f64,
    /// Sliding alone tells it: inertia, Coulomb and viscous friction. Errors of the method at low speed do not move it.
    #[serde(skip)]
    pub(super) by_sliding: bool,
}

/// Those that the refit moved.
pub(super) fn moved(search: &Search) -> Vec<Moved> {
    let model = &search.base.model;
    let at = &search.base.fit.at;
    let spreads = spreads(model, &search.base.fit);
    model
        .free
        .iter()
        .zip(at)
        .zip(&spreads)
        .filter(|((free, _), _)| free.owner != Owner::Own(Own::Skew))
        .filter_map(|((free, &x), &spread)| {
            let (before, after) = (free.start, free.value(x));
            let far = (x - free.coordinate(before)).abs();
            let relative = (after - before).abs() / before.abs().max(1e-300);
            (far > MOVED.0 * spread && relative > MOVED.1).then(|| Moved {
                parameter: free.name.clone(),
                before,
                after,
                deviation: if free.logarithmic {
                    spread * after
                } else {
                    spread
                },
                by_sliding: relative > BY_SLIDING
                    && matches!(
                        free.owner,
                        Owner::Own(Own::Inertia | Own::Coulomb | Own::Viscous)
                    ),
            })
        })
        .collect()
}
