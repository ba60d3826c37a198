//! From everything that was tried to a verdict: none, parameters, an effect, several, ambiguous or unknown.
//!
//! Scores are held-out log densities over as many nodes as are independent; with what the data leave of the priors they are
//! evidence, by which effects are ranked, so that one that could have explained much else does not tie with a plain one. How much is left over is counted in times of
//! what is open, as the geometric mean over records and regimes: an rms in N m would be decided by whichever regime the
//! method knows least of. What an effect explains is a share of the logarithm of that. A rest of few moments hardly moves that
//! mean; it shows in the ratio of root-mean-squares, which counts beside it.

use super::accuse::{DEPENDS, LITTLE};
use super::bristles::{PRESLIDING, bends_nearly_all};
use super::ceiling;
use super::chosen::Chosen;
use super::coupling::COUPLING;
use super::hypothesis::{Hypothesis, sort};
use super::moved::{Moved, moved};
use super::rivals::asks_for_another;
use super::shares::{Shares, probability};
use super::tried::Search;
use serde::Serialize;

/// What is concluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// One effect.
    Effect,
    /// All of several effects.
    Effects,
    /// The simulator's own parameters were wrong.
    Parameters,
    /// Nothing is missing.
    None,
    /// Something is, and nothing in the catalogue explains it.
    Unknown,
    /// Any one of several effects.
    Ambiguous,
    /// The data cannot decide.
    Insufficient,
}

/// Why an effect that explains what there is is not named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doubt {
    /// It takes the simulator's own parameters to where they are hardly believed.
    Strains,
    /// Two effects explain it together, and one of them has a form that no axis is known by.
    IsUnusual,
    /// A second effect gains beside it what it would not where nothing else is.
    AsksForAnother,
    /// It carries nearly all of static friction: what is missing is that this bends at all.
    BendsAll,
}

/// The conclusion and what it rests on.
#[derive(Clone)]
pub struct Verdict {
    /// What is concluded.
    pub kind: Kind,
    /// Places in `ranked` of the effects it names.
    pub named: Vec<usize>,
    /// How probable it is.
    pub probability: f64,
    /// Every hypothesis that was fitted, best first, with its probability.
    pub ranked: Vec<(Hypothesis, f64)>,
    /// Probability that nothing is missing.
    pub none: f64,
    /// Probability that only parameters were wrong.
    pub parameters: f64,
    /// Probability that the effect is not in the catalogue.
    pub unknown: f64,
    /// An effect that explains what there is and is not named, and why.
    pub doubt: Option<(&'static str, Doubt)>,
    /// The one that is named though its form is not the catalogue's.
    pub in_another_form: Option<&'static str>,
    /// The simulator's parameters that moved.
    pub moved: Vec<Moved>,
    /// Rms of the refitted simulator and of the best hypothesis on held-out data, and the floor, N m.
    pub rms_nm: [f64; 3],
}

impl Verdict {
    /// Whether a second look would find no more: something explains all that is left, and is doubted for other reasons. A coupling that
    /// asks for another effect may have another load.
    pub(super) fn is_settled(&self) -> bool {
        self.doubt.is_some_and(|(id, doubt)| match doubt {
            Doubt::IsUnusual | Doubt::BendsAll => true,
            Doubt::AsksForAnother => id != COUPLING,
            Doubt::Strains => false,
        })
    }
}

/// Concludes.
pub fn verdict(search: &Search) -> Verdict {
    let base = &search.base;
    let mut ranked: Vec<Hypothesis> = search
        .single
        .iter()
        .chain(&search.several)
        .filter(|h| h.is_credible(base))
        .cloned()
        .collect();
    sort(&mut ranked);
    let chosen = Chosen::new(search);
    let accused = chosen.is_accused();
    // What is not accused explains nothing.
    let of_best = accused.then(|| chosen.left());
    let left = of_best.as_ref().unwrap_or_else(|| chosen.left_alone());
    let shown = chosen.is_shown();
    let explains_little = !shown
        && (search.is_unlisted()
            || left.much && chosen.explained < LITTLE
            || !accused
                && (left.is_of_no_list()
                    || left.is_anything() && ceiling::depends_in_sliding(search, base, DEPENDS)));
    let explains = !shown && !explains_little && accused;
    let strains = explains && chosen.strains();
    let leaves_another = explains && !strains && chosen.leaves_another(left);
    let in_another_form = leaves_another && chosen.is_in_another_form();
    let asks = explains && !strains && !leaves_another && asks_for_another(search, chosen.best);
    let mut small = if left.much {
        Vec::new()
    } else {
        chosen.small(accused)
    };
    let bent = small.iter().find(|h| bends_nearly_all(&base.model, h));
    let bent = bent.map(|h| h.added[0].id);
    if bent.is_some() {
        let presliding = search.alone(PRESLIDING).filter(|h| h.is_credible(base));
        small = presliding.into_iter().collect();
    }
    let id = || chosen.best.added[0].id;
    let doubt = if strains {
        Some((id(), Doubt::Strains))
    } else if explains && chosen.is_unusual() {
        Some((id(), Doubt::IsUnusual))
    } else if asks {
        Some((id(), Doubt::AsksForAnother))
    } else {
        let bent = bent.filter(|_| small.is_empty());
        bent.map(|id| (id, Doubt::BendsAll))
    };
    let left_unknown = explains_little || doubt.is_some() || leaves_another && !in_another_form;
    let best = small.first().copied().unwrap_or(chosen.best);
    let moved = moved(search);
    let moved_matters = chosen.refit_matters(&moved);
    let place_of = |h: &Hypothesis| ranked.iter().position(|other| other.ids() == h.ids());

    let (kind, named) = if left_unknown {
        (Kind::Unknown, Vec::new())
    } else if !small.is_empty() {
        let mut named: Vec<usize> = small.iter().copied().filter_map(place_of).collect();
        named.sort_unstable();
        (one_of(small.len()), named)
    } else if !accused && moved_matters {
        (Kind::Parameters, Vec::new())
    } else if !accused {
        (Kind::None, Vec::new())
    } else if best.added.len() > 1 {
        (Kind::Effects, place_of(best).into_iter().collect())
    } else {
        let tied = chosen.tied(&ranked);
        (one_of(tied.len()), tied)
    };
    let probability = probability(search, kind, &chosen, left, !small.is_empty());
    let shares = Shares::new(base, &ranked, kind, &named, probability);
    let (none, parameters) = if moved_matters {
        (0.0, shares.plain)
    } else {
        (shares.plain, 0.0)
    };
    let (floor, before) = search.noise.rms(&search.nodes, &base.held_out);
    let after = search.noise.rms(&search.nodes, &best.held_out).1;
    Verdict {
        kind,
        named,
        probability,
        ranked: ranked.into_iter().zip(shares.ranked).collect(),
        none,
        parameters,
        unknown: shares.unknown,
        in_another_form: chosen
            .best
            .ids()
            .first()
            .copied()
            .filter(|_| in_another_form && small.is_empty()),
        doubt,
        moved,
        rms_nm: [before, after, floor],
    }
}

/// One of so many effects.
fn one_of(effects: usize) -> Kind {
    if effects > 1 {
        Kind::Ambiguous
    } else {
        Kind::Effect
    }
}
