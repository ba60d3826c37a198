//! Frames between microcontroller and host, both directions: a byte stream that may be cut anywhere.
//!
//! | bytes | content |
//! |---|---|
//! | 2 | sync word, 5A B1 |
//! | 1 | kind, see [`Kind`] |
//! | 1 | number of entries in the payload |
//! | 2 | length of the payload in bytes |
//! | n | payload |
//! | 4 | CRC-32 (ISO-HDLC) of everything between sync word and here |
//!
//! All numbers are little-endian.

use crc::{CRC_32_ISO_HDLC, Crc, Table};

/// First bytes of a frame.
pub const SYNC: [u8; 2] = [0x5a, 0xb1];
/// Bytes before the payload.
pub const HEADER_BYTES: usize = 6;
/// Bytes of a frame besides its payload.
pub const OVERHEAD_BYTES: usize = HEADER_BYTES + 4;
/// Longest payload.
pub const MOST_PAYLOAD_BYTES: usize = 1024;

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// What a frame holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Samples, microcontroller to host; see `trace`.
    Samples = 1,
    /// Counters and versions, microcontroller to host; see `status`.
    Status = 2,
    /// Answer to a command; see `command`.
    Reply = 3,
    /// Samples of a burst, microcontroller to host; see `trace`.
    Burst = 4,
    /// Command, host to microcontroller; see `command`.
    Command = 16,
}

impl Kind {
    fn of(byte: u8) -> Option<Self> {
        Some(match byte {
            1 => Self::Samples,
            2 => Self::Status,
            3 => Self::Reply,
            4 => Self::Burst,
            16 => Self::Command,
            _ => return None,
        })
    }
}

/// A frame that arrived whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// What it holds.
    pub kind: Kind,
    /// Number of entries in the payload.
    pub count: u8,
    /// The entries.
    pub payload: &'a [u8],
}

/// Writes a frame into a buffer.
///
/// ```
/// use bristle_core::wire::{Decoder, FrameWriter, Kind};
/// let mut buffer = [0; 64];
/// let mut frame = FrameWriter::new(&mut buffer, Kind::Command);
/// frame.u32(7);
/// let bytes = frame.finish(1).unwrap();
/// let mut decoder = Decoder::<64>::new();
/// decoder.feed(bytes);
/// let frame = decoder.next_frame().unwrap();
/// assert_eq!((frame.kind, frame.count, frame.payload), (Kind::Command, 1, &[7, 0, 0, 0][..]));
/// ```
pub struct FrameWriter<'a> {
    bytes: &'a mut [u8],
    at: usize,
    fits: bool,
}

impl<'a> FrameWriter<'a> {
    /// Starts a frame at the beginning of a buffer.
    pub fn new(bytes: &'a mut [u8], kind: Kind) -> Self {
        let mut writer = Self {
            bytes,
            at: 0,
            fits: true,
        };
        writer.put(&SYNC);
        writer.put(&[kind as u8, 0, 0, 0]);
        writer
    }

    fn put(&mut self, bytes: &[u8]) {
        match self.bytes.get_mut(self.at..self.at + bytes.len()) {
            Some(place) => {
                place.copy_from_slice(bytes);
                self.at += bytes.len();
            }
            None => self.fits = false,
        }
    }

    /// Adds a byte.
    pub fn u8(&mut self, value: u8) {
        self.put(&[value]);
    }

    /// Adds two bytes.
    pub fn u16(&mut self, value: u16) {
        self.put(&value.to_le_bytes());
    }

    /// Adds four bytes.
    pub fn u32(&mut self, value: u32) {
        self.put(&value.to_le_bytes());
    }

    /// Adds four bytes.
    pub fn f32(&mut self, value: f32) {
        self.put(&value.to_le_bytes());
    }

    /// Fills in count, length and checksum, and gives the frame; `None` if it did not fit.
    pub fn finish(mut self, count: u8) -> Option<&'a [u8]> {
        let length = self.at.checked_sub(HEADER_BYTES)?;
        if length > MOST_PAYLOAD_BYTES {
            return None;
        }
        *self.bytes.get_mut(3)? = count;
        self.bytes
            .get_mut(4..HEADER_BYTES)?
            .copy_from_slice(&(length as u16).to_le_bytes());
        let sum = CRC.checksum(self.bytes.get(SYNC.len()..self.at)?);
        self.put(&sum.to_le_bytes());
        let (bytes, at, fits) = (self.bytes, self.at, self.fits);
        if fits { bytes.get(..at) } else { None }
    }
}

/// Reads numbers off the front of a payload; every one is `None` once the bytes have run out.
#[derive(Clone, Copy, Debug)]
pub struct Reader<'a>(pub &'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    /// Takes a byte.
    pub fn u8(&mut self) -> Option<u8> {
        self.take::<1>().map(|[byte]| byte)
    }

    /// Takes two bytes.
    pub fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    /// Takes four bytes.
    pub fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    /// Takes four bytes.
    pub fn f32(&mut self) -> Option<f32> {
        self.take().map(f32::from_le_bytes)
    }

    /// `Some` if nothing is left.
    pub fn end(&self) -> Option<()> {
        self.0.is_empty().then_some(())
    }
}

/// Finds frames in a stream, of up to `N` bytes each. Never panics, whatever the bytes.
#[derive(Clone, Debug)]
pub struct Decoder<const N: usize> {
    bytes: [u8; N],
    length: usize,
    /// Bytes of the frame given last, dropped at the next call.
    given: usize,
    /// Bytes that belonged to no frame.
    pub skipped_bytes: u32,
    /// Frames whose checksum was wrong.
    pub damaged_frames: u32,
}

impl<const N: usize> Default for Decoder<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Decoder<N> {
    /// An empty one.
    pub const fn new() -> Self {
        Self {
            bytes: [0; N],
            length: 0,
            given: 0,
            skipped_bytes: 0,
            damaged_frames: 0,
        }
    }

    /// Takes as many bytes as there is room for, and says how many. Call [`Decoder::next_frame`] until it gives `None`
    /// to make room.
    pub fn feed(&mut self, bytes: &[u8]) -> usize {
        self.drop_given();
        let room = self.bytes.get_mut(self.length..).unwrap_or_default();
        let count = room.len().min(bytes.len());
        for (to, from) in room.iter_mut().zip(bytes) {
            *to = *from;
        }
        self.length += count;
        count
    }

    /// The next whole frame. `None` leaves room for more bytes.
    pub fn next_frame(&mut self) -> Option<Frame<'_>> {
        self.drop_given();
        loop {
            match self.look() {
                Look::More => return None,
                Look::Skip { damaged } => {
                    self.damaged_frames = self.damaged_frames.wrapping_add(u32::from(damaged));
                    self.skipped_bytes = self.skipped_bytes.wrapping_add(1);
                    self.drop_front(1);
                }
                Look::Whole(kind, length) => {
                    self.given = length + OVERHEAD_BYTES;
                    let payload = self.bytes.get(HEADER_BYTES..HEADER_BYTES + length)?;
                    let count = *self.bytes.get(3)?;
                    return Some(Frame {
                        kind,
                        count,
                        payload,
                    });
                }
            }
        }
    }

    fn drop_given(&mut self) {
        let given = core::mem::take(&mut self.given);
        self.drop_front(given);
    }

    fn drop_front(&mut self, count: usize) {
        let count = count.min(self.length);
        if count > 0 {
            self.bytes.copy_within(count..self.length, 0);
            self.length -= count;
        }
    }

    /// What the bytes at the front are.
    fn look(&self) -> Look {
        let bytes = self.bytes.get(..self.length).unwrap_or_default();
        let known = bytes.len().min(SYNC.len());
        if bytes.get(..known) != SYNC.get(..known) {
            return Look::Skip { damaged: false };
        }
        let &[_, _, kind, _, low, high, ..] = bytes else {
            return Look::More;
        };
        let length = usize::from(u16::from_le_bytes([low, high]));
        let Some(kind) = Kind::of(kind) else {
            return Look::Skip { damaged: false };
        };
        if length > MOST_PAYLOAD_BYTES || length + OVERHEAD_BYTES > N {
            return Look::Skip { damaged: false };
        }
        let end = HEADER_BYTES + length;
        let (Some(body), Some(&[a, b, c, d])) =
            (bytes.get(SYNC.len()..end), bytes.get(end..end + 4))
        else {
            return Look::More;
        };
        if CRC.checksum(body) == u32::from_le_bytes([a, b, c, d]) {
            Look::Whole(kind, length)
        } else {
            Look::Skip { damaged: true }
        }
    }
}

enum Look {
    /// Too few bytes to say.
    More,
    /// No frame starts here.
    Skip { damaged: bool },
    /// A frame with a payload of so many bytes.
    Whole(Kind, usize),
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn frame(kind: Kind, words: &[u32]) -> Vec<u8> {
        let mut buffer = [0; MOST_PAYLOAD_BYTES + OVERHEAD_BYTES];
        let mut writer = FrameWriter::new(&mut buffer, kind);
        words.iter().for_each(|&word| writer.u32(word));
        writer.finish(words.len() as u8).unwrap().to_vec()
    }

    /// Feeds in pieces and gives count and payload of every frame.
    fn decode(bytes: &[u8], piece: usize) -> (Vec<(u8, Vec<u8>)>, Decoder<256>) {
        let mut decoder = Decoder::<256>::new();
        let mut frames = Vec::new();
        for mut part in bytes.chunks(piece) {
            while !part.is_empty() {
                let taken = decoder.feed(part);
                part = &part[taken..];
                while let Some(frame) = decoder.next_frame() {
                    frames.push((frame.count, frame.payload.to_vec()));
                }
            }
        }
        (frames, decoder)
    }

    #[test]
    fn finds_frames_between_rubbish_in_pieces_of_any_size() {
        let mut bytes = Vec::new();
        bytes.extend(frame(Kind::Samples, &[1, 2, 3]));
        bytes.extend([0x5a, 0x00, 0x5a, 0xb1, 0x01]);
        bytes.extend(frame(Kind::Reply, &[4]));
        let mut damaged = frame(Kind::Status, &[5, 6]);
        damaged[8] ^= 1;
        bytes.extend(damaged);
        bytes.extend(frame(Kind::Command, &[]));
        for piece in 1..bytes.len() {
            let (frames, decoder) = decode(&bytes, piece);
            let counts: Vec<u8> = frames.iter().map(|frame| frame.0).collect();
            assert_eq!(counts, [3, 1, 0], "pieces of {piece}");
            assert_eq!(decoder.damaged_frames, 1);
        }
    }

    #[test]
    fn refuses_to_write_what_does_not_fit() {
        let mut small = [0; 12];
        let mut writer = FrameWriter::new(&mut small, Kind::Samples);
        writer.u32(0);
        assert!(writer.finish(1).is_none());
        assert!(FrameWriter::new(&mut [], Kind::Samples).finish(0).is_none());
    }

    proptest! {
        #[test]
        fn any_bytes_end_without_a_panic_or_a_full_buffer(
            bytes in proptest::collection::vec(
                prop_oneof![Just(0x5a_u8), Just(0xb1), Just(1), Just(0), any::<u8>()], 0..2000),
            piece in 1_usize..300,
        ) {
            let (_, mut decoder) = decode(&bytes, piece);
            // Whatever is left is shorter than a frame, so there is always room to go on.
            prop_assert!(decoder.feed(&[0]) == 1);
        }

        #[test]
        fn every_frame_survives_rubbish_in_front(
            rubbish in proptest::collection::vec(any::<u8>(), 0..64),
            words in proptest::collection::vec(any::<u32>(), 0..20),
        ) {
            let mut bytes = rubbish;
            bytes.extend(frame(Kind::Samples, &words));
            // A false start in the rubbish waits for at most a buffer of bytes.
            bytes.extend([0; 256]);
            let (frames, _) = decode(&bytes, 7);
            let payload: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            prop_assert!(frames.contains(&(words.len() as u8, payload)));
        }
    }
}
