//! Branches of a slow loop: torque against position from one reversal to the next.

use crate::identify::record::span;
use crate::signal::rms;

/// Means over small steps of time, at the branch's constant speed.
#[derive(Clone, Debug, PartialEq)]
pub struct Branch {
    /// +1 or -1.
    pub direction: f64,
    /// rad
    pub position_rad: Vec<f64>,
    /// N m
    pub torque_nm: Vec<f64>,
    /// s
    pub time_s: Vec<f64>,
    /// Rms of the torque about the means, N m.
    pub spread_nm: f64,
}

impl Branch {
    /// The branch from so far after its beginning on; none where nothing is left.
    pub(super) fn after(&self, distance_rad: f64) -> Option<Self> {
        let origin = self.position_rad.first()?;
        let from = self
            .position_rad
            .iter()
            .position(|q| (q - origin).abs() >= distance_rad)?;
        let rest = |values: &[f64]| values[from..].to_vec();
        (self.position_rad.len() > from + 2).then(|| Self {
            direction: self.direction,
            position_rad: rest(&self.position_rad),
            torque_nm: rest(&self.torque_nm),
            time_s: rest(&self.time_s),
            spread_nm: self.spread_nm,
        })
    }
}

/// A position counts as turned when it came back by this many encoder counts.
const TURN_COUNTS: f64 = 3.0;
/// Share of a branch's median speed from which on it counts as constant: before that the bristles' damping changes torque.
const UP_TO_SPEED: f64 = 0.8;
/// Most rows of a branch.
const MOST_ROWS: f64 = 200.0;

/// Branches of a stretch of a record. `count` is the least step of position.
pub(super) fn branches(
    time_s: &[f64],
    position: &[f64],
    torque: &[f64],
    count: f64,
) -> Vec<Branch> {
    let turn = (TURN_COUNTS * count).max(0.02 * span(position));
    let mut turns = vec![0];
    let (mut low, mut high, mut direction) = (0, 0, 0.0);
    for k in 1..position.len() {
        if position[k] > position[high] {
            high = k;
        }
        if position[k] < position[low] {
            low = k;
        }
        if direction >= 0.0 && position[high] - position[k] > turn {
            // While the direction is still unknown the beginning is the first turn.
            if direction > 0.0 || position[high] - position[0] > turn {
                turns.push(high);
            }
            (direction, low) = (-1.0, k);
        } else if direction <= 0.0 && position[k] - position[low] > turn {
            if direction < 0.0 || position[0] - position[low] > turn {
                turns.push(low);
            }
            (direction, high) = (1.0, k);
        }
    }
    turns.push(position.len() - 1);
    turns
        .windows(2)
        .filter_map(|ends| {
            let range = ends[0]..ends[1] + 1;
            branch(
                &time_s[range.clone()],
                &position[range.clone()],
                &torque[range],
                count,
            )
        })
        .collect()
}

/// Rows are means over even times, of a count of travel or more: over a whole count rounding averages out. A row chosen
/// by its measured position would be biased by that position's noise.
fn branch(time_s: &[f64], position: &[f64], torque: &[f64], count: f64) -> Option<Branch> {
    let travel = position[position.len() - 1] - position[0];
    let direction = travel.signum();
    let rows = (travel.abs() / count).min(MOST_ROWS).floor();
    let length = (position.len() as f64 / rows).ceil() as usize;
    if rows < 3.0 || length == 0 {
        return None;
    }
    let means = |values: &[f64]| -> Vec<f64> {
        values
            .chunks_exact(length)
            .map(|part| part.iter().sum::<f64>() / length as f64)
            .collect()
    };
    let (time_s, mut position_rad, torque_nm) = (means(time_s), means(position), means(torque));
    let spread_nm = rms(torque
        .iter()
        .zip(0..)
        .filter_map(|(u, k): (_, usize)| Some(u - torque_nm.get(k / length)?)));
    // The encoder rounds down: on average by half a count.
    for q in &mut position_rad {
        *q += 0.5 * count;
    }
    let steps: Vec<f64> = position_rad
        .windows(2)
        .map(|q| direction * (q[1] - q[0]))
        .collect();
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let slow = UP_TO_SPEED * sorted.get(sorted.len() / 2)?;
    let from = steps.iter().position(|&step| step >= slow)?;
    let to = steps.iter().rposition(|&step| step >= slow)? + 1;
    Some(Branch {
        direction,
        position_rad: position_rad[from..=to].to_vec(),
        torque_nm: torque_nm[from..=to].to_vec(),
        time_s: time_s[from..=to].to_vec(),
        spread_nm,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_has_its_branches() {
        let q = |k: usize| {
            let x = k as f64 / 400.0;
            if x < 0.25 {
                x
            } else if x < 0.75 {
                0.5 - x
            } else {
                x - 1.0
            }
        };
        let position: Vec<f64> = (0..800).map(|k| (q(k % 400) * 200.0).floor()).collect();
        let time: Vec<f64> = (0..800).map(|k| k as f64).collect();
        let found = branches(&time, &position, &position, 1.0);
        let directions: Vec<f64> = found.iter().map(|branch| branch.direction).collect();
        assert_eq!(directions, [1.0, -1.0, 1.0, -1.0, 1.0]);
        for branch in &found {
            let steps: Vec<f64> = branch
                .position_rad
                .windows(2)
                .map(|pair| pair[1] - pair[0])
                .collect();
            assert!(
                steps.iter().all(|step| step * branch.direction > 0.0),
                "{steps:?}"
            );
        }
    }
}
