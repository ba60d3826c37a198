//! The size at which an effect is as strong against the noise as was asked for.

use crate::axis::Axis;
use crate::draw::Draw;
use crate::experiment::Experiment;
use crate::form::{Built, Entry, Form, Shape};
use crate::simulate::{Run, run};

/// An axis and what it is made to do.
pub(crate) struct Bench {
    pub(crate) axis: Axis,
    pub(crate) experiments: Vec<Experiment>,
    /// Seed of the noise.
    pub(crate) seed: u64,
}

/// An effect with its shape.
#[derive(Clone, Copy)]
pub(crate) struct Chosen {
    pub(crate) entry: &'static Entry,
    pub(crate) shape: Shape,
}

impl Chosen {
    pub(crate) fn build(&self, size: f64, axis: &Axis) -> Built {
        (self.entry.build)(size, &self.shape, axis)
    }
}

/// Gap and floor of a set of runs, rms over all samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measure {
    pub(crate) gap: f64,
    pub(crate) floor: f64,
    /// Both together, as they came.
    pub(crate) before: f64,
}

impl Bench {
    /// Every experiment with effects; `None` if one of them runs away.
    pub(crate) fn runs(&self, forms: &mut [Box<dyn Form>], substep_s: f64) -> Option<Vec<Run>> {
        (2..)
            .zip(&self.experiments)
            .map(|(stream, experiment)| {
                run(
                    &self.axis,
                    forms,
                    experiment,
                    substep_s,
                    &mut Draw::new(self.seed, stream),
                )
            })
            .collect()
    }

    fn measure_at(&self, chosen: &Chosen, size: f64, substep_s: f64) -> Option<Measure> {
        let mut forms = [chosen.build(size, &self.axis).form];
        self.runs(&mut forms, substep_s).map(|runs| measure(&runs))
    }

    /// Size and measure of an effect whose gap is `ratio` times the floor within a tenth, or with `any` the nearest that
    /// was found; `None` if no size gives that, or the axis runs away.
    pub(crate) fn calibrate(
        &self,
        chosen: &Chosen,
        ratio: f64,
        substep_s: f64,
        any: bool,
    ) -> Option<(f64, Measure)> {
        const EVALUATIONS: usize = 8;
        let off = |measure: &Measure| libm::log((measure.gap / measure.floor).max(1e-6) / ratio);
        // Logarithms of size, with how far off the gap is there.
        let (mut below, mut above) = (None, None);
        let (lowest, highest) = (libm::log(chosen.entry.smallest), 0.0);
        let mut at = libm::log(0.15);
        let mut nearest: Option<(f64, Measure)> = None;
        for _ in 0..EVALUATIONS {
            let size = libm::exp(at);
            let measure = self.measure_at(chosen, size, substep_s)?;
            let now = off(&measure);
            if nearest
                .as_ref()
                .is_none_or(|(_, best)| now.abs() < off(best).abs())
            {
                nearest = Some((size, measure));
            }
            if now.abs() < 0.1 || (at <= lowest && now > 0.0) || (at >= highest && now < 0.0) {
                break;
            }
            if now < 0.0 {
                below = Some((at, now));
            } else {
                above = Some((at, now));
            }
            at = match (below, above) {
                // The gap grows about in proportion to the size, unless it sets in at one: then halves of the bracket.
                (Some((a, off_a)), Some((b, off_b))) if off_b - off_a < 3.0 * (b - a) => {
                    a + (b - a) * (-off_a / (off_b - off_a)).clamp(0.1, 0.9)
                }
                (Some((a, _)), Some((b, _))) => 0.5 * (a + b),
                _ => (at - now.clamp(-2.5, 4.0)).clamp(lowest, highest),
            };
        }
        nearest.filter(|(_, measure)| any || off(measure).abs() < 0.1)
    }
}

/// Gap after a refit of inertia, dry and viscous friction, and floor.
pub(crate) fn measure(runs: &[Run]) -> Measure {
    let all = || {
        runs.iter()
            .flat_map(|run| (0..run.gap.len()).map(move |k| (run, k)))
    };
    let refit = |value: &dyn Fn(&Run, usize) -> f64| {
        let mut normal = [[0.0; 4]; 3];
        let mut sum = 0.0;
        let mut count = 0.0;
        for (run, k) in all() {
            let value = value(run, k);
            let row = run.regressors[k];
            for i in 0..3 {
                for j in 0..3 {
                    normal[i][j] += row[i] * row[j];
                }
                normal[i][3] += row[i] * value;
            }
            sum += value * value;
            count += 1.0;
        }
        let right = [normal[0][3], normal[1][3], normal[2][3]];
        let solved = solve(normal);
        let explained: f64 = solved.iter().zip(&right).map(|(a, b)| a * b).sum();
        ((sum - explained).max(0.0) / count).sqrt()
    };
    let noise = all()
        .map(|(run, k)| run.noise[k] * run.noise[k])
        .sum::<f64>()
        / all().count() as f64;
    Measure {
        gap: refit(&|run, k| run.gap[k]),
        floor: noise.sqrt(),
        before: refit(&|run, k| run.gap[k] + run.noise[k]),
    }
}

/// Three equations by elimination; what nothing determines is zero.
fn solve(mut m: [[f64; 4]; 3]) -> [f64; 3] {
    let scale =
        [m[0][0].sqrt(), m[1][1].sqrt(), m[2][2].sqrt()].map(|s| if s > 0.0 { s } else { 1.0 });
    for i in 0..3 {
        for j in 0..3 {
            m[i][j] /= scale[i] * scale[j];
        }
        m[i][3] /= scale[i];
    }
    // Positive semidefinite with ones on the diagonal: no pivoting is needed.
    for i in 0..3 {
        for j in i + 1..3 {
            let factor = if m[i][i] > 1e-9 {
                m[j][i] / m[i][i]
            } else {
                0.0
            };
            let upper = m[i];
            for (value, above) in m[j].iter_mut().zip(upper).skip(i) {
                *value -= factor * above;
            }
        }
    }
    let mut x = [0.0; 3];
    for i in (0..3).rev() {
        let rest: f64 = (i + 1..3).map(|j| m[i][j] * x[j]).sum();
        x[i] = if m[i][i] > 1e-9 {
            (m[i][3] - rest) / m[i][i]
        } else {
            0.0
        };
    }
    [x[0] / scale[0], x[1] / scale[1], x[2] / scale[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_and_leaves_out_what_nothing_determines() {
        let x = solve([
            [4.0, 2.0, 0.0, 10.0],
            [2.0, 5.0, 1.0, 13.0],
            [0.0, 1.0, 9.0, 11.0],
        ]);
        let right = [
            4.0 * x[0] + 2.0 * x[1],
            2.0 * x[0] + 5.0 * x[1] + x[2],
            x[1] + 9.0 * x[2],
        ];
        for (a, b) in right.iter().zip([10.0, 13.0, 11.0]) {
            assert!((a - b).abs() < 1e-12);
        }
        assert_eq!(
            solve([
                [1.0, 0.0, 0.0, 2.0],
                [0.0, 0.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 3.0]
            ]),
            [2.0, 0.0, 3.0]
        );
    }
}
