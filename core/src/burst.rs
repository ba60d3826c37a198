//! A burst: the samples about an event, from before it to after it, kept in memory and read out later. Whatever a slow
//! link loses meanwhile, these are all there.
//!
//! It is fed from the trace's queue, below the control tick, and costs the tick nothing. A step is bounded: one sample
//! is put into a ring and looked at.

use crate::supervisor::Fault;
use crate::trace::Record;

/// Samples that a burst may have: 0.15 s at 10 kHz, a reversal with what leads to it and what follows. Nearly half of the
/// microcontroller's RAM.
pub const BURST_SAMPLES: usize = 1536;

/// What is compared with a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Quantity {
    /// z of the time-free observer, rad.
    Deflection = 0,
    /// Velocity of the Luenberger-like observer, rad/s.
    Velocity = 1,
    /// Torque put out, N m.
    Torque = 2,
}

impl Quantity {
    /// All of them, by number.
    pub const ALL: [Self; 3] = [Self::Deflection, Self::Velocity, Self::Torque];

    fn of(self, record: &Record) -> f32 {
        match self {
            Self::Deflection => record.z_time_free_rad,
            Self::Velocity => record.velocity_rad_s,
            Self::Torque => record.torque_ref_nm,
        }
    }
}

/// The event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Trigger {
    /// The host says so.
    Command,
    /// The encoder has come back from its furthest by so many counts.
    Reversal {
        /// At least 1.
        counts: u16,
    },
    /// After so many samples within a count either way, the encoder has left where it rested by so many counts.
    BreakAway {
        /// Samples of rest.
        rest: u16,
        /// At least 2.
        counts: u16,
    },
    /// A fault appears.
    Fault,
    /// A quantity passes a level upwards.
    Above(Quantity, f32),
    /// A quantity passes a level downwards.
    Below(Quantity, f32),
}

impl Trigger {
    /// Whether it can ever come, and not always.
    fn is_usable(self) -> bool {
        match self {
            Self::Command | Self::Fault => true,
            Self::Reversal { counts } => counts >= 1,
            Self::BreakAway { rest, counts } => rest >= 1 && counts >= 2,
            Self::Above(_, level) | Self::Below(_, level) => level.is_finite(),
        }
    }
}

/// What the host asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The event.
    pub trigger: Trigger,
    /// Samples before that of the event.
    pub before: u16,
    /// Samples from that of the event on, itself among them.
    pub after: u16,
}

/// Where a burst stands. The numbers are part of the wire form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Stage {
    /// Nothing was asked for since boot.
    #[default]
    Idle = 0,
    /// The samples before the event are not yet together; an event is none meanwhile.
    Filling = 1,
    /// Waits for the event.
    Waiting = 2,
    /// The event has come, samples after it are taken.
    Taking = 3,
    /// All is there, and stays until the next setting.
    Full = 4,
}

impl Stage {
    /// The one with a number.
    pub fn of(number: u8) -> Option<Self> {
        [
            Self::Idle,
            Self::Filling,
            Self::Waiting,
            Self::Taking,
            Self::Full,
        ]
        .into_iter()
        .nth(usize::from(number))
    }

    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Self::Idle => "not armed",
            Self::Filling => "fills the samples before the event",
            Self::Waiting => "waits for the event",
            Self::Taking => "takes the samples after the event",
            Self::Full => "is full",
        }
    }
}

/// What the samples so far tell a trigger.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Past {
    /// There is one.
    any: bool,
    /// Furthest that the encoder has come in its direction, and that direction; zero before it is known.
    furthest: i32,
    direction: i32,
    /// Where it rests, and for how many samples.
    rest: i32,
    rested: u16,
    faulty: bool,
    value: f32,
}

/// A ring of `N` samples and its trigger.
#[derive(Clone, Debug)]
pub struct Burst<const N: usize> {
    ring: [Record; N],
    /// Place of the next sample.
    next: usize,
    /// Samples in the ring since the setting, at most `N`.
    held: usize,
    stage: Stage,
    setting: Setting,
    past: Past,
    asked: bool,
    left: u16,
    event_tick: u32,
}

impl<const N: usize> Default for Burst<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Burst<N> {
    /// Nothing is asked for. All zeros, so that an image does not hold it.
    pub const fn new() -> Self {
        Self {
            ring: [Record::EMPTY; N],
            next: 0,
            held: 0,
            stage: Stage::Idle,
            setting: Setting {
                trigger: Trigger::Command,
                before: 0,
                after: 0,
            },
            past: Past {
                any: false,
                furthest: 0,
                direction: 0,
                rest: 0,
                rested: 0,
                faulty: false,
                value: 0.0,
            },
            asked: false,
            left: 0,
            event_tick: 0,
        }
    }

    /// Begins anew with a setting; false if it does not fit or its trigger means nothing, and then nothing changes.
    pub fn arm(&mut self, setting: Setting) -> bool {
        let samples = usize::from(setting.before) + usize::from(setting.after);
        if setting.after == 0 || samples > N || !setting.trigger.is_usable() {
            return false;
        }
        self.next = 0;
        self.held = 0;
        self.stage = Stage::Filling;
        self.setting = setting;
        self.past = Past::default();
        self.asked = false;
        self.left = setting.after;
        true
    }

    /// The event is now, whatever the trigger; false if none is waited for.
    pub fn fire(&mut self) -> bool {
        self.asked = matches!(self.stage, Stage::Filling | Stage::Waiting);
        self.asked
    }

    /// Where it stands.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Number of the tick of the event, once it has come.
    pub fn event_tick(&self) -> Option<u32> {
        matches!(self.stage, Stage::Taking | Stage::Full).then_some(self.event_tick)
    }

    /// Samples that can be read: none before it is full.
    pub fn samples(&self) -> usize {
        match self.stage {
            Stage::Full => usize::from(self.setting.before) + usize::from(self.setting.after),
            _ => 0,
        }
    }

    /// A sample of a full burst, the oldest one first.
    pub fn sample(&self, number: usize) -> Option<&Record> {
        let samples = self.samples();
        if number >= samples {
            return None;
        }
        self.ring.get((self.next + N - samples + number) % N)
    }

    /// Takes the next sample of the trace.
    pub fn take(&mut self, record: &Record) {
        if matches!(self.stage, Stage::Idle | Stage::Full) {
            return;
        }
        let asked = core::mem::take(&mut self.asked);
        let event = self.look(record) || asked;
        if self.stage == Stage::Filling && self.held >= usize::from(self.setting.before) {
            self.stage = Stage::Waiting;
        }
        if self.stage == Stage::Waiting && event {
            self.stage = Stage::Taking;
            self.event_tick = record.tick;
        }
        // An order that came too early is kept.
        self.asked = asked && self.stage == Stage::Filling;
        if let Some(place) = self.ring.get_mut(self.next) {
            *place = *record;
        }
        self.next = if self.next + 1 < N { self.next + 1 } else { 0 };
        self.held = (self.held + 1).min(N);
        if self.stage == Stage::Taking {
            self.left = self.left.saturating_sub(1);
            if self.left == 0 {
                self.stage = Stage::Full;
            }
        }
    }

    /// Whether the trigger's event is in this sample.
    fn look(&mut self, record: &Record) -> bool {
        let counts = record.counts;
        let faulty = record.status.fault().unwrap_or_default() != Fault::None;
        let past = &mut self.past;
        let value = match self.setting.trigger {
            Trigger::Above(quantity, _) | Trigger::Below(quantity, _) => quantity.of(record),
            _ => 0.0,
        };
        if !past.any {
            *past = Past {
                any: true,
                furthest: counts,
                rest: counts,
                faulty,
                value,
                ..Past::default()
            };
            return false;
        }
        let before = *past;
        past.value = value;
        past.faulty = faulty;
        match self.setting.trigger {
            Trigger::Command => false,
            Trigger::Fault => faulty && !before.faulty,
            // A value that is no number passes nothing.
            Trigger::Above(_, level) => before.value < level && value >= level,
            Trigger::Below(_, level) => before.value > level && value <= level,
            Trigger::Reversal { counts: back } => past.has_reversed(counts, i32::from(back)),
            Trigger::BreakAway { rest, counts: away } => {
                past.has_broken_away(counts, rest, u32::from(away))
            }
        }
    }
}

impl Past {
    fn has_reversed(&mut self, counts: i32, back: i32) -> bool {
        let beyond = counts.wrapping_sub(self.furthest);
        if beyond.wrapping_mul(self.direction) > 0 {
            self.furthest = counts;
            return false;
        }
        if beyond.unsigned_abs() < back.unsigned_abs() {
            return false;
        }
        // Which way it goes at first is no reversal.
        let reversed = self.direction != 0;
        self.direction = beyond.signum();
        self.furthest = counts;
        reversed
    }

    fn has_broken_away(&mut self, counts: i32, rest: u16, away: u32) -> bool {
        let moved = counts.wrapping_sub(self.rest).unsigned_abs();
        if moved <= 1 {
            self.rested = self.rested.saturating_add(1);
            return false;
        }
        if moved < away && self.rested >= rest {
            // It leaves, or creeps within presliding.
            return false;
        }
        let broken = self.rested >= rest;
        self.rest = counts;
        self.rested = 0;
        broken
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::supervisor::{Limit, State};
    use crate::trace::Status;
    use std::vec::Vec;

    fn record(tick: u32, counts: i32) -> Record {
        Record {
            tick,
            counts,
            ..Record::default()
        }
    }

    fn armed(trigger: Trigger, before: u16, after: u16) -> Burst<16> {
        let mut burst = Burst::new();
        assert!(burst.arm(Setting {
            trigger,
            before,
            after
        }));
        burst
    }

    fn ticks(burst: &Burst<16>) -> Vec<u32> {
        (0..burst.samples())
            .map(|number| burst.sample(number).unwrap().tick)
            .collect()
    }

    /// Feeds positions and gives the tick of the event.
    fn event(trigger: Trigger, positions: &[i32]) -> Option<u32> {
        let mut burst = armed(trigger, 0, 1);
        for (tick, counts) in positions.iter().enumerate() {
            burst.take(&record(tick as u32, *counts));
        }
        burst.event_tick()
    }

    #[test]
    fn keeps_what_was_before_and_after_whatever_the_ring_holds() {
        for wait in [5, 6, 15, 16, 17, 40, 1000] {
            let mut burst = armed(Trigger::Command, 5, 7);
            for tick in 0..wait {
                burst.take(&record(tick, 0));
                assert_eq!((burst.samples(), burst.event_tick()), (0, None));
            }
            assert!(burst.fire());
            for tick in wait..wait + 30 {
                burst.take(&record(tick, 0));
            }
            assert_eq!(burst.stage(), Stage::Full);
            assert_eq!(burst.event_tick(), Some(wait));
            let expected: Vec<u32> = (wait - 5..wait + 7).collect();
            assert_eq!(ticks(&burst), expected);
            assert!(burst.sample(12).is_none() && !burst.fire());
        }
    }

    #[test]
    fn the_whole_ring_can_be_asked_for_and_no_more() {
        let mut burst = armed(Trigger::Command, 15, 1);
        for tick in 0..15 {
            burst.take(&record(tick, 0));
        }
        assert!(burst.fire());
        burst.take(&record(15, 0));
        assert_eq!(ticks(&burst), (0..16).collect::<Vec<_>>());
        let before = burst.clone();
        for (trigger, samples_before, after) in [
            (Trigger::Command, 16, 1),
            (Trigger::Command, u16::MAX, u16::MAX),
            (Trigger::Command, 1, 0),
            (Trigger::Reversal { counts: 0 }, 1, 1),
            (Trigger::BreakAway { rest: 0, counts: 3 }, 1, 1),
            (Trigger::BreakAway { rest: 3, counts: 1 }, 1, 1),
            (Trigger::Above(Quantity::Torque, f32::NAN), 1, 1),
        ] {
            let setting = Setting {
                trigger,
                before: samples_before,
                after,
            };
            assert!(!burst.arm(setting), "{setting:?}");
        }
        assert_eq!(ticks(&burst), ticks(&before));
    }

    #[test]
    fn an_order_that_comes_too_early_waits_for_the_samples_before() {
        let mut burst = armed(Trigger::Command, 4, 2);
        burst.take(&record(0, 0));
        assert!(burst.fire());
        for tick in 1..10 {
            burst.take(&record(tick, 0));
        }
        assert_eq!(
            (burst.event_tick(), ticks(&burst)),
            (Some(4), (0..6).collect())
        );
        // Any other event that comes so early is not one.
        let mut burst = armed(Trigger::Reversal { counts: 1 }, 4, 2);
        for (tick, counts) in [0, 1, 0, 1, 2, 3, 2, 1, 0].into_iter().enumerate() {
            burst.take(&record(tick as u32, counts));
        }
        assert_eq!(burst.event_tick(), Some(6));
    }

    #[test]
    fn a_reversal_is_no_jitter_and_no_start() {
        let reversal = |counts| Trigger::Reversal { counts };
        assert_eq!(event(reversal(2), &[0, 1, 2, 3, 4, 5]), None);
        assert_eq!(event(reversal(2), &[0, 1, 2, 3, 2, 3, 2, 3, 4]), None);
        assert_eq!(event(reversal(2), &[0, 1, 2, 3, 2, 1]), Some(5));
        assert_eq!(event(reversal(2), &[0, -3, -4, -3, -2]), Some(4));
        // The counter may wrap.
        let wrapping = [i32::MAX - 1, i32::MAX, i32::MIN, i32::MIN + 1, i32::MAX];
        assert_eq!(event(reversal(2), &wrapping), Some(4));
        assert_eq!(event(reversal(2), &wrapping[..4]), None);
    }

    #[test]
    fn a_break_away_comes_after_rest() {
        let trigger = Trigger::BreakAway { rest: 4, counts: 3 };
        assert_eq!(event(trigger, &[0, 1, 0, 1, 0, 1, 2, 3]), Some(7));
        assert_eq!(event(trigger, &[0, 1, 2, 3, 4, 5, 6, 7, 8]), None);
        assert_eq!(event(trigger, &[0, 5, 9, 9, 9, 9, 9, 8, 6]), Some(8));
        // It creeps by two counts and stays there.
        assert_eq!(event(trigger, &[0, 0, 0, 0, 0, 2, 2, 2, 2, 2]), None);
    }

    #[test]
    fn levels_are_passed_one_way_and_by_numbers_only() {
        let feed = |trigger, values: &[f32]| {
            let mut burst = armed(trigger, 0, 1);
            for (tick, value) in values.iter().enumerate() {
                burst.take(&Record {
                    tick: tick as u32,
                    torque_ref_nm: *value,
                    ..Record::default()
                });
            }
            burst.event_tick()
        };
        let above = Trigger::Above(Quantity::Torque, 0.5);
        let below = Trigger::Below(Quantity::Torque, -0.5);
        assert_eq!(feed(above, &[0.6, 0.7, 0.4, 0.5]), Some(3));
        assert_eq!(feed(above, &[0.4, f32::NAN, 0.6, 0.7]), None);
        assert_eq!(feed(below, &[-0.6, 0.0, 0.7, -0.6]), Some(3));
        assert_eq!(feed(below, &[-0.6, -0.7]), None);
    }

    #[test]
    fn a_fault_is_one_when_it_appears() {
        let status = |fault| Status::new(State::Armed, Limit::None, fault, 0);
        let mut burst = armed(Trigger::Fault, 1, 1);
        for (tick, fault) in [
            Fault::Overspeed,
            Fault::Overspeed,
            Fault::None,
            Fault::DriveFault,
        ]
        .into_iter()
        .enumerate()
        {
            burst.take(&Record {
                tick: tick as u32,
                status: status(fault),
                ..Record::default()
            });
        }
        assert_eq!(
            (burst.event_tick(), ticks(&burst)),
            (Some(3), std::vec![2, 3])
        );
    }
}
