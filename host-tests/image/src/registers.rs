//! The registers that are modelled, and what each of them does.

use crate::timer::{TICK, TIME};
use crate::{clocks, timer, watchdog};

/// What a register does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Holds what is written.
    Word,
    /// Clock control.
    Rcc(clocks::Register),
    /// TIM7 or TIM15.
    Timer(usize, timer::Register),
    /// TIM2.CR1.
    EncoderControl,
    /// TIM2.SR.
    EncoderFlags,
    /// TIM2.CNT.
    EncoderCount,
    /// TIM2.CCR3.
    EncoderCapture,
    /// TIM2.ECR.
    EncoderIndex,
    /// DAC1.CR.
    DacControl,
    /// DAC1.DHR12R1.
    DacHold,
    /// DAC1.DOR1.
    DacOutput,
    /// IDR of a port.
    PortInput(usize),
    /// BSRR of a port.
    PortSet(usize),
    /// IWDG.
    Watchdog(watchdog::Register),
    /// SCB.ICSR.
    Icsr,
    /// SCB.SHPR, from this exception less four.
    SystemPriority(usize),
    /// SCB.AIRCR.
    Reset,
    /// DWT.CYCCNT.
    Cycles,
}

/// A peripheral and its registers: name, what it does, value after reset.
pub type Listed = (&'static str, &'static [(&'static str, Model, u32)]);

/// The registers modelled, each with its value after reset.
pub const MODELLED: &[Listed] = {
    use Model::{Cycles, Icsr, Rcc, Reset, SystemPriority, Timer, Watchdog, Word};
    use clocks::Register as C;
    use timer::Register as T;
    use watchdog::Register as W;
    &[
        (
            "RCC",
            &[
                ("CR", Rcc(C::Cr), 0x0500),
                ("CFGR", Rcc(C::Cfgr), 0x0005),
                ("BDCR", Rcc(C::Bdcr), 0),
                ("CSR", Rcc(C::Csr), 0),
                ("CRRCR", Rcc(C::Crrcr), 0),
                ("PLLCFGR", Word, 0x1000),
                ("ICSCR", Word, 0x4000_0000),
                ("CCIPR", Word, 0),
                ("CCIPR2", Word, 0),
                ("AHB1ENR", Word, 0x0100),
                ("AHB2ENR", Word, 0),
                ("AHB3ENR", Word, 0),
                ("APB1ENR1", Word, 0x0400),
                ("APB1ENR2", Word, 0),
                ("APB2ENR", Word, 0),
                ("AHB1RSTR", Word, 0),
                ("AHB2RSTR", Word, 0),
                ("AHB3RSTR", Word, 0),
                ("APB1RSTR1", Word, 0),
                ("APB1RSTR2", Word, 0),
                ("APB2RSTR", Word, 0),
            ],
        ),
        // Voltage scaling is ready at once: SR2 stays zero.
        (
            "PWR",
            &[
                ("CR1", Word, 0x0200),
                ("CR2", Word, 0),
                ("CR3", Word, 0x8000),
                ("CR4", Word, 0),
                ("CR5", Word, 0x0100),
                ("SR1", Word, 0),
                ("SR2", Word, 0),
            ],
        ),
        ("FLASH", &[("ACR", Word, 0x0004_0600)]),
        (
            "SYSCFG",
            &[
                ("CFGR1", Word, 0x7c00_0001),
                ("EXTICR[0]", Word, 0),
                ("EXTICR[1]", Word, 0),
                ("EXTICR[2]", Word, 0),
                ("EXTICR[3]", Word, 0),
            ],
        ),
        ("DBGMCU", &[("CR", Word, 0)]),
        (
            "TIM2",
            &[
                ("CR1", Model::EncoderControl, 0),
                ("CR2", Word, 0),
                ("SMCR", Word, 0),
                ("DIER", Word, 0),
                ("SR", Model::EncoderFlags, 0),
                ("EGR", Word, 0),
                ("CCMR_INPUT[0]", Word, 0),
                ("CCMR_INPUT[1]", Word, 0),
                ("CCER", Word, 0),
                ("CNT", Model::EncoderCount, 0),
                ("CCR[2]", Model::EncoderCapture, 0),
                ("PSC", Word, 0),
                ("ARR", Word, 0xffff_ffff),
                ("ECR", Model::EncoderIndex, 0),
                ("TISEL", Word, 0),
                ("AF1", Word, 0),
                ("AF2", Word, 0),
            ],
        ),
        (
            "TIM7",
            &[
                ("CR1", Timer(TICK, T::Cr1), 0),
                ("CR2", Word, 0),
                ("DIER", Timer(TICK, T::Dier), 0),
                ("SR", Timer(TICK, T::Sr), 0),
                ("EGR", Timer(TICK, T::Egr), 0),
                ("CNT", Timer(TICK, T::Cnt), 0),
                ("PSC", Timer(TICK, T::Psc), 0),
                ("ARR", Timer(TICK, T::Arr), 0xffff),
            ],
        ),
        (
            "TIM15",
            &[
                ("CR1", Timer(TIME, T::Cr1), 0),
                ("CR2", Word, 0),
                ("SMCR", Word, 0),
                ("DIER", Timer(TIME, T::Dier), 0),
                ("SR", Timer(TIME, T::Sr), 0),
                ("EGR", Timer(TIME, T::Egr), 0),
                ("CNT", Timer(TIME, T::Cnt), 0),
                ("PSC", Timer(TIME, T::Psc), 0),
                ("ARR", Timer(TIME, T::Arr), 0xffff),
                ("CCR[0]", Timer(TIME, T::Ccr(0)), 0),
                ("CCR[1]", Timer(TIME, T::Ccr(1)), 0),
            ],
        ),
        (
            "DAC1",
            &[
                ("CR", Model::DacControl, 0),
                ("MCR", Word, 0),
                // DACRDY of both channels: ready at once.
                ("SR", Word, 1 << 11 | 1 << 27),
                ("DHR12R[0]", Model::DacHold, 0),
                ("DOR[0]", Model::DacOutput, 0),
            ],
        ),
        (
            "IWDG",
            &[
                ("KR", Watchdog(W::Kr), 0),
                ("PR", Watchdog(W::Pr), 0),
                ("RLR", Watchdog(W::Rlr), 0xfff),
                ("SR", Watchdog(W::Sr), 0),
                ("WINR", Watchdog(W::Winr), 0xfff),
            ],
        ),
        (
            "DWT",
            &[
                ("CTRL", Word, 0x4000_0000),
                ("CYCCNT", Cycles, 0),
                ("LAR", Word, 0),
            ],
        ),
        (
            "SCB",
            &[
                ("CPUID", Word, 0x410f_c241),
                ("ICSR", Icsr, 0),
                ("VTOR", Word, 0),
                ("AIRCR", Reset, 0xfa05_0000),
                ("SCR", Word, 0),
                ("CCR", Word, 0x0200),
                ("SHPR1", SystemPriority(0), 0),
                ("SHPR2", SystemPriority(4), 0),
                ("SHPR3", SystemPriority(8), 0),
                ("SHCSR", Word, 0),
                ("CPACR", Word, 0),
                ("DHCSR", Word, 0),
                ("DEMCR", Word, 0),
                ("FPCCR", Word, 0xc000_0000),
            ],
        ),
    ]
};

/// Registers of a port; every port has the same.
pub const PORT: &[(&str, u32)] = &[
    ("MODER", 0xffff_ffff),
    ("OTYPER", 0),
    ("OSPEEDR", 0),
    ("PUPDR", 0),
    ("ODR", 0),
    ("AFR[0]", 0),
    ("AFR[1]", 0),
];
/// The ports.
pub const PORTS: [&str; 7] = [
    "GPIOA", "GPIOB", "GPIOC", "GPIOD", "GPIOE", "GPIOF", "GPIOG",
];
