//! Waves over angle, one order after the other, at the nodes of all records.

use super::regime::Node;
use crate::inverse::Record;
use bristle_plant::Unit;
use bristle_plant::effect::Scale;
use rayon::prelude::*;

/// Orders of a spectrum over angle.
const ORDERS: usize = 240;
/// Orders that are turned on from the first of them rather than calculated each.
const RUN: usize = 30;
/// Part of the product of squares that sine and cosine of an order must have apart; less, and the records pass no whole
/// wave of it.
const APART: f64 = 0.01;

/// What `of` makes of each order, in waves a turn or a metre, and its sine and cosine at the nodes at these places: whole
/// orders a turn, or multiples of one wave over a linear stroke.
pub(super) fn over_orders<T: Send>(
    records: &[Record],
    nodes: &[Node],
    scale: &Scale,
    places: &[usize],
    of: impl Fn(f64, &[[f64; 2]]) -> T + Sync,
) -> Vec<T> {
    let unit = scale.unit;
    let step = match unit {
        Unit::Rotary => 1.0,
        Unit::Linear => 1.0 / scale.stroke_rad(),
    };
    let angles: Vec<f64> = places
        .iter()
        .map(|&i| unit.wave_rad(step * nodes[i].position_rad(records)))
        .collect();
    let at = |order: usize| -> Vec<[f64; 2]> {
        let wave = |angle: &f64| (order as f64 * angle).sin_cos().into();
        angles.iter().map(wave).collect()
    };
    let first = at(1);
    let runs: Vec<Vec<T>> = (0..ORDERS)
        .into_par_iter()
        .step_by(RUN)
        .map(|before| {
            let mut waves = at(before);
            let orders = before + 1..(before + RUN).min(ORDERS) + 1;
            let one = |order: usize| {
                for ([sin, cos], [by_sin, by_cos]) in waves.iter_mut().zip(&first) {
                    (*sin, *cos) = (*sin * by_cos + *cos * by_sin, *cos * by_cos - *sin * by_sin);
                }
                of(step * order as f64, &waves)
            };
            orders.map(one).collect()
        })
        .collect();
    runs.into_iter().flatten().collect()
}

/// Squares and product of an order's sine and cosine, summed over nodes: what least squares of a wave needs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Squares {
    sines: f64,
    products: f64,
    cosines: f64,
}

impl Squares {
    /// Over all nodes of the order at hand.
    pub(super) fn new(at: &[[f64; 2]]) -> Self {
        let mut squares = Self::default();
        for [sin, cos] in at {
            squares.sines += sin * sin;
            squares.products += sin * cos;
            squares.cosines += cos * cos;
        }
        squares
    }

    /// The wave that fits best what has these products with sine and cosine; none where the records pass no whole wave.
    pub(super) fn solve(self, [a, b]: [f64; 2]) -> Option<[f64; 2]> {
        let all = self.sines * self.cosines;
        let determinant = all - self.products * self.products;
        (determinant > APART * all).then(|| {
            [
                (self.cosines * a - self.products * b) / determinant,
                (self.sines * b - self.products * a) / determinant,
            ]
        })
    }
}
