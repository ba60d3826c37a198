//! Power over frequency in half-overlapping Hann windows: Welch 1967, IEEE Trans. Audio Electroacoust. 15.

use crate::inverse::Record;
use crate::signal::fourier;
use std::f64::consts::TAU;

/// Power of a rest over frequency, window by window.
pub(super) struct Windows {
    /// Line by line, Hz.
    pub(super) at_hz: Vec<f64>,
    /// Place of each window's record, and its one-sided density, a value a line, N^2 m^2/Hz.
    pub(super) density: Vec<(usize, Vec<f64>)>,
}

impl Windows {
    /// Of a rest with a value a node, N m, in windows of so many nodes of the slowest record. Records of other rates come to
    /// the same lines with a window of another length.
    pub(super) fn new(records: &[Record], rest: &[f64], length: usize) -> Self {
        let slowest_s = records.iter().map(Record::node_s).fold(0.0, f64::max);
        let lines = length / 2;
        let highest_hz = 0.5 / slowest_s;
        let mut density = Vec::new();
        let mut first = 0;
        for (place, record) in records.iter().enumerate() {
            let window = (length as f64 * slowest_s / record.node_s()).round() as usize;
            let hann: Vec<f64> = (0..window)
                .map(|k| 0.5 - 0.5 * (TAU * k as f64 / window as f64).cos())
                .collect();
            // One-sided; a Hann window has 3/8 of the power.
            let per = 2.0 * record.node_s() / (0.375 * window as f64);
            let transform = fourier(window);
            let (mut input, mut output) = (transform.make_input_vec(), transform.make_output_vec());
            for stretch in &record.stretches {
                let nodes = record.nodes_of(stretch);
                let rest = &rest[first..first + nodes];
                for start in (0..(nodes + 1).saturating_sub(window)).step_by(window / 2) {
                    for (x, (rest, hann)) in input.iter_mut().zip(rest[start..].iter().zip(&hann)) {
                        *x = rest * hann;
                    }
                    if transform.process(&mut input, &mut output).is_ok() {
                        let lines = output[1..=lines].iter();
                        let powers = lines.map(|line| per * line.norm_sqr());
                        density.push((place, powers.collect()));
                    }
                }
                first += nodes;
            }
        }
        Self {
            at_hz: (1..=lines)
                .map(|line| highest_hz * line as f64 / lines as f64)
                .collect(),
            density,
        }
    }
}
