//! Counting answers: right and wrong by effect, and whether probabilities mean what they say.

use crate::output;
use bristle_gap::InputError;
use bristle_gap::diagnose::{Diagnosis, Kind};
use bristle_gap::output::write_atomically;
use bristle_gap::report::Table;
use bristle_gap::trial::Trial;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// What a diagnosis should say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// The effects that are there.
    Effects,
    /// That there is none.
    None,
    /// That the parameters are off.
    Parameters,
    /// That it is none of those it knows.
    Unknown,
}

/// What came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// What it should say.
    Right,
    /// A tie of the truth with what these experiments cannot tell from it, as was computed before; where the truth is unknown to it or
    /// there are several effects, that alone.
    AsOne,
    /// A tie that holds the truth and more, or where the truth is unknown to it a tie.
    Tied,
    /// Of several effects some, and no other.
    Part,
    /// Something that is not there.
    Wrong,
    /// Unknown, though it is in the catalogue or nothing is there.
    Unknown,
    /// That there is nothing, only parameters, or too little data.
    Nothing,
    /// The logs were refused as wrong as a whole.
    Refused,
    /// No axis was found that could show the effect.
    NotShowable,
}

const COLUMNS: [(Outcome, &str); 9] = [
    (Outcome::Right, "right"),
    (Outcome::AsOne, "as one"),
    (Outcome::Tied, "tied"),
    (Outcome::Part, "part"),
    (Outcome::Wrong, "wrong"),
    (Outcome::Unknown, "unknown"),
    (Outcome::Nothing, "nothing"),
    (Outcome::Refused, "refused"),
    (Outcome::NotShowable, "not showable"),
];

/// A trial and its diagnosis.
#[derive(Serialize)]
pub struct Case {
    seed: u64,
    truth: Vec<String>,
    parameters: Vec<BTreeMap<String, f64>>,
    /// Gap as a share of the floor.
    share: f64,
    floor_of_coulomb: f64,
    model: &'static str,
    rate_hz: f64,
    experiments: Vec<&'static str>,
    outcome: Outcome,
    seconds: f64,
    diagnosis: Option<Diagnosis>,
    refused: Option<String>,
    /// What was named though these experiments cannot tell it from the truth, by effect.
    alike: Vec<Vec<&'static str>>,
}

impl Case {
    /// Judges a diagnosis; `trial` is none where none could be drawn, `alike` what cannot be told from each effect.
    pub fn new(
        seed: u64,
        truth: &[&str],
        trial: Option<&Trial>,
        diagnosis: Option<Result<Diagnosis, InputError>>,
        alike: Vec<Vec<&'static str>>,
        seconds: f64,
        expected: Expected,
    ) -> Self {
        let outcome = match &diagnosis {
            None => Outcome::NotShowable,
            Some(Err(_)) => Outcome::Refused,
            Some(Ok(said)) => {
                let verdict = &said.verdict;
                judge(expected, truth, &alike, verdict.kind, &verdict.effects)
            }
        };
        let (diagnosis, refused) = match diagnosis.transpose() {
            Ok(diagnosis) => (diagnosis, None),
            Err(error) => (None, Some(error.to_string())),
        };
        let friction = trial.map(|trial| &trial.truth.friction);
        Self {
            seed,
            truth: truth.iter().map(|id| (*id).to_string()).collect(),
            parameters: trial.map_or(Vec::new(), |trial| {
                let effects = trial.truth.effects.iter();
                effects
                    .map(|effect| effect.parameters.iter().cloned().collect())
                    .collect()
            }),
            share: trial.map_or(0.0, |trial| trial.gap_nm / trial.floor_nm),
            floor_of_coulomb: trial
                .zip(friction.and_then(|friction| friction.coulomb))
                .map_or(0.0, |(trial, coulomb)| trial.floor_nm / coulomb),
            model: friction
                .and_then(|friction| friction.model)
                .map_or("", |model| model.name()),
            rate_hz: trial.map_or(0.0, |trial| 1.0 / trial.logs[0].median_step_s()),
            experiments: trial.map_or(Vec::new(), |trial| trial.experiments.clone()),
            outcome,
            seconds,
            diagnosis,
            refused,
            alike,
        }
    }

    fn name(&self) -> String {
        if self.truth.is_empty() {
            "none".to_string()
        } else {
            self.truth.join(" + ")
        }
    }

    /// The verdict in words.
    fn said(&self) -> Option<String> {
        if self.refused.is_some() {
            return Some("refused".to_string());
        }
        let verdict = &self.diagnosis.as_ref()?.verdict;
        let effects = &verdict.effects;
        Some(match verdict.kind {
            Kind::Effect | Kind::Effects => effects.join(" + "),
            Kind::Ambiguous => effects.join(" or "),
            Kind::Parameters => "parameters".to_string(),
            Kind::None => "none".to_string(),
            Kind::Unknown => "unknown".to_string(),
            Kind::Insufficient => "insufficient".to_string(),
        })
    }
}

fn judge(
    expected: Expected,
    truth: &[&str],
    alike: &[Vec<&str>],
    kind: Kind,
    said: &[String],
) -> Outcome {
    let says = |id: &str| said.iter().any(|one| one == id);
    let is = |truth: &[&str]| said.iter().all(|one| truth.contains(&one.as_str()));
    let as_one: Vec<&str> = alike.iter().flatten().copied().collect();
    // Each effect by its own name or by one that cannot be told from it.
    let found = || {
        let one_of = |(place, id): (usize, &&str)| {
            says(id)
                || alike
                    .get(place)
                    .is_some_and(|ids| ids.iter().any(|id| says(id)))
        };
        said.len() == truth.len() && truth.iter().enumerate().all(one_of)
    };
    match (expected, kind) {
        (Expected::None, Kind::None)
        | (Expected::Parameters, Kind::Parameters)
        | (Expected::Unknown, Kind::Unknown) => Outcome::Right,
        (_, Kind::None | Kind::Parameters | Kind::Insufficient) => Outcome::Nothing,
        (_, Kind::Unknown) => Outcome::Unknown,
        (Expected::Unknown, Kind::Effect | Kind::Ambiguous) if is(&as_one) => Outcome::AsOne,
        (Expected::Unknown, Kind::Ambiguous) => Outcome::Tied,
        (Expected::Effects, Kind::Effect | Kind::Effects) if is(truth) => {
            if truth.iter().all(|id| says(id)) {
                Outcome::Right
            } else {
                Outcome::Part
            }
        }
        (Expected::Effects, Kind::Effects) if found() => Outcome::AsOne,
        (Expected::Effects, Kind::Ambiguous) if truth.iter().any(|id| says(id)) => {
            if is(&[truth, &as_one].concat()) {
                Outcome::AsOne
            } else {
                Outcome::Tied
            }
        }
        _ => Outcome::Wrong,
    }
}

/// Counts by effect, and the reliability of the probabilities.
pub fn tables(title: &str, cases: &[Case]) -> Vec<Table> {
    let mut by_name: BTreeMap<String, Vec<&Case>> = BTreeMap::new();
    for case in cases {
        by_name.entry(case.name()).or_default().push(case);
    }
    let mut seconds: Vec<f64> = cases
        .iter()
        .filter(|case| case.diagnosis.is_some())
        .map(|case| case.seconds)
        .collect();
    seconds.sort_by(f64::total_cmp);
    let median = seconds.get(seconds.len() / 2).copied().unwrap_or(0.0);
    let mut header = vec!["truth", "cases"];
    header.extend(COLUMNS.map(|(_, name)| name));
    header.push("what was said instead");
    let count = |of: &[Outcome]| {
        let those = cases.iter().filter(|case| of.contains(&case.outcome));
        those.count()
    };
    let shown = cases.len() - count(&[Outcome::NotShowable]);
    let right = count(&[Outcome::Right, Outcome::AsOne]);
    let share = 100.0 * right as f64 / shown.max(1) as f64;
    let which = if shown < cases.len() {
        " that can be shown"
    } else {
        ""
    };
    let mut counts = Table::new(
        &format!(
            "{title}: {right} of {shown}{which} right, {share:.0} %; median {} s a case",
            output::short(median)
        ),
        &header,
    );
    for (name, of) in &by_name {
        counts.rows.push(row(name, of, true));
    }
    if by_name.len() > 1 {
        let all: Vec<&Case> = cases.iter().collect();
        counts.rows.push(row("all", &all, false));
    }
    vec![counts, reliability(cases)]
}

fn row(name: &str, cases: &[&Case], in_detail: bool) -> Vec<String> {
    let mut cells = vec![name.to_string(), cases.len().to_string()];
    for (outcome, _) in COLUMNS {
        let count = cases.iter().filter(|case| case.outcome == outcome).count();
        cells.push(count.to_string());
    }
    let instead = cases
        .iter()
        .filter(|case| in_detail && ![Outcome::Right, Outcome::AsOne].contains(&case.outcome))
        .filter_map(|case| Some(format!("{} (#{})", case.said()?, case.seed)));
    cells.push(instead.collect::<Vec<_>>().join("; "));
    cells
}

/// Ends of the classes of probability.
const CLASSES: [f64; 8] = [0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0];

/// How often verdicts of a probability were right. A tie is right where it holds the truth.
fn reliability(cases: &[Case]) -> Table {
    let said: Vec<(f64, f64)> = cases
        .iter()
        .filter_map(|case| {
            let verdict = &case.diagnosis.as_ref()?.verdict;
            let right = matches!(
                case.outcome,
                Outcome::Right | Outcome::AsOne | Outcome::Tied
            );
            (verdict.kind != Kind::Insufficient)
                .then_some((verdict.probability, if right { 1.0 } else { 0.0 }))
        })
        .collect();
    let mean = |list: &[(f64, f64)], of: &dyn Fn(&(f64, f64)) -> f64| {
        list.iter().map(of).sum::<f64>() / list.len().max(1) as f64
    };
    let brier = mean(&said, &|(p, right)| (p - right).powi(2));
    let mut off = 0.0;
    let mut rows = Vec::new();
    let mut low = 0.0;
    for high in CLASSES {
        let within = |p: f64| p > low && p <= high || (low == 0.0 && p <= 0.0);
        let class: Vec<(f64, f64)> = said.iter().copied().filter(|(p, _)| within(*p)).collect();
        if !class.is_empty() {
            let (claimed, right) = (
                mean(&class, &|(p, _)| *p),
                mean(&class, &|(_, right)| *right),
            );
            off += (claimed - right).abs() * class.len() as f64 / said.len() as f64;
            rows.push(vec![
                format!("{low} to {high}"),
                class.len().to_string(),
                format!("{claimed:.3}"),
                format!("{right:.3}"),
            ]);
        }
        low = high;
    }
    Table {
        caption: format!(
            "Probability of the verdict against how often it was right: Brier score {brier:.3}, mean distance \
             {off:.3} over {} verdicts",
            said.len()
        ),
        header: ["probability", "verdicts", "mean", "right"]
            .map(str::to_string)
            .to_vec(),
        rows,
    }
}

/// Puts tables into a Markdown file between the marks of their title, or at its end.
pub fn write_docs(
    path: &Path,
    command: &str,
    title: &str,
    tables: &[Table],
) -> Result<(), InputError> {
    let old = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
        Err(error) => {
            return Err(InputError::new(
                path,
                format!("cannot be read: {error}"),
                "name a text file that may be written",
            ));
        }
    };
    let (begin, end) = (
        format!("<!-- {title} -->\n"),
        format!("<!-- end of {title} -->\n"),
    );
    let mut block = format!("{begin}`{command}`\n");
    for table in tables {
        block += &format!("\n{}\n\n{}", table.caption, markdown(table));
    }
    block += &end;
    let new = match (old.find(&begin), old.find(&end)) {
        (Some(from), Some(to)) if from < to => {
            format!("{}{block}{}", &old[..from], &old[to + end.len()..])
        }
        _ if old.is_empty() => block,
        _ => format!("{}\n\n{block}", old.trim_end()),
    };
    write_atomically(path, |writer| write!(writer, "{new}"))
}

fn markdown(table: &Table) -> String {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    let rule = vec!["---".to_string(); table.header.len()];
    let rows: String = table.rows.iter().map(|row| line(row)).collect();
    format!("{}{}{rows}", line(&table.header), line(&rule))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(expected: Expected, truth: &[&str], kind: Kind, effects: &[&str]) -> Outcome {
        let effects: Vec<String> = effects.iter().map(|id| (*id).to_string()).collect();
        judge(expected, truth, &[vec!["c"]], kind, &effects)
    }

    #[test]
    fn judges_what_was_said() {
        use Expected::{Effects, None, Parameters, Unknown};
        let one = |kind, effects: &[&str]| said(Effects, &["a"], kind, effects);
        assert_eq!(one(Kind::Effect, &["a"]), Outcome::Right);
        assert_eq!(one(Kind::Effect, &["b"]), Outcome::Wrong);
        assert_eq!(one(Kind::Effects, &["a", "b"]), Outcome::Wrong);
        assert_eq!(one(Kind::Ambiguous, &["b", "a"]), Outcome::Tied);
        assert_eq!(one(Kind::Ambiguous, &["c", "a"]), Outcome::AsOne);
        assert_eq!(one(Kind::Ambiguous, &["b", "c"]), Outcome::Wrong);
        assert_eq!(one(Kind::Unknown, &[]), Outcome::Unknown);
        assert_eq!(one(Kind::Parameters, &[]), Outcome::Nothing);
        let two = |kind, effects: &[&str]| said(Effects, &["a", "b"], kind, effects);
        assert_eq!(two(Kind::Effects, &["b", "a"]), Outcome::Right);
        assert_eq!(two(Kind::Effect, &["b"]), Outcome::Part);
        assert_eq!(two(Kind::Effects, &["b", "c"]), Outcome::AsOne);
        assert_eq!(two(Kind::Effects, &["a", "c"]), Outcome::Wrong);
        assert_eq!(two(Kind::Effects, &["b", "d"]), Outcome::Wrong);
        assert_eq!(said(None, &[], Kind::None, &[]), Outcome::Right);
        assert_eq!(said(None, &[], Kind::Parameters, &[]), Outcome::Nothing);
        assert_eq!(said(None, &[], Kind::Effect, &["a"]), Outcome::Wrong);
        assert_eq!(
            said(None, &[], Kind::Ambiguous, &["a", "b"]),
            Outcome::Wrong
        );
        assert_eq!(said(Parameters, &[], Kind::Parameters, &[]), Outcome::Right);
        assert_eq!(said(Parameters, &[], Kind::None, &[]), Outcome::Nothing);
        assert_eq!(said(Unknown, &["a"], Kind::Unknown, &[]), Outcome::Right);
        assert_eq!(
            said(Unknown, &["a"], Kind::Ambiguous, &["b", "c"]),
            Outcome::Tied
        );
        assert_eq!(said(Unknown, &["a"], Kind::Effect, &["b"]), Outcome::Wrong);
        assert_eq!(said(Unknown, &["a"], Kind::Effect, &["c"]), Outcome::AsOne);
    }

    #[test]
    fn tables_go_between_their_marks() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("docs.md");
        std::fs::write(&path, "# Title\n").unwrap();
        let table = |cell: &str| vec![Table::new("caption", &["head"]).row(&[cell])];
        let write =
            |title: &str, cell: &str| write_docs(&path, "bristle", title, &table(cell)).unwrap();
        write("first", "one");
        write("second", "two");
        let before = std::fs::read_to_string(&path).unwrap();
        assert!(
            before.starts_with("# Title\n\n<!-- first -->\n"),
            "{before}"
        );
        write("first", "three");
        let after = std::fs::read_to_string(&path).unwrap();
        assert_eq!(after, before.replace("| one |", "| three |"));
    }
}
