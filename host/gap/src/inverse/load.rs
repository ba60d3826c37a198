//! A load behind a spring, perhaps with a play, taken along the motor's measured motion.

use bristle_plant::effect::{Coupling, Instant};

/// Steps of a load within a sample: a step is exact but for friction, which a load that follows faster than this hardly changes.
const MOST_STEPS: f64 = 10.0;

/// Whether what the balance lacks may correct the load behind a coupling: when a load meets the next flank of a play, or slips, is as wrong as all that it
/// did before, and one that swings undamped keeps its errors for as long. One that nothing rubs floats in its gap, and no balance tells where.
pub fn is_corrected(coupling: &Coupling) -> bool {
    coupling.gap_rad == 0.0 || !coupling.friction_on_motor
}

/// The second inertia behind its coupling, driven by the motor's measured motion: the twist e = q - q_l obeys
/// e'' = a + F/J_l - (k e + d e')/J_l, without k and d inside the play. A step is exact for constant a and F, so that a
/// stiff coupling is none.
pub(super) struct Load {
    coupling: Coupling,
    inertia_kg_m2: f64,
    /// Of the motor ahead of it, rad, and its rate, rad/s.
    pub(super) twist_rad: f64,
    pub(super) twisting_rad_s: f64,
    steps: u32,
    /// Friction of the step before, N m.
    opposed_nm: f64,
    half: Stride,
    whole: Stride,
    /// A step of the motor, and the part of what the balance lacks by which it corrects the load.
    sample: Stride,
    corrected_part: Option<f64>,
}

/// A stretch of time that a load moves on by.
struct Stride {
    dt_s: f64,
    /// Twist and its rate after it, each of what both were before.
    kept: [[f64; 2]; 2],
}

impl Load {
    /// At rest, and twisted by the torque that is held there. While its bristles stick it swings on them, too. `corrects` is the
    /// damping ratio that a correction gives its errors, where it [may be](is_corrected) corrected.
    pub(super) fn new(
        coupling: Coupling,
        inertia: f64,
        bristles_nm_rad: f64,
        held_nm: f64,
        step_s: f64,
        corrects: Option<f64>,
    ) -> Self {
        let inertia_kg_m2 = inertia * coupling.load_share;
        let natural_2 = coupling.stiffness_nm_rad / inertia_kg_m2;
        let held_2 = natural_2 + bristles_nm_rad / inertia_kg_m2;
        let loss = 0.5 * coupling.damping_nm_s_rad / inertia_kg_m2;
        // Half a radian a step lets friction follow, and tells when flanks meet. Without either a step of any length is exact.
        let steps = if coupling.friction_on_motor && coupling.gap_rad == 0.0 {
            1.0
        } else {
            let steps = held_2.sqrt() * step_s / 0.5;
            steps.ceil().clamp(1.0, MOST_STEPS)
        };
        let dt_s = step_s / steps;
        let stride = |dt_s| {
            let (even, odd) = damped(natural_2, loss, dt_s);
            let kept = [
                [even + loss * odd, odd],
                [-natural_2 * odd, even - loss * odd],
            ];
            Stride { dt_s, kept }
        };
        Self {
            coupling,
            inertia_kg_m2,
            twist_rad: held_nm / coupling.stiffness_nm_rad
                + 0.5 * coupling.gap_rad.copysign(held_nm),
            twisting_rad_s: 0.0,
            steps: steps as u32,
            opposed_nm: held_nm,
            half: stride(0.5 * dt_s),
            whole: stride(dt_s),
            sample: stride(step_s),
            corrected_part: corrects
                .filter(|_| is_corrected(&coupling))
                .map(|damping_ratio| corrected_part(damping_ratio, natural_2.sqrt() * step_s)),
        }
    }

    /// Takes a part of what the balance lacked a sample ago for torque of the coupling, while a flank is touched.
    pub(super) fn correct(&mut self, lacks_nm: f64) {
        let (Some(part), Some(flank)) = (self.corrected_part, self.flank()) else {
            return;
        };
        let off = part * lacks_nm / self.coupling.stiffness_nm_rad;
        let [of_twist, of_rate] = self.sample.kept;
        self.twist_rad += of_twist[0] * off;
        self.twisting_rad_s += of_rate[0] * off;
        if (self.twist_rad - flank) * flank < 0.0 {
            self.twist_rad = flank;
        }
    }

    /// Moves on by a step of the motor and gives the mean torque of the coupling on the motor, less what accelerates the
    /// load as the motor accelerates: the balance counts that as measured.
    pub(super) fn advance(
        &mut self,
        now: &Instant,
        motor_rad_s2: f64,
        mut friction: impl FnMut(&Instant, f64) -> f64,
    ) -> f64 {
        let mut now = *now;
        let dt_s = self.whole.dt_s;
        now.step_s = dt_s;
        let (motor_rad, motor_rad_s) = (now.motion.position_rad, now.motion.velocity_rad_s);
        let mut sum = 0.0;
        for step in 0..self.steps {
            let flank = self.flank();
            let before = [self.twist_rad, self.twisting_rad_s];
            let middle = self.moved(before, flank, motor_rad_s2, &self.half);
            let off_s = (f64::from(step) + 0.5 - 0.5 * f64::from(self.steps)) * dt_s;
            let velocity_rad_s = motor_rad_s + motor_rad_s2 * off_s;
            now.motion.load_position_rad = motor_rad + motor_rad_s * off_s - middle[0];
            now.motion.load_velocity_rad_s = velocity_rad_s - middle[1];
            let torque = flank.map_or(0.0, |flank| {
                self.coupling.stiffness_nm_rad * (middle[0] - flank)
                    + self.coupling.damping_nm_s_rad * middle[1]
            });
            let opposed = friction(&now, torque);
            self.opposed_nm = opposed;
            [self.twist_rad, self.twisting_rad_s] =
                self.moved(before, flank, motor_rad_s2, &self.whole);
            let load_rad_s = velocity_rad_s - self.twisting_rad_s;
            if now.motion.load_velocity_rad_s * load_rad_s < 0.0 && torque.abs() <= opposed.abs() {
                self.twisting_rad_s = velocity_rad_s;
            }
            sum += opposed - self.inertia_kg_m2 * (self.twisting_rad_s - before[1]) / dt_s;
        }
        sum / f64::from(self.steps)
    }

    /// Twist at which the coupling bears nothing; none inside the play.
    fn flank(&self) -> Option<f64> {
        let half = 0.5 * self.coupling.gap_rad;
        let touches = self.twist_rad.abs() > half || half == 0.0;
        touches.then(|| half.copysign(self.twist_rad))
    }

    /// Twist and its rate after a stride with friction as it is known, from what both were.
    fn moved(
        &self,
        [twist, rate]: [f64; 2],
        flank: Option<f64>,
        motor_rad_s2: f64,
        stride: &Stride,
    ) -> [f64; 2] {
        let drives = motor_rad_s2 + self.opposed_nm / self.inertia_kg_m2;
        if let Some(flank) = flank {
            let rests = flank + drives * self.inertia_kg_m2 / self.coupling.stiffness_nm_rad;
            let [of_twist, of_rate] = stride.kept;
            let twist = twist - rests;
            [
                rests + of_twist[0] * twist + of_twist[1] * rate,
                of_rate[0] * twist + of_rate[1] * rate,
            ]
        } else {
            let after = rate + drives * stride.dt_s;
            [twist + 0.5 * (rate + after) * stride.dt_s, after]
        }
    }
}

/// Part of what the balance lacks that corrects a load that swings by so many radians a sample: what is wrong of it decays in so many of them. Where
/// it swings by more than half a period its sign turns.
fn corrected_part(damping_ratio: f64, angle: f64) -> f64 {
    let part = 2.0 * (1.0 - (-damping_ratio * angle).exp());
    part.min(1.0) * angle.sin().signum()
}

/// e^(-loss t) times cosh and sinh(r t)/r, r^2 = loss^2 - natural^2; cos and sin where that is below zero.
fn damped(natural_2: f64, loss: f64, t: f64) -> (f64, f64) {
    let r_2 = loss * loss - natural_2;
    let r = r_2.abs().sqrt();
    if r * t < 1e-6 {
        let kept = (-loss * t).exp();
        (kept, kept * t)
    } else if r_2 > 0.0 {
        let (slow, fast) = (((r - loss) * t).exp(), (-(r + loss) * t).exp());
        (0.5 * (slow + fast), 0.5 * (slow - fast) / r)
    } else {
        let kept = (-loss * t).exp();
        (kept * (r * t).cos(), kept * (r * t).sin() / r)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error of a load that is pushed against a flank, of what it was at first, after five radians of its swing.
    fn error_left(corrects: bool) -> f64 {
        let (step_s, natural_rad_s, damping_ratio, inertia_kg_m2): (f64, f64, f64, f64) =
            (1e-4, 553.0, 0.015, 1e-3);
        let natural_2 = natural_rad_s.powi(2);
        let load_share = 0.5;
        let load_kg_m2 = load_share * inertia_kg_m2;
        let coupling = Coupling {
            load_share,
            stiffness_nm_rad: natural_2 * load_kg_m2,
            damping_nm_s_rad: 2.0 * damping_ratio * natural_rad_s * load_kg_m2,
            gap_rad: 1e-3,
            friction_on_motor: false,
        };
        let now = Instant {
            step_s,
            ..Instant::default()
        };
        let new = || Load::new(coupling, inertia_kg_m2, 0.0, 0.1, step_s, Some(0.6));
        let (mut is, mut taken) = (new(), new());
        let off_rad = 0.2 * (is.twist_rad - 0.5 * coupling.gap_rad);
        taken.twist_rad += off_rad;
        let accelerates_rad_s2 = 0.1 / load_kg_m2;
        let mut before_nm = None;
        for _ in 0..(5.0 / (natural_rad_s * step_s)) as usize {
            let [is_nm, taken_nm] = [&mut is, &mut taken]
                .map(|load| load.advance(&now, accelerates_rad_s2, |_, _| 0.0));
            let lacks_nm = is_nm - taken_nm;
            if let Some(before_nm) = before_nm.replace(lacks_nm).filter(|_| corrects) {
                taken.correct(0.5 * (before_nm + lacks_nm));
            }
        }
        let rate = (is.twisting_rad_s - taken.twisting_rad_s) / natural_rad_s;
        (is.twist_rad - taken.twist_rad).hypot(rate) / off_rad
    }

    #[test]
    fn an_error_of_the_load_decays_where_the_balance_corrects_it() {
        // e^(-5 x 0.015) of it by itself, e^(-5 x 0.6) and as much again as a half swing may hide where it is corrected.
        assert!(error_left(false) > 0.9, "{}", error_left(false));
        assert!(error_left(true) < 0.1, "{}", error_left(true));
    }
}
