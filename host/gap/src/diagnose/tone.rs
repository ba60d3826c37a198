//! Tones in a rest: what goes on at one frequency through a whole record can be predicted, so it is no noise.

use super::regime::Node;
use super::spectrum::{PADDED, two_columns};
use crate::inverse::Record;
use crate::signal::fourier;
use nalgebra::DVector;
use std::f64::consts::TAU;

/// Part of the squares that a tone takes. The highest line of noise takes some 2 ln(n)/n of n independent ones: a hundredth of a
/// thousand.
const STANDS_OUT: f64 = 0.1;
/// Most tones of a record.
const MOST: usize = 3;
/// Frequencies of the mains, Hz. A tone at one of them or a multiple is the recorder's hum.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];

/// A tone.
struct Tone {
    rad_s: f64,
    cosine: f64,
    sine: f64,
}

impl Tone {
    fn at(&self, time_s: f64) -> f64 {
        let (sine, cosine) = (self.rad_s * time_s).sin_cos();
        self.cosine * cosine + self.sine * sine
    }
}

/// A rest without the tones that stand out among some nodes of each record, places and values.
pub(super) fn toneless(
    records: &[Record],
    nodes: &[Node],
    left_over: &[f64],
    among: impl Fn(usize) -> Vec<(usize, f64)>,
) -> Vec<f64> {
    let mut toneless = left_over.to_vec();
    for (place, record) in records.iter().enumerate() {
        let of_record: Vec<usize> = (0..nodes.len())
            .filter(|&at| nodes[at].record == place)
            .collect();
        let Some(&first) = of_record.first() else {
            continue;
        };
        let mut values: Vec<(f64, f64)> = of_record
            .iter()
            .map(|&at| (nodes[at].time_s(records), left_over[at]))
            .collect();
        let among: Vec<usize> = among(place).into_iter().map(|(at, _)| at - first).collect();
        let spacing_s = record.node_s();
        take_tones(&mut values, &among, spacing_s);
        for (at, (_, value)) in of_record.into_iter().zip(values) {
            toneless[at] = value;
        }
    }
    toneless
}

/// Takes off the values `all` at their times, s, the tones that stand out among some of them, which lie a multiple of `spacing_s` apart.
fn take_tones(all: &mut [(f64, f64)], among: &[usize], spacing_s: f64) {
    for _ in 0..MOST {
        let Some(tone) = loudest(all, among, spacing_s) else {
            break;
        };
        for (time_s, value) in all.iter_mut() {
            *value -= tone.at(*time_s);
        }
    }
}

fn loudest(all: &[(f64, f64)], among: &[usize], spacing_s: f64) -> Option<Tone> {
    let place = |time_s: f64| (time_s / spacing_s).round() as usize;
    let last = among.iter().map(|&at| place(all[at].0)).max()?;
    let length = (PADDED * (last + 1)).next_power_of_two();
    let mut even = vec![0.0; length];
    for &at in among {
        even[place(all[at].0)] += all[at].1;
    }
    let plan = fourier(length);
    let mut spectrum = plan.make_output_vec();
    plan.process(&mut even, &mut spectrum).ok()?;
    let line_hz = 1.0 / (length as f64 * spacing_s);
    let resolved_hz = 1.0 / (last + 1) as f64 / spacing_s;
    let is_hum = |line: usize| {
        let hz = line as f64 * line_hz;
        let off = |mains_hz: f64| (hz - mains_hz * (hz / mains_hz).round().max(1.0)).abs();
        MAINS_HZ
            .into_iter()
            .any(|mains_hz| off(mains_hz) < resolved_hz)
    };
    // Below a few periods a record it is no tone.
    let lines = spectrum.iter().enumerate().skip(3 * PADDED);
    let (line, _) = lines
        .filter(|(line, _)| !is_hum(*line))
        .max_by(|a, b| a.1.norm_sqr().total_cmp(&b.1.norm_sqr()))?;
    let rad_s = TAU * line as f64 * line_hz;
    let column = |of: fn(f64) -> f64| {
        let values = among.iter().map(|&at| of(rad_s * all[at].0));
        DVector::from_iterator(among.len(), values)
    };
    let rest = DVector::from_iterator(among.len(), among.iter().map(|&at| -all[at].1));
    let (cosine, sine, takes) = two_columns(&column(f64::cos), &column(f64::sin), &rest)?;
    (takes > STANDS_OUT * rest.norm_squared()).then_some(Tone {
        rad_s,
        cosine,
        sine,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Noise of size one and a tone, 8 s at 4 ms with a gap; what is left of both, rms.
    fn left(tone: f64, frequency_hz: f64) -> f64 {
        let mut generator = ChaCha8Rng::seed_from_u64(5);
        let mut all: Vec<(f64, f64)> = (0..2000)
            .map(|k| {
                let time_s = 0.004 * f64::from(k);
                let noise: f64 = StandardNormal.sample(&mut generator);
                (
                    time_s,
                    noise + tone * (TAU * frequency_hz * time_s + 0.4).sin(),
                )
            })
            .collect();
        let among: Vec<usize> = (0..600).chain(900..2000).collect();
        take_tones(&mut all, &among, 0.004);
        crate::signal::rms(all.iter().map(|(_, value)| *value))
    }

    #[test]
    fn a_tone_is_taken_and_noise_is_left() {
        // The lines are 1/16 of a period a record apart at most, so that a tone between two keeps (pi/8)^2/6 = 3 % of its square, which
        // the next round takes. Noise of 2000 values is known to 1/sqrt(4000) = 1.6 %: four of those.
        for tone in [3.0, 0.0] {
            let left = left(tone, 11.43);
            assert!((left - 1.0).abs() < 0.064, "{tone}: {left}");
        }
        // A hum stays: 1 and a tone of 3, whose mean square is 4.5.
        let left = left(3.0, 60.02);
        assert!((left / 5.5_f64.sqrt() - 1.0).abs() < 0.064, "{left}");
    }
}
