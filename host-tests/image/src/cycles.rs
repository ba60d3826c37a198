//! Length and estimated cost of a Thumb-2 instruction.
//!
//! Costs are those of the Cortex-M4 technical reference manual (chapter 3.3, and chapter 7 for the floating point unit)
//! for memory without wait states, as code in CCM has. Where the manual gives a range the upper end stands here, except
//! for the refill of the pipeline, 1 to 3, where it is 2. Two of its rules for neighbours are followed: a load of a core
//! register right after another one overlaps with it (3.3.3), and IT folds onto an instruction of 16 bits before it
//! (table 3-1). What the estimate leaves out: bus contention, and flash wait states of code outside CCM.

/// Cycles that a taken branch adds.
pub const REFILL: u32 = 2;

/// Cycles of exception entry, and of exit: 12 and 10 without wait states; the lazy save of floating point registers is
/// assumed to be needed, which adds 17 at the first floating point instruction.
pub const ENTRY: u32 = 12;
/// See [`ENTRY`].
pub const EXIT: u32 = 10;

/// An instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// Bytes.
    pub length: u32,
    /// Estimated cycles, without the refill of a taken branch.
    pub cycles: u32,
}

/// Decodes an instruction from its first halfword and the one after it.
pub fn decode(first: u16, second: u16) -> Instruction {
    if first >> 11 >= 0b11101 {
        Instruction {
            length: 4,
            cycles: wide(first, second),
        }
    } else {
        Instruction {
            length: 2,
            cycles: narrow(first),
        }
    }
}

fn narrow(op: u16) -> u32 {
    match op >> 8 {
        // LDR literal, LDR and LDRB and LDRH from a register or the stack pointer.
        0x48..=0x4f | 0x56..=0x5f | 0x68..=0x6f | 0x78..=0x7f | 0x88..=0x8f | 0x98..=0x9f => 2,
        // Stores with a register offset take two, with an immediate one.
        0x50..=0x55 => 2,
        // PUSH, POP.
        0xb4 | 0xb5 | 0xbc | 0xbd => 1 + (op & 0x1ff).count_ones(),
        // STM, LDM.
        0xc0..=0xcf => 1 + (op & 0xff).count_ones(),
        _ => 1,
    }
}

fn wide(first: u16, second: u16) -> u32 {
    match first >> 9 & 0x7f {
        // LDM, STM, then (bit 6) LDRD, STRD, exclusive accesses and table branches.
        0b111_0100 => {
            if first & 0x40 == 0 {
                1 + second.count_ones()
            } else if first & 0xfff0 == 0xe8d0 && second & 0xffe0 == 0xf000 {
                2
            } else {
                3
            }
        }
        // Coprocessor 10 and 11: floating point.
        0b111_0110 | 0b111_0111 if second & 0x0e00 == 0x0a00 => float(first, second),
        // Single loads and stores, multiplications and divisions.
        0b111_1100 if first & 0x0010 != 0 => 2,
        0b111_1100 => 1,
        0b111_1101 => match first >> 4 & 0xff {
            // SDIV, UDIV: 2 to 12.
            0xb9 | 0xbb => 12,
            _ => 1,
        },
        // MSR, MRS, barriers.
        0b111_1001 if second & 0xd000 == 0x8000 && first & 0xff80 == 0xf380 => 4,
        _ => 1,
    }
}

fn float(first: u16, second: u16) -> u32 {
    if first & 0xff00 == 0xee00 {
        if second & 0x10 != 0 {
            return 1; // moves between register banks
        }
        return match (first >> 4 & 0xb, second >> 6 & 1) {
            (0 | 1, _) => 3,                                          // VMLA, VMLS, VNMLA
            (9 | 0xa, _) => 3,                                        // VFNMA, VFMA
            (8, _) => 14,                                             // VDIV
            (0xb, 1) if first & 0xf == 1 && second & 0x80 != 0 => 14, // VSQRT
            _ => 1,
        };
    }
    // Loads and stores: one for the instruction and one a word; moves of two registers have bit 21 and P, U, W clear.
    let single = first & 0x0120 == 0x0100;
    if single {
        2
    } else {
        1 + u32::from(second & 0xff)
    }
}

/// Base and target of a single load of a core register.
fn load(first: u16, second: u16) -> Option<(u16, u16)> {
    let low = |at: u16| first >> at & 7;
    match first >> 8 {
        0x48..=0x4f => Some((15, low(8))),
        0x98..=0x9f => Some((13, low(8))),
        0x56..=0x5f | 0x68..=0x6f | 0x78..=0x7f | 0x88..=0x8f => Some((low(3), low(0))),
        0xf8..=0xf9 if first & 0x10 != 0 => Some((first & 15, second >> 12)),
        _ => None,
    }
}

/// Whether an instruction is IT.
fn is_it(first: u16) -> bool {
    first & 0xff00 == 0xbf00 && first & 0xf != 0
}

/// Instructions and estimated cycles of a stretch of code without a branch inside.
pub fn stretch(code: &[u8]) -> (u32, u32) {
    let half = |at: usize| match code.get(at..at + 2) {
        Some(b) => u16::from_le_bytes([b[0], b[1]]),
        None => 0,
    };
    let (mut at, mut count, mut cycles) = (0, 0, 0);
    let mut last_length = 0;
    let mut last_load = None;
    while at < code.len() {
        let (first, second) = (half(at), half(at + 2));
        let one = decode(first, second);
        let this_load = load(first, second);
        let overlaps = match (last_load, this_load) {
            (Some((_, target)), Some((base, _))) => target != base,
            _ => false,
        };
        let saved = overlaps || last_length == 2 && is_it(first);
        at += one.length as usize;
        count += 1;
        cycles += one.cycles - u32::from(saved);
        last_length = one.length;
        last_load = this_load;
    }
    (count, cycles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_of_known_encodings() {
        let cycles = |first, second| decode(first, second).cycles;
        assert_eq!(cycles(0x6808, 0), 2, "ldr r0, [r1]");
        assert_eq!(cycles(0x6008, 0), 1, "str r0, [r1]");
        assert_eq!(cycles(0xb5f0, 0), 6, "push {{r4-r7, lr}}");
        assert_eq!(cycles(0xee80, 0x0a20), 14, "vdiv.f32 s0, s0, s1");
        assert_eq!(cycles(0xeeb1, 0x0ac0), 14, "vsqrt.f32 s0, s0");
        assert_eq!(cycles(0xee30, 0x0a20), 1, "vadd.f32 s0, s0, s1");
        assert_eq!(cycles(0xee20, 0x0a20), 1, "vmul.f32 s0, s0, s1");
        assert_eq!(cycles(0xeea0, 0x0a81), 3, "vfma.f32 s0, s1, s2");
        assert_eq!(cycles(0xed90, 0x0a00), 2, "vldr s0, [r0]");
        assert_eq!(cycles(0xed2d, 0x8b04), 5, "vpush {{d8, d9}}");
        assert_eq!(cycles(0xfb90, 0xf0f1), 12, "sdiv r0, r0, r1");
        assert_eq!(cycles(0xfb00, 0xf001), 1, "mul r0, r0, r1");
        assert_eq!(cycles(0xe9d0, 0x0100), 3, "ldrd r0, r1, [r0]");
        assert_eq!(cycles(0xf8d0, 0x0004), 2, "ldr.w r0, [r0, #4]");
        assert_eq!(decode(0xf8d0, 4).length, 4);
        assert_eq!(stretch(&[0x08, 0x68, 0x80, 0xee, 0x20, 0x0a]), (2, 16));
    }

    #[test]
    fn neighbours() {
        // ldr r0, [r1]; ldr r2, [r3]: 3. ldr r0, [r1]; ldr r2, [r0]: 4.
        assert_eq!(stretch(&[0x08, 0x68, 0x1a, 0x68]), (2, 3));
        assert_eq!(stretch(&[0x08, 0x68, 0x02, 0x68]), (2, 4));
        // cmp r0, r1; it ne; movne r2, #1: 2. With the wide cmp.w: 3.
        assert_eq!(stretch(&[0x88, 0x42, 0x18, 0xbf, 0x01, 0x22]), (3, 2));
        assert_eq!(
            stretch(&[0xb0, 0xeb, 0x01, 0x0f, 0x18, 0xbf, 0x01, 0x22]),
            (3, 3)
        );
    }
}
