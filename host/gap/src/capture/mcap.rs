//! Samples as an MCAP file, which PlotJuggler and Foxglove open: JSON messages with a schema, in packed chunks.
//!
//! Topic `/axis` has every sample, in numbers, under the names of the CSV log; topic `/status` says state, limit, fault
//! and the end of an experiment in words, whenever one of them changes. A message's time is its sample's.

use super::Sample;
use super::write::{Layout, Position, Value};
use bristle_core::trace::{END_SHIFT, Status};
use bristle_plant::axis::Truth;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Compression, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::io::{self, Write};

/// What a file holds beside its samples: names and values.
pub type About = BTreeMap<String, String>;

/// Written piece by piece; [`McapLog::finish`] ends it.
pub struct McapLog<W: Write> {
    writer: Writer<NoSeek<W>>,
    layout: Layout,
    names: Vec<&'static str>,
    axis: u16,
    status: u16,
    samples: u32,
    changes: u32,
    last: Option<Status>,
    text: String,
}

impl<W: Write> McapLog<W> {
    /// Begins a file with what is known of it now.
    ///
    /// # Errors
    /// As the writer.
    pub fn new(to: W, layout: Layout, about: &About) -> io::Result<Self> {
        let options = WriteOptions::new()
            .disable_seeking(true)
            .compression(Some(Compression::Zstd))
            // The sender waits for no thread: a chunk is packed in 5 ms.
            .compression_threads(0)
            .library(concat!("bristle ", env!("CARGO_PKG_VERSION")));
        let mut writer = options.create(NoSeek::new(to)).map_err(fault)?;
        write_about(&mut writer, "capture", about)?;
        let names = layout.names();
        let numbers = names.iter().map(|&name| (name, "number"));
        let axis = channel(&mut writer, "/axis", "bristle.Sample", numbers, &layout)?;
        let words = ["state", "limit", "fault", "ended"].map(|name| (name, "string"));
        let words = words.into_iter().chain([("tick", "number")]);
        let status = channel(&mut writer, "/status", "bristle.Status", words, &layout)?;
        Ok(Self {
            writer,
            layout,
            names,
            axis,
            status,
            samples: 0,
            changes: 0,
            last: None,
            text: String::new(),
        })
    }

    /// Writes a sample. `truth` is for a layout that has it.
    ///
    /// # Errors
    /// As the writer.
    pub fn row(&mut self, sample: &Sample, truth: Option<&Truth>) -> io::Result<()> {
        let status = sample.record.status;
        if self.last != Some(status) {
            self.change(sample)?;
            self.last = Some(status);
        }
        self.numbers(sample, truth).map_err(io::Error::other)?;
        self.samples = self.samples.wrapping_add(1);
        self.write(self.axis, self.samples, sample)
    }

    /// The sample as a JSON object. What JSON has no number for is null.
    fn numbers(&mut self, sample: &Sample, truth: Option<&Truth>) -> fmt::Result {
        let (text, mut names) = (&mut self.text, self.names.iter());
        text.clear();
        let mut written = Ok(());
        let mut before = '{';
        self.layout.values(sample, truth, |value| {
            let name = names.next().copied().unwrap_or_default();
            let mut put = || {
                write!(text, "{before}\"{name}\":")?;
                match value {
                    Value::Single(value) if !value.is_finite() => text.write_str("null"),
                    Value::Double(value) if !value.is_finite() => text.write_str("null"),
                    Value::Single(value) => write!(text, "{value:?}"),
                    Value::Double(value) => write!(text, "{value:?}"),
                    Value::Whole(value) => write!(text, "{value}"),
                    Value::Code(number, _) => write!(text, "{number}"),
                }
            };
            written = written.and_then(|()| put());
            before = ',';
        });
        written?;
        text.write_char('}')
    }

    fn change(&mut self, sample: &Sample) -> io::Result<()> {
        let status = sample.record.status;
        let [state, limit, fault, flags] = status.0.to_le_bytes();
        let word = |known: Option<&'static str>, number: u8| {
            known.map_or(number.to_string(), str::to_owned)
        };
        self.text.clear();
        let written = write!(
            self.text,
            r#"{{"state":"{}","limit":"{}","fault":"{}","ended":"{}","tick":{}}}"#,
            word(status.state().map(|known| known.text()), state),
            word(status.limit().map(|known| known.text()), limit),
            word(status.fault().map(|known| known.text()), fault),
            word(status.ended().map(|known| known.text()), flags >> END_SHIFT),
            sample.record.tick
        );
        written.map_err(io::Error::other)?;
        self.changes = self.changes.wrapping_add(1);
        self.write(self.status, self.changes, sample)
    }

    fn write(&mut self, channel_id: u16, sequence: u32, sample: &Sample) -> io::Result<()> {
        let time_ns = (sample.time_s * 1e9).round() as u64;
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.writer
            .write_to_known_channel(&header, self.text.as_bytes())
            .map_err(fault)
    }

    /// Ends the file with what is known of it only now, and gives the writer back.
    ///
    /// # Errors
    /// As the writer.
    pub fn finish(mut self, result: &About) -> io::Result<W> {
        write_about(&mut self.writer, "result", result)?;
        self.writer.finish().map_err(fault)?;
        Ok(self.writer.into_inner().into_inner())
    }
}

fn channel<'a, W: Write>(
    writer: &mut Writer<NoSeek<W>>,
    topic: &str,
    schema: &str,
    columns: impl Iterator<Item = (&'a str, &'a str)>,
    layout: &Layout,
) -> io::Result<u16> {
    let columns: Vec<String> = columns
        .map(|(name, kind)| format!(r#""{name}":{{"type":"{kind}"}}"#))
        .collect();
    let text = format!(
        r#"{{"title":"{schema}","type":"object","properties":{{{}}}}}"#,
        columns.join(",")
    );
    let id = writer
        .add_schema(schema, "jsonschema", text.as_bytes())
        .map_err(fault)?;
    let counts = match layout.position {
        Position::Counts => String::new(),
        Position::Rad { counts_per_turn } => counts_per_turn.to_string(),
    };
    let mut about = About::new();
    if !counts.is_empty() {
        about.insert("counts_per_turn".to_owned(), counts);
    }
    writer.add_channel(id, topic, "json", &about).map_err(fault)
}

fn write_about<W: Write>(
    writer: &mut Writer<NoSeek<W>>,
    name: &str,
    notes: &About,
) -> io::Result<()> {
    let metadata = Metadata {
        name: name.to_owned(),
        metadata: notes.clone(),
    };
    writer.write_metadata(&metadata).map_err(fault)
}

fn fault(error: mcap::McapError) -> io::Error {
    match error {
        mcap::McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
