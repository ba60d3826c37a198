//! Seals: what is committed to by its SHA-256 before it is compared.
//!
//! A seal proves that a file is the one that was sealed. It hides nothing by itself: a key stays secret as long as its
//! file, and the seed in it, are kept from whoever answers; and sealed answers prove when they were given only to whoever
//! had their hash before the key was opened.

use bristle_gap::InputError;
use bristle_gap::output::write_atomically;
use bristle_withheld::Truth;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// Version of the three files.
pub const SCHEMA: u32 = 1;
/// Name of the seal among the cases.
pub const SEAL: &str = "seal.json";

/// What stands readable beside the cases.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seal {
    pub schema: u32,
    pub program: String,
    pub made: String,
    /// Of the key file, byte for byte.
    pub key_sha256: String,
    pub cases: Vec<CaseFiles>,
}

/// A case's files and their hashes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseFiles {
    pub case: String,
    pub files: BTreeMap<String, String>,
}

/// The key: what is withheld of every case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Key {
    pub schema: u32,
    pub program: String,
    /// First seed; case by case the next ones, in another order than the cases' names.
    pub seed: u64,
    /// Keeps the hash from being guessed at by making keys of likely seeds, if the seed was not chosen by hand.
    pub salt: String,
    pub cases: BTreeMap<String, Truth>,
}

/// All answers, sealed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answers {
    pub schema: u32,
    pub program: String,
    pub sealed: String,
    /// Of the cases' seal: which set was answered.
    pub seal_sha256: String,
    pub answers: Vec<Answer>,
    /// Of all of the above.
    pub sha256: String,
}

/// The answer to a case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    pub case: String,
    /// Hashes of the files that were read.
    pub files: BTreeMap<String, String>,
    pub time: String,
    pub program: String,
    pub seconds: f64,
    /// The diagnosis's JSON, or else:
    pub answer: Option<Value>,
    /// why there is none.
    pub error: Option<String>,
    /// Of all of the above.
    pub sha256: String,
}

impl Answer {
    /// The hash that it should have.
    pub fn hash(&self) -> String {
        hash_of(&Self {
            sha256: String::new(),
            ..self.clone()
        })
    }
}

impl Answers {
    /// The hash that they should have.
    pub fn hash(&self) -> String {
        hash_of(&Self {
            sha256: String::new(),
            ..self.clone()
        })
    }
}

/// This program and its version.
pub fn program() -> String {
    format!("bristle {}", env!("CARGO_PKG_VERSION"))
}

/// Now, in UTC.
pub fn now() -> String {
    OffsetDateTime::now_utc()
        .format(&Rfc3339)
        .unwrap_or_default()
}

/// SHA-256 in hexadecimal digits.
pub fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes)
        .iter()
        .fold(String::new(), |mut text, byte| {
            // Writing into a String does not fail.
            let _ = write!(text, "{byte:02x}");
            text
        })
}

fn hash_of(value: &impl Serialize) -> String {
    // None of the types here has a key that is no text, which is all that can fail.
    hash(serde_json::to_string(value).unwrap_or_default().as_bytes())
}

/// SHA-256 of a file.
pub fn hash_file(path: &Path) -> Result<String, InputError> {
    Ok(hash(&bytes(path)?))
}

/// A file's bytes.
pub fn bytes(path: &Path) -> Result<Vec<u8>, InputError> {
    std::fs::read(path).map_err(|error| {
        InputError::new(path, format!("cannot be read: {error}"), "check the path")
    })
}

/// Reads a JSON file.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<T, InputError> {
    serde_json::from_slice(&bytes(path)?).map_err(|error| {
        InputError::new(
            path,
            format!("is not what it should be: {error}"),
            "give the file that `bristle blind` wrote",
        )
        .at_line(error.line().max(1) as u64)
    })
}

/// Text of a JSON file.
pub fn text(path: &Path, value: &impl Serialize) -> Result<String, InputError> {
    serde_json::to_string_pretty(value)
        .map(|text| text + "\n")
        .map_err(|error| {
            InputError::new(
                path,
                format!("cannot be written: {error}"),
                "report this as a fault",
            )
        })
}

/// Writes a JSON file; gives its hash.
pub fn write(path: &Path, value: &impl Serialize) -> Result<String, InputError> {
    let text = text(path, value)?;
    write_atomically(path, |writer| writer.write_all(text.as_bytes()))?;
    Ok(hash(text.as_bytes()))
}

/// A set of cases as its seal lists it.
pub struct Set {
    pub folder: PathBuf,
    pub seal: Seal,
    pub seal_sha256: String,
}

impl Set {
    /// Reads the seal of a folder of cases.
    pub fn read(folder: &Path) -> Result<Self, InputError> {
        let path = folder.join(SEAL);
        let seal: Seal = read(&path)?;
        if seal.schema != SCHEMA {
            return Err(InputError::new(
                &path,
                format!("has schema {} where {SCHEMA} is known", seal.schema),
                "use the version of bristle that made the cases",
            ));
        }
        // A name leads to a file of the set and nowhere else.
        let plain = |name: &str| !name.is_empty() && !name.contains(['/', '\\']) && name != "..";
        let names = seal
            .cases
            .iter()
            .flat_map(|case| case.files.keys().chain([&case.case]));
        if let Some(name) = names.into_iter().find(|name| !plain(name)) {
            return Err(InputError::new(
                &path,
                format!("`{name}` is no name of a case or file"),
                "make the cases again",
            ));
        }
        Ok(Self {
            folder: folder.to_path_buf(),
            seal_sha256: hash_file(&path)?,
            seal,
        })
    }

    /// Hashes of a case's files as they are now; refused if they are not those of the seal.
    pub fn check(&self, case: &CaseFiles) -> Result<(), InputError> {
        for (name, sealed) in &case.files {
            let path = self.folder.join(&case.case).join(name);
            let found = hash_file(&path)?;
            if found != *sealed {
                return Err(changed(&path, sealed, &found));
            }
        }
        Ok(())
    }
}

/// The refusal of what is not what was sealed.
pub fn changed(path: &Path, sealed: &str, found: &str) -> InputError {
    InputError::new(
        path,
        format!("was changed after it was sealed: SHA-256 {sealed} then, {found} now"),
        "restore it, or make and answer the cases again",
    )
}
