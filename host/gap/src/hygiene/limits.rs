//! What an axis can do at most: where its position did more, something else did it.

use crate::axis_file::AxisFile;
use bristle_plant::Unit;

/// What an axis must have missed to call its encoder stuck, in counts.
const MISSED_COUNTS: f64 = 50.0;

/// What the axis can do at most.
pub(super) struct Limits {
    /// Inertia, kg m^2.
    pub(super) inertia: f64,
    /// Effort that surely breaks away, N m.
    pub(super) breaks_away_nm: f64,
    /// Largest effort, N m.
    pub(super) largest_nm: f64,
    /// Friction that may help, N m.
    level_nm: f64,
    /// A count, or a step of the grid that positions lie on, rad.
    pub(super) count: f64,
    /// Travel to believe in before an encoder is called stuck, rad.
    pub(super) missed_rad: f64,
    /// Its places come again each turn.
    pub(super) rotary: bool,
}

impl Limits {
    pub(super) fn new(axis: &AxisFile, position: &[f64], effort: &[f64], count: f64) -> Self {
        let friction = &axis.friction;
        let level = friction
            .stiction
            .unwrap_or(0.0)
            .max(friction.coulomb.unwrap_or(0.0));
        let mut moving: Vec<f64> = position
            .windows(2)
            .zip(effort)
            .filter(|(pair, _)| pair[0] != pair[1])
            .map(|(_, effort)| effort.abs())
            .collect();
        let middle = moving.len() / 2;
        let typical = if moving.is_empty() {
            0.0
        } else {
            *moving.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        let largest = effort.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
        // Twice what the file says, for a file that is wrong; twice what it takes to move on this record, for a file
        // that is very wrong.
        let breaks_away_nm = 2.0 * level.max(typical);
        let inertia = axis.axis.inertia;
        let presliding = friction
            .stiffness
            .filter(|stiffness| *stiffness > 0.0)
            .map_or(0.0, |stiffness| 20.0 * level / stiffness);
        Self {
            inertia,
            breaks_away_nm,
            largest_nm: largest,
            level_nm: level,
            count,
            missed_rad: MISSED_COUNTS * count + presliding,
            rotary: axis.unit == Unit::Rotary,
        }
    }

    /// Second difference of positions so far apart in time that is beyond every doubt, rad: by an acceleration three times
    /// what this effort and friction at twice its level give.
    pub(super) fn within(&self, effort_nm: f64, step_s: f64) -> f64 {
        self.by(3.0, effort_nm, step_s)
    }

    /// That of so many times the acceleration, rad.
    pub(super) fn by(&self, times: f64, effort_nm: f64, step_s: f64) -> f64 {
        let acceleration = times * (effort_nm + 2.0 * self.level_nm) / self.inertia;
        acceleration * step_s * step_s + 4.0 * self.count
    }
}
