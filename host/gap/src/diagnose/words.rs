//! The verdict in a sentence.

use super::locate::Region;
use super::result::Diagnosis;
use super::verdict::Kind;
use crate::report::short;

impl Diagnosis {
    /// The verdict in a sentence, and how probable it is.
    pub fn sentence(&self) -> String {
        let names = self.verdict.effects.join(", ");
        let gap = &self.gap;
        let closed = format!(
            "{:.0} % of the gap closes on data that took no part in the fit ({:.0} to {:.0} %)",
            100.0 * gap.closed_fraction.value,
            100.0 * gap.closed_fraction.low,
            100.0 * gap.closed_fraction.high
        );
        let said = match self.verdict.kind {
            Kind::Effect => format!("The simulator lacks {names}: {closed}."),
            Kind::Effects => format!("The simulator lacks all of {names}: {closed}."),
            Kind::Ambiguous => {
                format!("These data cannot tell apart {names}; any of them fits: {closed}.")
            }
            Kind::Parameters => {
                let moved: Vec<String> = self
                    .moved
                    .iter()
                    .map(|m| format!("{} {} -> {}", m.parameter, short(m.before), short(m.after)))
                    .collect();
                format!(
                    "No effect is missing; parameters were off: {}.",
                    moved.join(", ")
                )
            }
            Kind::None => {
                "Nothing is missing: the simulator explains the data to the noise.".to_string()
            }
            Kind::Unknown => {
                let at_best = gap.ceiling.map_or_else(String::new, |ceiling| {
                    format!(
                        " A smooth function of position, motion, effort and time closes {:.0} % of it ({:.0} to {:.0} %): so much could \
                         be closed at best.",
                        100.0 * ceiling.value,
                        100.0 * ceiling.low,
                        100.0 * ceiling.high
                    )
                });
                format!("A gap is left that no effect of the catalogue explains.{at_best}")
            }
            Kind::Insufficient => "The data cannot decide.".to_string(),
        };
        format!("{said} Probability {:.2}.", self.verdict.probability)
    }

    /// What each of two named effects closes of the gap, in a sentence.
    pub fn credit_sentence(&self) -> Option<String> {
        let credits: Vec<String> = self
            .candidates
            .iter()
            .filter_map(|candidate| {
                let credit = 100.0 * candidate.credit?;
                Some(format!("{} {credit:.0} %", candidate.effect))
            })
            .collect();
        (!credits.is_empty()).then(|| {
            format!(
                "Of the gap each closes, as the mean of alone and beside the other: {}.",
                credits.join(", ")
            )
        })
    }

    /// Where more of the gap lies than of the time, by more than chance; the most concentrated first.
    pub fn concentrated(&self) -> impl Iterator<Item = &Region> {
        let regions = self.located.regions.iter();
        regions.filter(|region| region.is_significant())
    }
}
