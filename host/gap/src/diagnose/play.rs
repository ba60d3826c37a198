//! A play is looked for about the coupling that fits best without one. From a guess far off its flanks meet at moments at
//! which they did not, and no step of a fit leads from the one to the other.

use super::candidate::{Background, Screened, Start};
use crate::error::InputError;
use crate::inverse::{Fit, Model, fit_near};
use bristle_plant::effect::Entry;
use rayon::prelude::*;
use std::f64::consts::TAU;

const COUPLING: &str = "mechanics.compliance";
const PLAY: &str = "mechanics.backlash";
/// Plays that are tried, in times of the smallest usual one: from hardly one at all.
const GAPS: [f64; 4] = [0.4, 1.0, 3.0, 10.0];
/// Resonances, in times of the coupling's: a play makes it seem softer than it is.
const STIFFER: [f64; 4] = [1.0, 1.2, 1.5, 2.0];
/// Fall of the sum of squares that the play must bring beside the coupling, and the part of the fall by the coupling: less
/// is what a coupling without a play leaves over by the method's own error.
const BRINGS: (f64, f64) = (16.0, 0.1);

/// Whether an effect puts a load behind a spring.
pub(super) fn springs(entry: &Entry) -> bool {
    [COUPLING, PLAY].contains(&entry.id)
}

/// Tries the play among `screened` about the coupling among `found`, and puts it there where it does better than the
/// coupling, and than the play that was found.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn try_about_coupling(
    background: &Background<'_>,
    screened: &[Screened],
    found: &mut Vec<(&'static Entry, Model, Fit)>,
) -> Result<(), InputError> {
    let of = |id: &str| found.iter().find(|(entry, ..)| entry.id == id);
    let play = screened.iter().find(|(entry, _)| entry.id == PLAY);
    let (Some((play, _)), Some((_, with, coupled))) = (play, of(COUPLING)) else {
        return Ok(());
    };
    let brought = background.fit.cost - coupled.cost;
    if brought < BRINGS.0 {
        return Ok(());
    }
    let found_before = of(PLAY).map_or(f64::INFINITY, |(_, _, fit)| fit.cost);
    let enough = coupled.cost - BRINGS.0.max(BRINGS.1 * brought);
    let own = &coupled.at[..background.model.free.len()];
    let best = starts(background, play, with, coupled)
        .into_par_iter()
        .map(|start| {
            let mut model = background.with(play, &start);
            // Both are read alike.
            model.scales_effort = with.scales_effort;
            let mut at = own.to_vec();
            at.extend(model.start().into_iter().skip(at.len()));
            let left_over = model.left_over(background.records, &at)?;
            Ok((background.weighted(&left_over).norm_squared(), model, at))
        })
        .collect::<Result<Vec<_>, InputError>>()?
        .into_iter()
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, model, at)) = best else {
        return Ok(());
    };
    let known = &background.fit.jacobian;
    let fit = fit_near(&model, background.records, background.weights, at, known)?;
    if fit.cost < found_before.min(enough) {
        let play = *play;
        found.retain(|(entry, ..)| entry.id != PLAY);
        found.push((play, model, fit));
    }
    Ok(())
}

/// Plays about a coupling, by [values of the two effects](bristle_plant::effect::ALL).
fn starts(
    background: &Background<'_>,
    play: &'static Entry,
    with: &Model,
    coupled: &Fit,
) -> Vec<Start> {
    let point = with.at(&coupled.at);
    let Some(coupling) = point.effects().last() else {
        return Vec::new();
    };
    let [compliance, share, damping_ratio, on_motor] = coupling.values[..] else {
        return Vec::new();
    };
    let inertia = point.believed().whole_inertia_kg_m2() * share * (1.0 - share);
    let resonance_hz = (inertia * compliance).sqrt().recip() / TAU;
    let [smallest, _] = (play.parameters[0].range)(background.scale);
    // A coupling without a play says little of where friction acts.
    let mut starts = Vec::new();
    for gap in GAPS {
        for times in STIFFER {
            for on_motor in [on_motor, 1.0 - on_motor] {
                starts.push(Start {
                    values: vec![
                        gap * smallest,
                        share,
                        times * resonance_hz,
                        damping_ratio,
                        on_motor,
                    ],
                    phases: Vec::new(),
                    gain: 0.0,
                    guessed: false,
                });
            }
        }
    }
    starts
}
