//! Intervals by profile likelihood: a value belongs to the interval if, with it held and everything else fitted anew, the
//! sum of squares stays below the limit that the F distribution sets.
//!
//! Source: Bates and Watts, Nonlinear Regression Analysis and Its Applications, Wiley 1988, chapter 6. The linear
//! approximation would give v_s a bounded interval on data that show no fall at all.

use super::curve::{Held, Linear, Normal};
use super::problem::{Optimum, Problem, spread};
use crate::axis_file::StribeckShape;
use crate::identify::{Estimate, Parameter, Verdict};

/// Every parameter of a fit with its interval.
pub(super) fn estimates(
    problem: &Problem<'_>,
    shape: StribeckShape,
    best: &Optimum,
    limit: f64,
) -> Vec<Estimate> {
    let grid = problem.grid(shape);
    let falls = shape != StribeckShape::Constant;
    let velocity = own(
        grid.velocities,
        grid.velocity_count,
        best.velocity,
        limit,
        |velocity| {
            spread(grid.exponents, grid.exponent_count)
                .chain([best.exponent])
                .filter_map(|exponent| problem.at(shape, velocity, exponent))
                .map(|at| at.sum)
                .fold(f64::INFINITY, f64::min)
        },
    );
    let exponent = own(
        grid.exponents,
        grid.exponent_count,
        best.exponent,
        limit,
        |exponent| {
            inside(velocity, grid.velocities)
                .chain([best.velocity])
                .filter_map(|velocity| problem.at(shape, velocity, exponent))
                .map(|at| at.sum)
                .fold(f64::INFINITY, f64::min)
        },
    );
    // The linear parameters need the curve's own no further than where those are believable.
    let mut settings = vec![(best.velocity, best.exponent)];
    if falls {
        let exponents: Vec<f64> = if shape == StribeckShape::GeneralisedExponential {
            inside(exponent, grid.exponents).step_by(4).collect()
        } else {
            vec![best.exponent]
        };
        settings.extend(
            inside(velocity, grid.velocities)
                .flat_map(|v| exponents.iter().map(move |&d| (v, d)).collect::<Vec<_>>()),
        );
    }
    let normals: Vec<Normal> = settings
        .into_iter()
        .filter_map(|(v, d)| Normal::new(problem.rows, shape, v, d, problem.both_ways))
        .collect();
    let torque = (problem
        .rows
        .iter()
        .map(|row| row.torque * row.torque)
        .sum::<f64>()
        / problem.rows.len() as f64)
        .sqrt();
    let linear = |direction: Linear, least: f64| {
        let value = direction.dot(&best.linear);
        let sum = |value: f64| {
            let held = Some(Held { direction, value });
            normals
                .iter()
                .filter_map(|normal| normal.solve(held))
                .map(|at| at.0)
                .fold(f64::INFINITY, f64::min)
        };
        let size = if direction[1] != 0.0 {
            torque / problem.high
        } else {
            torque
        };
        let size = size.max(value.abs());
        [
            edge(value, -size, least, limit, sum),
            edge(value, size, f64::INFINITY, limit, sum),
        ]
    };
    let unit = |i: usize| Linear::from_fn(|j, _| if i == j { 1.0 } else { 0.0 });
    let everywhere = [f64::NEG_INFINITY, f64::INFINITY];
    let coulomb = linear(unit(2), 0.0);
    let friction = best.linear[2];
    let sum_only = format!(
        "only one direction was measured: {:.4e} N m (N) is F_C with the offset; measure the other direction too",
        best.linear[2]
    );
    let repeat = || "repeat the speed ladder, or hold each speed longer".to_string();
    let mut estimates = Vec::new();
    let offset = if problem.both_ways {
        linear(unit(0), f64::NEG_INFINITY)
    } else {
        everywhere
    };
    estimates.push(Estimate::judged(
        Parameter::Offset,
        best.linear[0],
        offset,
        friction,
        || {
            if problem.both_ways {
                repeat()
            } else {
                sum_only.clone()
            }
        },
    ));
    if problem.both_ways {
        estimates.push(Estimate::judged(
            Parameter::Coulomb,
            friction,
            coulomb,
            friction,
            repeat,
        ));
    } else {
        let open = [0.0, f64::INFINITY];
        estimates.push(Estimate::judged(
            Parameter::Coulomb,
            friction,
            open,
            friction,
            || sum_only.clone(),
        ));
    }
    let viscous = linear(unit(1), 0.0);
    let faster = || format!("measure faster than {:.3e} rad/s", problem.high);
    estimates.push(Estimate::judged(
        Parameter::Viscous,
        best.linear[1],
        viscous,
        best.linear[1],
        faster,
    ));
    if falls {
        let mut stiction = if problem.both_ways {
            linear(unit(2) + unit(3), 0.0)
        } else {
            [0.0, f64::INFINITY]
        };
        if velocity[0] == 0.0 {
            // A fall that ends below the slowest point may start at any level.
            stiction[1] = f64::INFINITY;
        }
        let advice = || advice(problem, velocity, best.velocity);
        let mut stiction = Estimate::judged(
            Parameter::Stiction,
            best.linear[2] + best.linear[3],
            stiction,
            best.linear[2] + best.linear[3],
            advice,
        );
        let v_s = Estimate::judged(
            Parameter::StribeckVelocity,
            best.velocity,
            velocity,
            best.velocity,
            advice,
        );
        if v_s.verdict == Verdict::NotIdentified && stiction.verdict == Verdict::Identified {
            // A level that the slowest points show is not yet that at rest.
            stiction.verdict = Verdict::Weak;
            stiction.advice = Some(advice());
        }
        estimates.extend([stiction, v_s]);
        if shape == StribeckShape::GeneralisedExponential {
            estimates.push(Estimate::judged(
                Parameter::StribeckExponent,
                best.exponent,
                exponent,
                best.exponent,
                || "add points where friction falls, about v_s".to_string(),
            ));
        }
    }
    estimates
}

fn advice(problem: &Problem<'_>, [low, high]: [f64; 2], velocity: f64) -> String {
    match (low > 0.0, high.is_finite()) {
        (false, false) => problem.slower(),
        (false, true) => format!(
            "the fall lies below the slowest speed, {:.3e} rad/s: v_s and F_S need slower points, or a break-away \
             experiment for F_S",
            problem.low
        ),
        (true, false) => format!(
            "the fall has no end below the fastest speed, {:.3e} rad/s: v_s and F_C need faster points",
            problem.high
        ),
        (true, true) => format!(
            "add points in both directions about {velocity:.3e} rad/s, where friction falls"
        ),
    }
}

/// A fine grid over an interval, or over its bounds where it has none of its own.
fn inside([low, high]: [f64; 2], bounds: [f64; 2]) -> impl Iterator<Item = f64> {
    let low = if low > 0.0 { low } else { bounds[0] };
    let high = if high.is_finite() { high } else { bounds[1] };
    spread([low, high], 40)
}

/// Interval of one of the curve's own parameters: 0 or infinity where the limit holds up to the bound of the grid.
fn own(
    bounds: [f64; 2],
    count: usize,
    best: f64,
    limit: f64,
    sum: impl Fn(f64) -> f64,
) -> [f64; 2] {
    if count < 2 {
        return [best; 2];
    }
    let mut values: Vec<f64> = spread(bounds, count).chain([best]).collect();
    values.sort_by(f64::total_cmp);
    let inside: Vec<bool> = values
        .iter()
        .map(|&v| v == best || sum(v) <= limit)
        .collect();
    let first = inside.iter().position(|&is| is).unwrap_or(0);
    let last = inside.iter().rposition(|&is| is).unwrap_or(0);
    let between = |mut within: f64, mut beyond: f64| {
        for _ in 0..30 {
            let middle = (within * beyond).sqrt();
            if sum(middle) <= limit {
                within = middle;
            } else {
                beyond = middle;
            }
        }
        within
    };
    [
        if first == 0 {
            0.0
        } else {
            between(values[first], values[first - 1])
        },
        if last + 1 == values.len() {
            f64::INFINITY
        } else {
            between(values[last], values[last + 1])
        },
    ]
}

/// Where the sum of squares reaches the limit on the side of the best value that `size` has the sign of; `least` where it
/// does not before it, and infinity where it does not within a thousand times the size.
fn edge(best: f64, size: f64, least: f64, limit: f64, sum: impl Fn(f64) -> f64) -> f64 {
    const FIRST: f64 = 1e-6;
    const FARTHEST: f64 = 1e3;
    let mut share = FIRST;
    let mut within = best;
    let mut beyond = loop {
        let next = best + share * size;
        if size < 0.0 && next <= least {
            if sum(least) <= limit {
                return least;
            }
            break least;
        }
        if sum(next) > limit {
            break next;
        }
        if share > FARTHEST {
            return size.signum() * f64::INFINITY;
        }
        within = next;
        share *= 2.0;
    };
    for _ in 0..40 {
        let middle = 0.5 * (within + beyond);
        if sum(middle) <= limit {
            within = middle;
        } else {
            beyond = middle;
        }
    }
    within
}
