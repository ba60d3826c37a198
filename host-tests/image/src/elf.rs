//! The firmware's ELF: what to load, and where its symbols are.

use object::{Object, ObjectSegment, ObjectSymbol};
use std::collections::HashMap;
use std::path::Path;

/// An ELF file.
pub struct Image {
    bytes: Vec<u8>,
    loads: Vec<(u32, Vec<u8>)>,
    symbols: HashMap<String, (u32, u32)>,
}

impl Image {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read or is no ELF.
    pub fn read(path: &Path) -> Result<Self, String> {
        let bytes = std::fs::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
        Self::parse(bytes).map_err(|e| format!("{}: {e}", path.display()))
    }

    fn parse(bytes: Vec<u8>) -> Result<Self, object::Error> {
        let file = object::File::parse(bytes.as_slice())?;
        let headers = match &file {
            object::File::Elf32(elf) => elf.elf_program_headers(),
            _ => &[],
        };
        let endian = object::Endianness::Little;
        let mut loads = Vec::new();
        // Segments go to their load address: flash holds the initial values of RAM, which the start-up code copies.
        for (segment, header) in file.segments().zip(
            headers
                .iter()
                .filter(|h| h.p_type.get(endian) == object::elf::PT_LOAD),
        ) {
            let data = segment.data()?;
            if !data.is_empty() {
                loads.push((header.p_paddr.get(endian), data.to_vec()));
            }
        }
        let symbols = file
            .symbols()
            .filter_map(|s| {
                let name = s.name().ok()?.to_owned();
                Some((name, (s.address() as u32, s.size() as u32)))
            })
            .collect();
        Ok(Self {
            loads,
            symbols,
            bytes,
        })
    }

    /// Bare code in flash, whose first words are the vectors: for tests of the machine itself.
    pub fn of_code(flash: &[u8]) -> Self {
        Self {
            bytes: Vec::new(),
            loads: vec![(0x0800_0000, flash.to_vec())],
            symbols: HashMap::new(),
        }
    }

    /// The whole file.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Load addresses and contents.
    pub fn loads(&self) -> &[(u32, Vec<u8>)] {
        &self.loads
    }

    /// Address of a symbol by its exact name; functions carry the Thumb bit.
    pub fn address(&self, name: &str) -> Option<u32> {
        self.symbols.get(name).map(|s| s.0)
    }

    /// Names that contain a text, with address and size.
    pub fn matching<'a>(&'a self, part: &'a str) -> impl Iterator<Item = (&'a str, u32, u32)> + 'a {
        self.symbols
            .iter()
            .filter(move |(name, _)| name.contains(part))
            .map(|(name, &(address, size))| (name.as_str(), address, size))
    }

    /// The function that an address lies in.
    pub fn function(&self, address: u32) -> Option<&str> {
        self.symbols
            .iter()
            .find(|(_, (start, size))| {
                let start = start & !1;
                *size > 0 && address >= start && address < start + size
            })
            .map(|(name, _)| name.as_str())
    }
}
