//! Reading a log from an MCAP file, as `capture::Recorder` writes it: topic `/axis`, a JSON object a sample, whose names
//! are those of the CSV log.

use std::borrow::Cow;
use std::path::Path;

use mcap::McapError;
use mcap::records::Record;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use super::Log;
use super::gather::{Gather, Need};
use crate::capture::{About, word};
use crate::error::{InputError, quoted};

/// With which a file begins.
pub(super) const MAGIC: &[u8] = mcap::MAGIC;

/// The samples.
const TOPIC: &str = "/axis";
/// What a file of ours says of itself.
const ABOUT: [&str; 2] = ["capture", "result"];
/// No record of ours is longer; a damaged length must not fill the memory.
const MOST_RECORD_BYTES: usize = 64 << 20;

/// Reads a log from the bytes of a file.
pub(super) fn read(path: &Path, bytes: &[u8], needed: &[Need]) -> Result<Log, InputError> {
    let damaged = |error: McapError| damaged(path, &error);
    let options = LinearReaderOptions::default()
        .with_validate_chunk_crcs(true)
        .with_record_length_limit(MOST_RECORD_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    let mut left = bytes;
    let mut samples = Samples::new(path, needed);
    let mut about = About::new();
    while let Some(event) = reader.next_event() {
        match event.map_err(damaged)? {
            LinearReadEvent::ReadRequest(wanted) => {
                let (piece, rest) = left.split_at(wanted.min(left.len()));
                reader.insert(piece.len()).copy_from_slice(piece);
                reader.notify_read(piece.len());
                left = rest;
            }
            LinearReadEvent::Record { opcode, data } => {
                match mcap::parse_record(opcode, data).map_err(damaged)? {
                    Record::Channel(channel) if channel.topic == TOPIC => {
                        if channel.message_encoding != "json" {
                            return Err(InputError::new(
                                path,
                                format!(
                                    "{TOPIC} is encoded as {}, not as json",
                                    quoted(&channel.message_encoding)
                                ),
                                REMEDY,
                            ));
                        }
                        samples.channel = Some(channel.id);
                    }
                    Record::Channel(channel) if !samples.others.contains(&channel.topic) => {
                        samples.others.push(channel.topic);
                    }
                    Record::Message { header, data }
                        if samples.channel == Some(header.channel_id) =>
                    {
                        samples.message(&data)?;
                    }
                    Record::Metadata(notes) if ABOUT.contains(&notes.name.as_str()) => {
                        about.extend(notes.metadata);
                    }
                    _ => {}
                }
            }
        }
    }
    samples.log(about)
}

const REMEDY: &str = "give a log of `bristle capture` or `run`, or write one as CSV";

fn damaged(path: &Path, error: &McapError) -> InputError {
    let (what, remedy) = match error {
        McapError::UnexpectedEof | McapError::BadFooter => (
            "the MCAP data end too early".to_owned(),
            "copy or record the file again",
        ),
        McapError::UnsupportedCompression(name) => (
            format!("its chunks are packed with {}", quoted(name)),
            "pack them with zstd, or not at all",
        ),
        error => (
            format!("the MCAP data are damaged ({error})"),
            "copy or record the file again",
        ),
    };
    InputError::new(path, what, remedy)
}

/// Number of a code to its word.
type Word = fn(u8) -> Option<&'static str>;

/// Messages on their way into a log.
struct Samples<'a> {
    path: &'a Path,
    needed: &'a [Need],
    channel: Option<u16>,
    /// Other topics that are there.
    others: Vec<String>,
    /// From the first message on, which names the columns.
    gather: Option<Gather<'a>>,
    /// For each column, where its numbers are codes.
    words: Vec<Option<Word>>,
}

impl<'a> Samples<'a> {
    fn new(path: &'a Path, needed: &'a [Need]) -> Self {
        Self {
            path,
            needed,
            channel: None,
            others: Vec::new(),
            gather: None,
            words: Vec::new(),
        }
    }

    fn message(&mut self, data: &[u8]) -> Result<(), InputError> {
        let number = self.gather.as_ref().map_or(0, |gather| gather.rows) + 1;
        let at = |mut error: InputError| {
            error.message = format!("message {number} of {TOPIC}: {}", error.message);
            error
        };
        self.row(data).map_err(at)
    }

    fn row(&mut self, data: &[u8]) -> Result<(), InputError> {
        let wrong = |what: String| InputError::new(self.path, what, REMEDY);
        let Row(cells) = serde_json::from_slice(data)
            .map_err(|error| wrong(format!("is no JSON object of numbers ({error})")))?;
        let gather = match &mut self.gather {
            Some(gather) => gather,
            none => {
                let names: Vec<String> = cells.iter().map(|(name, _)| (*name).to_owned()).collect();
                for (i, name) in names.iter().enumerate() {
                    if name.is_empty() || names.iter().take(i).any(|earlier| earlier == name) {
                        return Err(wrong(format!(
                            "{} stands twice or is no name",
                            quoted(name)
                        )));
                    }
                }
                self.words = names.iter().map(|name| word(name)).collect();
                none.insert(Gather::new(self.path, names, self.needed)?)
            }
        };
        let mut texts = Vec::with_capacity(cells.len());
        for (i, name) in gather.names.iter().enumerate() {
            // Mostly in the order of the first message.
            let cell = cells
                .get(i)
                .filter(|(its, _)| its == name)
                .or_else(|| cells.iter().find(|(its, _)| its == name));
            let Some((_, value)) = cell else {
                return Err(
                    wrong("has no value, where the first one has".to_owned()).in_column(name)
                );
            };
            let word = self.words.get(i).copied().flatten();
            texts.push(text(value.get(), word));
        }
        if cells.len() != gather.names.len() {
            let what = format!(
                "{} values where the first one has {}",
                cells.len(),
                gather.names.len()
            );
            return Err(wrong(what));
        }
        gather.row(texts.iter().map(|text| text.as_bytes()))
    }

    fn log(self, about: About) -> Result<Log, InputError> {
        let rows = self.gather.as_ref().map_or(0, |gather| gather.rows);
        let (what, remedy) = match (self.channel, self.gather) {
            (Some(_), Some(gather)) if rows >= 2 => return Ok(gather.log(about)),
            (Some(_), _) => (
                format!("{rows} messages of {TOPIC}"),
                "a log needs at least two",
            ),
            (None, _) if self.others.is_empty() => (format!("has no topic {TOPIC}"), REMEDY),
            (None, _) => (
                format!(
                    "has no topic {TOPIC}, but {}",
                    quoted(&self.others.join(", "))
                ),
                REMEDY,
            ),
        };
        Err(InputError::new(self.path, what, remedy))
    }
}

/// A value as the cell of a CSV log.
fn text(value: &str, word: Option<Word>) -> Cow<'_, str> {
    match (value.as_bytes(), word) {
        (b"null", _) => "NaN".into(),
        // A string of JSON is one, or the object would not have been read.
        ([b'"', ..], _) => serde_json::from_str(value).unwrap_or_default(),
        (_, Some(word)) => value.parse().ok().and_then(word).unwrap_or(value).into(),
        (_, None) => value.into(),
    }
}

/// A JSON object in the order in which it stands.
struct Row<'a>(Vec<(&'a str, &'a RawValue)>);

impl<'de> Deserialize<'de> for Row<'de> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Pairs;
        impl<'de> Visitor<'de> for Pairs {
            type Value = Row<'de>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut pairs = Vec::with_capacity(16);
                while let Some(pair) = map.next_entry()? {
                    pairs.push(pair);
                }
                Ok(Row(pairs))
            }
        }
        deserializer.deserialize_map(Pairs)
    }
}
