//! The NUCLEO-G474RE: clocks, pins and peripherals, and the registers that the control tick touches.
//!
//! | signal | pin | Arduino | peripheral |
//! |---|---|---|---|
//! | encoder A, B | PA0, PA1 | A0, A1 | TIM2 channels 1, 2 |
//! | encoder index | PB10 | D6 | TIM2 channel 3, capture |
//! | torque reference | PA4 | A2 | DAC1 output 1, started by TIM7 |
//! | torque reference, feature `pwm` | PC0 | A5 | TIM1 channel 1 |
//! | drive enable, high = on | PB0 | A3 | output, external pull-down |
//! | drive healthy, high = yes | PC1 | A4 | input, pull-down: a broken wire is a fault |

use embassy_stm32::Peripherals;
use embassy_stm32::gpio::{AfType, Flex, Input, Level, Output, Pull, Speed};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::timer::regs::SrGp16;
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, FilterValue, Mms, Sms};
use embassy_stm32::pac::{GPIOB, GPIOC, Interrupt, RCC, TIM2, TIM7};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;

use crate::timing;

/// Pin of the drive enable on port B.
const ENABLE_PIN: usize = 0;
/// Pin of the drive's health on port C.
const HEALTHY_PIN: usize = 1;
/// The interrupt of the control tick.
const TICK: Interrupt = Interrupt::TIM7_DAC;
/// The interrupt of what the tick leaves to be done after it; its peripheral (trigonometric accelerator) is not used.
const AFTER: Interrupt = Interrupt::CORDIC;
/// The spare interrupt that wakes the tasks; its peripheral (filter accelerator) is not used.
const WAKE: Interrupt = Interrupt::FMAC;

/// The clocks: crystal to 170 MHz, everything undivided.
pub fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(Hse {
        freq: Hertz(timing::CRYSTAL_HZ),
        mode: HseMode::Oscillator,
    });
    config.rcc.pll = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV6,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV1;
    config.rcc.apb2_pre = APBPrescaler::DIV1;
    config.rcc.boost = true;
    config.rcc.hsi48 = None;
    config.bdma_interrupt_priority = priority(timing::PRIORITY_TASKS);
    config
}

fn priority(level: u8) -> Priority {
    Priority::from(level << (8 - timing::PRIORITY_BITS))
}

/// The drive enable goes low before anything else happens on the board.
pub fn disable_drive_early(p: &mut Peripherals) {
    core::mem::forget(Output::new(p.PB0.reborrow(), Level::Low, Speed::Low));
}

/// Sets up pins and peripherals; the torque reference is zero and the drive disabled. The tick does not run yet.
pub fn init(mut p: Peripherals) {
    disable_drive_early(&mut p);
    core::mem::forget(Input::new(p.PC1, Pull::Down));
    // Pull-ups, as open-collector encoders want them; a push-pull one does not mind.
    for pin in [
        Flex::new(p.PA0).into_alternate(1),
        Flex::new(p.PA1).into_alternate(1),
        Flex::new(p.PB10).into_alternate(1),
    ] {
        core::mem::forget(pin);
    }
    encoder();
    #[cfg(not(feature = "pwm"))]
    {
        core::mem::forget(analog(Flex::new(p.PA4)));
        crate::output::init();
    }
    #[cfg(feature = "pwm")]
    {
        let mut pin = Flex::new(p.PC0);
        pin.set_as_af_unchecked(
            2,
            AfType::output(embassy_stm32::gpio::OutputType::PushPull, Speed::Medium),
        );
        core::mem::forget(pin);
        crate::output::init();
    }
    tick_timer();
    cycle_counter();
}

trait Alternate {
    fn into_alternate(self, function: u8) -> Self;
}

impl Alternate for Flex<'static> {
    fn into_alternate(mut self, function: u8) -> Self {
        self.set_as_af_unchecked(function, AfType::input(Pull::Up));
        self
    }
}

#[cfg(not(feature = "pwm"))]
fn analog(mut pin: Flex<'static>) -> Flex<'static> {
    pin.set_as_analog();
    pin
}

/// TIM2 counts both edges of A and B over its whole 32 bits, and copies the count on each index edge.
///
/// The index does not reset the counter: a counter that jumps would have to be mended in the tick, and a lost count
/// shows as well in the copy. That also means that the hardware's own index error flag has nothing to say here.
fn encoder() {
    RCC.apb1enr1().modify(|w| w.set_tim2en(true));
    // 8 samples at a clock of 170/8 MHz: pulses below 0.38 us are noise. At 16,384 counts and 50 turns a second A and B
    // have 1.2 us between edges.
    let filter = FilterValue::FDTS_DIV8_N8;
    TIM2.ccmr_input(0).write(|w| {
        w.set_ccs(0, CcmrInputCcs::TI4);
        w.set_icf(0, filter);
        w.set_ccs(1, CcmrInputCcs::TI4);
        w.set_icf(1, filter);
    });
    TIM2.ccmr_input(1).write(|w| {
        w.set_ccs(0, CcmrInputCcs::TI4);
        w.set_icf(0, filter);
    });
    TIM2.ccer().write(|w| w.set_cce(2, true));
    TIM2.smcr().write(|w| w.set_sms(Sms::ENCODER_MODE_3));
    TIM2.arr().write_value(u32::MAX);
    TIM2.cnt().write_value(0);
    TIM2.cr1().write(|w| w.set_cen(true));
}

fn tick_timer() {
    RCC.apb1enr1().modify(|w| w.set_tim7en(true));
    TIM7.psc().write_value(0);
    TIM7.arr()
        .write(|w| w.set_arr((timing::TICK_CYCLES - 1) as u16));
    TIM7.cr2().write(|w| w.set_mms(Mms::UPDATE));
    TIM7.dier().write(|w| w.set_uie(true));
    TIM7.sr().write(|w| w.set_uif(false));
    TICK.set_priority(priority(timing::PRIORITY_TICK));
    AFTER.set_priority(priority(timing::PRIORITY_TICK));
    WAKE.set_priority(priority(timing::PRIORITY_TASKS));
}

fn cycle_counter() {
    // SAFETY: runs once at boot on the only core; nobody else has these registers.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
}

/// Starts the tick. From here on the handler owns the state.
///
/// # Safety
/// Everything the handler uses must be set up.
pub unsafe fn start_ticks() {
    // SAFETY: the caller's promise; enabling cannot break a critical section, since the handler uses none.
    unsafe {
        TICK.enable();
        AFTER.enable();
        WAKE.enable();
    }
    TIM7.cr1().modify(|w| w.set_cen(true));
    #[cfg(feature = "pwm")]
    crate::output::start();
}

/// Says that the tick's interrupt has been taken.
#[inline(always)]
pub fn acknowledge_tick() {
    TIM7.sr().write(|w| w.set_uif(false));
}

/// Cycles since the timer's update: in the first line of the handler, its entry latency.
#[inline(always)]
pub fn cycles_since_update() -> u32 {
    u32::from(TIM7.cnt().read().cnt())
}

/// Free-running count of core cycles.
#[inline(always)]
pub fn cycles() -> u32 {
    cortex_m::peripheral::DWT::cycle_count()
}

/// What the encoder's timer says.
#[derive(Clone, Copy)]
pub struct EncoderReading {
    /// Free-running count.
    pub count: u32,
    /// Count at the last index edge, if there was one since the last reading.
    pub index: Option<u32>,
    /// Both inputs changed at once: a count was lost, or the filter is too slow.
    pub illegal: bool,
}

/// Reads the encoder.
#[inline(always)]
pub fn read_encoder() -> EncoderReading {
    let count = TIM2.cnt().read();
    let status = TIM2.sr().read();
    let index = status.ccif(2);
    let illegal = status.terrif();
    if index || illegal {
        // Writing 0 clears a bit, 1 leaves it alone: so exactly those that were seen are cleared.
        TIM2.sr().write_value(SrGp16(!status.0));
    }
    EncoderReading {
        count,
        index: if index {
            Some(TIM2.ccr(2).read())
        } else {
            None
        },
        illegal,
    }
}

/// Switches the drive on or off.
#[inline(always)]
pub fn set_drive_enable(on: bool) {
    GPIOB.bsrr().write(|w| {
        if on {
            w.set_bs(ENABLE_PIN, true);
        } else {
            w.set_br(ENABLE_PIN, true);
        }
    });
}

/// True while the drive says that it is well.
#[inline(always)]
pub fn drive_is_healthy() -> bool {
    GPIOC.idr().read().idr(HEALTHY_PIN).to_bits() != 0
}

/// What remains of this tick runs right after it. One store to the interrupt controller.
#[inline(always)]
pub fn prepare_next_tick() {
    cortex_m::peripheral::NVIC::pend(AFTER);
}

/// Wakes the low-priority tasks. One store to the interrupt controller.
#[inline(always)]
pub fn wake_tasks() {
    cortex_m::peripheral::NVIC::pend(WAKE);
}
