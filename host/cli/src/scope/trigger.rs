//! When the picture stands: at an event, with a part of the window before it.

use super::buffer::Point;
use bristle_core::supervisor::Fault;

/// What it waits for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum On {
    /// Nothing: the picture runs.
    #[default]
    Free,
    /// Velocity passes through zero, either way.
    Reversal,
    /// Torque rises through the level.
    Torque,
    /// Velocity rises through the level.
    Velocity,
    /// Another limit than before.
    Limit,
    /// A fault.
    Fault,
}

impl On {
    const ALL: [Self; 6] = [
        Self::Free,
        Self::Reversal,
        Self::Torque,
        Self::Velocity,
        Self::Limit,
        Self::Fault,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Reversal => "reversal",
            Self::Torque => "torque above level",
            Self::Velocity => "velocity above level",
            Self::Limit => "limit changes",
            Self::Fault => "fault",
        }
    }

    /// The next one.
    pub fn next(self) -> Self {
        let place = Self::ALL.iter().position(|&on| on == self).unwrap_or(0);
        Self::ALL[(place + 1) % Self::ALL.len()]
    }

    /// Whether it has a level.
    pub fn has_level(self) -> bool {
        matches!(self, Self::Torque | Self::Velocity)
    }
}

/// Part of the window before the event.
const BEFORE: f64 = 0.25;

/// The trigger on its way through the samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct Trigger {
    /// What it waits for.
    pub on: On,
    /// Level, in the unit of what has one.
    pub level: f64,
    last: Option<Point>,
    /// Velocity's last sign: zero is no sign.
    sign: f32,
    hit_s: Option<f64>,
}

impl Trigger {
    /// Takes the next sample. A new event counts once the window of the last one is over.
    pub fn sample(&mut self, point: &Point, window_s: f64) {
        let busy = self.hit_s.is_some_and(|hit_s| {
            (0.0..(1.0 - BEFORE) * window_s).contains(&(point.time_s - hit_s))
        });
        if self.happens(point) && !busy {
            self.hit_s = Some(point.time_s);
        }
        if point.velocity_rad_s != 0.0 {
            self.sign = point.velocity_rad_s.signum();
        }
        self.last = Some(*point);
    }

    fn happens(&self, point: &Point) -> bool {
        let Some(last) = &self.last else {
            return false;
        };
        let rises =
            |before: f32, now: f32| f64::from(before) < self.level && f64::from(now) >= self.level;
        match self.on {
            On::Free => false,
            On::Reversal => point.velocity_rad_s * self.sign < 0.0,
            On::Torque => rises(last.torque_nm, point.torque_nm),
            On::Velocity => rises(last.velocity_rad_s, point.velocity_rad_s),
            On::Limit => last.status.limit() != point.status.limit(),
            On::Fault => {
                last.status.fault() != point.status.fault()
                    && point.status.fault() != Some(Fault::None)
            }
        }
    }

    /// Where the window ends, if it stands by an event.
    pub fn window_end_s(&self, window_s: f64) -> Option<f64> {
        if self.on == On::Free {
            return None;
        }
        self.hit_s.map(|hit_s| hit_s + (1.0 - BEFORE) * window_s)
    }

    /// Waits for another event, or for the next one of these.
    pub fn set(&mut self, on: On) {
        self.on = on;
        self.hit_s = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bristle_core::supervisor::{Limit, State};
    use bristle_core::trace::Status;

    fn point(tick: u32, velocity_rad_s: f32, fault: Fault) -> Point {
        Point {
            time_s: f64::from(tick) * 1e-4,
            counts: 0,
            velocity_rad_s,
            torque_nm: velocity_rad_s,
            z_rad: 0.0,
            z_time_free_rad: 0.0,
            status: Status::new(State::Armed, Limit::None, fault, 0),
        }
    }

    /// Ends of the windows, in ticks.
    fn hits(on: On, level: f64, velocity: impl Fn(u32) -> f32) -> Vec<i64> {
        let mut trigger = Trigger {
            level,
            ..Trigger::default()
        };
        trigger.set(on);
        let mut hits = Vec::new();
        for tick in 0..10_000 {
            let fault = if tick < 5000 {
                Fault::None
            } else {
                Fault::Overspeed
            };
            trigger.sample(&point(tick, velocity(tick), fault), 0.1);
            hits.extend(
                trigger
                    .window_end_s(0.1)
                    .map(|end_s| (end_s * 1e4).round() as i64),
            );
            hits.dedup();
        }
        hits
    }

    #[test]
    fn it_finds_its_event_and_keeps_its_window() {
        // Two reversals in a second, the first over a stretch of rest.
        let velocity = |tick: u32| match tick {
            0..2000 => 1.0,
            2000..3000 => 0.0,
            3000..7000 => -1.0,
            _ => 1.0,
        };
        assert_eq!(hits(On::Reversal, 0.0, velocity), [3750, 7750]);
        assert_eq!(hits(On::Velocity, 0.5, velocity), [7750]);
        assert_eq!(hits(On::Torque, -0.5, velocity), [7750]);
        assert_eq!(hits(On::Fault, 0.0, velocity), [5750]);
        assert!(hits(On::Limit, 0.0, velocity).is_empty());
        assert!(hits(On::Free, 0.0, velocity).is_empty());
        // Reversals every 10 ms: within the window of one no other counts.
        let fast = |tick: u32| {
            if (tick / 100).is_multiple_of(2) {
                1.0
            } else {
                -1.0
            }
        };
        let found = hits(On::Reversal, 0.0, fast);
        assert!(
            found.windows(2).all(|pair| pair[1] - pair[0] >= 750),
            "{found:?}"
        );
    }
}
