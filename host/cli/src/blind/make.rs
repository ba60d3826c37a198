//! `bristle blind make`: cases and their key.

use super::seal::{self, CaseFiles, Key, SCHEMA, SEAL, Seal};
use crate::output::{self, Progress};
use bristle_gap::InputError;
use bristle_gap::output::{Values, write_atomically, write_columns};
use bristle_withheld::{Case, Truth};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Make cases with withheld effects, and the key that says what is in them.
///
/// Beside the cases stands only the key's SHA-256. Keep the key, and the seed if you chose one, from whoever answers.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  bristle blind make --cases 200 --out cases --key-out cases.key.json\n  bristle blind make \
                        --cases 40 --seed 120 --out try --key-out try.key.json"
)]
pub struct Args {
    /// How many; every 40 hold all classes.
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    cases: u32,
    /// First seed, for cases that can be made again; a random one, which only the key has, where left out. 0 to 9999 are
    /// for development, from 10000 on for reporting.
    #[arg(long)]
    seed: Option<u64>,
    /// Folder for the cases: new, or empty.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// File for the key, outside the folder.
    #[arg(long, value_name = "FILE")]
    key_out: PathBuf,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let (seed, seal) = make(args)?;
    let from = if args.seed.is_some() {
        format!(" from seed {seed}")
    } else {
        String::new()
    };
    output::print(&format!(
        "{} cases{from} in {}\nkey: {}\nkey SHA-256: {}\n",
        args.cases,
        args.out.display(),
        args.key_out.display(),
        seal.key_sha256,
    ));
    Ok(())
}

fn make(args: &Args) -> Result<(u64, Seal), InputError> {
    let cannot = |error: std::io::Error| {
        InputError::new(
            &args.out,
            format!("cannot be made: {error}"),
            "name a folder in a place that may be written to",
        )
    };
    std::fs::create_dir_all(&args.out).map_err(cannot)?;
    if std::fs::read_dir(&args.out)
        .map_err(cannot)?
        .next()
        .is_some()
    {
        return Err(InputError::new(
            &args.out,
            "is not empty",
            "name a new folder for the cases",
        ));
    }
    let key_folder = match args.key_out.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let inside = |folder: &Path| -> std::io::Result<bool> {
        Ok(std::fs::canonicalize(folder)?.starts_with(std::fs::canonicalize(&args.out)?))
    };
    if inside(key_folder).unwrap_or(false) {
        return Err(InputError::new(
            &args.key_out,
            "lies among the cases",
            "name a place outside the folder of the cases",
        ));
    }
    let seed = match args.seed {
        Some(seed) => seed,
        // Beyond the seeds of development.
        None => {
            getrandom::u64().map_err(|error| {
                InputError::new(
                    &args.key_out,
                    format!("no random seed: {error}"),
                    "give one with --seed",
                )
            })? | 1 << 32
        }
    };
    let salt = seal::hash(format!("salt of the blind key of seed {seed}").as_bytes());
    // The order of names says nothing about the order of seeds, which deals the classes.
    let mut order: Vec<u64> = (0..u64::from(args.cases)).collect();
    order.sort_by_key(|i| seal::hash(format!("{salt} {i}").as_bytes()));
    let done = AtomicUsize::new(0);
    let progress = Progress::new("cases");
    let made: Vec<(CaseFiles, Truth)> = order
        .par_iter()
        .enumerate()
        .map(|(place, offset)| {
            let name = format!("case-{:04}", place + 1);
            let case = bristle_withheld::case(seed.wrapping_add(*offset));
            let files = write_case(&args.out.join(&name), &case)?;
            progress.set((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / order.len() as f64);
            Ok((CaseFiles { case: name, files }, case.truth))
        })
        .collect::<Result<_, InputError>>()?;
    drop(progress);
    let (cases, truths): (Vec<CaseFiles>, Vec<Truth>) = made.into_iter().unzip();
    let key = Key {
        schema: SCHEMA,
        program: seal::program(),
        seed,
        salt,
        cases: cases
            .iter()
            .map(|case| case.case.clone())
            .zip(truths)
            .collect(),
    };
    let seal = Seal {
        schema: SCHEMA,
        program: seal::program(),
        made: seal::now(),
        key_sha256: seal::write(&args.key_out, &key)?,
        cases,
    };
    seal::write(&args.out.join(SEAL), &seal)?;
    Ok((seed, seal))
}

/// Writes a case's files; gives their hashes.
pub fn write_case(folder: &Path, case: &Case) -> Result<BTreeMap<String, String>, InputError> {
    std::fs::create_dir_all(folder).map_err(|error| {
        InputError::new(
            folder,
            format!("cannot be made: {error}"),
            "name a folder in a place that may be written to",
        )
    })?;
    let mut files = BTreeMap::new();
    let axis = folder.join("axis.toml");
    write_atomically(&axis, |writer| writer.write_all(case.axis_toml.as_bytes()))?;
    files.insert("axis.toml".to_owned(), seal::hash_file(&axis)?);
    for (i, log) in case.logs.iter().enumerate() {
        let name = format!("{}-{}.csv.gz", i + 1, log.name);
        let columns: Vec<(&str, Values<'_>)> = log
            .columns
            .iter()
            .map(|(name, values)| match *name {
                "position_counts" => (*name, Values::Whole(values)),
                _ => (*name, Values::Numbers(values)),
            })
            .collect();
        write_columns(folder.join(&name), &columns)?;
        files.insert(name.clone(), seal::hash_file(&folder.join(&name))?);
    }
    Ok(files)
}
