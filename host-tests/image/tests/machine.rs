//! The emulated processor itself, on code written by hand.

use bristle_image::machine::RAM;
use bristle_image::pins::Still;
use bristle_image::{Image, Machine, Stop};

/// Where the code starts: after all vectors.
const CODE: usize = 0x200;
/// Where the handler of TIM7 is.
const HANDLER: usize = 0x300;

/// An image with a stack, the code and the handler of TIM7.
fn image(code: &[u16], handler: &[u16]) -> Image {
    let mut flash = vec![0; 0x400];
    let mut put = |at: usize, bytes: &[u8]| flash[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &(RAM.0 as u32 + 0x1000).to_le_bytes());
    put(4, &(0x0800_0001 + CODE as u32).to_le_bytes());
    put(4 * (16 + 55), &(0x0800_0001 + HANDLER as u32).to_le_bytes());
    let bytes = |code: &[u16]| -> Vec<u8> { code.iter().flat_map(|h| h.to_le_bytes()).collect() };
    put(CODE, &bytes(code));
    put(HANDLER, &bytes(handler));
    Image::of_code(&flash)
}

fn start(code: &[u16], handler: &[u16]) -> Machine {
    Machine::new(&image(code, handler), Box::new(Still)).unwrap()
}

/// `movw` and `movt` of a 32-bit constant into a low register.
fn load(register: u16, value: u32) -> [u16; 4] {
    let half = |op: u16, v: u16| {
        let first = op | v >> 12 | (v >> 11 & 1) << 10;
        [first, (v >> 8 & 7) << 12 | register << 8 | v & 0xff]
    };
    let [a, b] = half(0xf240, value as u16);
    let [c, d] = half(0xf2c0, (value >> 16) as u16);
    [a, b, c, d]
}

/// `str r1, [r0]` after loading address and value.
fn store(address: u32, value: u32) -> Vec<u16> {
    [&load(0, address)[..], &load(1, value), &[0x6001]].concat()
}

/// Lets TIM7's interrupt through and starts TIM7 at its reset period, 65,536 cycles.
fn enable_tick() -> Vec<u16> {
    [
        store(0xe000_e104, 1 << 23),
        store(0x4000_140c, 1),
        store(0x4000_1400, 1),
    ]
    .concat()
}

/// Counts in RAM and clears the timer's flag; uses a floating point register.
fn counting_handler() -> Vec<u16> {
    [
        store(0x4000_1410, 0),
        load(0, RAM.0 as u32).to_vec(),
        // ldr r1, [r0]; adds r1, #1; str r1, [r0]; vmov s0, r1; movs r0, #0; bx lr
        vec![0x6801, 0x3101, 0x6001, 0xee00, 0x1a10, 0x2000, 0x4770],
    ]
    .concat()
}

#[test]
fn a_register_without_a_model_fails_with_its_name() {
    let mut machine = start(&[store(0x5000_0810, 1), vec![0xe7fe]].concat(), &[]);
    let Err(Stop::Fault(text)) = machine.run_until(1000) else {
        panic!("went on")
    };
    assert!(text.contains("DAC1 offset 0x10 (DHR8R[0])"), "{text}");
}

#[test]
fn a_panic_stops_the_run() {
    let mut machine = start(&[0xde00], &[]);
    assert!(matches!(machine.run_until(1000), Err(Stop::Fault(_))));
}

#[test]
fn sleeps_between_interrupts_and_counts_time() {
    // wfe; b to wfe
    let code = [enable_tick(), vec![0xbf20, 0xe7fd]].concat();
    let mut machine = start(&code, &counting_handler());
    machine.run_until(10 * 65_536 + 1000).unwrap();
    assert_eq!(machine.word(RAM.0 as u32), Ok(10));
    let cost = machine.cost(55);
    // Three pairs of movw and movt, a store, and six more.
    assert_eq!((cost.runs, cost.most_instructions), (10, 13));
}

#[test]
fn an_interrupt_leaves_all_registers_as_they_were() {
    // A loop that counts in r0, and in s0 as a float, until they differ.
    let code = [
        enable_tick(),
        // movs r0, #0; movs r2, #0
        vec![0x2000, 0x2200],
        // Loop: adds r0, #1; vmov s0, r0; b to the next, since interrupts are taken between blocks.
        vec![0x3001, 0xee00, 0x0a10, 0xe7ff],
        // vcvt.f32.s32 s1, s0; vcvt.s32.f32 s1, s1; vmov r1, s1; cmp r0, r1; vmov r1, s0
        vec![
            0xeef8, 0x0ac0, 0xeefd, 0x0ae0, 0xee10, 0x1a90, 0x4288, 0xee10, 0x1a10,
        ],
        // it ne; movne r2, #1; cmp r0, r1; it ne; movne r2, #1
        vec![0xbf18, 0x2201, 0x4288, 0xbf18, 0x2201],
        // lsls r3, r0, #12; bne to the loop; movs r0, #0, so that the count stays exact in a float; b to the loop
        vec![0x0303, 0xd1eb, 0x2000, 0xe7e9],
    ]
    .concat();
    let code = [float_on(), code].concat();
    let mut machine = start(&code, &counting_handler());
    machine.run_until(50 * 65_536 + 1000).unwrap();
    assert_eq!(machine.word(RAM.0 as u32), Ok(50));
    assert_eq!(machine.register(2), 0, "a register changed under the loop");
    assert!(machine.register(0) > 0);
}

/// CPACR, as the start-up code does.
fn float_on() -> Vec<u16> {
    store(0xe000_ed88, 0xf << 20)
}

#[test]
fn a_mask_holds_the_interrupt_back() {
    // cpsid i, then a loop.
    let code = [vec![0xb672], enable_tick(), vec![0xe7fe]].concat();
    let mut machine = start(&code, &counting_handler());
    machine.run_until(3 * 65_536).unwrap();
    assert_eq!(machine.word(RAM.0 as u32), Ok(0));
}

#[test]
fn the_watchdog_resets() {
    // Start it at its shortest: PR 0, RLR 0x10, about 2 ms.
    let code = [
        store(0x4000_3008, 0x10),
        store(0x4000_3000, 0xcccc),
        vec![0xe7fe],
    ]
    .concat();
    let mut machine = start(&code, &[]);
    let stop = machine.run_until(10_000_000);
    assert_eq!(
        stop,
        Err(Stop::Reset(bristle_image::clocks::Cause::Watchdog))
    );
    // 17 counts of 4 LSI periods of 5312.5 cycles.
    let due = 17.0 * 4.0 * 5312.5;
    assert!((machine.cycles() as f64 - due).abs() < 100.0);
}
