//! Sampled linear models of any order from torque and position: least squares, and refined instrumental variables.
//!
//! Position is read in whole counts, and that noise sits on the output: least squares of the ARX equation takes it for
//! damping. The simplified refined instrumental-variable method filters the equation by 1/A and takes the noise-free
//! output for instruments, so that for white noise it is as good as any method can be.
//!
//! Source: Young and Jakeman, Int. J. Control 29(1), 1979 (SRIV); thesis (Aktas, ITU 2002) eq. 2.28.

use crate::identify::linear::{Solution, instrumental};
use crate::signal::rms;
use nalgebra::{DMatrix, DVector};

/// Torque and position of a stretch, even in time.
#[derive(Clone, Copy)]
pub(super) struct Record<'a> {
    pub torque: &'a [f64],
    pub position: &'a [f64],
}

impl<'a> Record<'a> {
    pub fn part(&self, from: usize, to: usize) -> Record<'a> {
        Record {
            torque: &self.torque[from..to],
            position: &self.position[from..to],
        }
    }
}

/// a1..an, b1..bn and a constant, for the origin of position and the offset of torque together.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub order: usize,
    pub delay: usize,
    pub solution: Solution,
}

impl Model {
    pub fn a(&self, i: usize) -> f64 {
        self.solution.parameters[i]
    }

    pub fn b(&self, i: usize) -> f64 {
        self.solution.parameters[self.order + i]
    }

    fn constant(&self) -> f64 {
        self.solution.parameters[2 * self.order]
    }

    /// The output for a torque, from rest at the record's mean.
    pub fn simulate(&self, torque: &[f64], start: f64) -> Vec<f64> {
        let (n, first) = (self.order, torque.first().copied().unwrap_or(0.0));
        let mut out: Vec<f64> = Vec::with_capacity(torque.len());
        for k in 0..torque.len() {
            let mut y = self.constant();
            for i in 0..n {
                y -= self.a(i) * if k > i { out[k - 1 - i] } else { start };
                let lag = 1 + i + self.delay;
                y += self.b(i) * if k >= lag { torque[k - lag] } else { first };
            }
            out.push(y);
        }
        out
    }

    /// What a simulation leaves of position, past its beginning.
    pub fn residuals(&self, record: Record<'_>) -> Vec<f64> {
        let start = record.position.first().copied().unwrap_or(0.0);
        let out = self.simulate(record.torque, start);
        let skip = record.position.len() / 20;
        out.iter()
            .zip(record.position)
            .skip(skip)
            .map(|(x, y)| y - x)
            .collect()
    }

    /// Their rms.
    pub fn output_error(&self, record: Record<'_>) -> f64 {
        rms(self.residuals(record))
    }

    fn stable(&self) -> bool {
        // Jury's test of orders up to three.
        let a = |i: usize| if i < self.order { self.a(i) } else { 0.0 };
        let (a1, a2, a3) = (a(0), a(1), a(2));
        1.0 + a1 + a2 + a3 > 0.0
            && 1.0 - a1 + a2 - a3 > 0.0
            && a3.abs() < 1.0
            && (a2 - a1 * a3).abs() < 1.0 - a3 * a3
    }
}

/// Least squares of the equation as it stands.
pub(super) fn least_squares(record: Record<'_>, order: usize, delay: usize) -> Option<Model> {
    filtered(record, order, delay, |signal| signal.to_vec())
}

/// Refined instrumental variables, from several beginnings; the one that leaves least of the output.
pub(super) fn refined(record: Record<'_>, order: usize, delay: usize) -> Option<Model> {
    // Beginnings: least squares after a low-pass that takes the encoder's noise away, its pole given in samples.
    const POLES: [f64; 3] = [3.0, 15.0, 75.0];
    POLES
        .iter()
        .filter_map(|&samples| {
            let pole = (-1.0 / samples).exp();
            let smooth = |signal: &[f64]| over(&over(signal, &[-pole]), &[-pole]);
            let start = filtered(record, order, delay, smooth)?;
            iterate(record, start)
        })
        .map(|model| (model.output_error(record), model))
        .filter(|(error, _)| error.is_finite())
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, model)| model)
}

/// Refined instrumental variables from one beginning; none where it leads to no stable model.
pub(super) fn iterate(record: Record<'_>, mut model: Model) -> Option<Model> {
    const ROUNDS: usize = 20;
    const SETTLED: f64 = 1e-6;
    for round in 0..ROUNDS {
        if !model.stable() {
            return None;
        }
        let (order, delay) = (model.order, model.delay);
        let a: Vec<f64> = (0..order).map(|i| model.a(i)).collect();
        let clean = model.simulate(record.torque, record.position[0]);
        let filter = |signal: &[f64]| over(signal, &a);
        let (y, u, x) = (
            filter(record.position),
            filter(record.torque),
            filter(&clean),
        );
        let one = filter(&vec![1.0; y.len()]);
        let skip = record.position.len() / 50 + order + delay;
        let (left, regressors) = equation(&y, &y, &u, &one, order, delay, skip);
        let (_, instruments) = equation(&y, &x, &u, &one, order, delay, skip);
        let last = round + 1 == ROUNDS;
        let next = Model {
            order,
            delay,
            solution: instrumental(&left, &regressors, &instruments, 0)?,
        };
        let change = (&next.solution.parameters - &model.solution.parameters).norm()
            / next.solution.parameters.norm();
        model = next;
        if change < SETTLED || last {
            if !model.stable() {
                return None;
            }
            // Noise that stays over some samples, as rounding to counts does, needs its correlation counted.
            let lags = (4.0 * (left.len() as f64).cbrt()) as usize;
            model.solution = instrumental(&left, &regressors, &instruments, lags)?;
            return Some(model);
        }
    }
    None
}

fn filtered(
    record: Record<'_>,
    order: usize,
    delay: usize,
    filter: impl Fn(&[f64]) -> Vec<f64>,
) -> Option<Model> {
    let (y, u) = (filter(record.position), filter(record.torque));
    let one = filter(&vec![1.0; y.len()]);
    let (left, regressors) = equation(
        &y,
        &y,
        &u,
        &one,
        order,
        delay,
        record.position.len() / 50 + order + delay,
    );
    let solution = instrumental(&left, &regressors, &regressors, 0)?;
    Some(Model {
        order,
        delay,
        solution,
    })
}

/// Left side, and columns -y(k-i), u(k-i-delay), 1 with `past` in the place of y.
fn equation(
    y: &[f64],
    past: &[f64],
    u: &[f64],
    one: &[f64],
    order: usize,
    delay: usize,
    skip: usize,
) -> (DVector<f64>, DMatrix<f64>) {
    let rows = y.len() - skip;
    let left = DVector::from_iterator(rows, y[skip..].iter().copied());
    let columns = DMatrix::from_fn(rows, 2 * order + 1, |row, column| {
        let k = skip + row;
        if column < order {
            -past[k - 1 - column]
        } else if column < 2 * order {
            u[k - 1 - (column - order) - delay]
        } else {
            one[k]
        }
    });
    (left, columns)
}

/// A signal through 1/A, from rest at its first value.
fn over(signal: &[f64], a: &[f64]) -> Vec<f64> {
    let rest = signal.first().copied().unwrap_or(0.0) / (1.0 + a.iter().sum::<f64>());
    let mut out: Vec<f64> = Vec::with_capacity(signal.len());
    for (k, value) in signal.iter().enumerate() {
        let past: f64 = a
            .iter()
            .enumerate()
            .map(|(i, a)| a * if k > i { out[k - 1 - i] } else { rest })
            .sum();
        out.push(value - past);
    }
    out
}
