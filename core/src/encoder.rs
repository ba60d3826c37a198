//! Wrapped encoder counts to differences and turns. Counts stay integers: an f32 angle loses the encoder after some
//! ten thousand turns, so nothing downstream ever sees an absolute angle.

use core::hint::cold_path;

use crate::error::{ParameterError, positive, require};

/// What the encoder is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    counts_per_turn: i32,
    largest_step: u32,
}

/// Where the encoder stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State {
    last: u32,
    /// The reading from which [`Self::travel_counts`] counts.
    zero: u32,
    /// Steps that were too large to be motion, and were not passed on.
    pub rejected: u32,
}

/// A position of any number of turns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Turns {
    /// Whole turns since the start; wraps.
    pub turns: i32,
    /// Counts within the turn, 0 to one less than a turn.
    pub counts_in_turn: i32,
}

impl State {
    /// The counter's last reading.
    #[inline]
    pub fn reading(&self) -> u32 {
        self.last
    }

    /// Sum of the steps since the start, or since [`Self::begin_travel`], counts; wraps.
    #[inline]
    pub fn travel_counts(&self) -> i32 {
        self.last.wrapping_sub(self.zero).cast_signed()
    }

    /// The travel counts from here on.
    #[inline]
    pub fn begin_travel(&mut self) {
        self.zero = self.last;
    }
}

impl Encoder {
    /// Counts per turn (per metre on a linear axis) and the largest step between two samples that the axis can make.
    ///
    /// # Errors
    /// Either one below 1, or a step of more than a turn.
    pub fn new(counts_per_turn: i32, largest_step: i32) -> Result<Self, ParameterError> {
        let turn = positive("counts_per_rev", f64::from(counts_per_turn))?;
        let step = f64::from(largest_step);
        require(
            "largest_step_counts",
            step,
            step >= 1.0 && step <= turn,
            "at least 1 and at most a turn",
        )?;
        Ok(Self {
            counts_per_turn,
            largest_step: largest_step.unsigned_abs(),
        })
    }

    /// Counts per turn.
    pub fn counts_per_turn(&self) -> i32 {
        self.counts_per_turn
    }

    /// Starts at a counter reading.
    pub fn start(&self, raw: u32) -> State {
        State {
            last: raw,
            zero: raw,
            rejected: 0,
        }
    }

    /// Takes a reading of the free-running 32-bit counter and gives the step since the last one in counts.
    ///
    /// A step too large to be motion gives `None`, is counted, and the new reading becomes the base of the next one: a
    /// reading that was wrong once costs two samples, a lasting jump one.
    #[inline]
    pub fn update(&self, state: &mut State, raw: u32) -> Option<i32> {
        let step = raw.wrapping_sub(state.last).cast_signed();
        state.last = raw;
        // Both bounds with one comparison.
        if step.cast_unsigned().wrapping_add(self.largest_step) > 2 * self.largest_step {
            cold_path();
            state.rejected = state.rejected.saturating_add(1);
            state.zero = state.zero.wrapping_add(step.cast_unsigned());
            return None;
        }
        Some(step)
    }

    /// Adds a step to a position.
    pub fn turn(&self, position: &mut Turns, step: i32) {
        let mut counts = position.counts_in_turn.wrapping_add(step);
        // Both ends of the turn with one comparison.
        if counts.cast_unsigned() >= self.counts_per_turn.cast_unsigned() {
            let (back, turn) = if counts < 0 {
                (self.counts_per_turn, -1)
            } else {
                (-self.counts_per_turn, 1)
            };
            counts += back;
            position.turns = position.turns.wrapping_add(turn);
        }
        position.counts_in_turn = counts;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps_with_the_counter() {
        let encoder = Encoder::new(16384, 8000).unwrap();
        let mut state = encoder.start(u32::MAX - 1);
        assert_eq!(encoder.update(&mut state, 3), Some(5));
        assert_eq!(encoder.update(&mut state, u32::MAX - 1), Some(-5));
        assert_eq!(state.travel_counts(), 0);
        assert_eq!(encoder.update(&mut state, u32::MAX - 2), Some(-1));
        assert_eq!(state.travel_counts(), -1);
    }

    #[test]
    fn turns_carry_both_ways() {
        let encoder = Encoder::new(16384, 8000).unwrap();
        let mut position = Turns::default();
        for (step, turns, counts_in_turn) in [
            (5, 0, 5),
            (-5, 0, 0),
            (-1, -1, 16383),
            (1, 0, 0),
            (16384, 1, 0),
        ] {
            encoder.turn(&mut position, step);
            let whole = Turns {
                turns,
                counts_in_turn,
            };
            assert_eq!(position, whole);
        }
    }

    #[test]
    fn travel_begins_anew() {
        let encoder = Encoder::new(16384, 8000).unwrap();
        let mut state = encoder.start(10);
        encoder.update(&mut state, 17);
        state.begin_travel();
        encoder.update(&mut state, 14);
        assert_eq!(state.travel_counts(), -3);
    }

    #[test]
    fn a_reading_wrong_once_leaves_the_position_whole() {
        let encoder = Encoder::new(16384, 100).unwrap();
        let mut state = encoder.start(0);
        assert_eq!(encoder.update(&mut state, 10), Some(10));
        assert_eq!(encoder.update(&mut state, 1 << 30), None);
        assert_eq!(encoder.update(&mut state, 12), None);
        assert_eq!(encoder.update(&mut state, 15), Some(3));
        assert_eq!(state.rejected, 2);
        // 10 and 3: what was rejected is not part of it.
        assert_eq!(state.travel_counts(), 13);
    }

    #[test]
    fn counts_a_million_turns() {
        let encoder = Encoder::new(16384, 16384).unwrap();
        let mut state = encoder.start(7);
        let mut position = Turns::default();
        let mut raw = 7_u32;
        for _ in 0..2_000_000 {
            raw = raw.wrapping_add(8192);
            let step = encoder.update(&mut state, raw).unwrap();
            encoder.turn(&mut position, step);
        }
        let whole = Turns {
            turns: 1_000_000,
            counts_in_turn: 0,
        };
        assert_eq!(position, whole);
    }

    #[test]
    fn refuses_what_means_nothing() {
        assert!(Encoder::new(0, 1).is_err());
        assert!(Encoder::new(100, 0).is_err());
        assert!(Encoder::new(100, 101).is_err());
    }
}
