//! Friction of the axis: bristles advanced by their exact solution at constant speed, or a static law.
//!
//! dz/dt = v (1 - a sgn(v) z/z_ss(v)), F = s0 z + s1 dz/dt + s2 v, z_ss = g(v)/s0. LuGre has a = 1; the elasto-plastic
//! law (Dupont et al., IEEE TAC 47(5), 2002) has a = 0 below z_ba, 1 from z_ss and half a sine between. With v and a
//! held over a step, z runs exponentially towards z_ss/a, which is what a step takes; a is that of the middle of the
//! step. g is Gaussian in v, the curve that an axis file means where it names no other.

use crate::draw::Draw;
use std::f64::consts::PI;

/// Which law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Law {
    /// g(v) sgn(v) + s2 v; up to g(0) at rest.
    Static,
    /// One state that creeps under any load.
    Lugre,
    /// One state that holds below break-away.
    ElastoPlastic,
}

/// Parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Friction {
    pub(crate) law: Law,
    pub(crate) coulomb: f64,
    pub(crate) stiction: f64,
    pub(crate) stribeck_velocity: f64,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) viscous: f64,
    pub(crate) breakaway_ratio: f64,
}

/// What effects make of the friction at an instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level {
    /// Factor on g.
    pub(crate) coulomb: f64,
    /// Added to g, N m.
    pub(crate) rise: f64,
    /// Factor on s2.
    pub(crate) viscous: f64,
}

impl Default for Level {
    fn default() -> Self {
        Self {
            coulomb: 1.0,
            rise: 0.0,
            viscous: 1.0,
        }
    }
}

impl Friction {
    /// g at a velocity, N m. An effect cannot turn friction into a motor.
    pub(crate) fn level(&self, v: f64, level: &Level) -> f64 {
        let share = v / self.stribeck_velocity;
        let g = self.coulomb + (self.stiction - self.coulomb) * libm::exp(-share * share);
        (level.coulomb * g + level.rise).max(0.02 * self.coulomb)
    }

    /// z after a step of `h` at velocity `v`, with `g` the level there.
    pub(crate) fn bristle(&self, z: f64, v: f64, h: f64, g: f64) -> f64 {
        let z_ss = g / self.stiffness;
        let way = v * h;
        let middle = z + 0.5 * way * (1.0 - self.share(z, v, z_ss) * z * v.signum() / z_ss);
        let a = self.share(middle, v, z_ss);
        let r = a * way.abs() / z_ss;
        if r < 1e-9 {
            return z + way * (1.0 - a * z * v.signum() / z_ss);
        }
        let kept = libm::exp(-r);
        z * kept + way * (1.0 - kept) / r
    }

    /// Mean torque of the bristles over a step in which z went from one value to another.
    pub(crate) fn torque(&self, z: f64, z_next: f64, h: f64) -> f64 {
        0.5 * self.stiffness * (z + z_next) + self.damping * (z_next - z) / h
    }

    /// How much of the motion is slip.
    fn share(&self, z: f64, v: f64, z_ss: f64) -> f64 {
        if self.law == Law::Lugre {
            return 1.0;
        }
        let way = z * v.signum() / z_ss;
        if way <= self.breakaway_ratio {
            0.0
        } else if way >= 1.0 {
            1.0
        } else {
            let x = (way - self.breakaway_ratio) / (1.0 - self.breakaway_ratio);
            0.5 - 0.5 * libm::cos(PI * x)
        }
    }

    /// The law with a small error in every number, as the axis file has it.
    pub(crate) fn misjudged(
        &self,
        draw: &mut Draw,
        mut wrong: impl FnMut(&mut Draw) -> f64,
    ) -> Self {
        let coulomb = self.coulomb * wrong(draw);
        Self {
            law: self.law,
            coulomb,
            // The ratio of both levels is wrong by a part of what it exceeds one: F_S stays above F_C.
            stiction: coulomb * (1.0 + (self.stiction / self.coulomb - 1.0) * wrong(draw)),
            stribeck_velocity: self.stribeck_velocity * wrong(draw),
            stiffness: self.stiffness * wrong(draw),
            damping: self.damping * wrong(draw),
            viscous: self.viscous * wrong(draw),
            breakaway_ratio: self.breakaway_ratio,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn friction(law: Law) -> Friction {
        Friction {
            law,
            coulomb: 0.08,
            stiction: 0.1,
            stribeck_velocity: 0.5,
            stiffness: 30.0,
            damping: 0.0,
            viscous: 0.0,
            breakaway_ratio: 0.7,
        }
    }

    /// LuGre at constant speed from rest has a closed form: z = z_ss (1 - exp(-|x|/z_ss)).
    #[test]
    fn lugre_follows_its_closed_form_at_any_step() {
        let friction = friction(Law::Lugre);
        let v = 0.2;
        let g = friction.level(v, &Level::default());
        let z_ss = g / friction.stiffness;
        for steps in [3, 1000] {
            let h = 0.01 / f64::from(steps);
            let z = (0..steps).fold(0.0, |z, _| friction.bristle(z, v, h, g));
            let exact = z_ss * (1.0 - libm::exp(-v * 0.01 / z_ss));
            // Rounding of a thousand steps.
            assert!((z - exact).abs() < 1e-13, "{steps}: {z} {exact}");
        }
    }

    #[test]
    fn elasto_plastic_holds_below_break_away_and_slides_at_g() {
        let friction = friction(Law::ElastoPlastic);
        let g = friction.level(0.0, &Level::default());
        let mut z = 0.0;
        // Back and forth below z_ba: elastic, so it returns exactly but for rounding.
        let way = 0.5 * friction.breakaway_ratio * g / friction.stiffness;
        for v in [way, -way, -way, way] {
            z = friction.bristle(z, v, 1.0, g);
        }
        assert!(z.abs() < 1e-18, "{z}");
        // Thirty times z_ss.
        for _ in 0..10_000 {
            z = friction.bristle(z, 0.1, 1e-4, g);
        }
        assert!((friction.stiffness * z / g - 1.0).abs() < 1e-9);
    }

    /// With a between 0 and 1 the middle of the step is an approximation; its error falls with the square of the step.
    #[test]
    fn the_step_is_of_second_order() {
        let friction = friction(Law::ElastoPlastic);
        let g = friction.level(0.1, &Level::default());
        let end = |steps: u32| {
            let h = 0.03 / f64::from(steps);
            (0..steps).fold(0.0, |z, _| friction.bristle(z, 0.1, h, g))
        };
        let exact = end(100_000);
        let (coarse, fine) = ((end(40) - exact).abs(), (end(80) - exact).abs());
        // Four for second order, two for first: three tells them apart.
        assert!(coarse / fine > 3.0, "{coarse:e} {fine:e}");
    }
}
