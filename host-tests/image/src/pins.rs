//! What the image sees and moves: encoder counter, converter, port pins; and the world behind them.

/// What leaves the chip during a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// Code at the output of DAC1 channel 1; none while the channel is off.
    pub dac: Option<u16>,
    /// Output data of ports A to G.
    pub ports: [u16; 7],
}

/// What arrives at the end of a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// Encoder position, 32 bits of it.
    pub count: u32,
    /// Position of the index edge that lay within the tick.
    pub index: Option<u32>,
    /// Both encoder lines changed at once.
    pub illegal_transition: bool,
    /// Input levels of ports A to G.
    pub ports: [u16; 7],
}

/// The world behind the pins.
pub trait World {
    /// Runs one tick with constant outputs.
    fn advance(&mut self, outputs: &Outputs) -> Inputs;
}

/// Nothing moves.
#[derive(Clone, Copy, Debug, Default)]
pub struct Still;

impl World for Still {
    fn advance(&mut self, _: &Outputs) -> Inputs {
        Inputs::default()
    }
}

/// DAC1: two channels, of which the first is brought out.
#[derive(Clone, Debug, Default)]
pub struct Dac {
    /// CR.
    pub control: u32,
    /// DHR12R of channel 1.
    pub holding: u16,
    /// DOR of channel 1.
    pub output: u16,
}

/// TSEL of DAC1 for the trigger output of TIM7.
const TRIGGER_TIM7: u32 = 2;

impl Dac {
    /// Writes the holding register; without a trigger it goes out at once.
    pub fn hold(&mut self, code: u32) {
        self.holding = (code & 0xfff) as u16;
        if self.control & 2 == 0 {
            self.output = self.holding;
        }
    }

    /// TIM7's trigger output rises.
    pub fn trigger(&mut self) {
        if self.control & 2 != 0 && self.control >> 2 & 0xf == TRIGGER_TIM7 {
            self.output = self.holding;
        }
    }

    /// Code at the pin.
    pub fn code(&self) -> Option<u16> {
        (self.control & 1 != 0).then_some(self.output)
    }
}

/// Flags of TIM2 that the encoder raises. CC3IF: the index, wired to channel 3, made a capture.
const CAPTURE: u32 = 1 << 3;
/// Both lines changed at once.
const TRANSITION_ERROR: u32 = 1 << 23;

/// TIM2 in encoder mode.
#[derive(Clone, Debug, Default)]
pub struct EncoderCounter {
    /// Count.
    pub count: u32,
    /// SR.
    pub flags: u32,
    /// CCR3.
    pub capture: u32,
    /// ECR; an index that resets the counter is not modelled.
    pub index_control: u32,
    /// CR1.
    pub control: u32,
    last: u32,
}

impl EncoderCounter {
    /// Takes what the world did in a tick.
    pub fn take(&mut self, inputs: &Inputs) {
        if self.control & 1 != 0 {
            let step = inputs.count.wrapping_sub(self.last);
            self.count = self.count.wrapping_add(step);
            if let Some(edge) = inputs.index {
                self.flags |= CAPTURE;
                self.capture = self.count.wrapping_sub(inputs.count.wrapping_sub(edge));
            }
            if inputs.illegal_transition {
                self.flags |= TRANSITION_ERROR;
            }
        }
        self.last = inputs.count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triggered_converter_waits_for_its_trigger() {
        let mut dac = Dac {
            control: 1 | 2 | TRIGGER_TIM7 << 2,
            ..Dac::default()
        };
        dac.hold(0x123);
        assert_eq!(dac.code(), Some(0));
        dac.trigger();
        assert_eq!(dac.code(), Some(0x123));
    }
}
