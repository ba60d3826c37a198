//! A load behind a spring, perhaps with a play, taken along the motor's measured motion.

use super::twin::leads_rad_s2;
use bristle_plant::effect::{Coupling, Instant};

/// Steps of a load within a sample: a step is exact but for friction, which a load that follows faster than this hardly changes.
const MOST_STEPS: f64 = 10.0;

/// What keeps a load behind a spring from where the errors of all that it did before take it: when it meets the next flank of a play, or slips, is as wrong
/// as that, and one that swings undamped keeps its errors for as long.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Corrects {
    /// A part of what the balance lacks is taken for torque of the coupling, which gives its errors this damping ratio.
    ByBalance(f64),
    /// The model moves the motor, too, and leads it along the measured motion: the noise of a measured one is flanks that shake, which pump a load that
    /// hardly anything damps.
    ByMotor,
}

impl Corrects {
    /// Whether it tells anything of a load behind a coupling. One that nothing rubs floats in its gap, and no balance says where.
    pub fn applies(self, coupling: &Coupling) -> bool {
        match self {
            Self::ByBalance(_) => coupling.gap_rad == 0.0 || !coupling.friction_on_motor,
            Self::ByMotor => true,
        }
    }
}

/// Torque on a motor that the model does not know, in parts of Coulomb friction in a root hertz. By the bandwidth that comes of it the true values of twelve
/// opened plays left at most 1.2 times the squares that they left by the best one of 10 to 400 rad/s, which was 40 for some and 180 for others.
const UNKNOWN: f64 = 1.6e-4;
/// Fastest bandwidth that helped any of them, rad/s, and the part of a sample that it may take.
const FASTEST: (f64, f64) = (250.0, 0.4);

/// Bandwidth of what leads a motor along the measured motion, rad/s: that of a steady Kalman filter of position and velocity, of which friction tells
/// the one noise and the noise of the measured position the other.
pub(super) fn leads_rad_s(friction_rad_s2: f64, position_noise_rad: f64, step_s: f64) -> f64 {
    let (fastest, part) = FASTEST;
    let trusted = UNKNOWN * friction_rad_s2 / (position_noise_rad * step_s.sqrt());
    trusted.sqrt().min(fastest).min(part / step_s)
}

/// The second inertia behind its coupling, driven by the motor's measured motion: the twist e = q - q_l obeys
/// e'' = a + F/J_l - (k e + d e')/J_l, without k and d inside the play; where the model moves the motor, with the motor's acceleration
/// but for the coupling as a, and both inertias against each other in the last term. A step is exact for constant a and F, so that a
/// stiff coupling is none.
pub(super) struct Load {
    coupling: Coupling,
    inertia_kg_m2: f64,
    /// What swings on the coupling: the load where the motor moves as measured, else both against each other.
    swings_kg_m2: f64,
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
    motor_kg_m2: f64,
    /// Where the model moves it itself.
    motor: Option<Motor>,
}

/// The motor before a load, [as the model moves it](Corrects::ByMotor), led along the measured motion with this bandwidth.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motor {
    pub(super) position_rad: f64,
    pub(super) velocity_rad_s: f64,
    pub(super) leads_rad_s: f64,
}

/// A stretch of time that a load moves on by.
struct Stride {
    dt_s: f64,
    /// Twist and its rate after it, each of what both were before.
    kept: [[f64; 2]; 2],
}

impl Load {
    /// At rest, and twisted by the torque that is held there. While its bristles stick it swings on them, too. The motor is
    /// this one.
    pub(super) fn new(
        coupling: Coupling,
        inertia: f64,
        bristles_nm_rad: f64,
        held_nm: f64,
        step_s: f64,
        corrects: Option<Corrects>,
        motor: Motor,
    ) -> Self {
        let inertia_kg_m2 = inertia * coupling.load_share;
        let corrects = corrects.filter(|corrects| corrects.applies(&coupling));
        let motor = (corrects == Some(Corrects::ByMotor)).then_some(motor);
        let swings_kg_m2 = motor.map_or(inertia_kg_m2, |_| {
            Coupling::reduced_kg_m2(inertia, coupling.load_share)
        });
        let natural_2 = coupling.stiffness_nm_rad / swings_kg_m2;
        let held_2 = natural_2 + bristles_nm_rad / inertia_kg_m2;
        let loss = 0.5 * coupling.damping_nm_s_rad / swings_kg_m2;
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
            swings_kg_m2,
            motor_kg_m2: inertia * (1.0 - Coupling::simulated(coupling.load_share)),
            motor,
            twist_rad: held_nm / coupling.stiffness_nm_rad
                + 0.5 * coupling.gap_rad.copysign(held_nm),
            twisting_rad_s: 0.0,
            steps: steps as u32,
            opposed_nm: held_nm,
            half: stride(0.5 * dt_s),
            whole: stride(dt_s),
            sample: stride(step_s),
            corrected_part: match corrects {
                Some(Corrects::ByBalance(damping_ratio)) => {
                    Some(corrected_part(damping_ratio, natural_2.sqrt() * step_s))
                }
                Some(Corrects::ByMotor) | None => None,
            },
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

    /// What drives the twist where the motor is led: its acceleration but for the coupling, by the torque that is on it and by what leads it to where it was
    /// measured, rad/s^2; else that of the measured motion.
    pub(super) fn driven_rad_s2(
        &self,
        net_nm: f64,
        [position_rad, velocity_rad_s]: [f64; 2],
        motor_rad_s2: f64,
    ) -> f64 {
        self.motor.map_or(motor_rad_s2, |motor| {
            let leads_rad_s2 = leads_rad_s2(
                motor.leads_rad_s,
                position_rad - motor.position_rad,
                velocity_rad_s - motor.velocity_rad_s,
            );
            let whole_kg_m2 = self.motor_kg_m2 + self.inertia_kg_m2;
            (net_nm + whole_kg_m2 * leads_rad_s2) / self.motor_kg_m2
        })
    }

    /// Moves on by a step of the motor and gives the mean torque of the coupling on the motor, less what accelerates the
    /// load as the motor accelerates: the balance counts that as measured.
    pub(super) fn advance(
        &mut self,
        now: &Instant,
        driven_rad_s2: f64,
        motor_rad_s2: f64,
        mut friction: impl FnMut(&Instant, f64) -> f64,
    ) -> f64 {
        let mut now = *now;
        let dt_s = self.whole.dt_s;
        now.step_s = dt_s;
        let measured = [now.motion.position_rad, now.motion.velocity_rad_s];
        let mut sum = 0.0;
        for step in 0..self.steps {
            let flank = self.flank();
            let before = [self.twist_rad, self.twisting_rad_s];
            let middle = self.moved(before, flank, driven_rad_s2, &self.half);
            let off_s = (f64::from(step) + 0.5 - 0.5 * f64::from(self.steps)) * dt_s;
            let [position_rad, velocity_rad_s] = match self.motor {
                Some(motor) => [
                    motor.position_rad + 0.5 * dt_s * motor.velocity_rad_s,
                    motor.velocity_rad_s,
                ],
                None => [
                    measured[0] + measured[1] * off_s,
                    measured[1] + motor_rad_s2 * off_s,
                ],
            };
            now.motion.load_position_rad = position_rad - middle[0];
            now.motion.load_velocity_rad_s = velocity_rad_s - middle[1];
            let torque = flank.map_or(0.0, |flank| {
                self.coupling.stiffness_nm_rad * (middle[0] - flank)
                    + self.coupling.damping_nm_s_rad * middle[1]
            });
            let opposed = friction(&now, torque);
            self.opposed_nm = opposed;
            [self.twist_rad, self.twisting_rad_s] =
                self.moved(before, flank, driven_rad_s2, &self.whole);
            let load_rad_s = velocity_rad_s - self.twisting_rad_s;
            if now.motion.load_velocity_rad_s * load_rad_s < 0.0 && torque.abs() <= opposed.abs() {
                self.twisting_rad_s = velocity_rad_s;
            }
            if let Some(motor) = &mut self.motor {
                let twists_rad_s2 = (self.twisting_rad_s - before[1]) / dt_s;
                let on_load_rad_s2 = opposed / self.inertia_kg_m2;
                let coupled_nm =
                    self.swings_kg_m2 * (driven_rad_s2 + on_load_rad_s2 - twists_rad_s2);
                let accelerates_rad_s2 = driven_rad_s2 - coupled_nm / self.motor_kg_m2;
                motor.position_rad +=
                    (motor.velocity_rad_s + 0.5 * dt_s * accelerates_rad_s2) * dt_s;
                motor.velocity_rad_s += accelerates_rad_s2 * dt_s;
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
        driven_rad_s2: f64,
        stride: &Stride,
    ) -> [f64; 2] {
        let drives = driven_rad_s2 + self.opposed_nm / self.inertia_kg_m2;
        if let Some(flank) = flank {
            let rests = flank + drives * self.swings_kg_m2 / self.coupling.stiffness_nm_rad;
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
        let new = || {
            Load::new(
                coupling,
                inertia_kg_m2,
                0.0,
                0.1,
                step_s,
                Some(Corrects::ByBalance(0.6)),
                Motor::default(),
            )
        };
        let (mut is, mut taken) = (new(), new());
        let off_rad = 0.2 * (is.twist_rad - 0.5 * coupling.gap_rad);
        taken.twist_rad += off_rad;
        let accelerates_rad_s2 = 0.1 / load_kg_m2;
        let mut before_nm = None;
        for _ in 0..(5.0 / (natural_rad_s * step_s)) as usize {
            let [is_nm, taken_nm] = [&mut is, &mut taken]
                .map(|load| load.advance(&now, accelerates_rad_s2, accelerates_rad_s2, |_, _| 0.0));
            let lacks_nm = is_nm - taken_nm;
            if let Some(before_nm) = before_nm.replace(lacks_nm).filter(|_| corrects) {
                taken.correct(0.5 * (before_nm + lacks_nm));
            }
        }
        let rate = (is.twisting_rad_s - taken.twisting_rad_s) / natural_rad_s;
        (is.twist_rad - taken.twist_rad).hypot(rate) / off_rad
    }

    /// Speed to which a shaking motor pumps a load that floats in a play, in times of that of its shaking.
    fn pumped_times(corrects: Option<Corrects>) -> f64 {
        let (step_s, inertia_kg_m2, gap_rad): (f64, f64, f64) = (1e-3, 1e-3, 1e-3);
        let (load_share, natural_rad_s) = (0.5, 700.0);
        let load_kg_m2 = load_share * inertia_kg_m2;
        let coupling = Coupling {
            load_share,
            stiffness_nm_rad: natural_rad_s * natural_rad_s * load_kg_m2,
            damping_nm_s_rad: 0.02 * natural_rad_s * load_kg_m2,
            gap_rad,
            friction_on_motor: true,
        };
        let mut load = Load::new(
            coupling,
            inertia_kg_m2,
            0.0,
            0.0,
            step_s,
            corrects,
            Motor {
                leads_rad_s: 60.0,
                ..Motor::default()
            },
        );
        load.twist_rad = 0.5 * gap_rad;
        let now = Instant {
            step_s,
            ..Instant::default()
        };
        // Each sample is off by 0.1 of the play to one side or the other.
        let off_rad = |k: u32| match k {
            0 => 0.0,
            _ => 0.1 * gap_rad * [1.0, -1.0][(k.wrapping_mul(2_654_435_761) >> 31) as usize],
        };
        let (mut before_rad_s, mut fastest_rad_s) = (0.0, 0.0_f64);
        for k in 0..4000 {
            let velocity_rad_s = (off_rad(k + 1) - off_rad(k)) / step_s;
            let motor_rad_s2 = (velocity_rad_s - before_rad_s) / step_s;
            before_rad_s = velocity_rad_s;
            let driven_rad_s2 = load.driven_rad_s2(0.0, [off_rad(k), 0.0], motor_rad_s2);
            load.advance(&now, driven_rad_s2, motor_rad_s2, |_, _| 0.0);
            let motor_rad_s = load
                .motor
                .map_or(velocity_rad_s, |motor| motor.velocity_rad_s);
            fastest_rad_s = fastest_rad_s.max((motor_rad_s - load.twisting_rad_s).abs());
        }
        fastest_rad_s * step_s / (0.1 * gap_rad)
    }

    #[test]
    fn noise_of_the_motion_pumps_no_load_before_which_the_model_moves_the_motor() {
        // A flank that shakes by one of these speeds throws the load by up to two of them; led, the motor moves by 0.06 of that.
        let (measured, led) = (pumped_times(None), pumped_times(Some(Corrects::ByMotor)));
        assert!(measured > 1.0, "{measured}");
        assert!(led < 0.5, "{led}");
    }

    #[test]
    fn a_motor_is_led_faster_by_a_finer_encoder_as_far_as_helps() {
        let leads = |position_noise_rad| leads_rad_s(200.0, position_noise_rad, 1e-3);
        // With the square root of one over the noise.
        let (coarse, fine) = (leads(1e-2), leads(1e-4));
        assert!((fine / coarse - 10.0).abs() < 1e-9, "{coarse} {fine}");
        assert_eq!(leads(1e-7), 250.0);
        assert_eq!(leads(0.0), 250.0);
        assert_eq!(leads_rad_s(200.0, 1e-7, 4e-3), 100.0);
    }

    #[test]
    fn an_error_of_the_load_decays_where_the_balance_corrects_it() {
        // e^(-5 x 0.015) of it by itself, e^(-5 x 0.6) and as much again as a half swing may hide where it is corrected.
        assert!(error_left(false) > 0.9, "{}", error_left(false));
        assert!(error_left(true) < 0.1, "{}", error_left(true));
    }
}
