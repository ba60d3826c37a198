//! Couplings to which no fit leads: with another load behind the same resonance, and where a play was found.

use super::candidate::{Background, Start};
use super::coupling::COUPLING;
use super::play::{BRINGS, PLAY};
use super::screen::Tried;
use crate::error::InputError;
use crate::inverse::{Model, PROMISES, STANDS_STILL, fit_near_until};
use bristle_plant::effect::{Coupling, Entry};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Times of the inertia behind a coupling to that before it.
const LOADS: [f64; 4] = [0.25, 0.5, 2.0, 4.0];
/// So often at most: each may lead on.
const ROUNDS: usize = 3;

/// Fits the coupling among `found` from the spring of the play among them, where that came out nearer, and puts it there where it then does better: a
/// play that is next to none leads to a resonance that no coupling was tried at.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn spring_of_play(
    background: &Background<'_>,
    found: &mut [Tried],
) -> Result<(), InputError> {
    let place = |id: &str| found.iter().position(|one| one.entry.id == id);
    let (Some(play), Some(coupling)) = (place(PLAY), place(COUPLING)) else {
        return Ok(());
    };
    let (nearer, farther) = (&found[play], &found[coupling]);
    let most = farther.fit.cost - BRINGS.0;
    if nearer.fit.cost >= most {
        return Ok(());
    }
    let point = nearer.model.at(&nearer.fit.at);
    let values = point.effects().last().map(|added| &added.values[..]);
    let Some(&[_, share, resonance_hz, damping_ratio, on_motor]) = values else {
        return Ok(());
    };
    let inertia = Coupling::reduced_kg_m2(point.believed().whole_inertia_kg_m2(), share);
    let compliance = ((TAU * resonance_hz).powi(2) * inertia).recip();
    let values = vec![compliance, share, damping_ratio, on_motor];
    let entry = farther.entry;
    let spring = Beside::new(background, entry, values, nearer);
    let spring = spring.fitted(background, entry, STANDS_STILL)?;
    if spring.fit.cost < most {
        found[coupling] = spring;
    }
    Ok(())
}

/// Fits a coupling anew with other parts of the inertia behind the same resonance, and takes it where it then does better: of a load that swings undamped
/// a fit finds the resonance first, and stays where that has led it.
///
/// # Errors
/// The friction model refuses the parameters.
pub(super) fn other_loads(
    background: &Background<'_>,
    coupling: &mut Tried,
) -> Result<(), InputError> {
    if coupling.entry.id != COUPLING {
        return Ok(());
    }
    for _ in 0..ROUNDS {
        let point = coupling.model.at(&coupling.fit.at);
        let values = point.effects().last().map(|added| &added.values[..]);
        let Some(&[compliance, share, damping_ratio, on_motor]) = values else {
            break;
        };
        let share = Coupling::simulated(share);
        let others = LOADS.into_par_iter().map(|times| {
            let odds = times * share / (1.0 - share);
            let load = odds / (1.0 + odds);
            let [before, after] = [share, load].map(|share| Coupling::reduced_kg_m2(1.0, share));
            let values = vec![compliance * before / after, load, damping_ratio, on_motor];
            let one = Beside::new(background, coupling.entry, values, coupling);
            one.fitted(background, coupling.entry, PROMISES)
        });
        let others = others.collect::<Result<Vec<_>, InputError>>()?;
        let nearest = others
            .into_iter()
            .min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost));
        let Some(nearest) = nearest.filter(|one| one.fit.cost < coupling.fit.cost - BRINGS.0)
        else {
            break;
        };
        let (model, at) = (nearest.model, nearest.fit.at);
        *coupling = Beside { model, at }.fitted(background, coupling.entry, STANDS_STILL)?;
    }
    Ok(())
}

/// An effect, and where a fit of it begins: at the simulator's own parameters as they came out with another that is read alike.
pub(super) struct Beside {
    pub(super) model: Model,
    pub(super) at: Vec<f64>,
}

impl Beside {
    pub(super) fn new(
        background: &Background<'_>,
        entry: &'static Entry,
        values: Vec<f64>,
        other: &Tried,
    ) -> Self {
        let mut model = background.with(entry, &Start::at(values));
        model.scales_effort = other.model.scales_effort;
        let own = background.model.free.len();
        let mut at = other.fit.at[..own].to_vec();
        at.extend_from_slice(&model.start()[own..]);
        Self { model, at }
    }

    /// Fitted until the cost changes by less than a part of itself.
    ///
    /// # Errors
    /// The friction model refuses the parameters.
    fn fitted(
        self,
        background: &Background<'_>,
        entry: &'static Entry,
        stands_still: f64,
    ) -> Result<Tried, InputError> {
        let Self { model, at } = self;
        let (records, weights) = (background.records, background.weights);
        let known = &background.fit.jacobian;
        let fit = fit_near_until(stands_still, &model, records, weights, at, known)?;
        Ok(Tried { entry, model, fit })
    }
}
