//! What the chores need to know of an image: sections, functions and their instructions.

use object::elf::SHF_ALLOC;
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, SymbolKind};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

/// A section that takes memory.
struct Section {
    name: String,
    range: Range<u64>,
    data: Vec<u8>,
    /// Lies in flash, be it only to be copied.
    loaded: bool,
}

/// An image, read whole.
pub struct Image {
    sections: Vec<Section>,
    /// Functions by address: all names and the end.
    functions: BTreeMap<u64, (Vec<String>, u64)>,
    /// Where code and data begin within functions: true for code.
    marks: BTreeMap<u64, bool>,
}

/// A function.
pub struct Function {
    /// Its names; functions that came out the same share their code.
    pub names: Vec<String>,
    /// Where it lies.
    pub range: Range<u64>,
}

impl Function {
    /// All names in one.
    pub fn name(&self) -> String {
        self.names.join(" = ")
    }
}

impl Image {
    /// Reads an ELF file.
    pub fn read(path: &Path) -> Result<Self, String> {
        let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
        let file = object::File::parse(&*bytes).map_err(|error| error.to_string())?;
        let sections = file
            .sections()
            .filter(|section| match section.flags() {
                SectionFlags::Elf { sh_flags } => sh_flags & u64::from(SHF_ALLOC) != 0,
                _ => false,
            })
            .map(|section| Section {
                name: section.name().unwrap_or("?").to_string(),
                range: section.address()..section.address() + section.size(),
                data: section.data().unwrap_or_default().to_vec(),
                loaded: !matches!(
                    section.kind(),
                    SectionKind::UninitializedData | SectionKind::Common
                ),
            })
            .collect();
        let mut functions: BTreeMap<u64, (Vec<String>, u64)> = BTreeMap::new();
        let mut marks = BTreeMap::new();
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            match name.get(..2) {
                Some("$t") => _ = marks.insert(symbol.address(), true),
                Some("$d") => _ = marks.insert(symbol.address(), false),
                _ if symbol.kind() == SymbolKind::Text && symbol.is_definition() => {
                    // Bit 0 only says that the code is Thumb.
                    let start = symbol.address() & !1;
                    let entry = functions.entry(start).or_default();
                    entry
                        .0
                        .push(format!("{:#}", rustc_demangle::demangle(name)));
                    entry.1 = entry.1.max(start + symbol.size());
                }
                _ => {}
            }
        }
        Ok(Self {
            sections,
            functions,
            marks,
        })
    }

    /// Name and size of every section that lies in flash.
    pub fn loaded_sections(&self) -> impl Iterator<Item = (&str, u64)> {
        self.sections
            .iter()
            .filter(|section| section.loaded && !section.range.is_empty())
            .map(|section| {
                (
                    section.name.as_str(),
                    section.range.end - section.range.start,
                )
            })
    }

    /// Bytes in flash.
    pub fn flash_bytes(&self) -> u64 {
        self.loaded_sections().map(|section| section.1).sum()
    }

    /// Bytes taken of a memory.
    pub fn memory_bytes(&self, memory: Range<u64>) -> u64 {
        self.sections
            .iter()
            .filter(|section| memory.contains(&section.range.start))
            .map(|section| section.range.end - section.range.start)
            .sum()
    }

    /// The function with a name.
    pub fn function(&self, name: &str) -> Option<Function> {
        let start = self
            .functions
            .iter()
            .find(|(_, (names, _))| names.iter().any(|each| each == name))?
            .0;
        self.function_at(*start)
    }

    /// The function that an address lies in.
    pub fn function_at(&self, address: u64) -> Option<Function> {
        let (&start, (names, end)) = self.functions.range(..=address).next_back()?;
        // A symbol without a size reaches to the next one.
        let end = if *end > start {
            *end
        } else {
            self.functions.range(start + 1..).next()?.0 & !1
        };
        (address < end).then(|| Function {
            names: names.clone(),
            range: start..end,
        })
    }

    /// Address, halfword and the halfword after it of every instruction of a function. Data between them is left out.
    pub fn instructions(&self, function: &Function) -> Vec<(u64, u16, u16)> {
        let mut found = Vec::new();
        let mut at = function.range.start;
        while at < function.range.end {
            let is_code = self
                .marks
                .range(..=at)
                .next_back()
                .is_none_or(|mark| *mark.1);
            let (Some(first), second) = (self.halfword(at), self.halfword(at + 2)) else {
                break;
            };
            if !is_code {
                at += 2;
                continue;
            }
            found.push((at, first, second.unwrap_or(0)));
            // 11101, 11110 and 11111 at the front announce a second halfword.
            at += if first >> 11 >= 0b11101 { 4 } else { 2 };
        }
        found
    }

    fn halfword(&self, address: u64) -> Option<u16> {
        let section = self
            .sections
            .iter()
            .find(|section| section.range.contains(&address))?;
        let offset = usize::try_from(address - section.range.start).ok()?;
        let bytes = section.data.get(offset..offset + 2)?;
        Some(u16::from_le_bytes(bytes.try_into().ok()?))
    }
}
