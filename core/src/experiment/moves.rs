//! Position moves: from rest to rest, out and back, each pair half as long as the one before, with a pause after each.
//!
//! A move follows s = L (x - sin(2 pi x)/(2 pi)), x from 0 to 1: velocity and acceleration begin and end at zero. All
//! moves take the same time, so that speeds fall with the lengths, down to reversals within presliding. The largest speed
//! is 2 L/T, the largest acceleration 2 pi L/T^2.

use super::sine_and_cosine;
use crate::real::Real;

/// Lengths of a round: from the whole one down to 1/128 of it.
pub const LENGTHS: u32 = 8;
/// Most lengths that a pause may have.
pub const MOST_PAUSES: u32 = 1024;

/// Share of the way and of the mean speed, given how much of a move is over.
#[inline(always)]
pub(super) fn profile<T: Real>(x: T) -> (T, T) {
    let (sin, cos) = sine_and_cosine(x);
    (
        x - sin * T::of(0.5 * core::f64::consts::FRAC_1_PI),
        T::ONE - cos,
    )
}

/// Ticks of a pause: 1 to `choices` times `pause_ticks`, drawn by ten bits of a shift register.
#[inline]
pub(super) fn pause(bits: u16, pause_ticks: u32, choices: u32) -> u32 {
    let drawn = u32::from(bits & 0x3ff) * choices.min(MOST_PAUSES);
    pause_ticks.saturating_mul((drawn >> 10) + 1)
}

#[cfg(test)]
mod tests {
    use super::super::{Experiment, Player, Reference};
    use std::vec::Vec;

    const TICK_S: f64 = 1e-4;

    fn play(pauses: u32, ticks: usize) -> Vec<(f64, f64)> {
        let experiment = Experiment::Moves {
            length_rad: 2.0,
            move_ticks: 1000,
            pause_ticks: 100,
            pauses,
        };
        let mut player = Player::new(experiment, TICK_S);
        (0..ticks)
            .map(|_| match player.next_tick() {
                Reference::Position {
                    position_rad,
                    velocity_rad_s,
                } => (position_rad, velocity_rad_s),
                other => panic!("{other:?}"),
            })
            .collect()
    }

    #[test]
    fn goes_out_and_back_by_halves_and_repeats_exactly() {
        // Move and pause, out and back, eight lengths.
        let round = 2 * 1100 * 8;
        let signal = play(1, 3 * round);
        assert_eq!(signal[..round], signal[2 * round..]);
        for length in 0..8 {
            let out = length * 2200 + 1050;
            assert_eq!(signal[out], (2.0 / f64::from(1 << length), 0.0));
            assert_eq!(signal[out + 1100], (0.0, 0.0));
        }
    }

    #[test]
    fn is_smooth_and_keeps_its_stated_bounds() {
        let signal = play(1, 2 * 1100 * 8);
        // T = 0.1 s: 2 L/T and 2 pi L/T^2.
        let (speed, acceleration) = (40.0, core::f64::consts::TAU * 2.0 / 0.01);
        let mut fastest = 0.0_f64;
        for (k, pair) in signal.windows(2).enumerate() {
            let ((q0, v0), (q1, v1)) = (pair[0], pair[1]);
            fastest = fastest.max(v0.abs());
            assert!((v1 - v0).abs() <= acceleration * TICK_S * 1.000_001, "{k}");
            // The trapezoid's remainder: a twelfth of the largest jerk, 2 pi acceleration/T, times the tick cubed.
            let step = q1 - q0 - 0.5 * (v0 + v1) * TICK_S;
            let jerk = core::f64::consts::TAU * acceleration / 0.1;
            assert!(step.abs() < jerk * 1e-12 / 12.0 * 1.01, "{k}: {step}");
        }
        assert!((fastest - speed).abs() < 1e-9, "{fastest}");
    }

    #[test]
    fn pauses_are_drawn_the_same_every_time() {
        let lengths = |signal: &[(f64, f64)]| {
            let mut lengths = Vec::new();
            let mut at_rest = 0;
            for (_, velocity) in signal {
                if *velocity == 0.0 {
                    at_rest += 1;
                } else if at_rest > 0 {
                    // The first tick of a move is at rest too.
                    lengths.push((at_rest - 1) / 100);
                    at_rest = 0;
                }
            }
            lengths
        };
        let drawn = lengths(&play(4, 60_000));
        assert_eq!(drawn, lengths(&play(4, 60_000)));
        for pause in 1..=4 {
            assert!(drawn.contains(&pause), "{drawn:?}");
        }
        assert!(drawn[1..].iter().all(|pause| (1..=4).contains(pause)));
    }
}
