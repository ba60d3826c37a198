//! `bristle blind answer`: the diagnosis on every case, sealed.

use super::answerer;
use super::seal::{self, Answer, Answers, CaseFiles, SCHEMA, Set};
use crate::output::{self, Progress};
use bristle_gap::{AxisFile, InputError, Log};
use rayon::prelude::*;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Diagnose every case of a set without its key, and seal the answers.
///
/// Answers are kept as they come, beside the output: started again, it goes on where it was stopped.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  bristle blind answer cases --out answers.json")]
pub struct Args {
    /// Folder of cases that `bristle blind make` wrote.
    #[arg(value_name = "DIR")]
    cases: PathBuf,
    /// File for the sealed answers.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Cases at a time; as many as there are processors where left out.
    #[arg(long, value_name = "N", default_value_t = 0)]
    jobs: usize,
}

/// What answers a case.
pub type Answerer = dyn Fn(&AxisFile, &[Log]) -> Result<Value, InputError> + Sync;

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let answers = answer(&args.cases, &args.out, args.jobs, &answerer::answer)?;
    let failed = answers
        .answers
        .iter()
        .filter(|answer| answer.error.is_some())
        .count();
    output::print(&format!(
        "{} answers, {failed} of them errors, sealed in {}\nSHA-256: {}\n",
        answers.answers.len(),
        args.out.display(),
        answers.sha256,
    ));
    Ok(())
}

/// Where answers wait until all are there.
pub fn part(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(".part");
    PathBuf::from(name)
}

/// Answers every case of a folder and seals the answers.
pub fn answer(
    folder: &Path,
    out: &Path,
    jobs: usize,
    answerer: &Answerer,
) -> Result<Answers, InputError> {
    let set = Set::read(folder)?;
    if out.exists() {
        return Err(InputError::new(
            out,
            "holds sealed answers already",
            "name another file, or remove this one",
        ));
    }
    let waiting = part(out);
    let mut done = kept(&waiting, &set)?;
    let missing: Vec<&CaseFiles> = set
        .seal
        .cases
        .iter()
        .filter(|case| !done.contains_key(&case.case))
        .collect();
    let cannot = |error: std::io::Error| {
        InputError::new(
            &waiting,
            format!("cannot be written: {error}"),
            "name a file in a folder that may be written to",
        )
    };
    let file = Mutex::new(
        OpenOptions::new()
            .create(true)
            .append(true)
            .open(&waiting)
            .map_err(cannot)?,
    );
    let count = AtomicUsize::new(done.len());
    let progress = Progress::new("answers");
    let all = set.seal.cases.len() as f64;
    progress.set(done.len() as f64 / all);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(jobs)
        .build()
        .map_err(|error| InputError::new(folder, error.to_string(), "give fewer --jobs"))?;
    let new: Vec<Answer> = pool.install(|| {
        missing
            .par_iter()
            .map(|case| {
                let answer = answer_case(&set, case, answerer)?;
                keep(&file, &answer).map_err(cannot)?;
                progress.set((count.fetch_add(1, Ordering::Relaxed) + 1) as f64 / all);
                Ok(answer)
            })
            .collect::<Result<_, InputError>>()
    })?;
    drop(progress);
    done.extend(new.into_iter().map(|answer| (answer.case.clone(), answer)));
    let mut answers = Answers {
        schema: SCHEMA,
        program: seal::program(),
        sealed: seal::now(),
        seal_sha256: set.seal_sha256.clone(),
        answers: done.into_values().collect(),
        sha256: String::new(),
    };
    answers.sha256 = answers.hash();
    seal::write(out, &answers)?;
    drop(file);
    std::fs::remove_file(&waiting).map_err(cannot)?;
    Ok(answers)
}

fn answer_case(set: &Set, case: &CaseFiles, answerer: &Answerer) -> Result<Answer, InputError> {
    set.check(case)?;
    let folder = set.folder.join(&case.case);
    let axis = AxisFile::read(folder.join("axis.toml"))?;
    let logs = case
        .files
        .keys()
        .filter(|name| *name != "axis.toml")
        .map(|name| Log::read(folder.join(name)))
        .collect::<Result<Vec<_>, _>>()?;
    let start = Instant::now();
    let result = answerer(&axis, &logs);
    let seconds = start.elapsed().as_secs_f64();
    let (answer, error) = match result {
        Ok(answer) => (Some(answer), None),
        Err(error) => (None, Some(error.to_string())),
    };
    let mut answer = Answer {
        case: case.case.clone(),
        files: case.files.clone(),
        time: seal::now(),
        program: seal::program(),
        seconds,
        answer,
        error,
        sha256: String::new(),
    };
    answer.sha256 = answer.hash();
    Ok(answer)
}

/// Answers of a run that was stopped, as far as they are whole, of these files and of this version.
fn kept(path: &Path, set: &Set) -> Result<BTreeMap<String, Answer>, InputError> {
    if !path.exists() {
        return Ok(BTreeMap::new());
    }
    let text = seal::bytes(path)?;
    Ok(text
        .split(|byte| *byte == b'\n')
        .filter_map(|line| serde_json::from_slice::<Answer>(line).ok())
        .filter(|answer| {
            answer.hash() == answer.sha256
                && answer.program == seal::program()
                && answer.error.is_none()
        })
        .filter(|answer| {
            set.seal
                .cases
                .iter()
                .any(|case| case.case == answer.case && case.files == answer.files)
        })
        .map(|answer| (answer.case.clone(), answer))
        .collect())
}

fn keep(file: &Mutex<File>, answer: &Answer) -> std::io::Result<()> {
    let line = serde_json::to_string(answer).map_err(std::io::Error::other)?;
    let mut file = file
        .lock()
        .map_err(|_| std::io::Error::other("another case failed"))?;
    // A line that a stop cut short ends here, so that the next one stands by itself.
    file.write_all(format!("\n{line}\n").as_bytes())
}
