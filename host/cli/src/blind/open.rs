//! `bristle blind open`: key against sealed answers.

use super::answer::part;
use super::page::Score;
use super::score::score;
use super::seal::{self, Answers, Key, Set, changed};
use crate::output;
use bristle_gap::InputError;
use bristle_gap::output::write_atomically;
use std::path::{Path, PathBuf};

/// Open the key of a set of cases and score the sealed answers.
///
/// Refused while an answer is missing, and when the key, a case's file or an answer is not what was sealed.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle blind open cases --key cases.key.json --answers answers.json\n  bristle blind open \
                        cases --key cases.key.json --answers answers.json --report blind.html --docs docs/blind.md"
)]
pub struct Args {
    /// Folder of the cases.
    #[arg(value_name = "DIR")]
    cases: PathBuf,
    /// Key that `bristle blind make` wrote.
    #[arg(long, value_name = "FILE")]
    key: PathBuf,
    /// Answers that `bristle blind answer` sealed.
    #[arg(long, value_name = "FILE")]
    answers: PathBuf,
    /// SHA-256 that `bristle blind answer` printed, if you had it before the key was opened.
    #[arg(long, value_name = "SHA-256")]
    answers_sha256: Option<String>,
    /// Also write the score as JSON; `-` for standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Also write a report.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Also write the result as a page of the docs.
    #[arg(long, value_name = "FILE")]
    docs: Option<PathBuf>,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let score = open(
        &args.cases,
        &args.key,
        &args.answers,
        args.answers_sha256.as_deref(),
    )?;
    let quiet = output::json_on_stdout(args.json.as_deref());
    if !quiet {
        for table in score.tables() {
            output::print_words(&table);
        }
    }
    output::write_json(args.json.as_deref(), &score)?;
    let command = output::command_line();
    if let Some(path) = &args.docs {
        let page = score.markdown(&command);
        write_atomically(path, |writer| writer.write_all(page.as_bytes()))?;
    }
    match &args.report {
        Some(path) => output::write_report(path, &score.report(&command), quiet),
        None => Ok(()),
    }
}

/// Checks every seal, then scores.
pub fn open(
    cases: &Path,
    key_path: &Path,
    answers_path: &Path,
    expected: Option<&str>,
) -> Result<Score, InputError> {
    let set = Set::read(cases)?;
    if !answers_path.exists() && part(answers_path).exists() {
        return Err(InputError::new(
            answers_path,
            "not every answer is sealed",
            "run `bristle blind answer` to its end; the key stays closed until then",
        ));
    }
    // The answers first: what is wrong with them must be said without a look at the key.
    let answers = checked_answers(answers_path, &set, expected)?;
    for case in &set.seal.cases {
        set.check(case)?;
    }
    let found = seal::hash_file(key_path)?;
    if found != set.seal.key_sha256 {
        return Err(changed(key_path, &set.seal.key_sha256, &found));
    }
    let key: Key = seal::read(key_path)?;
    let outcomes = answers
        .answers
        .iter()
        .map(|answer| {
            let truth = key.cases.get(&answer.case).ok_or_else(|| {
                InputError::new(
                    key_path,
                    format!("has no {}", answer.case),
                    "give the key that belongs to the cases",
                )
            })?;
            Ok(score(truth, answer))
        })
        .collect::<Result<_, InputError>>()?;
    Ok(Score::new(&set.seal, &key, &answers, outcomes))
}

fn checked_answers(path: &Path, set: &Set, expected: Option<&str>) -> Result<Answers, InputError> {
    let answers: Answers = seal::read(path)?;
    let refused = |what: String| {
        InputError::new(
            path,
            what,
            "answer the cases again; an answer counts as it was sealed",
        )
    };
    if answers.seal_sha256 != set.seal_sha256 {
        return Err(refused(format!(
            "answers another set: seal {} there, {} here",
            answers.seal_sha256, set.seal_sha256
        )));
    }
    for answer in &answers.answers {
        let found = answer.hash();
        if found != answer.sha256 {
            return Err(refused(format!(
                "the answer to {} was changed after it was sealed: SHA-256 {} then, {found} now",
                answer.case, answer.sha256
            )));
        }
    }
    let found = answers.hash();
    if found != answers.sha256 {
        return Err(refused(format!(
            "the list of answers was changed after it was sealed: SHA-256 {} then, {found} now",
            answers.sha256
        )));
    }
    if let Some(expected) = expected.filter(|expected| *expected != answers.sha256) {
        return Err(refused(format!(
            "has SHA-256 {}, not the {expected} that was given",
            answers.sha256
        )));
    }
    for case in &set.seal.cases {
        let mine: Vec<_> = answers
            .answers
            .iter()
            .filter(|answer| answer.case == case.case)
            .collect();
        match mine[..] {
            [] => return Err(refused(format!("holds no answer to {}", case.case))),
            [answer] if answer.files == case.files => {}
            [_] => {
                return Err(refused(format!(
                    "the answer to {} is to other files than the sealed ones",
                    case.case
                )));
            }
            _ => {
                return Err(refused(format!(
                    "holds {} answers to {}",
                    mine.len(),
                    case.case
                )));
            }
        }
    }
    Ok(answers)
}
