//! Exception entry and return of ARMv7-M, which the engine leaves to its user: the frame on the stack, the floating
//! point part included, and EXC_RETURN.

use unicorn_engine::{RegisterARM, Unicorn, uc_error};

const CORE: [RegisterARM; 7] = [
    RegisterARM::R0,
    RegisterARM::R1,
    RegisterARM::R2,
    RegisterARM::R3,
    RegisterARM::R12,
    RegisterARM::LR,
    RegisterARM::PC,
];
const FLOAT: [RegisterARM; 8] = [
    RegisterARM::D0,
    RegisterARM::D1,
    RegisterARM::D2,
    RegisterARM::D3,
    RegisterARM::D4,
    RegisterARM::D5,
    RegisterARM::D6,
    RegisterARM::D7,
];
/// CONTROL.FPCA: floating point is in use, so its registers belong to the frame.
const FPCA: u64 = 4;
/// CONTROL.SPSEL: thread mode runs on the process stack. The image never does.
const SPSEL: u64 = 2;
/// xPSR bit that says that the frame was aligned by a word.
const ALIGNED: u32 = 1 << 9;
/// EXC_RETURN bit that is clear with a floating point frame.
const BASIC_FRAME: u32 = 1 << 4;

/// Takes an exception: pushes the frame and starts the handler.
///
/// # Errors
/// The engine's: a stack outside memory.
pub fn enter<D>(uc: &mut Unicorn<'_, D>, exception: usize, vectors: u32) -> Result<(), uc_error> {
    let control = uc.reg_read(RegisterARM::CONTROL)?;
    if control & SPSEL != 0 {
        return Err(uc_error::EXCEPTION);
    }
    let extended = control & FPCA != 0;
    let handler_mode = uc.reg_read(RegisterARM::IPSR)? != 0;
    let stack = uc.reg_read(RegisterARM::SP)? as u32;
    let size = if extended { 104 } else { 32 };
    let aligned = stack & 4;
    let frame = (stack & !4) - size;
    let mut bytes = Vec::with_capacity(104);
    for register in CORE {
        bytes.extend((uc.reg_read(register)? as u32).to_le_bytes());
    }
    let xpsr = uc.reg_read(RegisterARM::XPSR)? as u32;
    bytes.extend((xpsr & !ALIGNED | aligned << 7).to_le_bytes());
    if extended {
        for register in FLOAT {
            bytes.extend(uc.reg_read(register)?.to_le_bytes());
        }
        bytes.extend((uc.reg_read(RegisterARM::FPSCR)? as u32).to_le_bytes());
        bytes.extend([0; 4]);
        uc.reg_write(RegisterARM::CONTROL, control & !FPCA)?;
    }
    uc.mem_write(u64::from(frame), &bytes)?;
    uc.reg_write(RegisterARM::SP, u64::from(frame))?;
    let back =
        0xffff_ffe1 | if handler_mode { 0 } else { 8 } | if extended { 0 } else { BASIC_FRAME };
    uc.reg_write(RegisterARM::LR, u64::from(back))?;
    // A handler starts outside any IT block, with its own number in IPSR.
    let thumb = 1 << 24;
    uc.reg_write(RegisterARM::XPSR, thumb | exception as u64)?;
    let mut vector = [0; 4];
    uc.mem_read(u64::from(vectors) + 4 * exception as u64, &mut vector)?;
    uc.reg_write(RegisterARM::PC, u64::from(u32::from_le_bytes(vector)))
}

/// Returns from an exception with the EXC_RETURN value that the handler branched to.
///
/// # Errors
/// The engine's: a stack outside memory, or a value that means another stack.
pub fn leave<D>(uc: &mut Unicorn<'_, D>, back: u32) -> Result<(), uc_error> {
    if back & 4 != 0 {
        return Err(uc_error::EXCEPTION);
    }
    let extended = back & BASIC_FRAME == 0;
    let frame = uc.reg_read(RegisterARM::SP)? as u32;
    let size = if extended { 104 } else { 32 };
    let bytes = uc.mem_read_as_vec(u64::from(frame), size as usize)?;
    let word = |i: usize| {
        u32::from_le_bytes([
            bytes[4 * i],
            bytes[4 * i + 1],
            bytes[4 * i + 2],
            bytes[4 * i + 3],
        ])
    };
    let xpsr = word(7);
    uc.reg_write(RegisterARM::XPSR, u64::from(xpsr & !ALIGNED))?;
    for (i, register) in CORE.into_iter().enumerate() {
        // Thumb, always.
        let thumb = u32::from(register == RegisterARM::PC);
        uc.reg_write(register, u64::from(word(i) | thumb))?;
    }
    if extended {
        for (i, register) in FLOAT.into_iter().enumerate() {
            let value = u64::from(word(8 + 2 * i)) | u64::from(word(9 + 2 * i)) << 32;
            uc.reg_write(register, value)?;
        }
        uc.reg_write(RegisterARM::FPSCR, u64::from(word(24)))?;
    }
    let control = uc.reg_read(RegisterARM::CONTROL)? & !FPCA;
    let fpca = if extended { FPCA } else { 0 };
    uc.reg_write(RegisterARM::CONTROL, control | fpca)?;
    let aligned = if xpsr & ALIGNED != 0 { 4 } else { 0 };
    uc.reg_write(RegisterARM::SP, u64::from(frame + size + aligned))
}
