//! Commands from the host and the answers to them, in [`crate::wire`] frames.
//!
//! A command is a number that the host chooses and gets back, an operation, and what it needs. Nothing that arrives can
//! make the parser panic; what is not a command is answered as malformed.

use crate::burst::{Burst, Quantity, Setting, Stage, Trigger};
use crate::experiment::bounds::Refusal;
use crate::experiment::fields::{read_experiment, write_experiment};
use crate::experiment::{Bounds, Experiment};
use crate::feed_forward::Span;
use crate::observer::luenberger::BuildError;
use crate::parameters::{ENTRIES, Parameters};
use crate::wire::{Frame, FrameWriter, Kind, Reader};

/// Most parameters in one command.
pub const MOST_CHANGES: usize = 32;
/// Points of a part of a feed-forward table; [`feed_forward::POINTS`](crate::feed_forward::POINTS) is a multiple.
pub const PART_POINTS: usize = 32;
/// Longest command or reply frame.
pub const MOST_COMMAND_BYTES: usize = 256;

/// What the host asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// The host is there.
    KeepAlive,
    /// From idle to armed: the drive is enabled, torque zero.
    Arm,
    /// Torque and drive away at once.
    Disarm,
    /// Torque to zero by a ramp; stays armed.
    Stop,
    /// From fault to idle.
    ClearFault,
    /// Plays a signal from its beginning, within bounds.
    Play(Experiment<f32>, Bounds<f32>),
    /// Changes parameters, all of them or none.
    Set(Changes),
    /// Asks for a parameter.
    Get(u8),
    /// Begins a burst anew.
    BurstArm(Setting),
    /// The event of the burst is now.
    BurstFire,
    /// Asks where the burst stands.
    BurstStage,
    /// Asks for a frame of a full burst's samples from a number on; it comes before the answer.
    BurstRead(u16),
    /// Puts torques into the feed-forward table that is being written.
    TablePut(TablePart),
    /// The table is whole and used from now on, laid over this span; below the speed, rad/s, its directions are blended.
    TableUse(Span<f32>, f32),
    /// No table is used.
    TableDrop,
}

/// A part of a feed-forward table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TablePart {
    /// Of the backward direction.
    pub backward: bool,
    /// Number of the first point.
    pub first: u16,
    /// N m
    pub torques_nm: [f32; PART_POINTS],
}

/// New values of parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Changes {
    entries: [(u8, f32); MOST_CHANGES],
    count: usize,
}

impl Default for Changes {
    fn default() -> Self {
        Self {
            entries: [(0, 0.0); MOST_CHANGES],
            count: 0,
        }
    }
}

impl Changes {
    /// Adds one; false if there is no room.
    pub fn add(&mut self, number: u8, value: f32) -> bool {
        match self.entries.get_mut(self.count) {
            Some(place) => {
                *place = (number, value);
                self.count += 1;
                true
            }
            None => false,
        }
    }

    /// The parameters with all of them, or why they are refused.
    ///
    /// # Errors
    /// A number that no parameter has, or a value out of its range.
    pub fn apply(&self, parameters: &Parameters) -> Result<Parameters, Reply> {
        let mut changed = *parameters;
        for (parameter, value) in self.iter() {
            changed.set(parameter, value).map_err(|entry| match entry {
                Some(entry) => Reply::OutOfRange {
                    parameter,
                    low: entry.low,
                    high: entry.high,
                },
                None => Reply::Malformed,
            })?;
        }
        Ok(changed)
    }

    /// Number of the parameter and its new value, in order.
    pub fn iter(&self) -> impl Iterator<Item = (u8, f32)> + '_ {
        self.entries.iter().take(self.count).copied()
    }
}

/// The answer to a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reply {
    /// Taken; what comes of it shows in the state of the samples. With the version of the parameters from now on.
    Accepted {
        /// Counts up with every change of the parameters.
        parameter_version: u32,
    },
    /// A parameter of this number had a value outside its range; nothing was changed.
    OutOfRange {
        /// Number of the parameter.
        parameter: u8,
        /// Least value.
        low: f32,
        /// Largest value.
        high: f32,
    },
    /// The parameters do not go together; nothing was changed. The log says why.
    Inconsistent,
    /// The observer gain is too small or too large for the other parameters; nothing was changed.
    Unstable {
        /// The nearest l1 that passes, NaN if none does.
        nearest_l1_1_s: f32,
    },
    /// Not a command of this version.
    Malformed,
    /// The order before has not been followed yet; ask again.
    Busy,
    /// The value asked for.
    Value {
        /// Number of the parameter.
        parameter: u8,
        /// Its value.
        value: f32,
    },
    /// An experiment that asks for too much; nothing plays because of it.
    Refused(Refusal),
    /// Where the burst stands.
    Burst {
        /// Its stage.
        stage: Stage,
        /// Samples that can be read.
        samples: u16,
        /// Tick of the event, once it has come, else 0.
        event_tick: u32,
    },
    /// A burst of more samples than there is room for, or with a trigger that means nothing; nothing was changed.
    BurstRefused {
        /// Samples that there is room for.
        most: u16,
    },
}

impl Command {
    /// Writes the frame.
    pub fn write<'a>(&self, number: u16, buffer: &'a mut [u8]) -> Option<&'a [u8]> {
        let mut frame = FrameWriter::new(buffer, Kind::Command);
        frame.u16(number);
        match self {
            Self::KeepAlive => frame.u8(0),
            Self::Arm => frame.u8(1),
            Self::Disarm => frame.u8(2),
            Self::Stop => frame.u8(3),
            Self::ClearFault => frame.u8(4),
            Self::Play(experiment, bounds) => {
                frame.u8(5);
                frame.f32(bounds.travel_rad);
                frame.f32(bounds.speed_rad_s);
                frame.f32(bounds.torque_nm);
                frame.u32(bounds.ticks);
                write_experiment(experiment, &mut frame);
            }
            Self::Set(changes) => {
                frame.u8(6);
                frame.u8(changes.count as u8);
                for (number, value) in changes.iter() {
                    frame.u8(number);
                    frame.f32(value);
                }
            }
            Self::Get(parameter) => {
                frame.u8(7);
                frame.u8(*parameter);
            }
            Self::BurstArm(setting) => {
                frame.u8(8);
                frame.u16(setting.before);
                frame.u16(setting.after);
                write_trigger(setting.trigger, &mut frame);
            }
            Self::BurstFire => frame.u8(9),
            Self::BurstStage => frame.u8(10),
            Self::BurstRead(first) => {
                frame.u8(11);
                frame.u16(*first);
            }
            Self::TablePut(part) => {
                frame.u8(12);
                frame.u8(u8::from(part.backward));
                frame.u16(part.first);
                part.torques_nm.iter().for_each(|torque| frame.f32(*torque));
            }
            Self::TableUse(span, speed_band_rad_s) => {
                frame.u8(13);
                frame.f32(*speed_band_rad_s);
                match *span {
                    Span::Period(period) => {
                        frame.u8(0);
                        frame.f32(period);
                    }
                    Span::Stroke(from, to) => {
                        frame.u8(1);
                        frame.f32(from);
                        frame.f32(to);
                    }
                }
            }
            Self::TableDrop => frame.u8(14),
        }
        frame.finish(1)
    }

    /// Reads a command frame: its number, 0 where there is none, and the command if it is one.
    pub fn read(frame: &Frame<'_>) -> (u16, Option<Self>) {
        let mut bytes = Reader(frame.payload);
        let number = bytes.u16();
        let command = match frame.kind {
            Kind::Command => Self::read_body(bytes, number),
            _ => None,
        };
        (number.unwrap_or(0), command)
    }

    fn read_body(mut bytes: Reader<'_>, number: Option<u16>) -> Option<Self> {
        number?;
        let command = match bytes.u8()? {
            0 => Self::KeepAlive,
            1 => Self::Arm,
            2 => Self::Disarm,
            3 => Self::Stop,
            4 => Self::ClearFault,
            5 => {
                let bounds = Bounds {
                    travel_rad: bytes.f32()?,
                    speed_rad_s: bytes.f32()?,
                    torque_nm: bytes.f32()?,
                    ticks: bytes.u32()?,
                };
                Self::Play(read_experiment(&mut bytes)?, bounds)
            }
            6 => {
                let mut changes = Changes::default();
                for _ in 0..bytes.u8()? {
                    if !changes.add(bytes.u8()?, bytes.f32()?) {
                        return None;
                    }
                }
                Self::Set(changes)
            }
            7 => Self::Get(bytes.u8()?),
            8 => Self::BurstArm(Setting {
                before: bytes.u16()?,
                after: bytes.u16()?,
                trigger: read_trigger(&mut bytes)?,
            }),
            9 => Self::BurstFire,
            10 => Self::BurstStage,
            11 => Self::BurstRead(bytes.u16()?),
            12 => Self::TablePut(TablePart {
                backward: read_choice(&mut bytes)?,
                first: bytes.u16()?,
                torques_nm: {
                    let mut torques_nm = [0.0; PART_POINTS];
                    for torque in &mut torques_nm {
                        *torque = bytes.f32()?;
                    }
                    torques_nm
                },
            }),
            13 => {
                let speed_band_rad_s = bytes.f32()?;
                let span = if read_choice(&mut bytes)? {
                    Span::Stroke(bytes.f32()?, bytes.f32()?)
                } else {
                    Span::Period(bytes.f32()?)
                };
                Self::TableUse(span, speed_band_rad_s)
            }
            14 => Self::TableDrop,
            _ => return None,
        };
        bytes.end()?;
        Some(command)
    }
}

impl Reply {
    /// Parameters that nothing can run on.
    pub fn to_parameters(error: &BuildError) -> Self {
        match error {
            BuildError::Parameter(_) => Self::Inconsistent,
            BuildError::Gain(error) => Self::Unstable {
                nearest_l1_1_s: error.nearest.map_or(f32::NAN, |nearest| nearest as f32),
            },
        }
    }

    /// Where a burst stands.
    pub fn to_burst<const N: usize>(burst: &Burst<N>) -> Self {
        Self::Burst {
            stage: burst.stage(),
            samples: burst.samples() as u16,
            event_tick: burst.event_tick().unwrap_or_default(),
        }
    }

    /// Writes the frame.
    pub fn write<'a>(&self, number: u16, buffer: &'a mut [u8]) -> Option<&'a [u8]> {
        let mut frame = FrameWriter::new(buffer, Kind::Reply);
        frame.u16(number);
        match *self {
            Self::Accepted { parameter_version } => {
                frame.u8(0);
                frame.u32(parameter_version);
            }
            Self::OutOfRange {
                parameter,
                low,
                high,
            } => {
                frame.u8(1);
                frame.u8(parameter);
                frame.f32(low);
                frame.f32(high);
            }
            Self::Inconsistent => frame.u8(2),
            Self::Unstable { nearest_l1_1_s } => {
                frame.u8(3);
                frame.f32(nearest_l1_1_s);
            }
            Self::Malformed => frame.u8(4),
            Self::Busy => frame.u8(5),
            Self::Value { parameter, value } => {
                frame.u8(6);
                frame.u8(parameter);
                frame.f32(value);
            }
            Self::Refused(refusal) => {
                frame.u8(7);
                frame.u8(refusal as u8);
            }
            Self::Burst {
                stage,
                samples,
                event_tick,
            } => {
                frame.u8(8);
                frame.u8(stage as u8);
                frame.u16(samples);
                frame.u32(event_tick);
            }
            Self::BurstRefused { most } => {
                frame.u8(9);
                frame.u16(most);
            }
        }
        frame.finish(1)
    }

    /// Reads a reply frame: the number of the command, and the answer.
    pub fn read(frame: &Frame<'_>) -> Option<(u16, Self)> {
        if frame.kind != Kind::Reply {
            return None;
        }
        let mut bytes = Reader(frame.payload);
        let number = bytes.u16()?;
        let reply = match bytes.u8()? {
            0 => Self::Accepted {
                parameter_version: bytes.u32()?,
            },
            1 => Self::OutOfRange {
                parameter: bytes.u8()?,
                low: bytes.f32()?,
                high: bytes.f32()?,
            },
            2 => Self::Inconsistent,
            3 => Self::Unstable {
                nearest_l1_1_s: bytes.f32()?,
            },
            4 => Self::Malformed,
            5 => Self::Busy,
            6 => Self::Value {
                parameter: bytes.u8()?,
                value: bytes.f32()?,
            },
            7 => Self::Refused(Refusal::of(bytes.u8()?)?),
            8 => Self::Burst {
                stage: Stage::of(bytes.u8()?)?,
                samples: bytes.u16()?,
                event_tick: bytes.u32()?,
            },
            9 => Self::BurstRefused { most: bytes.u16()? },
            _ => return None,
        };
        bytes.end()?;
        Some((number, reply))
    }
}

fn read_choice(bytes: &mut Reader<'_>) -> Option<bool> {
    match bytes.u8()? {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

fn write_trigger(trigger: Trigger, frame: &mut FrameWriter<'_>) {
    match trigger {
        Trigger::Command => frame.u8(0),
        Trigger::Fault => frame.u8(1),
        Trigger::Reversal { counts } => {
            frame.u8(2);
            frame.u16(counts);
        }
        Trigger::BreakAway { rest, counts } => {
            frame.u8(3);
            frame.u16(rest);
            frame.u16(counts);
        }
        Trigger::Above(quantity, level) => {
            frame.u8(4);
            frame.u8(quantity as u8);
            frame.f32(level);
        }
        Trigger::Below(quantity, level) => {
            frame.u8(5);
            frame.u8(quantity as u8);
            frame.f32(level);
        }
    }
}

fn read_trigger(bytes: &mut Reader<'_>) -> Option<Trigger> {
    let quantity = |number: u8| Quantity::ALL.get(usize::from(number)).copied();
    Some(match bytes.u8()? {
        0 => Trigger::Command,
        1 => Trigger::Fault,
        2 => Trigger::Reversal {
            counts: bytes.u16()?,
        },
        3 => Trigger::BreakAway {
            rest: bytes.u16()?,
            counts: bytes.u16()?,
        },
        4 => Trigger::Above(quantity(bytes.u8()?)?, bytes.f32()?),
        5 => Trigger::Below(quantity(bytes.u8()?)?, bytes.f32()?),
        _ => return None,
    })
}

/// The number of a parameter by its name.
pub fn parameter(name: &str) -> Option<u8> {
    ENTRIES
        .iter()
        .position(|entry| entry.name == name)
        .and_then(|place| u8::try_from(place).ok())
}

#[cfg(test)]
mod tests;
