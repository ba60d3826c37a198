//! Everything at an address that is not memory. A register that is not in the table fails the run with its name.

use crate::clocks;
use crate::interrupts::{Interrupts, PENDSV, SYSTICK};
use crate::names;
use crate::pins::{Dac, EncoderCounter, Inputs, Outputs, Still, World};
use crate::registers::{MODELLED, Model, PORT, PORTS};
use crate::timer::{TICK, TIME, Timer};
use crate::watchdog::Watchdog;
use std::collections::HashMap;

/// Interrupt controller's registers.
const NVIC: u32 = 0xe000_e100;

/// Peripherals, time, and the world.
pub struct Bus {
    /// Cycles since power on.
    pub now: u64,
    /// TIM7 and TIM15.
    pub timers: [Timer; 2],
    /// TIM2.
    pub encoder: EncoderCounter,
    /// DAC1.
    pub dac: Dac,
    /// IWDG.
    pub watchdog: Watchdog,
    /// NVIC.
    pub interrupts: Interrupts,
    /// What is behind the pins.
    pub world: Box<dyn World>,
    /// What went wrong; the run ends.
    pub fault: Option<String>,
    /// A write asks the engine to come back, since an exception may be due.
    pub attention: bool,
    /// Software asked for a reset.
    pub reset_asked: bool,
    /// Ticks that the timer made.
    pub ticks: u64,
    models: HashMap<u32, (Model, usize)>,
    words: Vec<u32>,
    reset_values: Vec<u32>,
    odr: [usize; 7],
    inputs: Inputs,
    tick_line: usize,
    time_line: usize,
    hold_ticks_until: u64,
}

impl Default for Bus {
    fn default() -> Self {
        Self::new(Box::new(Still))
    }
}

impl Bus {
    /// A chip at power on.
    pub fn new(world: Box<dyn World>) -> Self {
        let mut models = HashMap::new();
        let mut values = Vec::new();
        let mut add = |at: u32, model: Model, value: u32| {
            models.insert(at, (model, values.len()));
            values.push(value);
            values.len() - 1
        };
        for (peripheral, registers) in MODELLED {
            for &(name, model, value) in *registers {
                add(names::address(peripheral, name), model, value);
            }
        }
        let odr = std::array::from_fn(|port| {
            let mut odr = 0;
            for &(name, value) in PORT {
                let index = add(names::address(PORTS[port], name), Model::Word, value);
                if name == "ODR" {
                    odr = index;
                }
            }
            add(
                names::address(PORTS[port], "IDR"),
                Model::PortInput(port),
                0,
            );
            add(names::address(PORTS[port], "BSRR"), Model::PortSet(port), 0);
            odr
        });
        let mut bus = Self {
            now: 0,
            timers: Default::default(),
            encoder: EncoderCounter::default(),
            dac: Dac::default(),
            watchdog: Watchdog::default(),
            interrupts: Interrupts::default(),
            world,
            fault: None,
            attention: false,
            reset_asked: false,
            ticks: 0,
            models,
            reset_values: values.clone(),
            words: values,
            odr,
            inputs: Inputs::default(),
            tick_line: names::interrupt("TIM7_DAC"),
            time_line: names::interrupt("TIM1_BRK_TIM15"),
            hold_ticks_until: 0,
        };
        bus.reset(clocks::Cause::Power);
        bus
    }

    /// Resets every peripheral, and keeps the cause.
    pub fn reset(&mut self, cause: clocks::Cause) {
        self.words.copy_from_slice(&self.reset_values);
        let csr = self.models[&names::address("RCC", "CSR")].1;
        self.words[csr] = cause as u32;
        self.timers = Default::default();
        self.encoder = EncoderCounter::default();
        self.dac = Dac::default();
        self.watchdog = Watchdog::default();
        self.interrupts = Interrupts::default();
        self.reset_asked = false;
    }

    /// Levels that the ports put out.
    pub fn ports(&self) -> [u16; 7] {
        self.odr.map(|i| self.words[i] as u16)
    }

    /// Keeps the tick's interrupt from the processor until a cycle, as a longer handler of its priority would.
    pub fn hold_tick_until(&mut self, cycle: u64) {
        self.hold_ticks_until = cycle;
    }

    /// The cycle of the tick timer's next overflow.
    pub fn next_tick(&self) -> Option<u64> {
        self.timers[TICK].next_event(self.now)
    }

    /// The next cycle at which something happens by itself.
    pub fn next_event(&self) -> Option<u64> {
        let timers = self.timers.iter().filter_map(|t| t.next_event(self.now));
        let held = (self.hold_ticks_until > self.now).then_some(self.hold_ticks_until);
        timers.chain(self.watchdog.expires()).chain(held).min()
    }

    /// Whether the watchdog has run out.
    pub fn watchdog_expired(&self) -> bool {
        self.watchdog.expires().is_some_and(|at| at <= self.now)
    }

    /// Time passes.
    pub fn advance(&mut self, to: u64) {
        while let Some(at) = self.next_event().filter(|&at| at <= to) {
            self.now = at.max(self.now);
            if self.timers[TICK].fire(at) {
                self.ticks += 1;
                self.tick();
            }
            self.timers[TIME].fire(at);
            if self.watchdog_expired() {
                return;
            }
        }
        self.now = to.max(self.now);
        self.lines();
    }

    /// The tick's timer overflows: the interval that ends here saw the old output, then the converter takes the new.
    fn tick(&mut self) {
        let outputs = Outputs {
            dac: self.dac.code(),
            ports: self.ports(),
        };
        self.inputs = self.world.advance(&outputs);
        self.encoder.take(&self.inputs);
        self.dac.trigger();
    }

    fn lines(&mut self) {
        if self.now >= self.hold_ticks_until {
            let tick = self.timers[TICK].line();
            self.interrupts.line(self.tick_line, tick);
        }
        let time = self.timers[TIME].line();
        self.interrupts.line(self.time_line, time);
    }

    /// Reads `size` bytes.
    pub fn read(&mut self, at: u32, size: usize) -> u32 {
        let base = at & !3;
        let value = if (NVIC..NVIC + 0x400).contains(&at) {
            self.interrupts.read(base - NVIC)
        } else {
            self.models
                .get(&base)
                .copied()
                .map(|(model, index)| self.read_model(model, index))
        };
        let Some(value) = value else {
            self.not_modelled("read of", at);
            return 0;
        };
        let shifted = value >> (8 * (at & 3));
        if size >= 4 {
            shifted
        } else {
            shifted & ((1 << (8 * size)) - 1)
        }
    }

    fn read_model(&self, model: Model, index: usize) -> u32 {
        match model {
            Model::Timer(i, register) => self.timers[i].read(register, self.now),
            Model::EncoderControl => self.encoder.control,
            Model::EncoderFlags => self.encoder.flags,
            Model::EncoderCount => self.encoder.count,
            Model::EncoderCapture => self.encoder.capture,
            Model::EncoderIndex => self.encoder.index_control,
            Model::DacControl => self.dac.control,
            Model::DacHold => u32::from(self.dac.holding),
            Model::DacOutput => u32::from(self.dac.output),
            Model::PortInput(port) => u32::from(self.inputs.ports[port]),
            Model::PortSet(_) => 0,
            Model::Watchdog(register) => self.watchdog.read(register),
            Model::SystemPriority(first) => self.interrupts.system_priority(first / 4),
            Model::Cycles => self.now as u32,
            Model::Word | Model::Rcc(_) | Model::Icsr | Model::Reset => self.words[index],
        }
    }

    /// Writes `size` bytes.
    pub fn write(&mut self, at: u32, size: usize, value: u32) {
        self.attention = true;
        if (NVIC..NVIC + 0x400).contains(&at) {
            if !self.interrupts.write(at - NVIC, size, value) {
                self.not_modelled("write to", at);
            }
            return;
        }
        let base = at & !3;
        let Some(&(model, index)) = self.models.get(&base) else {
            self.not_modelled("write to", at);
            return;
        };
        if let Model::SystemPriority(first) = model {
            let first = first + (at & 3) as usize;
            self.interrupts.set_system_priority(first, size, value);
            return;
        }
        // The bus copies a narrow write to the other lanes; only registers of 16 bits and less are written so.
        let value = if size == 4 {
            value
        } else {
            value << (8 * (at & 3))
        };
        self.write_model(model, index, value);
        self.lines();
    }

    fn write_model(&mut self, model: Model, index: usize, value: u32) {
        match model {
            Model::Word => self.words[index] = value,
            Model::Rcc(register) => {
                self.words[index] = clocks::written(register, self.words[index], value);
            }
            Model::Timer(i, register) => self.timers[i].write(register, value, self.now),
            Model::EncoderControl => self.encoder.control = value,
            Model::EncoderFlags => self.encoder.flags &= value,
            Model::EncoderCount => self.encoder.count = value,
            Model::EncoderIndex => self.encoder.index_control = value,
            Model::DacControl => self.dac.control = value,
            Model::DacHold => self.dac.hold(value),
            Model::PortSet(port) => {
                let odr = &mut self.words[self.odr[port]];
                *odr = *odr & !(value >> 16) | value & 0xffff;
            }
            Model::Watchdog(register) => self.watchdog.write(register, value, self.now),
            Model::Icsr => {
                if value & 1 << 28 != 0 {
                    self.interrupts.pend(PENDSV);
                }
                if value & 1 << 26 != 0 {
                    self.interrupts.pend(SYSTICK);
                }
            }
            Model::Reset => self.reset_asked |= value & 4 != 0,
            // Read-only.
            Model::DacOutput
            | Model::EncoderCapture
            | Model::PortInput(_)
            | Model::Cycles
            | Model::SystemPriority(_) => {}
        }
    }

    /// The register that holds the vector table's address.
    pub fn vectors(&self) -> u32 {
        self.words[self.models[&names::address("SCB", "VTOR")].1]
    }

    fn not_modelled(&mut self, what: &str, at: u32) {
        let text = format!(
            "{what} a register that is not modelled: {}",
            names::describe(at)
        );
        self.fault.get_or_insert(text);
    }
}
