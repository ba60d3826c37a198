//! The torque reference as a voltage: DAC1 on PA4, or with the `pwm` feature TIM1 on PC0. Mid-scale is no torque.
//!
//! Both take the value over at the update of the tick's period after the one that computed it.

#[cfg(not(feature = "pwm"))]
pub use dac::{CODE_SPAN, init, write};
#[cfg(feature = "pwm")]
pub use pwm::{CODE_SPAN, init, start, write};

const MIDDLE: i32 = (CODE_SPAN / 2) as i32;

/// Half codes of a torque, for one over the torque at full scale.
pub fn half_codes_1_nm(deflection_1_nm: f32) -> f32 {
    deflection_1_nm * (2 * MIDDLE) as f32
}

/// Code of a torque: mid-scale plus its share of half the span.
#[inline(always)]
pub fn code(torque_nm: f32, half_codes_1_nm: f32) -> u32 {
    // Rounded half away from zero, so that both directions are alike: twice the code, towards zero, and half of the
    // next one outwards. The conversion saturates and takes NaN to 0, which then is no torque.
    let twice = (torque_nm * half_codes_1_nm) as i32;
    let half_up = twice.saturating_add(2 * MIDDLE + 1) + (twice >> 31);
    (half_up >> 1).clamp(0, 2 * MIDDLE - 1) as u32
}

#[cfg(not(feature = "pwm"))]
mod dac {
    use embassy_stm32::pac::dac::vals::Mode;
    use embassy_stm32::pac::{DAC1, RCC};

    /// Codes of the converter.
    pub const CODE_SPAN: u32 = 4096;

    /// Trigger input 2 of DAC1 is the update of TIM7.
    const TRIGGER_TIM7: u8 = 2;

    /// Mid-scale on the pin.
    pub fn init() {
        RCC.ahb2enr().modify(|w| w.set_dac1en(true));
        DAC1.mcr().write(|w| {
            // The bus clock is above 160 MHz.
            w.set_hfsel(2);
            w.set_mode(0, Mode::NORMAL_EXT_BUFEN);
        });
        // Without a trigger the code is on the pin at once; then the timer takes over.
        DAC1.dhr12r(0).write(|w| w.set_dhr((CODE_SPAN / 2) as u16));
        DAC1.cr().write(|w| w.set_en(0, true));
        while !DAC1.sr().read().dacrdy(0) {}
        DAC1.cr().write(|w| w.set_tsel(0, TRIGGER_TIM7));
        DAC1.cr().write(|w| {
            w.set_tsel(0, TRIGGER_TIM7);
            w.set_ten(0, true);
            w.set_en(0, true);
        });
    }

    /// The code that the next update puts out.
    #[inline(always)]
    pub fn write(code: u32) {
        DAC1.dhr12r(0).write(|w| w.set_dhr(code as u16));
    }
}

#[cfg(feature = "pwm")]
mod pwm {
    use embassy_stm32::pac::timer::vals::Ocm;
    use embassy_stm32::pac::{RCC, TIM1};

    use crate::timing::{PWM_CYCLES, PWM_PER_TICK};

    /// Codes of the duty cycle.
    pub const CODE_SPAN: u32 = PWM_CYCLES;

    /// Half duty.
    pub fn init() {
        RCC.apb2enr().modify(|w| w.set_tim1en(true));
        TIM1.psc().write_value(0);
        TIM1.arr().write(|w| w.set_arr((PWM_CYCLES - 1) as u16));
        // One update a tick: a new duty cycle starts with the tick after the one that computed it, as with the DAC.
        TIM1.rcr().write(|w| w.set_rep((PWM_PER_TICK - 1) as u16));
        TIM1.ccmr_output(0).write(|w| {
            w.set_ocm(0, Ocm::PWM_MODE1);
            w.set_ocpe(0, true);
        });
        write(CODE_SPAN / 2);
        TIM1.ccer().write(|w| w.set_cce(0, true));
        TIM1.egr().write(|w| w.set_ug(true));
        TIM1.bdtr().write(|w| w.set_moe(true));
    }

    /// Starts the periods, in step with the tick's timer, which was started right before.
    pub fn start() {
        TIM1.cr1().modify(|w| w.set_cen(true));
    }

    /// The duty cycle from the next tick on.
    #[inline(always)]
    pub fn write(code: u32) {
        TIM1.ccr(0).write(|w| w.set_ccr(code as u16));
    }
}
