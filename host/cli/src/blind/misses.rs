//! The answers that went wrong, in tables.

use super::miss::{Miss, Reason};
use super::score::Outcome;
use bristle_gap::report::Table;
use bristle_withheld::Truth;
use std::collections::BTreeMap;

/// All that an effect of half the floor or more, or none, should have been.
fn missed(outcomes: &[Outcome]) -> impl Iterator<Item = (&Outcome, &Miss)> {
    outcomes
        .iter()
        .filter(|one| one.strength != "1/4x")
        .filter_map(|one| Some((one, one.miss.as_ref()?)))
}

/// How many answers went wrong for which reason.
pub fn reasons(outcomes: &[Outcome]) -> Table {
    let mut counts: BTreeMap<Reason, BTreeMap<&str, usize>> = BTreeMap::new();
    for (one, miss) in missed(outcomes) {
        let strengths = counts.entry(miss.reason).or_default();
        *strengths.entry(one.strength).or_default() += 1;
    }
    let header = ["reason", "cases", "at 4x", "at 1x", "without effect"];
    counts.iter().fold(
        Table::new("Why answers were wrong", &header),
        |table, (reason, strengths)| {
            let of = |strength| {
                strengths
                    .get(strength)
                    .copied()
                    .unwrap_or_default()
                    .to_string()
            };
            let all: usize = strengths.values().sum();
            table.row(&[
                reason.to_string(),
                all.to_string(),
                of("4x"),
                of("1x"),
                of(""),
            ])
        },
    )
}

/// The wrong answers one by one.
pub fn table(outcomes: &[Outcome], truths: &BTreeMap<String, Truth>) -> Table {
    let header = [
        "case",
        "seed",
        "truth",
        "size / floor",
        "verdict",
        "probability",
        "first three",
        "logs",
        "why",
        "in times of the floor",
        "would record next",
    ];
    missed(outcomes).fold(
        Table::new("Answers that were wrong", &header),
        |table, (one, miss)| {
            let truth = &truths[&one.case];
            let ratios: Vec<String> = truth
                .effects
                .iter()
                .map(|effect| format!("{:.2}", effect.ratio))
                .collect();
            let what = if one.truth.is_empty() {
                one.class.name().to_owned()
            } else {
                one.truth.join(" + ")
            };
            let said = match &one.error {
                Some(error) => format!("error: {error}"),
                None if one.named.is_empty() => one.kind.clone(),
                None => format!("{}: {}", one.kind, one.named.join(", ")),
            };
            table.row(&[
                one.case.clone(),
                truth.seed.to_string(),
                what,
                ratios.join(", "),
                said,
                one.probability
                    .map_or("-".to_owned(), |p| format!("{p:.2}")),
                one.first.join(", "),
                truth.experiments.join(", "),
                miss.reason.to_string(),
                miss.figures.clone(),
                one.next.clone(),
            ])
        },
    )
}
