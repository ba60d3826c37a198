//! A file as text: found, unpacked if it is gzip, and checked to be UTF-8.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;

use crate::error::InputError;

/// Text beyond this is refused rather than let fill the memory: three hours at 10 kHz fit in.
const LIMIT_BYTES: u64 = 4 << 30;

/// Reads a file whole as text, without a byte order mark.
pub(crate) fn read_text(path: &Path) -> Result<String, InputError> {
    text_of(path, read_bytes(path)?)
}

/// Bytes of a file as text, without a byte order mark.
pub(crate) fn text_of(path: &Path, mut bytes: Vec<u8>) -> Result<String, InputError> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(
            InputError::new(path, "the text is UTF-16", "save the file as UTF-8")
                .at_line(1)
                .at_character(1),
        );
    }
    if bytes.starts_with("\u{feff}".as_bytes()) {
        bytes.drain(..3);
    }
    if let Some(at) = bytes.iter().position(|&byte| byte == 0) {
        return Err(
            InputError::new(path, "not a text file: it holds a zero byte", WANT_TEXT)
                .at_line(line_at(&bytes, at))
                .at_character(character_at(&bytes, at)),
        );
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let byte = bytes.get(at).copied().unwrap_or_default();
        InputError::new(
            path,
            format!("not UTF-8 text: byte 0x{byte:02x} has no meaning here"),
            WANT_TEXT,
        )
        .at_line(line_at(bytes, at))
        .at_character(character_at(bytes, at))
    })
}

const WANT_TEXT: &str = "give a text file in UTF-8, or one packed with gzip";

/// Line from 1 of the byte at `at`; a lone carriage return ends a line too.
pub(crate) fn line_at(text: &[u8], at: usize) -> u64 {
    let before = text.get(..at).unwrap_or(text);
    let ends = before
        .iter()
        .enumerate()
        .filter(|&(i, &byte)| {
            byte == b'\n' || (byte == b'\r' && text.get(i + 1).is_some_and(|&next| next != b'\n'))
        })
        .count();
    ends as u64 + 1
}

/// Character from 1, within its line, of the byte at `at`.
pub(crate) fn character_at(text: &[u8], at: usize) -> u64 {
    let before = text.get(..at).unwrap_or(text);
    let start = before
        .iter()
        .rposition(|byte| matches!(byte, b'\r' | b'\n'))
        .map_or(0, |end| end + 1);
    let line = before.get(start..).unwrap_or_default();
    String::from_utf8_lossy(line).chars().count() as u64 + 1
}

/// Reads a file whole, unpacked if it is gzip.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, InputError> {
    let cannot = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound => InputError::new(path, "there is no such file", "check the path"),
        io::ErrorKind::PermissionDenied => {
            InputError::new(path, "may not be read", "check its permissions")
        }
        _ => InputError::new(path, format!("cannot be read: {error}"), "check the path"),
    };
    let mut file = File::open(path).map_err(cannot)?;
    let about = file.metadata().map_err(cannot)?;
    if about.is_dir() {
        return Err(InputError::new(path, "is a directory", "name a file in it"));
    }
    let mut bytes = Vec::with_capacity(about.len().min(LIMIT_BYTES) as usize);
    file.by_ref()
        .take(LIMIT_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(cannot)?;
    // The magic bytes decide, not the name: logs get renamed.
    if bytes.starts_with(&[0x1f, 0x8b]) {
        bytes = unpack(path, &bytes)?;
    }
    if bytes.len() as u64 > LIMIT_BYTES {
        return Err(InputError::new(
            path,
            "is longer than 4 GiB",
            "split the record",
        ));
    }
    Ok(bytes)
}

fn unpack(path: &Path, packed: &[u8]) -> Result<Vec<u8>, InputError> {
    let mut bytes = Vec::with_capacity(packed.len().saturating_mul(3));
    let result = MultiGzDecoder::new(packed)
        .take(LIMIT_BYTES + 1)
        .read_to_end(&mut bytes);
    match result {
        Ok(_) => Ok(bytes),
        Err(error) => {
            let what = if error.kind() == io::ErrorKind::UnexpectedEof {
                "the gzip data end too early".to_owned()
            } else {
                format!("the gzip data are damaged ({error})")
            };
            Err(InputError::new(path, what, "copy or record the file again")
                .at_line(line_at(&bytes, bytes.len())))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::line_at;

    #[test]
    fn counts_lines_of_every_convention() {
        assert_eq!(line_at(b"a\nb", 2), 2);
        assert_eq!(line_at(b"a\r\nb", 3), 2);
        assert_eq!(line_at(b"a\rb", 2), 2);
        assert_eq!(line_at(b"", 0), 1);
        assert_eq!(line_at(b"a\n\n\nb", 99), 4);
    }
}
