//! Real-time transfer as a debug probe does it: rings in the image's memory, found by their symbol.

use crate::elf::Image;
use crate::machine::Machine;

/// A ring: address of its descriptor (name, buffer, size, write, read, flags).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel(u32);

/// The control block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rtt {
    block: u32,
}

/// Bytes of the control block before the first ring, and of a ring.
const HEADER: u32 = 24;
const RING: u32 = 24;

impl Rtt {
    /// Where the image has it.
    ///
    /// # Errors
    /// An image without it.
    pub fn find(image: &Image) -> Result<Self, String> {
        let block = image.address("_SEGGER_RTT");
        block
            .map(|block| Self { block })
            .ok_or_else(|| "the image has no _SEGGER_RTT".to_owned())
    }

    /// Whether the image has set it up.
    ///
    /// # Errors
    /// Memory that cannot be read.
    pub fn ready(&self, machine: &Machine) -> Result<bool, String> {
        let mut id = [0; 10];
        machine.read(self.block, &mut id)?;
        Ok(&id == b"SEGGER RTT")
    }

    /// A ring from the image to the host.
    pub fn up(&self, index: u32) -> Channel {
        Channel(self.block + HEADER + RING * index)
    }

    /// A ring from the host to the image.
    ///
    /// # Errors
    /// Memory that cannot be read.
    pub fn down(&self, machine: &Machine, index: u32) -> Result<Channel, String> {
        let ups = machine.word(self.block + 16)?;
        Ok(self.up(ups + index))
    }
}

impl Channel {
    /// Buffer, size, write and read index.
    fn ring(self, machine: &Machine) -> Result<[u32; 4], String> {
        let at = |i: u32| machine.word(self.0 + 4 * i);
        Ok([at(1)?, at(2)?, at(3)?, at(4)?])
    }

    /// Takes what the image has written.
    ///
    /// # Errors
    /// Memory that cannot be read, a ring that is none.
    pub fn take(self, machine: &mut Machine) -> Result<Vec<u8>, String> {
        let [buffer, size, write, read] = self.ring(machine)?;
        if write == read {
            return Ok(Vec::new());
        }
        if write >= size || read >= size {
            return Err(format!("ring at {:#x}: {write}, {read} of {size}", self.0));
        }
        let mut bytes = vec![0; ((write + size - read) % size) as usize];
        let first = bytes.len().min((size - read) as usize);
        let (head, tail) = bytes.split_at_mut(first);
        machine.read(buffer + read, head)?;
        machine.read(buffer, tail)?;
        machine.write(self.0 + 16, &write.to_le_bytes())?;
        Ok(bytes)
    }

    /// Gives bytes to the image; false if they do not fit.
    ///
    /// # Errors
    /// Memory that cannot be written, a ring that is none.
    pub fn give(self, machine: &mut Machine, bytes: &[u8]) -> Result<bool, String> {
        let [buffer, size, write, read] = self.ring(machine)?;
        if write >= size || read >= size {
            return Err(format!("ring at {:#x}: {write}, {read} of {size}", self.0));
        }
        let free = (read + size - write - 1) % size;
        if bytes.len() > free as usize {
            return Ok(false);
        }
        let first = bytes.len().min((size - write) as usize);
        let (head, tail) = bytes.split_at(first);
        machine.write(buffer + write, head)?;
        machine.write(buffer, tail)?;
        let end = (write + bytes.len() as u32) % size;
        machine.write(self.0 + 12, &end.to_le_bytes())?;
        Ok(true)
    }
}
