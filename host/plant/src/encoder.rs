//! The incremental encoder: whole counts of a free-running 32-bit counter, and an index pulse once a turn.

/// What the encoder is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EncoderConfig {
    /// Angle of one count, rad.
    pub rad_per_count: f64,
    /// Counts between index pulses; none on an axis without an index.
    pub counts_per_turn: Option<i64>,
    /// Noise of the sensor before it is quantised, rad rms.
    pub noise_rad: f64,
}

/// A reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// Counts since position zero.
    pub counts: i64,
    /// The index lay between the last reading and this one.
    pub index: bool,
}

impl Reading {
    /// The hardware counter, 32 bits of the count.
    pub fn raw(self) -> u32 {
        (self.counts.cast_unsigned() & u64::from(u32::MAX)) as u32
    }
}

impl EncoderConfig {
    /// Reads a position that carries sensor noise already, after a reading of so many counts.
    pub fn read(&self, position_rad: f64, last_counts: i64) -> Reading {
        let counts = (position_rad / self.rad_per_count).floor() as i64;
        let index = self
            .counts_per_turn
            .is_some_and(|turn| counts.div_euclid(turn) != last_counts.div_euclid(turn));
        Reading { counts, index }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_and_marks_the_index() {
        let encoder = EncoderConfig {
            rad_per_count: 0.5,
            counts_per_turn: Some(4),
            noise_rad: 0.0,
        };
        assert_eq!(encoder.read(1.99, 0).counts, 3);
        assert!(encoder.read(2.01, 3).index);
        let below = encoder.read(-0.01, 0);
        assert_eq!(
            (below.counts, below.index, below.raw()),
            (-1, true, u32::MAX)
        );
    }
}
