//! Files that are there whole or not at all.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;

use crate::error::InputError;

/// Writes a file through a temporary one beside it, which takes its name only once it is complete.
///
/// If `write` fails, what stood at `path` before stands there still. A name that ends in `.gz` is packed. What is no
/// regular file (a pipe, `/dev/stdout`) is written to once everything is ready.
///
/// # Errors
/// The path cannot be written, or `write` failed.
pub fn write_atomically<T>(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<T>,
) -> Result<T, InputError> {
    let path = path.as_ref();
    let fail = |error: io::Error| {
        InputError::new(
            path,
            format!("cannot be written: {error}"),
            "name a file in a folder that exists and may be written to",
        )
    };
    let about = fs::metadata(path);
    if about.as_ref().is_ok_and(fs::Metadata::is_dir) {
        return Err(InputError::new(
            path,
            "cannot be written: is a directory",
            "name a file in it",
        ));
    }
    if about.is_ok_and(|about| !about.is_file()) {
        let mut bytes = Vec::new();
        let value = pack_by_name(path, &mut bytes, write).map_err(fail)?;
        let mut file = fs::OpenOptions::new()
            .write(true)
            .open(path)
            .map_err(fail)?;
        file.write_all(&bytes).map_err(fail)?;
        return Ok(value);
    }
    // A link stays a link: the file it leads to is replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let folder = match target.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".bristle-");
    // Temporary files are private by default, results are not: the user's umask decides.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let temporary = builder.tempfile_in(folder).map_err(fail)?;
    let mut buffered = BufWriter::with_capacity(1 << 16, temporary);
    let value = pack_by_name(path, &mut buffered, write).map_err(fail)?;
    let temporary = buffered
        .into_inner()
        .map_err(|error| fail(error.into_error()))?;
    temporary
        .persist(&target)
        .map_err(|error| fail(error.error))?;
    Ok(value)
}

fn pack_by_name<T>(
    path: &Path,
    sink: &mut dyn Write,
    write: impl FnOnce(&mut dyn Write) -> io::Result<T>,
) -> io::Result<T> {
    if path.extension().is_some_and(|name| name == "gz") {
        let mut packed = GzEncoder::new(sink, Compression::default());
        let value = write(&mut packed)?;
        packed.finish()?;
        Ok(value)
    } else {
        write(sink)
    }
}

/// Values of one CSV column.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Printed so that they read back bit for bit.
    Numbers(&'a [f64]),
    /// Whole numbers, printed without a point.
    Whole(&'a [f64]),
    /// Printed as they are, in quotes where needed.
    Text(&'a [String]),
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
        for row in 0..rows {
            for (_, values) in columns {
                cell.clear();
                match values {
                    // Debug is the shortest form that reads back equal, with an exponent where that is shorter.
                    Values::Numbers(values) => write!(cell, "{:?}", values[row])?,
                    Values::Whole(values) => write!(cell, "{}", values[row])?,
                    Values::Text(values) => cell.extend_from_slice(values[row].as_bytes()),
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
