//! Looks at the image for what must not be in the call trees of the control interrupts, and for how much stack it takes.
//!
//! The tree follows direct calls and jumps out of a function. A jump through a register could lead anywhere and is a
//! finding itself, but for the linker's own long jumps, whose name says where they lead.

use crate::elf::{Function, Image};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The control interrupt, and what follows it at the same priority.
const HANDLERS: [&str; 2] = ["TIM7_DAC", "CORDIC"];

/// The interrupt that sends the trace.
const SPARE: &str = "FMAC";

/// Bytes that the core itself puts on the stack at the entry, floating-point registers included.
const ENTRY_BYTES: u64 = 26 * 4 + 4;

/// What no function in the tree may have in its name, and why.
const FORBIDDEN: &[(&str, &str)] = &[
    ("panic", "panic"),
    ("unwrap_failed", "panic"),
    ("expect_failed", "panic"),
    ("slice_index", "panic"),
    ("defmt", "log"),
    ("critical_section", "critical section"),
    ("alloc::", "allocation"),
    ("ldivmod", "64-bit division"),
    ("udivmod", "64-bit division"),
    ("__udivdi3", "64-bit division"),
    ("__divdi3", "64-bit division"),
    ("__aeabi_d", "f64"),
    ("__aeabi_f", "soft float"),
    ("__aeabi_i2d", "f64"),
    ("__aeabi_ui2d", "f64"),
    ("__aeabi_l2", "soft float"),
    ("__aeabi_ul2", "soft float"),
    ("df2", "f64"),
    ("df3", "f64"),
    ("sf3", "soft float"),
];

/// Prefixes of the linker's long jumps.
const LONG_JUMPS: [&str; 2] = ["__Thumbv7ABSLongThunk_", "__ThumbV7PILongThunk_"];

/// Checks an image; false if something was found.
pub fn run(path: &Path) -> bool {
    let image = match Image::read(path) {
        Ok(image) => image,
        Err(error) => {
            eprintln!("{}: {error}", path.display());
            return false;
        }
    };
    // The spare interrupt logs and masks: a check that does not see it sees nothing.
    let Some(spare) = look_at(&image, SPARE) else {
        return false;
    };
    let mut clean = true;
    for name in HANDLERS {
        let Some(handler) = look_at(&image, name) else {
            return false;
        };
        for (name, bytes) in handler.done.values() {
            println!("{name}: {bytes} bytes of stack of its own");
        }
        println!(
            "{name}: {} functions, {} instructions, worst stack {} bytes with the core's {ENTRY_BYTES}",
            handler.done.len(),
            handler.instructions,
            handler.stack + ENTRY_BYTES
        );
        for finding in &handler.findings {
            eprintln!("FOUND: {finding}");
        }
        clean &= handler.findings.is_empty();
    }
    let sees = ["log: ", "masks interrupts"]
        .iter()
        .all(|what| spare.findings.iter().any(|finding| finding.contains(what)));
    if !sees {
        eprintln!("FOUND: nothing in {SPARE}, which logs and masks: the check is blind");
    }
    if clean {
        println!(
            "no panic, log, critical section, allocation, 64-bit division or software float; all of it in CCM"
        );
    }
    clean && sees
}

/// Looks at the call tree of an interrupt.
fn look_at<'a>(image: &'a Image, name: &str) -> Option<Tree<'a>> {
    let Some(function) = image.function(name) else {
        eprintln!("FOUND: no function {name}");
        return None;
    };
    let mut tree = Tree {
        image,
        findings: BTreeSet::new(),
        done: BTreeMap::new(),
        instructions: 0,
        stack: 0,
    };
    tree.stack = tree.visit(&function, &mut Vec::new());
    Some(tree)
}

struct Tree<'a> {
    image: &'a Image,
    findings: BTreeSet<String>,
    /// Name and own stack of each function seen, by address.
    done: BTreeMap<u64, (String, u64)>,
    /// Instructions of all of them.
    instructions: usize,
    /// The most stack they take.
    stack: u64,
}

impl Tree<'_> {
    /// Looks at a function and all it calls; gives the most stack they take.
    fn visit(&mut self, function: &Function, callers: &mut Vec<u64>) -> u64 {
        let name = function.name();
        if callers.contains(&function.range.start) {
            self.findings
                .insert(format!("{name} calls itself: its stack has no bound"));
            return 0;
        }
        self.name_is_fine(&name);
        if !(0x1000_0000..0x1000_8000).contains(&function.range.start) {
            self.findings.insert(format!("{name} lies outside of CCM"));
        }
        let mut own = 0;
        let mut callees = BTreeSet::new();
        let instructions = self.image.instructions(function);
        for &(at, first, second) in &instructions {
            own += stack_bytes(first, second);
            match look(at, first, second) {
                Step::On => {}
                Step::To(target) => {
                    if !function.range.contains(&target) {
                        callees.insert(target);
                    }
                }
                Step::Anywhere => self.jump(function, &name, at, &mut callees),
                Step::Masks => {
                    self.findings
                        .insert(format!("{name} masks interrupts at {at:#x}"));
                }
                Step::Traps => {
                    self.findings
                        .insert(format!("{name} traps at {at:#x}: a panic was inlined"));
                }
            }
        }
        if !self.done.contains_key(&function.range.start) {
            self.instructions += instructions.len();
        }
        self.done.insert(function.range.start, (name.clone(), own));
        callers.push(function.range.start);
        let mut most = 0;
        for target in callees {
            match self.image.function_at(target) {
                Some(callee) => most = most.max(self.visit(&callee, callers)),
                None => {
                    self.findings
                        .insert(format!("{name} calls {target:#x}, which is no function"));
                }
            }
        }
        callers.pop();
        own + most
    }

    fn name_is_fine(&mut self, name: &str) {
        for (part, what) in FORBIDDEN {
            if name.contains(part) {
                self.findings.insert(format!("{what}: {name}"));
            }
        }
    }

    /// A jump through a register: a long jump of the linker, or a finding.
    fn jump(&mut self, function: &Function, name: &str, at: u64, callees: &mut BTreeSet<u64>) {
        let target = function.names.iter().find_map(|name| {
            LONG_JUMPS
                .iter()
                .find_map(|prefix| name.strip_prefix(prefix))
        });
        match target {
            Some(target) => {
                let plain = format!("{:#}", rustc_demangle::demangle(target));
                match self.image.function(&plain) {
                    Some(callee) => _ = callees.insert(callee.range.start),
                    None => self.name_is_fine(&plain),
                }
            }
            None => {
                self.findings
                    .insert(format!("{name} jumps through a register at {at:#x}"));
            }
        }
    }
}

/// Where an instruction leads.
#[derive(Debug, PartialEq)]
enum Step {
    On,
    To(u64),
    Anywhere,
    Masks,
    Traps,
}

fn look(at: u64, first: u16, second: u16) -> Step {
    let here = at.wrapping_add(4);
    let to = |offset: i64| Step::To(here.wrapping_add_signed(offset));
    let narrow = first >> 11 < 0b11101;
    match first {
        // b<c> and b of one halfword; conditions 14 and 15 are udf and svc.
        _ if first >> 12 == 0b1101 && (first >> 8) & 15 < 14 => {
            to(i64::from(first as u8 as i8) * 2)
        }
        _ if narrow && first >> 11 == 0b11100 => to(signed(u32::from(first & 0x7ff), 11) * 2),
        _ if first >> 8 == 0xde => Step::Traps,
        // bx and blx, but for the return through lr.
        _ if first & 0xff07 == 0x4700 && first != 0x4770 => Step::Anywhere,
        // mov pc, register.
        _ if first & 0xff87 == 0x4687 => Step::Anywhere,
        // cpsid
        _ if first & 0xfff0 == 0xb670 => Step::Masks,
        _ if narrow => Step::On,
        // msr PRIMASK, BASEPRI, BASEPRI_MAX, FAULTMASK
        _ if first & 0xfff0 == 0xf380
            && second >> 8 == 0x88
            && (16..20).contains(&(second & 0xff)) =>
        {
            Step::Masks
        }
        // udf of two halfwords
        _ if first & 0xfff0 == 0xf7f0 && second & 0xf000 == 0xa000 => Step::Traps,
        // ldr pc
        _ if first & 0xff70 == 0xf850 && second >> 12 == 15 => Step::Anywhere,
        _ if first >> 11 == 0b11110 && second >> 15 == 1 => {
            wide_branch(first, second).map_or(Step::On, to)
        }
        _ => Step::On,
    }
}

/// Offset of bl, b and b<c> of two halfwords.
fn wide_branch(first: u16, second: u16) -> Option<i64> {
    let (first, second) = (u32::from(first), u32::from(second));
    let s = (first >> 10) & 1;
    let (j1, j2) = ((second >> 13) & 1, (second >> 11) & 1);
    match (second >> 12) & 0b101 {
        // b (x0x1) and bl (x1x1)
        0b001 | 0b101 => {
            let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
            let bits =
                s << 24 | i1 << 23 | i2 << 22 | (first & 0x3ff) << 12 | (second & 0x7ff) << 1;
            Some(signed(bits, 25))
        }
        // b<c>; the conditions 14 and 15 are other instructions.
        0b000 if (first >> 7) & 7 != 7 => {
            let bits = s << 20 | j2 << 19 | j1 << 18 | (first & 0x3f) << 12 | (second & 0x7ff) << 1;
            Some(signed(bits, 21))
        }
        _ => None,
    }
}

fn signed(bits: u32, width: u32) -> i64 {
    let shift = 32 - width;
    i64::from((bits << shift).cast_signed() >> shift)
}

/// Bytes by which an instruction moves the stack down.
fn stack_bytes(first: u16, second: u16) -> u64 {
    let registers = |list: u16| u64::from(list.count_ones()) * 4;
    match first {
        // push of one halfword, lr in bit 8; push of two; sub sp of one
        _ if first & 0xfe00 == 0xb400 => registers(first & 0x1ff),
        0xe92d => registers(second),
        _ if first & 0xff80 == 0xb080 => u64::from(first & 0x7f) * 4,
        // sub.w sp, sp, #constant
        _ if first & 0xfbff == 0xf1ad && (second >> 8) & 15 == 13 => expanded(first, second),
        // subw sp, sp, #constant
        _ if first & 0xfbff == 0xf2ad && (second >> 8) & 15 == 13 => {
            u64::from((first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xff)
        }
        // str with write-back to sp, as push of one register
        0xf84d if second & 0x0fff == 0x0d04 => 4,
        // vpush: a word for each in the list
        _ if first & 0xffbf == 0xed2d => u64::from(second & 0xff) * 4,
        _ => 0,
    }
}

/// The constant of a data-processing instruction.
fn expanded(first: u16, second: u16) -> u64 {
    let code = (u32::from(first) >> 10 & 1) << 11
        | (u32::from(second) >> 12 & 7) << 8
        | u32::from(second & 0xff);
    let byte = code & 0xff;
    u64::from(match code >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte * 0x0101_0101,
        _ => (0x80 | code & 0x7f).rotate_right(code >> 7),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn follows_branches() {
        // From a listing: 10000022 ittt; 1000001e bmi 0x10000030; 1000002e b 0x1000003c.
        assert_eq!(look(0x1000_001e, 0xd407, 0), Step::To(0x1000_0030));
        assert_eq!(look(0x1000_002e, 0xe005, 0), Step::To(0x1000_003c));
        // bl to itself: offset -4.
        assert_eq!(look(0x100, 0xf7ff, 0xfffe), Step::To(0x100));
        // beq.w 0x106 at 0x100; b.w 0x106.
        assert_eq!(look(0x100, 0xf000, 0x8001), Step::To(0x106));
        assert_eq!(look(0x100, 0xf000, 0xb801), Step::To(0x106));
    }

    #[test]
    fn sees_what_must_not_be() {
        assert_eq!(look(0, 0x4770, 0), Step::On, "bx lr");
        assert_eq!(look(0, 0x4718, 0), Step::Anywhere, "bx r3");
        assert_eq!(look(0, 0x4798, 0), Step::Anywhere, "blx r3");
        assert_eq!(look(0, 0xdefe, 0), Step::Traps, "udf");
        assert_eq!(look(0, 0xb672, 0), Step::Masks, "cpsid i");
        assert_eq!(look(0, 0xf380, 0x8811), Step::Masks, "msr BASEPRI, r0");
        assert_eq!(look(0, 0xf3ef, 0x8011), Step::On, "mrs r0, BASEPRI");
        assert_eq!(look(0, 0xf3bf, 0x8f5f), Step::On, "dmb sy");
    }

    #[test]
    fn adds_up_the_stack() {
        assert_eq!(stack_bytes(0xb5f0, 0), 20, "push r4-r7, lr");
        assert_eq!(stack_bytes(0xe92d, 0x0f00), 16, "push.w r8-r11");
        assert_eq!(stack_bytes(0xb081, 0), 4, "sub sp, #4");
        assert_eq!(stack_bytes(0xed2d, 0x8b08), 32, "vpush d8-d11");
        assert_eq!(stack_bytes(0xf5ad, 0x7d00), 512, "sub.w sp, sp, #512");
        assert_eq!(stack_bytes(0xf84d, 0xbd04), 4, "str r11, [sp, #-4]!");
    }
}
