//! Multisine: eight sines an octave apart, 1 to 128 periods of the slowest, all of one amplitude.
//!
//! Phases were searched for a small peak: the crest factor is 2.21, where Schroeder's phases (1970, equation 5) give 2.87
//! on octaves, and all sines in phase up to 4. The sum begins at zero. Sine and cosine of an octave come from those of the
//! one below by doubling the angle, five multiplications a line; nothing is carried from tick to tick, so that each period
//! repeats bit for bit.

use crate::real::Real;

/// Lines of the spectrum.
pub const LINES: u32 = PHASES.len() as u32;
/// Fewest ticks of the slowest sine: eight of the fastest one.
pub const LEAST_PERIOD_TICKS: u32 = 8 << (LINES - 1);

/// Cosine and sine of each line's phase, over the sum's peak.
const PHASES: [(f64, f64); 8] = [
    (-0.975_005_786 / PEAK, 0.222_179_469 / PEAK),
    (-0.316_431_468 / PEAK, 0.948_615_373 / PEAK),
    (0.614_844_067 / PEAK, 0.788_648_701 / PEAK),
    (0.255_869_411 / PEAK, -0.966_711_355 / PEAK),
    (0.756_515_654 / PEAK, 0.653_975_585 / PEAK),
    (0.214_842_691 / PEAK, -0.976_648_667 / PEAK),
    (0.990_461_538 / PEAK, 0.137_789_485 / PEAK),
    (-0.589_390_070 / PEAK, -0.807_848_591 / PEAK),
];

/// Peak of the sum of eight sines of amplitude one with these phases.
const PEAK: f64 = 4.417_95;

/// The sum over its peak, given sine and cosine of the slowest line.
#[inline(always)]
pub(super) fn of_slowest<T: Real>(sine: T, cosine: T) -> T {
    let (mut sine, mut cosine) = (sine, cosine);
    let mut sum = T::ZERO;
    for (of_sine, of_cosine) in PHASES {
        sum += T::of(of_sine) * sine + T::of(of_cosine) * cosine;
        let twice = sine + sine;
        (sine, cosine) = (twice * cosine, T::ONE - twice * sine);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::{Experiment, Player, Reference};
    use super::*;
    use std::vec::Vec;

    const PERIOD: u32 = 10_000;

    fn torques<T: Real>(ticks: usize) -> Vec<T> {
        let experiment = Experiment::Multisine {
            amplitude_nm: T::of(0.02),
            period_ticks: PERIOD,
        };
        let mut player = Player::new(experiment, T::of(1e-4));
        (0..ticks)
            .map(|_| match player.next_tick() {
                Reference::Torque(torque) => torque,
                other => panic!("{other:?}"),
            })
            .collect()
    }

    #[test]
    fn repeats_bit_for_bit_and_begins_at_zero() {
        let torque = torques::<f32>(3 * PERIOD as usize);
        assert_eq!(
            torque[..PERIOD as usize],
            torque[2 * PERIOD as usize..3 * PERIOD as usize]
        );
        // Nine digits of eight phases.
        assert!(torques::<f64>(1)[0].abs() < 0.02 * 1e-8);
    }

    #[test]
    fn peak_is_the_amplitude_and_crest_factor_is_low() {
        let torque = torques::<f64>(PERIOD as usize);
        let peak = torque.iter().fold(0.0_f64, |peak, u| peak.max(u.abs()));
        let rms = libm::sqrt(torque.iter().map(|u| u * u).sum::<f64>() / f64::from(PERIOD));
        // At 78 ticks of the fastest sine, a tick may miss the peak by (pi/78)^2/2 of it.
        assert!((0.999 * 0.02..=0.02).contains(&peak), "{peak}");
        assert!(peak / rms < 2.21, "{}", peak / rms);
    }

    #[test]
    fn holds_its_lines_and_nothing_else() {
        let torque = torques::<f64>(PERIOD as usize);
        let period = PERIOD as usize;
        // What the emulated board computes three million times otherwise.
        let cosines: Vec<f64> = (0..period)
            .map(|i| libm::cos(core::f64::consts::TAU * i as f64 / period as f64))
            .collect();
        let line = |harmonic: u32| {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, u) in torque.iter().enumerate() {
                let turn = harmonic as usize * i;
                re += u * cosines[turn % period] * 2e-4;
                im += u * cosines[(turn + period * 3 / 4) % period] * 2e-4;
            }
            libm::sqrt(re * re + im * im)
        };
        for harmonic in 0..300_u32 {
            let expected = if harmonic.is_power_of_two() && harmonic <= 128 {
                0.02 / PEAK
            } else {
                0.0
            };
            // What `sine_of_turns` is off by, doubled with each octave, of a line.
            let limit = 0.02 / PEAK * 3.8e-9 * 128.0;
            assert!(
                (line(harmonic) - expected).abs() < limit,
                "{harmonic}: {}",
                line(harmonic)
            );
        }
    }

    #[test]
    fn single_precision_follows() {
        let (narrow, wide) = (torques::<f32>(10_000), torques::<f64>(10_000));
        let worst = narrow
            .iter()
            .zip(&wide)
            .map(|(a, b)| (f64::from(*a) - b).abs())
            .fold(0.0_f64, f64::max);
        // Rounding grows with each octave; a step of the 12-bit converter is 2.4e-4.
        assert!(worst < 0.02 * 2.4e-4, "{worst}");
    }
}
