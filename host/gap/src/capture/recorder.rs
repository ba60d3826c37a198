//! A log as it is written: CSV, packed where its name ends in .gz, or MCAP where it ends in .mcap; there whole or not
//! at all.

use super::Sample;
use super::mcap::{About, McapLog};
use super::write::Layout;
use crate::error::InputError;
use crate::output::{AtomicFile, failed};
use bristle_plant::axis::Truth;
use std::path::{Path, PathBuf};

/// A log on its way. Dropped before [`Recorder::commit`], it leaves nothing.
pub struct Recorder {
    path: PathBuf,
    form: Form,
}

enum Form {
    Csv(Box<AtomicFile>, Layout),
    Mcap(Box<McapLog<AtomicFile>>),
}

impl Recorder {
    /// Begins a log. What is `about` it goes into an MCAP file; a CSV log has columns only.
    ///
    /// # Errors
    /// The path cannot be written.
    pub fn create(
        path: impl AsRef<Path>,
        layout: Layout,
        about: &About,
    ) -> Result<Self, InputError> {
        let path = path.as_ref();
        if path.to_string_lossy().ends_with(".mcap.gz") {
            let what = "an MCAP file is packed inside";
            return Err(InputError::new(path, what, "let its name end in .mcap"));
        }
        let mut file = AtomicFile::create(path)?;
        let form = if path.extension().is_some_and(|name| name == "mcap") {
            let log = McapLog::new(file, layout, about).map_err(|error| failed(path, &error))?;
            Form::Mcap(Box::new(log))
        } else {
            let written = layout.header(&mut file);
            written.map_err(|error| failed(path, &error))?;
            Form::Csv(Box::new(file), layout)
        };
        Ok(Self {
            path: path.to_path_buf(),
            form,
        })
    }

    /// Writes a sample.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn row(&mut self, sample: &Sample, truth: Option<&Truth>) -> Result<(), InputError> {
        let written = match &mut self.form {
            Form::Csv(file, layout) => layout.row(file, sample, truth),
            Form::Mcap(log) => log.row(sample, truth),
        };
        written.map_err(|error| failed(&self.path, &error))
    }

    /// Ends the log and gives it its name. What came of it goes into an MCAP file.
    ///
    /// # Errors
    /// The path cannot be written.
    pub fn commit(self, result: &About) -> Result<(), InputError> {
        match self.form {
            Form::Csv(file, _) => file.commit(),
            Form::Mcap(log) => log
                .finish(result)
                .map_err(|error| failed(&self.path, &error))?
                .commit(),
        }
    }
}
