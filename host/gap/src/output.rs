//! Files that are there whole or not at all.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use tempfile::NamedTempFile;

use crate::error::InputError;
use crate::log::Cells;

/// Writes a file through an [`AtomicFile`].
///
/// # Errors
/// The path cannot be written, or `write` failed.
pub fn write_atomically<T>(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<T>,
) -> Result<T, InputError> {
    let mut file = AtomicFile::create(path)?;
    let value = write(&mut file).map_err(|error| file.fail(&error))?;
    file.commit()?;
    Ok(value)
}

/// A file that takes its name only once it is complete: until [`AtomicFile::commit`] it is a temporary one beside it.
///
/// Dropped before that, what stood at the path stands there still. A name that ends in `.gz` is packed. What is no
/// regular file (a pipe, `/dev/stdout`) is written to once everything is ready.
pub struct AtomicFile {
    path: PathBuf,
    sink: Sink,
}

enum Sink {
    Plain(Place),
    Packed(GzEncoder<Place>),
}

/// Where the bytes wait.
enum Place {
    /// Beside the target, which is the second.
    Beside(BufWriter<NamedTempFile>, PathBuf),
    /// What is no regular file.
    Device(Vec<u8>),
}

impl Write for Place {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Beside(file, _) => file.write(bytes),
            Self::Device(waiting) => waiting.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Beside(file, _) => file.flush(),
            Self::Device(_) => Ok(()),
        }
    }
}

impl AtomicFile {
    /// Opens the temporary file.
    ///
    /// # Errors
    /// The path cannot be written.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, InputError> {
        let path = path.as_ref();
        let about = fs::metadata(path);
        if about.as_ref().is_ok_and(fs::Metadata::is_dir) {
            return Err(InputError::new(
                path,
                "cannot be written: is a directory",
                "name a file in it",
            ));
        }
        let place = if about.is_ok_and(|about| !about.is_file()) {
            Place::Device(Vec::new())
        } else {
            // A link stays a link: the file it leads to is replaced.
            let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
            let temporary = temporary_beside(&target).map_err(|error| failed(path, &error))?;
            Place::Beside(BufWriter::with_capacity(1 << 16, temporary), target)
        };
        let sink = if path.extension().is_some_and(|name| name == "gz") {
            Sink::Packed(GzEncoder::new(place, Compression::default()))
        } else {
            Sink::Plain(place)
        };
        Ok(Self {
            path: path.to_path_buf(),
            sink,
        })
    }

    /// Ends the file and gives it its name.
    ///
    /// # Errors
    /// The path cannot be written.
    pub fn commit(self) -> Result<(), InputError> {
        let Self { path, sink } = self;
        finish(&path, sink).map_err(|error| failed(&path, &error))
    }

    /// What went wrong in writing to it, as the error that names it.
    pub fn fail(&self, error: &io::Error) -> InputError {
        failed(&self.path, error)
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.sink {
            Sink::Plain(place) => place.write(bytes),
            Sink::Packed(packed) => packed.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.sink {
            Sink::Plain(place) => place.flush(),
            Sink::Packed(packed) => packed.flush(),
        }
    }
}

fn temporary_beside(target: &Path) -> io::Result<NamedTempFile> {
    let folder = match target.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".bristle-");
    // Temporary files are private by default, results are not: the user's umask decides.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

fn finish(path: &Path, sink: Sink) -> io::Result<()> {
    let place = match sink {
        Sink::Plain(place) => place,
        Sink::Packed(packed) => packed.finish()?,
    };
    match place {
        Place::Beside(file, target) => {
            let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.persist(target).map_err(|error| error.error)?;
            Ok(())
        }
        Place::Device(bytes) => {
            let mut device = fs::OpenOptions::new().write(true).open(path)?;
            device.write_all(&bytes)
        }
    }
}

/// The error of a path that cannot be written.
pub(crate) fn failed(path: &Path, error: &io::Error) -> InputError {
    InputError::new(
        path,
        format!("cannot be written: {error}"),
        "name a file in a folder that exists and may be written to",
    )
}

/// Values of one CSV column.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Printed so that they read back bit for bit.
    Numbers(&'a [f64]),
    /// Whole numbers, printed without a point.
    Whole(&'a [f64]),
    /// Printed as they are, in quotes where needed.
    Text(&'a Cells),
}

impl Values<'_> {
    fn len(&self) -> usize {
        match self {
            Values::Numbers(values) | Values::Whole(values) => values.len(),
            Values::Text(values) => values.len(),
        }
    }
}

/// Writes a CSV file with a header, packed where the name ends in `.gz`, whole or not at all.
///
/// # Errors
/// The path cannot be written, or the columns differ in length.
pub fn write_columns(
    path: impl AsRef<Path>,
    columns: &[(&str, Values<'_>)],
) -> Result<(), InputError> {
    let rows = columns.first().map_or(0, |(_, values)| values.len());
    if let Some((name, values)) = columns.iter().find(|(_, values)| values.len() != rows) {
        return Err(InputError::new(
            path,
            format!("has {} rows where the others have {rows}", values.len()),
            "give every column as many rows as the first",
        )
        .in_column(*name));
    }
    write_atomically(path, |writer| {
        let mut csv = csv::Writer::from_writer(writer);
        csv.write_record(columns.iter().map(|(name, _)| name))?;
        let mut cell = Vec::new();
        let mut texts: Vec<_> = columns
            .iter()
            .map(|(_, values)| match values {
                Values::Text(cells) => Some(cells.iter()),
                _ => None,
            })
            .collect();
        for row in 0..rows {
            for ((_, values), text) in columns.iter().zip(&mut texts) {
                cell.clear();
                match values {
                    // Debug is the shortest form that reads back equal, with an exponent where that is shorter.
                    Values::Numbers(values) => write!(cell, "{:?}", values[row])?,
                    Values::Whole(values) => write!(cell, "{}", values[row])?,
                    Values::Text(_) => {
                        let next = text.as_mut().and_then(Iterator::next);
                        cell.extend_from_slice(next.unwrap_or_default().as_bytes());
                    }
                }
                csv.write_field(&cell)?;
            }
            csv.write_record(None::<&[u8]>)?;
        }
        csv.flush()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        fs::write(&path, "old").unwrap();
        let result: Result<(), _> = write_atomically(&path, |writer| {
            writer.write_all(b"half of the new")?;
            Err(io::Error::other("power cut"))
        });
        assert!(result.unwrap_err().to_string().contains("power cut"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let error = write_columns("/no/such/folder/a.csv", &[]).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("/no/such/folder/a.csv: cannot be written: ")
        );
    }

    #[test]
    fn ragged_columns_are_refused() {
        let error = write_columns(
            "a.csv",
            &[
                ("a", Values::Numbers(&[1.0])),
                ("b", Values::Numbers(&[1.0, 2.0])),
            ],
        )
        .unwrap_err();
        assert_eq!(
            error.to_string(),
            "a.csv: column b: has 2 rows where the others have 1; give every column as many rows as the first"
        );
    }

    #[cfg(unix)]
    #[test]
    fn writes_through_a_link_and_into_a_device() {
        let folder = tempfile::tempdir().unwrap();
        let real = folder.path().join("real.csv");
        let link = folder.path().join("link.csv");
        fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        write_columns(&link, &[("a", Values::Numbers(&[0.5]))]).unwrap();
        assert_eq!(fs::read_to_string(&real).unwrap(), "a\n0.5\n");
        write_columns("/dev/null", &[("a", Values::Numbers(&[0.5]))]).unwrap();
    }
}
