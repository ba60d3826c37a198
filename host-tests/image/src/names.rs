//! Names and addresses of the chip's registers, from the metadata that the firmware's register crate is made of.

use stm32_metapac::metadata::ir::{Array, BlockItemInner, IR};
use stm32_metapac::metadata::{METADATA, Peripheral};

type Listed = (&'static str, u32, &'static [(&'static str, u32)]);

/// Registers of the core that the chip's metadata does not list.
const CORE: &[Listed] = &[
    (
        "DWT",
        0xe000_1000,
        &[("CTRL", 0), ("CYCCNT", 4), ("LAR", 0xfb0)],
    ),
    (
        "SysTick",
        0xe000_e010,
        &[("CTRL", 0), ("LOAD", 4), ("VAL", 8), ("CALIB", 12)],
    ),
    (
        "SCB",
        0xe000_ed00,
        &[
            ("CPUID", 0x00),
            ("ICSR", 0x04),
            ("VTOR", 0x08),
            ("AIRCR", 0x0c),
            ("SCR", 0x10),
            ("CCR", 0x14),
            ("SHPR1", 0x18),
            ("SHPR2", 0x1c),
            ("SHPR3", 0x20),
            ("SHCSR", 0x24),
            ("CFSR", 0x28),
            ("HFSR", 0x2c),
            ("CPACR", 0x88),
            ("DHCSR", 0xf0),
            ("DEMCR", 0xfc),
            ("FPCCR", 0x234),
        ],
    ),
    (
        "NVIC",
        0xe000_e100,
        &[
            ("ISER", 0x000),
            ("ICER", 0x080),
            ("ISPR", 0x100),
            ("ICPR", 0x180),
            ("IABR", 0x200),
            ("IPR", 0x300),
        ],
    ),
];

fn peripheral(name: &str) -> Option<&'static Peripheral> {
    METADATA.peripherals.iter().find(|p| p.name == name)
}

/// A block's name as the metadata's peripherals and its own tables spell it.
fn same(a: &str, b: &str) -> bool {
    let plain = |s: &str| s.replace('_', "").to_ascii_lowercase();
    plain(a) == plain(b)
}

/// Names and offsets of all registers of a block, those of the block that it extends included.
fn registers(ir: &IR, block: &str) -> Vec<(String, u32)> {
    let Some(block) = ir.blocks.iter().find(|b| same(b.name, block)) else {
        return Vec::new();
    };
    let mut all = block.extends.map_or_else(Vec::new, |b| registers(ir, b));
    for item in block.items {
        let offsets: Vec<u32> = match &item.array {
            None => vec![0],
            Some(Array::Regular(a)) => (0..a.len).map(|i| i * a.stride).collect(),
            Some(Array::Cursed(a)) => a.offsets.to_vec(),
        };
        for (i, offset) in offsets.iter().enumerate() {
            let name = if offsets.len() > 1 {
                format!("{}[{i}]", item.name.to_ascii_uppercase())
            } else {
                item.name.to_ascii_uppercase()
            };
            let at = item.byte_offset + offset;
            match &item.inner {
                BlockItemInner::Register(_) => all.push((name, at)),
                BlockItemInner::Block(inner) => {
                    for (sub, o) in registers(ir, inner.block) {
                        all.push((format!("{name}.{sub}"), at + o));
                    }
                }
            }
        }
    }
    all
}

/// Address of a register, for example of `TIM7`, `CR1`.
///
/// # Panics
/// There is none: the table of models has a slip.
pub fn address(peripheral_name: &str, register: &str) -> u32 {
    if let Some((_, base, list)) = CORE.iter().find(|c| c.0 == peripheral_name) {
        let found = list.iter().find(|r| r.0 == register);
        return base
            + found
                .unwrap_or_else(|| panic!("{peripheral_name}.{register}"))
                .1;
    }
    let found = peripheral(peripheral_name).and_then(|p| {
        let all = p.registers.as_ref()?;
        let list = registers(all.ir, all.block);
        let at = list.iter().find(|r| r.0 == register)?.1;
        Some(p.address as u32 + at)
    });
    found.unwrap_or_else(|| panic!("no register {peripheral_name}.{register}"))
}

/// Number of an interrupt.
///
/// # Panics
/// There is none of that name.
pub fn interrupt(name: &str) -> usize {
    let found = METADATA.interrupts.iter().find(|i| i.name == name);
    found
        .unwrap_or_else(|| panic!("no interrupt {name}"))
        .number as usize
}

/// Peripheral, register and offset at an address, for a message.
pub fn describe(at: u32) -> String {
    let core = CORE
        .iter()
        .map(|c| (c.0, c.1))
        .filter(|c| at >= 0xe000_0000 && c.1 <= at);
    let chip = METADATA
        .peripherals
        .iter()
        .map(|p| (p.name, p.address as u32))
        .filter(|p| p.1 <= at);
    let Some((name, base)) = core.chain(chip).max_by_key(|p| p.1) else {
        return format!("{at:#010x}");
    };
    let offset = at - base;
    let register = if at >= 0xe000_0000 {
        CORE.iter().find(|c| c.0 == name).and_then(|c| {
            let found = c.2.iter().find(|r| r.1 == offset & !3)?;
            Some(found.0.to_owned())
        })
    } else {
        peripheral(name).and_then(|p| {
            let all = p.registers.as_ref()?;
            let list = registers(all.ir, all.block);
            Some(list.into_iter().find(|r| r.1 == offset & !3)?.0)
        })
    };
    let register = register.unwrap_or_else(|| "no register of that offset".to_owned());
    format!("{name} offset {offset:#x} ({register})")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knows_addresses_both_ways() {
        assert_eq!(address("TIM7", "ARR"), 0x4000_142c);
        assert_eq!(describe(0x4000_142c), "TIM7 offset 0x2c (ARR)");
        assert_eq!(address("SCB", "VTOR"), 0xe000_ed08);
        assert_eq!(interrupt("TIM7_DAC"), 55);
    }
}
