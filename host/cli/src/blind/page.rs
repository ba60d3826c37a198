//! The score of a set as figures, tables, report and page of the docs.

use super::calibration::{Calibration, calibration};
use super::misses;
use super::score::Outcome;
use super::seal::{Answers, Key, Seal};
use crate::output::short;
use bristle_gap::report::{Plot, Report, Table};
use bristle_withheld::{Class, Truth};
use serde::Serialize;
use std::collections::BTreeMap;

/// A figure beside what it should be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// What it is.
    pub name: &'static str,
    /// Cases behind it.
    pub count: usize,
    /// `None` without any.
    pub value: Option<f64>,
    /// At least, or at most.
    pub limit: f64,
    /// Whether the limit is a floor for the value.
    pub at_least: bool,
}

impl Figure {
    /// Whether it is where it should be; a figure without cases is not.
    pub fn holds(&self) -> bool {
        self.value.is_some_and(|value| {
            if self.at_least {
                value >= self.limit
            } else {
                value <= self.limit
            }
        })
    }
}

/// The score of a set.
#[derive(Clone, Debug, Serialize)]
pub struct Score {
    /// Whose answers.
    pub program: String,
    /// When the set was made, and when the answers were sealed.
    pub made: String,
    /// See `made`.
    pub sealed: String,
    /// First seed and number of cases.
    pub seed: u64,
    /// What was asked for.
    pub figures: Vec<Figure>,
    /// Of the verdicts' probabilities.
    pub calibration: Option<Calibration>,
    /// Case by case.
    pub outcomes: Vec<Outcome>,
    #[serde(skip)]
    truths: BTreeMap<String, Truth>,
}

fn share(outcomes: &[&Outcome], counts: impl Fn(&Outcome) -> bool) -> Option<f64> {
    let hits = outcomes.iter().filter(|outcome| counts(outcome)).count();
    (!outcomes.is_empty()).then(|| hits as f64 / outcomes.len() as f64)
}

fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values
        .into_iter()
        .filter(|value| value.is_finite())
        .collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| 0.5 * (values[(n - 1) / 2] + values[n / 2]))
}

impl Score {
    /// Puts the outcomes of a set together.
    pub fn new(seal: &Seal, key: &Key, answers: &Answers, outcomes: Vec<Outcome>) -> Self {
        let of = |class: Class, strength: &str| -> Vec<&Outcome> {
            outcomes
                .iter()
                .filter(|one| {
                    one.class == class && (strength.is_empty() || one.strength == strength)
                })
                .collect()
        };
        let innocent: Vec<&Outcome> = outcomes
            .iter()
            .filter(|one| matches!(one.class, Class::Clean | Class::Parameters))
            .collect();
        let (strong, even) = (of(Class::Single, "4x"), of(Class::Single, "1x"));
        let unknown = of(Class::Unknown, "");
        let resembling: Vec<&Outcome> = unknown
            .iter()
            .copied()
            .filter(|one| {
                key.cases[&one.case]
                    .effects
                    .iter()
                    .any(|effect| effect.resembles.is_some())
            })
            .collect();
        let pairs = of(Class::Pair, "");
        let answered: Vec<(f64, bool)> = outcomes
            .iter()
            .filter_map(|one| Some((one.probability?, one.right())))
            .collect();
        let calibration = calibration(&answered);
        let figure = |name, cases: &[&Outcome], value, limit, at_least| Figure {
            name,
            count: cases.len(),
            value,
            limit,
            at_least,
        };
        let single: Vec<&Outcome> = strong.iter().chain(&even).copied().collect();
        let every: Vec<&Outcome> = outcomes.iter().collect();
        let figures = vec![
            figure(
                "cases without an answer",
                &every,
                share(&every, |one| one.kind == "error"),
                0.0,
                false,
            ),
            figure(
                "4x single: exact",
                &strong,
                share(&strong, |one| one.exact),
                0.95,
                true,
            ),
            figure(
                "4x single: exact or tied with truth",
                &strong,
                share(&strong, Outcome::right),
                0.99,
                true,
            ),
            figure(
                "1x single: exact",
                &even,
                share(&even, |one| one.exact),
                0.8,
                true,
            ),
            figure(
                "no effect (clean or parameters): accused",
                &innocent,
                share(&innocent, |one| one.accused),
                0.02,
                false,
            ),
            figure(
                "clean: accused",
                &of(Class::Clean, ""),
                share(&of(Class::Clean, ""), |one| one.accused),
                0.02,
                false,
            ),
            figure(
                "unknown caught",
                &unknown,
                share(&unknown, |one| one.exact),
                0.85,
                true,
            ),
            figure(
                "unknown that resembles a listed one caught",
                &resembling,
                share(&resembling, |one| one.exact),
                0.85,
                true,
            ),
            figure(
                "pair: both found",
                &pairs,
                share(&pairs, |one| one.found == 2),
                0.75,
                true,
            ),
            figure(
                "single 4x and 1x: median closed fraction over the oracle's",
                &single,
                median(single.iter().filter_map(|one| one.closed)),
                0.9,
                true,
            ),
            Figure {
                name: "expected calibration error",
                count: answered.len(),
                value: calibration
                    .as_ref()
                    .map(|calibration| calibration.expected_error),
                limit: 0.1,
                at_least: false,
            },
        ];
        Self {
            program: answers.program.clone(),
            made: seal.made.clone(),
            sealed: answers.sealed.clone(),
            seed: key.seed,
            figures,
            calibration,
            truths: key.cases.clone(),
            outcomes,
        }
    }

    fn figures_table(&self) -> Table {
        let header = ["figure", "cases", "measured", "asked for", ""];
        self.figures.iter().fold(
            Table::new("Figures and limits", &header),
            |table, figure| {
                table.row(&[
                    figure.name.to_owned(),
                    figure.count.to_string(),
                    figure
                        .value
                        .map_or("-".to_owned(), |value| format!("{value:.3}")),
                    format!(
                        "{} {}",
                        if figure.at_least {
                            "at least"
                        } else {
                            "at most"
                        },
                        figure.limit
                    ),
                    if figure.holds() { "holds" } else { "MISSED" }.to_owned(),
                ])
            },
        )
    }

    /// Rows of shares over groups of outcomes.
    fn grouped(&self, caption: &str, name: &str, of: impl Fn(&Outcome) -> Option<String>) -> Table {
        let mut groups: BTreeMap<String, Vec<&Outcome>> = BTreeMap::new();
        for outcome in &self.outcomes {
            if let Some(group) = of(outcome) {
                groups.entry(group).or_default().push(outcome);
            }
        }
        let header = [
            name,
            "cases",
            "exact",
            "or tied",
            "family",
            "top 3",
            "block",
            "insufficient",
            "closed, median",
            "magnitude error, median",
            "s, median",
            "s, worst",
        ];
        groups
            .iter()
            .fold(Table::new(caption, &header), |table, (group, cases)| {
                let percent = |value: Option<f64>| {
                    value.map_or("-".to_owned(), |value| format!("{:.0} %", 100.0 * value))
                };
                let number = |value: Option<f64>| {
                    value.map_or("-".to_owned(), |value| format!("{value:.2}"))
                };
                let listed: Vec<&Outcome> = cases
                    .iter()
                    .copied()
                    .filter(|one| matches!(one.class, Class::Single | Class::Pair))
                    .collect();
                let effect: Vec<&Outcome> = cases
                    .iter()
                    .copied()
                    .filter(|one| !one.truth.is_empty())
                    .collect();
                table.row(&[
                    group.clone(),
                    cases.len().to_string(),
                    percent(share(cases, |one| one.exact)),
                    percent(share(cases, Outcome::right)),
                    percent(share(&listed, |one| one.family)),
                    percent(share(&listed, |one| one.top3)),
                    percent(share(&effect, |one| one.block)),
                    percent(share(cases, |one| one.kind == "insufficient")),
                    number(median(effect.iter().filter_map(|one| one.closed))),
                    number(median(cases.iter().filter_map(|one| one.magnitude_error))),
                    number(median(cases.iter().map(|one| one.seconds))),
                    number(cases.iter().map(|one| one.seconds).reduce(f64::max)),
                ])
            })
    }

    fn by_class(&self) -> Table {
        self.grouped("By class", "class", |one| {
            let name = one.class.name();
            Some(if one.strength.is_empty() {
                name.to_owned()
            } else {
                format!("{name}, {} the floor", one.strength)
            })
        })
    }

    fn by_effect(&self) -> Table {
        self.grouped(
            "Single and unknown effects at half the floor or more",
            "effect",
            |one| {
                let counts =
                    matches!(one.class, Class::Single | Class::Unknown) && one.strength != "1/4x";
                counts.then(|| one.truth.join(" + "))
            },
        )
    }

    fn reliability(&self) -> Table {
        let header = ["probability", "answers", "mean said", "right"];
        let table = Table::new("Reliability of the verdict's probability", &header);
        self.calibration
            .iter()
            .flat_map(|calibration| &calibration.bins)
            .fold(table, |table, bin| {
                table.row(&[
                    format!("{:.1} to {:.1}", bin.from, bin.to),
                    bin.count.to_string(),
                    format!("{:.2}", bin.said),
                    format!("{:.2}", bin.right),
                ])
            })
    }

    /// The tables, in their order.
    pub fn tables(&self) -> Vec<Table> {
        vec![
            self.figures_table(),
            self.by_class(),
            self.by_effect(),
            self.reliability(),
            misses::reasons(&self.outcomes),
            misses::table(&self.outcomes, &self.truths),
        ]
    }

    fn lead(&self) -> String {
        let held = self.figures.iter().filter(|figure| figure.holds()).count();
        let right = self.outcomes.iter().filter(|one| one.right()).count();
        format!(
            "{right} of {} answers right; {held} of {} figures within their limits.",
            self.outcomes.len(),
            self.figures.len()
        )
    }

    fn facts(&self) -> Vec<(&'static str, String)> {
        vec![
            ("cases", self.outcomes.len().to_string()),
            ("first seed", self.seed.to_string()),
            ("made", self.made.clone()),
            ("answered by", self.program.clone()),
            ("sealed", self.sealed.clone()),
            (
                "Brier score",
                self.calibration
                    .as_ref()
                    .map_or("-".to_owned(), |calibration| short(calibration.brier)),
            ),
        ]
    }

    /// The report.
    pub fn report(&self, command: &str) -> Report {
        let mut report = Report::new("Blind check of the diagnosis").lead(&self.lead());
        for (i, table) in self.tables().into_iter().enumerate() {
            if i == 3
                && let Some(calibration) = &self.calibration
            {
                let said: Vec<f64> = calibration.bins.iter().map(|bin| bin.said).collect();
                let right: Vec<f64> = calibration.bins.iter().map(|bin| bin.right).collect();
                report = report.plot(
                    Plot::xy("probability said", "")
                        .title("Reliability")
                        .y("share right", "")
                        .line("as it should be", &[0.0, 1.0], &[0.0, 1.0])
                        .points("measured", &said, &right),
                );
            }
            report = report.table(table);
        }
        let facts = self.facts();
        let mut shown: Vec<(&str, &str)> = facts
            .iter()
            .map(|(name, value)| (*name, value.as_str()))
            .collect();
        shown.push(("command", command));
        report.facts(&shown)
    }

    /// The page of the docs.
    pub fn markdown(&self, command: &str) -> String {
        let mut page = format!(
            "# Blind check\n\nWritten by `{command}`.\n\n{}\n\n{METHOD}\n",
            self.lead()
        );
        page += "| | |\n|---|---|\n";
        for (name, value) in self.facts() {
            page += &format!("| {name} | {value} |\n");
        }
        for table in self.tables() {
            page += &markdown(&table);
        }
        page
    }
}

const METHOD: &str = "\
Cases come from `host-tests/withheld`, which shares no code with the diagnosis. The answers were sealed before the key was
opened. Sizes are effort that the axis without the effect does not explain after a refit of inertia, dry and viscous
friction, rms over all samples, over the noise in terms of effort: `4x` is a ratio of 2 and more, `1x` of 0.5 to 2,
`1/4x` below. Whoever knows the effect is left with the noise: the oracle closes all of the gap above the floor. A family
holds effects that look alike on most records.
";

/// A table in Markdown.
fn markdown(table: &Table) -> String {
    let cell = |text: &String| text.replace('|', "\\|").replace(['\n', '\r'], " ");
    let line = |cells: &[String]| {
        format!(
            "| {} |\n",
            cells.iter().map(cell).collect::<Vec<_>>().join(" | ")
        )
    };
    let mut text = format!("\n## {}\n\n", table.caption);
    if table.rows.is_empty() {
        return text + "None.\n";
    }
    text += &line(&table.header);
    text += &format!("|{}\n", "---|".repeat(table.header.len()));
    table.rows.iter().for_each(|row| text += &line(row));
    text
}
