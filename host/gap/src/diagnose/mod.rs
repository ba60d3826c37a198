//! The gap: where it lies, which effect causes it, how far it shrinks.

mod accuse;
mod apply;
mod axis_at;
mod beside;
mod bristles;
mod candidate;
mod ceiling;
mod chosen;
mod closed;
mod confusable;
mod coupling;
mod credit;
mod details;
mod drift;
mod fitted_noise;
mod held_out;
mod hypothesis;
mod left;
mod likelihood;
mod limits;
mod locate;
mod look_again;
mod lost;
mod maps;
mod moved;
mod next;
mod null;
mod other_couplings;
mod own;
mod own_form;
mod play;
mod refitted;
mod regime;
mod report;
mod reproduce;
mod result;
mod ridge;
mod rivals;
mod rotor_noise;
mod round;
mod screen;
mod search;
mod shares;
mod signature;
mod single;
mod sound;
mod spectrum;
mod starts;
mod sudden;
#[cfg(test)]
mod testing;
mod tone;
mod tried;
mod usual_play;
mod verdict;
mod waves;
mod white_noise;
mod windows;
mod words;

pub use apply::{Applied, axis_file};
pub use candidate::{Background, Start};
pub use closed::{Closed, Part, closed_over};
pub use held_out::{held_out, spreads};
pub use hypothesis::Hypothesis;
pub(crate) use hypothesis::is_predicted;
pub use likelihood::{Group, Noise};
pub use locate::Region;
pub use maps::{Map, Maps, maps};
pub use next::{Proposal, next};
pub use refitted::DOUBT;
use refitted::Refitted;
pub use regime::{Node, Regime, nodes};
pub use report::{Context, report};
pub use reproduce::{Reproduced, reproduced};
pub use result::{Candidate, Diagnosis, NextExperiment, parameters};
pub use search::catalogue;
use search::search;
pub use tried::{Null, Search};
pub use verdict::{Doubt, Kind, Verdict};

use crate::axis_file::AxisFile;
use crate::believed::Believed;
use crate::error::InputError;
use crate::log::Log;
use bristle_plant::effect::Entry;

/// What may be varied in a diagnosis.
#[derive(Clone)]
pub struct Options {
    /// Effects that may be accused.
    pub catalogue: Vec<&'static Entry>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            catalogue: catalogue(),
        }
    }
}

/// A diagnosis and all that it rests on.
pub struct Outcome {
    /// As other programs read it.
    pub diagnosis: Diagnosis,
    /// All that was tried.
    pub search: Search,
    /// The conclusion, with its hypotheses.
    pub verdict: Verdict,
}

/// Diagnoses logs against what the axis file believes. `progress` is called with the share done.
///
/// # Errors
/// Logs and axis file do not fit, a log is wrong as a whole, or a number is out of range.
pub fn diagnose(
    logs: &[Log],
    axis: &AxisFile,
    believed: &Believed,
    options: &Options,
    progress: &dyn Fn(f64),
) -> Result<Outcome, InputError> {
    let refitted_for = |friction: &Believed| {
        let mut sound = sound::sound(logs, axis, friction, &options.catalogue)?;
        let refitted = Refitted::new(std::mem::take(&mut sound.records), believed)?;
        Ok((sound, refitted))
    };
    let (mut sound, mut refitted) = refitted_for(believed)?;
    if let Some(found) = refitted.prepared_for(believed) {
        (sound, refitted) = refitted_for(&found)?;
    }
    let mut catalogue = if sound.moves {
        options.catalogue.clone()
    } else {
        Vec::new()
    };
    if let Some(lost) = &sound.lost {
        catalogue.retain(|entry| entry.id != lost.added.entry.id);
    }
    let (mut search, mut concluded) = search(refitted, &catalogue, progress)?;
    if let Some(lost) = &sound.lost {
        lost.accuse(&mut search, &options.catalogue)?;
        concluded = verdict::verdict(&search);
    }
    let mut diagnosis = result::conclude(&search, &concluded, believed);
    if !sound.moves {
        diagnosis.undecided();
    }
    diagnosis.gap.drift = sound.drift_nm;
    diagnosis.notes.splice(0..0, sound.notes);
    Ok(Outcome {
        diagnosis,
        search,
        verdict: concluded,
    })
}
