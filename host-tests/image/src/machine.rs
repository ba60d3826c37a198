//! The processor: memory map, time, sleep, exceptions, reset.

use crate::bus::Bus;
use crate::clocks::Cause;
use crate::cost::Cost;
use crate::cycles;
use crate::elf::Image;
use crate::exceptions;
use crate::interrupts::COUNT;
use crate::pins::World;
use unicorn_engine::{Arch, ArmCpuModel, Mode, Prot, RegisterARM, Unicorn, uc_error};

/// Start and size of the memories; see memory.x.
pub const FLASH: (u64, u64) = (0x0800_0000, 512 * 1024);
/// See [`FLASH`].
pub const RAM: (u64, u64) = (0x2000_0000, 96 * 1024);
/// See [`FLASH`].
pub const CCM: (u64, u64) = (0x1000_0000, 32 * 1024);
/// Peripherals, and the core's own registers.
const MMIO: [(u64, u64); 3] = [
    (0x4000_0000, 0x0003_0000),
    (0x4800_0000, 0x0900_0000),
    (0xe000_0000, 0x0010_0000),
];
/// An address where no code is.
const NOWHERE: u64 = 0xe000_0000;
const WFE: u16 = 0xbf20;
const WFI: u16 = 0xbf30;
const SEV: u16 = 0xbf40;
/// The engine's number of the exception that a branch to EXC_RETURN raises.
const EXCEPTION_EXIT: u32 = 8;

/// Bits of xPSR that say how far an IT block has got.
const IT_STATE: u32 = 0x0600_fc00;

/// Why a run ended other than by time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// A register that is not modelled, a fault, an undefined instruction (which is how a panic ends).
    Fault(String),
    /// The chip was reset and is at its first instruction.
    Reset(Cause),
}

#[derive(Clone, Copy, Default)]
struct Block {
    address: u32,
    size: u32,
    instructions: u32,
    cycles: u32,
}

/// Blocks whose cost is remembered; a power of two.
const BLOCKS: usize = 1 << 14;

struct Core {
    bus: Bus,
    cycles: u64,
    instructions: u64,
    deadline: u64,
    /// An exception waits behind a mask: look again after every block.
    impatient: bool,
    /// A block has run since the engine was entered.
    begun: bool,
    /// Where the last block ended; 0 where the refill that follows belongs to something else.
    last_end: u32,
    blocks: Vec<Block>,
    raised: Option<u32>,
    event: bool,
}

impl Core {
    fn now(&mut self) -> &mut Bus {
        self.bus.now = self.bus.now.max(self.cycles);
        &mut self.bus
    }
}

struct Running {
    exception: usize,
    instructions: u64,
    cycles: u64,
}

/// A chip with an image in it.
pub struct Machine {
    uc: Unicorn<'static, Core>,
    running: Vec<Running>,
    costs: Vec<Cost>,
    /// Of each exception together with the one that ended before it.
    chained: Vec<Cost>,
    /// Instructions and cycles of the one that ended last.
    ended: [u64; 2],
    sleeping: Option<u16>,
}

fn text(error: uc_error) -> String {
    format!("engine: {error:?}")
}

impl Machine {
    /// A chip at power on, with the image in flash.
    ///
    /// # Errors
    /// An engine that cannot be set up, an image outside memory.
    pub fn new(image: &Image, world: Box<dyn World>) -> Result<Self, String> {
        let core = Core {
            bus: Bus::new(world),
            cycles: 0,
            instructions: 0,
            deadline: 0,
            impatient: false,
            begun: false,
            last_end: 0,
            blocks: vec![Block::default(); BLOCKS],
            raised: None,
            event: false,
        };
        let mut uc = Unicorn::new_with_data(Arch::ARM, Mode::MCLASS, core).map_err(text)?;
        uc.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)
            .map_err(text)?;
        for (start, size) in [RAM, CCM] {
            uc.mem_map(start, size, Prot::ALL).map_err(text)?;
        }
        uc.mem_map(FLASH.0, FLASH.1, Prot::READ | Prot::EXEC)
            .map_err(text)?;
        for (address, bytes) in image.loads() {
            uc.mem_write(u64::from(*address), bytes)
                .map_err(|e| format!("load at {address:#x}: {e:?}"))?;
        }
        let mut machine = Self {
            uc,
            running: Vec::new(),
            costs: vec![Cost::default(); COUNT],
            chained: vec![Cost::default(); COUNT],
            ended: [0; 2],
            sleeping: None,
        };
        machine.hook(image).map_err(text)?;
        machine.start().map_err(text)?;
        Ok(machine)
    }

    fn hook(&mut self, image: &Image) -> Result<(), uc_error> {
        for (start, size) in MMIO {
            let base = start as u32;
            self.uc.mmio_map(
                start,
                size,
                Some(
                    move |uc: &mut Unicorn<'_, Core>, offset: u64, size: usize| {
                        let bus = uc.get_data_mut().now();
                        u64::from(bus.read(base + offset as u32, size))
                    },
                ),
                Some(
                    move |uc: &mut Unicorn<'_, Core>, offset: u64, size: usize, value: u64| {
                        // What the write sets off waits for the end of the block: an engine that is stopped here
                        // would do the write again.
                        uc.get_data_mut()
                            .now()
                            .write(base + offset as u32, size, value as u32);
                    },
                ),
            )?;
        }
        self.uc.add_block_hook(1, 0, |uc, address, size| {
            block(uc, address as u32, size);
        })?;
        self.uc.add_intr_hook(|uc, number| {
            uc.get_data_mut().raised = Some(number);
            let _ = uc.emu_stop();
        })?;
        // SEV is a no-op to the engine. Halfwords that look like it but are data never run.
        for (start, bytes) in image.loads() {
            for (i, pair) in bytes.chunks_exact(2).enumerate() {
                if pair == SEV.to_le_bytes() {
                    let at = u64::from(*start) + 2 * i as u64;
                    self.uc
                        .add_code_hook(at, at, |uc, _, _| uc.get_data_mut().event = true)?;
                }
            }
        }
        Ok(())
    }

    /// Loads the stack pointer and the first instruction's address from the vectors.
    fn start(&mut self) -> Result<(), uc_error> {
        let word = |uc: &Unicorn<'_, Core>, at| -> Result<u64, uc_error> {
            let mut bytes = [0; 4];
            uc.mem_read(at, &mut bytes)?;
            Ok(u64::from(u32::from_le_bytes(bytes)))
        };
        let stack = word(&self.uc, FLASH.0)?;
        let entry = word(&self.uc, FLASH.0 + 4)?;
        self.uc.reg_write(RegisterARM::XPSR, 1 << 24)?;
        self.uc.reg_write(RegisterARM::CONTROL, 0)?;
        self.uc.reg_write(RegisterARM::PRIMASK, 0)?;
        self.uc.reg_write(RegisterARM::BASEPRI, 0)?;
        self.uc.reg_write(RegisterARM::SP, stack)?;
        self.uc.reg_write(RegisterARM::PC, entry | 1)?;
        self.running.clear();
        self.sleeping = None;
        Ok(())
    }

    /// Peripherals and the world.
    pub fn bus(&mut self) -> &mut Bus {
        self.uc.get_data_mut().now()
    }

    /// Cycles since power on.
    pub fn cycles(&self) -> u64 {
        self.uc.get_data().cycles
    }

    /// A general register, R0 to R12.
    pub fn register(&self, index: i32) -> u32 {
        let first = RegisterARM::R0 as i32;
        self.uc.reg_read(first + index).unwrap_or(0) as u32
    }

    /// Calls a function with two arguments in core registers, with nothing else running, and gives its result and cost.
    ///
    /// # Errors
    /// A fault in it.
    pub fn call(&mut self, function: u32, arguments: [u32; 2]) -> Result<(u32, Cost), String> {
        let before = (self.instructions(), self.cycles());
        for (i, argument) in arguments.into_iter().enumerate() {
            let register = RegisterARM::R0 as i32 + i as i32;
            self.uc
                .reg_write(register, u64::from(argument))
                .map_err(text)?;
        }
        self.uc
            .reg_write(RegisterARM::LR, NOWHERE | 1)
            .map_err(text)?;
        let core = self.uc.get_data_mut();
        core.deadline = u64::MAX;
        core.impatient = false;
        core.bus.attention = false;
        core.begun = false;
        core.last_end = 0;
        let result = self.uc.emu_start(u64::from(function | 1), NOWHERE, 0, 0);
        if let Some(fault) = self.uc.get_data().bus.fault.clone() {
            return Err(fault);
        }
        result.map_err(|e| format!("{e:?} at {:#x}", self.pc()))?;
        if u64::from(self.pc()) != NOWHERE {
            return Err(format!("stopped at {:#x}", self.pc()));
        }
        let (instructions, cycles) = (
            self.instructions() - before.0,
            // The return is a taken branch.
            self.cycles() - before.1 + u64::from(cycles::REFILL),
        );
        let cost = Cost {
            runs: 1,
            instructions,
            most_instructions: instructions,
            cycles,
            most_cycles: cycles,
            last_instructions: instructions,
        };
        Ok((self.register(0), cost))
    }

    /// Where the program is.
    pub fn pc(&self) -> u32 {
        self.uc.reg_read(RegisterARM::PC).unwrap_or(0) as u32
    }

    /// Instructions since power on.
    pub fn instructions(&self) -> u64 {
        self.uc.get_data().instructions
    }

    /// What an interrupt's handler cost so far.
    pub fn cost(&self, interrupt: usize) -> Cost {
        self.costs[16 + interrupt]
    }

    /// What an interrupt's handler cost so far together with the handler that ended before it.
    pub fn cost_with_the_one_before(&self, interrupt: usize) -> Cost {
        self.chained[16 + interrupt]
    }

    /// Forgets the costs so far.
    pub fn clear_costs(&mut self) {
        self.costs.fill(Cost::default());
        self.chained.fill(Cost::default());
    }

    /// Reads memory as a debug probe would.
    ///
    /// # Errors
    /// An address outside memory.
    pub fn read(&self, at: u32, bytes: &mut [u8]) -> Result<(), String> {
        self.uc.mem_read(u64::from(at), bytes).map_err(text)
    }

    /// Writes memory as a debug probe would.
    ///
    /// # Errors
    /// An address outside memory.
    pub fn write(&mut self, at: u32, bytes: &[u8]) -> Result<(), String> {
        self.uc.mem_write(u64::from(at), bytes).map_err(text)
    }

    /// Reads a word of memory.
    ///
    /// # Errors
    /// An address outside memory.
    pub fn word(&self, at: u32) -> Result<u32, String> {
        let mut bytes = [0; 4];
        self.read(at, &mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    /// Runs up to the tick timer's next overflow, or to a cycle if that comes first.
    ///
    /// # Errors
    /// Why it could not.
    pub fn run_tick(&mut self, at_most: u64) -> Result<(), Stop> {
        let now = self.cycles();
        let next = self.bus().timers[crate::timer::TICK].next_event(now);
        self.run_until(next.unwrap_or(u64::MAX).min(at_most))
    }

    /// Runs until a cycle.
    ///
    /// # Errors
    /// Why it could not.
    pub fn run_until(&mut self, cycle: u64) -> Result<(), Stop> {
        loop {
            self.catch_up()?;
            if self.cycles() >= cycle {
                return Ok(());
            }
            let fault = |e| Stop::Fault(text(e));
            self.take_exceptions().map_err(fault)?;
            let core = self.uc.get_data_mut();
            let next = core.bus.next_event().unwrap_or(u64::MAX).min(cycle);
            if let Some(how) = self.sleeping {
                if core.bus.interrupts.wakes() || how == WFE && core.event {
                    core.event = false;
                    self.sleeping = None;
                } else {
                    core.cycles = next;
                    continue;
                }
            }
            core.deadline = next;
            core.raised = None;
            core.begun = false;
            core.bus.attention = false;
            self.execute()?;
        }
    }

    /// Peripherals up to now; resets.
    fn catch_up(&mut self) -> Result<(), Stop> {
        let core = self.uc.get_data_mut();
        let cycles = core.cycles;
        core.bus.advance(cycles);
        if let Some(fault) = core.bus.fault.clone() {
            return Err(Stop::Fault(fault));
        }
        let cause = if core.bus.watchdog_expired() {
            Cause::Watchdog
        } else if core.bus.reset_asked {
            Cause::Software
        } else {
            return Ok(());
        };
        core.bus.reset(cause);
        self.start().map_err(|e| Stop::Fault(text(e)))?;
        Err(Stop::Reset(cause))
    }

    fn take_exceptions(&mut self) -> Result<(), uc_error> {
        self.uc.get_data_mut().impatient = false;
        while let Some(exception) = self.uc.get_data().bus.interrupts.next() {
            let primask = self.uc.reg_read(RegisterARM::PRIMASK)? & 1 != 0;
            let basepri = self.uc.reg_read(RegisterARM::BASEPRI)? as u8;
            // Inside an IT block the frame would have to hold its state; the next block of code will do.
            let conditional = self.uc.reg_read(RegisterARM::XPSR)? as u32 & IT_STATE != 0;
            let core = self.uc.get_data_mut();
            if conditional || !core.bus.interrupts.allowed(exception, primask, basepri) {
                core.impatient = true;
                return Ok(());
            }
            // Flash appears at zero too, where the vectors are until software moves them.
            let vectors = match core.bus.vectors() {
                0 => FLASH.0 as u32,
                moved => moved,
            };
            exceptions::enter(&mut self.uc, exception, vectors)?;
            let core = self.uc.get_data_mut();
            core.bus.interrupts.enter(exception);
            core.cycles += u64::from(cycles::ENTRY);
            core.last_end = 0;
            core.event = true;
            self.sleeping = None;
            self.running.push(Running {
                exception,
                instructions: core.instructions,
                cycles: core.cycles,
            });
        }
        Ok(())
    }

    fn execute(&mut self) -> Result<(), Stop> {
        let fault = |e| Stop::Fault(text(e));
        let pc = self.uc.reg_read(RegisterARM::PC).map_err(fault)?;
        let result = self.uc.emu_start(pc | 1, NOWHERE, 0, 0);
        let pc = self.uc.reg_read(RegisterARM::PC).map_err(fault)? as u32;
        if let Some(fault) = self.uc.get_data().bus.fault.clone() {
            return Err(Stop::Fault(format!("{fault}; near {pc:#x}")));
        }
        match self.uc.get_data().raised {
            Some(EXCEPTION_EXIT) => return self.leave(pc).map_err(fault),
            Some(number) => {
                let what = format!("exception {number} of the engine near {pc:#x}");
                return Err(Stop::Fault(what));
            }
            None => {}
        }
        let mut before = [0; 2];
        let _ = self.uc.mem_read(u64::from(pc & !1) - 2, &mut before);
        let before = u16::from_le_bytes(before);
        let slept = before == WFE && result == Err(uc_error::INSN_INVALID);
        if slept || before == WFI && result.is_ok() {
            self.sleeping = Some(before);
            return Ok(());
        }
        result.map_err(|e| Stop::Fault(format!("{e:?} at {pc:#x}")))
    }

    fn leave(&mut self, back: u32) -> Result<(), uc_error> {
        exceptions::leave(&mut self.uc, back)?;
        let core = self.uc.get_data_mut();
        let Some(done) = self.running.pop() else {
            return Err(uc_error::EXCEPTION);
        };
        core.bus.interrupts.leave(done.exception);
        let instructions = core.instructions - done.instructions;
        let cycles = core.cycles - done.cycles;
        self.costs[done.exception].count(instructions, cycles);
        let before = std::mem::replace(&mut self.ended, [instructions, cycles]);
        self.chained[done.exception].count(instructions + before[0], cycles + before[1]);
        core.cycles += u64::from(cycles::EXIT);
        core.last_end = 0;
        core.event = true;
        Ok(())
    }
}

/// A block of code is about to run: its time passes, or the engine comes back first.
fn block(uc: &mut Unicorn<'_, Core>, address: u32, size: u32) {
    let core = uc.get_data_mut();
    if core.cycles >= core.deadline || core.begun && (core.impatient || core.bus.attention) {
        let _ = uc.emu_stop();
        return;
    }
    let slot = (address >> 1) as usize & (BLOCKS - 1);
    let mut known = core.blocks[slot];
    if known.address != address || known.size != size {
        let code = uc
            .mem_read_as_vec(u64::from(address), size as usize)
            .unwrap_or_default();
        let (instructions, cycles) = cycles::stretch(&code);
        known = Block {
            address,
            size,
            instructions,
            cycles,
        };
        uc.get_data_mut().blocks[slot] = known;
    }
    let core = uc.get_data_mut();
    if core.last_end != 0 && core.last_end != address {
        core.cycles += u64::from(cycles::REFILL);
    }
    core.begun = true;
    core.last_end = address + size;
    core.cycles += u64::from(known.cycles);
    core.instructions += u64::from(known.instructions);
}
