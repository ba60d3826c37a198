//! Every sample into a file while the scope runs.

use bristle_gap::InputError;
use bristle_gap::capture::{About, Layout, Recorder, Sample, Summary};
use std::path::{Path, PathBuf};

/// A recording on its way.
pub struct Recording {
    path: PathBuf,
    recorder: Recorder,
    samples: u64,
    /// Losses before it began.
    lost: u64,
}

impl Recording {
    /// Begins one; so many samples were lost before.
    pub fn begin(path: PathBuf, about: &About, lost: u64) -> Result<Self, InputError> {
        Ok(Self {
            recorder: Recorder::create(&path, Layout::FIRMWARE, about)?,
            path,
            samples: 0,
            lost,
        })
    }

    /// Takes a sample.
    pub fn sample(&mut self, sample: &Sample) -> Result<(), InputError> {
        self.samples += 1;
        self.recorder.row(sample, None)
    }

    /// Its file, once it has ended.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Samples so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// Ends it with what is known only now, and says what it holds.
    pub fn end(self, summary: &Summary, mut known: About) -> Result<String, InputError> {
        let lost = summary.lost.saturating_sub(self.lost);
        let counts = [("samples", self.samples), ("lost", lost)];
        known.extend(counts.map(|(name, count)| (name.to_owned(), count.to_string())));
        self.recorder.commit(&known)?;
        let path = self.path.display();
        Ok(format!("{path}: {} samples, {lost} lost", self.samples))
    }
}

/// The name of the n-th recording, from 1: the first one's is as given.
pub fn numbered(path: &Path, number: usize) -> PathBuf {
    if number < 2 {
        return path.to_path_buf();
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let (stem, ending) = name.split_once('.').unwrap_or((&name, ""));
    let dot = if ending.is_empty() { "" } else { "." };
    path.with_file_name(format!("{stem}-{number}{dot}{ending}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_further_recording_gets_a_number() {
        let name = |path: &str, number| numbered(Path::new(path), number).display().to_string();
        assert_eq!(name("a/scope.mcap", 1), "a/scope.mcap");
        assert_eq!(name("a/scope.csv.gz", 3), "a/scope-3.csv.gz");
        assert_eq!(name("scope", 2), "scope-2");
    }
}
