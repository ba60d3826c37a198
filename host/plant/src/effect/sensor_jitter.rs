//! Time stamps that are off: the position is that of another instant than the one it is filed under.
//!
//! q + v d, d normal with the given rms, one draw for each sample. The same seed gives the same draws.
//!
//! Source: Da Dalt et al., "On the jitter requirements of the sampling clock", IEEE Trans. Circuits Syst. I 49(9), 2002:
//! an error in proportion to the slope.

use super::{Effect, Entry, Instant, Kind, Parameter};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

struct Jitter {
    jitter_s: f64,
    random: ChaCha8Rng,
}

impl Effect for Jitter {
    fn sensor(&mut self, now: &Instant) -> f64 {
        let draw: f64 = StandardNormal.sample(&mut self.random);
        now.motion.position_rad + self.jitter_s * draw * now.motion.velocity_rad_s
    }
}

pub(super) const ENTRY: Entry = Entry {
    id: "sensor.jitter",
    model: "q + v d, d normal",
    parameters: &[
        Parameter::same("jitter_s", Kind::Size, |_| [1e-5, 1e-3]),
        Parameter::same("seed", Kind::Seed, |_| [1.0, 1.0]).or(1.0),
    ],
    build: |values, _| {
        Box::new(Jitter {
            jitter_s: values[0],
            random: ChaCha8Rng::seed_from_u64(values[1].to_bits()),
        })
    },
};

#[cfg(test)]
mod tests {
    use super::super::testing::at;
    use super::*;
    use crate::unit::Unit;

    fn rms(velocity_rad_s: f64, seed: f64) -> f64 {
        let mut effect = (ENTRY.build)(&[1e-4, seed], Unit::Rotary);
        let errors = (0..20_000).map(|_| effect.sensor(&at(0.0, velocity_rad_s)));
        (errors.map(|e| e * e).sum::<f64>() / 2e4).sqrt()
    }

    #[test]
    fn its_noise_grows_with_speed() {
        assert_eq!(rms(0.0, 1.0), 0.0);
        for v in [1.0, -30.0_f64] {
            // The spread of an rms of 20000 draws is 0.5 %.
            assert!((rms(v, 1.0) / (1e-4 * v.abs()) - 1.0).abs() < 0.02);
        }
        assert_eq!(rms(1.0, 7.0), rms(1.0, 7.0));
        assert_ne!(rms(1.0, 7.0), rms(1.0, 8.0));
    }
}
