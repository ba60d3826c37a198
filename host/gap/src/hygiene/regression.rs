//! Least squares with standard errors from leaving out one block of time at a time: residuals of friction are correlated
//! over long times, so the usual formula would promise far too much.

use nalgebra::{SMatrix, SVector};

/// Inertia, Coulomb friction, viscous friction, offset.
pub(super) const TERMS: usize = 4;
type Normal = SMatrix<f64, TERMS, TERMS>;
type Vector = SVector<f64, TERMS>;

/// Blocks of time.
pub(super) const BLOCKS: usize = 16;
/// A term that the others explain to this part is not seen: its variance is a thousand times that of a term alone.
const UNSEEN: f64 = 1e-3;

/// Sums of one block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    xx: Normal,
    xy: Vector,
    yy: f64,
    y: f64,
    rows: f64,
}

impl Sums {
    pub(super) fn add(&mut self, x: [f64; TERMS], y: f64) {
        let x = Vector::from(x);
        self.xx += x * x.transpose();
        self.xy += x * y;
        self.yy += y * y;
        self.y += y;
        self.rows += 1.0;
    }

    fn plus(&self, other: &Self, sign: f64) -> Self {
        Self {
            xx: self.xx + other.xx * sign,
            xy: self.xy + other.xy * sign,
            yy: self.yy + other.yy * sign,
            y: self.y + other.y * sign,
            rows: self.rows + other.rows * sign,
        }
    }

    /// Parameters; a term that is not seen is left out and zero.
    fn solve(&self, seen: [bool; TERMS]) -> Option<Vector> {
        let mut xx = self.xx;
        let mut xy = self.xy;
        for i in 0..TERMS {
            if !seen[i] {
                xx.set_row(i, &SMatrix::zeros());
                xx.set_column(i, &SMatrix::zeros());
                xx[(i, i)] = 1.0;
                xy[i] = 0.0;
            }
        }
        let scale = Vector::from_fn(|i, _| 1.0 / xx[(i, i)].sqrt().max(f64::MIN_POSITIVE));
        let scaled = Normal::from_fn(|i, j| xx[(i, j)] * scale[i] * scale[j]);
        let solved = scaled.cholesky()?.solve(&xy.component_mul(&scale));
        let out = solved.component_mul(&scale);
        out.iter().all(|x| x.is_finite()).then_some(out)
    }

    /// Terms that differ enough from all others and from nothing; the last ones give way first.
    fn seen(&self) -> [bool; TERMS] {
        let mut seen = [false; TERMS];
        for i in 0..TERMS {
            if self.xx[(i, i)] <= 0.0 {
                continue;
            }
            let scale = |j: usize| 1.0 / self.xx[(j, j)].sqrt();
            let kept: Vec<usize> = (0..i).filter(|&j| seen[j]).collect();
            let inner = nalgebra::DMatrix::from_fn(kept.len(), kept.len(), |a, b| {
                self.xx[(kept[a], kept[b])] * scale(kept[a]) * scale(kept[b])
            });
            let with = nalgebra::DVector::from_fn(kept.len(), |a, _| {
                self.xx[(kept[a], i)] * scale(kept[a]) * scale(i)
            });
            let explained = match inner.cholesky() {
                Some(factor) => with.dot(&factor.solve(&with)),
                None => 1.0,
            };
            seen[i] = 1.0 - explained > UNSEEN;
        }
        seen
    }
}

/// A fit over all blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fit {
    /// Parameters, zero where not seen.
    pub(super) value: [f64; TERMS],
    pub(super) standard_error: [f64; TERMS],
    pub(super) seen: [bool; TERMS],
    /// Of the mean friction at `mean_speed`: Coulomb plus viscous.
    pub(super) friction: (f64, f64),
    /// Mean square of what is left.
    pub(super) left: f64,
    /// Share of the variance explained.
    pub(super) explained: f64,
}

/// Fits all blocks, and all but one in turn.
pub(super) fn fit(blocks: &[Sums], mean_speed: f64) -> Option<Fit> {
    let all = blocks
        .iter()
        .fold(Sums::default(), |all, block| all.plus(block, 1.0));
    if all.rows < 50.0 {
        return None;
    }
    let seen = all.seen();
    let value = all.solve(seen)?;
    let friction = |x: &Vector| x[1] + x[2] * mean_speed;
    let used: Vec<_> = blocks.iter().filter(|block| block.rows > 0.0).collect();
    let (mut squares, mut friction_squares) = (Vector::zeros(), 0.0);
    for block in &used {
        let without = all.plus(block, -1.0).solve(seen)?;
        let off = without - value;
        squares += off.component_mul(&off);
        friction_squares += (friction(&without) - friction(&value)).powi(2);
    }
    // The jackknife's variance.
    let n = used.len() as f64;
    let factor = (n - 1.0) / n;
    let left =
        (all.yy - 2.0 * value.dot(&all.xy) + value.dot(&(all.xx * value))).max(0.0) / all.rows;
    let variance = (all.yy - all.y * all.y / all.rows).max(f64::MIN_POSITIVE) / all.rows;
    Some(Fit {
        value: value.into(),
        standard_error: squares.map(|sum| (factor * sum).sqrt()).into(),
        seen,
        friction: (friction(&value), (factor * friction_squares).sqrt()),
        left,
        explained: 1.0 - left / variance,
    })
}
