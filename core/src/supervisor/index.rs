//! Whether the encoder's index comes back at whole turns from where it was first seen, counts.

use core::hint::cold_path;

use super::Limits;

/// Where the index was last, which moves by whole turns only, so that slow losses add up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Index {
    seen: bool,
    reference: u32,
}

impl Index {
    /// It has been seen since boot, or since it was forgotten.
    #[inline]
    pub(super) fn seen(self) -> bool {
        self.seen
    }

    /// Takes the count at an index edge; false if counts were lost or made.
    #[inline]
    pub(super) fn fits(&mut self, limits: &Limits, index: u32) -> bool {
        if !self.seen {
            cold_path();
            self.seen = true;
            self.reference = index;
            return true;
        }
        let turn = limits.counts_per_turn;
        let allowed = limits.index_counts;
        let near =
            |off: i32| off.wrapping_add(allowed).cast_unsigned() <= 2 * allowed.cast_unsigned();
        let distance = index.wrapping_sub(self.reference).cast_signed();
        // The same index again, or one a turn further.
        let mut off = distance;
        if !near(off) {
            off = if distance < 0 {
                distance.wrapping_add(turn)
            } else {
                distance.wrapping_sub(turn)
            };
        }
        let mut fits = near(off);
        if !fits {
            // Off, or indices were missed: only here is a division needed.
            cold_path();
            off = nearest(distance.wrapping_rem(turn.max(1)), turn);
            fits = near(off);
        }
        self.reference = index.wrapping_sub(off.cast_unsigned());
        fits
    }
}

/// A distance of less than a turn, less the nearest whole number of turns.
fn nearest(distance: i32, turn: i32) -> i32 {
    let half = turn >> 1;
    if distance > half {
        distance.wrapping_sub(turn)
    } else if distance < -half {
        distance.wrapping_add(turn)
    } else {
        distance
    }
}
