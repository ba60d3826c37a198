//! Where a coupling is looked for. Beside its resonance it changes what another one does not: it is looked for over many resonances, damped, which
//! makes them wide, and with friction on either side.

use super::starts::levels;
use bristle_plant::effect::{Entry, Kind, Scale};

pub(super) const COUPLING: &str = "mechanics.compliance";
/// Compliances over the usual range.
const COMPLIANCES: usize = 10;
/// Beyond it, in times of its end: an axis that is held by what it moves itself may be softer than any record of it shows.
const SOFTER: f64 = 2.0;
/// Parts of the inertia behind it.
const LOADS: [f64; 3] = [0.2, 0.5, 0.8];
/// The damping ratio, as a part of the most that is usual.
const DAMPED: f64 = 0.5;

/// Values of all couplings that are tried.
pub(super) fn couplings(entry: &Entry, scale: &Scale) -> Vec<Vec<f64>> {
    let range = |i: usize| (entry.parameters[i].range)(scale);
    let form = |i: usize| entry.parameters[i].kind == Kind::Form;
    let [low, high] = range(0);
    let damped = DAMPED * range(2)[1];
    debug_assert!(form(3));
    levels([low, SOFTER * high], COMPLIANCES)
        .flat_map(|compliance| LOADS.map(|load| (compliance, load)))
        .flat_map(|(compliance, load)| {
            range(3).map(|on_motor| vec![compliance, load, damped, on_motor])
        })
        .collect()
}
