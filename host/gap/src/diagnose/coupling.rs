//! Where a coupling is looked for. Beside its resonance it changes what another one does not: it is looked for over many resonances, damped, which
//! makes them wide, and with friction on either side.

use super::starts::levels;
use bristle_plant::effect::{Entry, Scale};

pub(super) const COUPLING: &str = "mechanics.compliance";
/// Compliances that are tried.
const COMPLIANCES: usize = 10;
/// The softest, in times of the softest usual one: a trial's was at 1.1.
const SOFTEST: f64 = 2.0;
/// Parts of the inertia behind it.
const LOADS: [f64; 3] = [0.2, 0.5, 0.8];
/// The damping ratio, as a part of the most that is usual.
const DAMPED: f64 = 0.5;

/// Values of all couplings that are tried: compliance, part of the inertia, damping ratio, whether friction is on the motor.
pub(super) fn couplings(coupling: &Entry, scale: &Scale) -> Vec<Vec<f64>> {
    let usual = |parameter: usize| (coupling.parameters[parameter].range)(scale);
    let ([stiffest, soft], [_, damped], on_motor) = (usual(0), usual(2), usual(3));
    levels([stiffest, SOFTEST * soft], COMPLIANCES)
        .flat_map(|compliance| LOADS.map(|load| (compliance, load)))
        .flat_map(|(compliance, load)| {
            on_motor.map(|on_motor| vec![compliance, load, DAMPED * damped, on_motor])
        })
        .collect()
}
