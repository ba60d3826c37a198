//! Feed-forward of what an axis is known to have beside its model: a torque by position and direction, and the inverse of
//! a dead zone. Cogging, unbalance, offset, and friction that depends on position or direction cancel so, to within what
//! the table resolves.
//!
//! Cost is bounded: one look-up and no loop. At low speed, where friction does not yet have its sliding value,
//! the two directions are blended in a straight line. Armstrong-Helouvry, "Control of Machines with Friction", Kluwer,
//! 1991, ch. 9 (friction look-up by position and direction).

use crate::error::{ParameterError, not_negative, positive, require};
use crate::real::Real;

/// Points of a table.
pub const POINTS: usize = 512;

/// Where a table begins, and how far it reaches. A linear axis reads m for rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Span<T> {
    /// Position repeats: from zero over this period, rad.
    Period(T),
    /// From one position to another, rad; beyond them the last value holds.
    Stroke(T, T),
}

/// The table; none of it changes in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedForward<T> {
    span: Span<T>,
    points_per_rad: T,
    speed_band_rad_s: T,
    /// One over it: the tick has no time for a division.
    per_speed_band_s_rad: T,
    dead_zone_nm: T,
    direction_nm: [[T; POINTS]; 2],
}

impl<T: Real> FeedForward<T> {
    /// Torque to add in forward and backward motion at even places of a span, the speed below which the two are blended,
    /// and the half width of a dead zone.
    ///
    /// # Errors
    /// A span or speed band not above zero, a negative dead zone, or a torque that is not finite.
    pub fn new(
        span: Span<T>,
        forward_nm: [T; POINTS],
        backward_nm: [T; POINTS],
        speed_band_rad_s: T,
        dead_zone_nm: T,
    ) -> Result<Self, ParameterError> {
        let points_per_rad = points_per_rad(span)?;
        for torque in forward_nm.iter().chain(&backward_nm) {
            require("torque_nm", *torque, true, "finite")?;
        }
        Ok(Self {
            span,
            points_per_rad,
            speed_band_rad_s: positive("speed_band_rad_s", speed_band_rad_s)?,
            per_speed_band_s_rad: T::ONE / speed_band_rad_s,
            dead_zone_nm: not_negative("dead_zone_nm", dead_zone_nm)?,
            direction_nm: [forward_nm, backward_nm],
        })
    }

    /// The same table in another precision.
    ///
    /// # Errors
    /// A number that the precision does not hold.
    pub fn cast<U: Real>(&self) -> Result<FeedForward<U>, ParameterError> {
        let to = |x: T| U::of(x.to_f64());
        let span = match self.span {
            Span::Period(period) => Span::Period(to(period)),
            Span::Stroke(from, end) => Span::Stroke(to(from), to(end)),
        };
        let [forward, backward] = self.direction_nm.map(|direction| direction.map(to));
        FeedForward::new(
            span,
            forward,
            backward,
            to(self.speed_band_rad_s),
            to(self.dead_zone_nm),
        )
    }

    /// Adds nothing anywhere; to be filled by [`Self::put`].
    pub const EMPTY: Self = Self {
        span: Span::Period(T::ONE),
        points_per_rad: T::ZERO,
        speed_band_rad_s: T::ONE,
        per_speed_band_s_rad: T::ONE,
        dead_zone_nm: T::ZERO,
        direction_nm: [[T::ZERO; POINTS]; 2],
    };

    /// Puts torques in place from a point on, forward or backward; false if one of them is beyond the last point or no
    /// number, and then nothing changes.
    pub fn put(&mut self, backward: bool, first: usize, torques_nm: &[T]) -> bool {
        let [forward_nm, backward_nm] = &mut self.direction_nm;
        let table = if backward { backward_nm } else { forward_nm };
        let places = first
            .checked_add(torques_nm.len())
            .and_then(|end| table.get_mut(first..end));
        match places {
            Some(places) if torques_nm.iter().all(|torque| torque.is_finite()) => {
                places.copy_from_slice(torques_nm);
                true
            }
            _ => false,
        }
    }

    /// Says where the points lie, and the speed below which the directions are blended.
    ///
    /// # Errors
    /// A span or speed band not above zero; nothing changes then.
    pub fn lay(&mut self, span: Span<T>, speed_band_rad_s: T) -> Result<(), ParameterError> {
        let points_per_rad = points_per_rad(span)?;
        self.speed_band_rad_s = positive("speed_band_rad_s", speed_band_rad_s)?;
        self.per_speed_band_s_rad = T::ONE / speed_band_rad_s;
        self.points_per_rad = points_per_rad;
        self.span = span;
        Ok(())
    }

    /// Torque to add at a position and a velocity, N m. Both may be anything: what is not finite adds nothing.
    #[inline(always)]
    pub fn torque_nm(&self, position_rad: T, velocity_rad_s: T) -> T {
        if !position_rad.is_finite() || !velocity_rad_s.is_finite() {
            return T::ZERO;
        }
        let (from, wraps) = match self.span {
            Span::Period(_) => (T::ZERO, true),
            Span::Stroke(from, _) => (from, false),
        };
        let last = T::of((POINTS - 1) as f64);
        let at = (position_rad - from) * self.points_per_rad;
        let (place, next, part) = if wraps {
            let points = T::of(POINTS as f64);
            let turns = at * T::of(1.0 / POINTS as f64);
            // Whole turns, 2^24 at most: beyond them a float has no fraction to look up.
            let most = T::of(16_777_216.0);
            let whole = T::of_ticks(turns.abs().within(most).to_index() as u32).copysign(turns);
            let mut inside = at - whole * points;
            if inside < T::ZERO {
                inside += points;
            }
            let inside = inside.most(T::ZERO).least(points);
            let place = inside.to_index().min(POINTS - 1);
            let part = inside - T::of_count(place as i32);
            (place, (place + 1) % POINTS, part)
        } else {
            let inside = at.most(T::ZERO).least(last);
            let place = inside.to_index().min(POINTS - 1);
            let next = (place + 1).min(POINTS - 1);
            (place, next, inside - T::of_count(place as i32))
        };
        let [forward, backward] = &self.direction_nm;
        let forward = forward[place] + (forward[next] - forward[place]) * part;
        let backward = backward[place] + (backward[next] - backward[place]) * part;
        let half = T::of(0.5);
        let direction = velocity_rad_s.within(self.speed_band_rad_s) * self.per_speed_band_s_rad;
        half * (forward + backward) + half * direction * (forward - backward)
    }

    /// The torque reference with everything added: the table, and beyond it the jump over the dead zone, which rises
    /// over a hundredth of its own width.
    #[inline]
    pub fn apply(&self, torque_nm: T, position_rad: T, velocity_rad_s: T) -> T {
        let wanted = torque_nm + self.torque_nm(position_rad, velocity_rad_s);
        let ramp = T::of(0.01) * self.dead_zone_nm;
        if ramp > T::ZERO {
            wanted + self.dead_zone_nm * (wanted.within(ramp) / ramp)
        } else {
            wanted
        }
    }
}

fn points_per_rad<T: Real>(span: Span<T>) -> Result<T, ParameterError> {
    let points_per_rad = match span {
        Span::Period(period) => T::of(POINTS as f64) / positive("period_rad", period)?,
        Span::Stroke(from, to) => T::of((POINTS - 1) as f64) / positive("stroke_rad", to - from)?,
    };
    positive("points_per_rad", points_per_rad)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: f64) -> [f64; POINTS] {
        core::array::from_fn(|i| libm::sin(core::f64::consts::TAU * n * i as f64 / POINTS as f64))
    }

    #[test]
    fn follows_a_wave_over_many_turns_both_ways() {
        let period = core::f64::consts::TAU;
        let table = FeedForward::new(Span::Period(period), wave(6.0), wave(6.0), 0.1, 0.0).unwrap();
        for k in -2000..2000 {
            let q = 0.0317 * f64::from(k);
            // A chord of 2 pi 6/512 = 0.074 rad lies at most 0.074^2/8 = 6.8e-4 below its arc.
            let error = table.torque_nm(q, 1.0) - libm::sin(6.0 * q);
            assert!(error.abs() < 7e-4, "{q}: {error}");
        }
    }

    #[test]
    fn blends_directions_and_holds_the_ends_of_a_stroke() {
        let ramp: [f64; POINTS] = core::array::from_fn(|i| i as f64 / (POINTS - 1) as f64);
        let table =
            FeedForward::new(Span::Stroke(-1.0, 1.0), ramp, [0.0; POINTS], 0.1, 0.0).unwrap();
        assert_eq!(table.torque_nm(5.0, 1.0), 1.0);
        assert_eq!(table.torque_nm(-5.0, 1.0), 0.0);
        assert!((table.torque_nm(0.0, 1.0) - 0.5).abs() < 1e-12);
        assert!((table.torque_nm(0.0, 0.0) - 0.25).abs() < 1e-12);
        assert_eq!(table.torque_nm(0.0, -1.0), 0.0);
    }

    #[test]
    fn undoes_a_dead_zone() {
        let none = [0.0; POINTS];
        let table = FeedForward::new(Span::Period(1.0), none, none, 0.1, 0.02).unwrap();
        let dead = |u: f64| {
            if u.abs() < 0.02 {
                0.0
            } else {
                u - 0.02_f64.copysign(u)
            }
        };
        for u in [-0.5, -0.001, 0.001, 0.3] {
            assert!((dead(table.apply(u, 0.0, 0.0)) - u).abs() < 1e-12, "{u}");
        }
        assert_eq!(table.apply(0.0, 0.0, 0.0), 0.0);
    }

    #[test]
    fn a_table_put_part_by_part_is_that_made_at_once() {
        let (forward, backward) = (wave(3.0), wave(5.0));
        let span = Span::Stroke(-1.0, 2.0);
        let whole = FeedForward::new(span, forward, backward, 0.2, 0.0).unwrap();
        let mut parts = FeedForward::EMPTY;
        assert_eq!(parts.torque_nm(0.3, 1.0), 0.0);
        for first in (0..POINTS).step_by(32) {
            assert!(parts.put(false, first, &forward[first..first + 32]));
            assert!(parts.put(true, first, &backward[first..first + 32]));
        }
        for (first, part) in [
            (POINTS - 1, [1.0, 1.0]),
            (usize::MAX, [1.0, 1.0]),
            (0, [0.0, f64::NAN]),
        ] {
            assert!(!parts.put(true, first, &part));
        }
        assert!(parts.lay(Span::Stroke(1.0, 1.0), 0.2).is_err());
        assert!(parts.lay(span, 0.0).is_err());
        parts.lay(span, 0.2).unwrap();
        assert_eq!(parts, whole);
    }

    #[test]
    fn bears_any_input() {
        let table = FeedForward::new(
            Span::Period(0.3_f32),
            [1.0; POINTS],
            [1.0; POINTS],
            0.1,
            0.0,
        );
        let table = table.unwrap();
        for x in [
            f32::NAN,
            f32::INFINITY,
            f32::MAX,
            -f32::MAX,
            -1e-30,
            0.3,
            -0.3,
        ] {
            let torque = table.torque_nm(x, 1.0);
            assert!(torque == 1.0 || torque == 0.0, "{x}: {torque}");
            assert!(table.torque_nm(0.1, x).is_finite());
        }
        let bad = [f32::NAN; POINTS];
        assert!(FeedForward::new(Span::Period(1.0), bad, bad, 0.1, 0.0).is_err());
        assert!(
            FeedForward::new(
                Span::Stroke(1.0, 1.0),
                [0.0; POINTS],
                [0.0; POINTS],
                0.1,
                0.0
            )
            .is_err()
        );
    }
}
