//! The axis as it is: drawn so that friction, inertia, speed and travel are in the proportions of real servo axes.

use crate::draw::Draw;
use crate::friction::{Friction, Law};
use crate::noise::window_s;
use std::f64::consts::TAU;

/// An axis, its encoder and its drive. Names are those of a rotary axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    pub(crate) linear: bool,
    pub(crate) inertia: f64,
    pub(crate) friction: Friction,
    /// Speed for which it is built, rad/s.
    pub(crate) rated_speed: f64,
    /// Travel to either side in an experiment, rad.
    pub(crate) travel: f64,
    /// The drive's limit, N m.
    pub(crate) torque_limit: f64,
    /// Travel of an encoder count, rad.
    pub(crate) count: f64,
    /// Samples a second.
    pub(crate) rate_hz: f64,
    /// Effort noise, N m rms; the share of its variance that is coloured; its correlation time, s.
    pub(crate) effort_noise: (f64, f64, f64),
    /// Encoder noise before rounding, in counts rms.
    pub(crate) count_noise: f64,
    /// Deviation of sampling instants, s rms.
    pub(crate) jitter_s: f64,
    /// Time constant of the current loop, s.
    pub(crate) current_loop_s: f64,
}

/// What an effect asks of the axis that hosts it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wanted {
    /// The law is static, so that presliding is missing in the file.
    pub(crate) is_static: bool,
    /// The law has bristles.
    pub(crate) bristles: bool,
    /// F_S = F_C.
    pub(crate) flat: bool,
    /// Rotary, or linear; any where `None`.
    pub(crate) linear: Option<bool>,
}

impl Axis {
    /// An axis that has what is wanted.
    pub(crate) fn draw(draw: &mut Draw, wanted: &Wanted) -> Self {
        let linear = wanted.linear.unwrap_or_else(|| draw.chance(0.35));
        let (coulomb, rated_speed, travel) = if linear {
            (draw.log(5.0, 60.0), draw.log(0.2, 0.6), draw.even(0.1, 0.3))
        } else {
            (
                draw.log(0.02, 0.5),
                draw.log(15.0, 120.0),
                TAU * draw.even(0.8, 3.0),
            )
        };
        // Friction alone stops it from rated speed in this time.
        let inertia = coulomb * draw.log(0.06, 0.3) / rated_speed;
        let rate_hz = draw.pick(&[500.0, 1000.0, 1000.0, 2000.0, 4000.0, 10_000.0]);
        let mut axis = Self {
            linear,
            inertia,
            friction: friction(draw, wanted, coulomb, inertia, rated_speed),
            rated_speed,
            travel,
            torque_limit: coulomb * draw.even(6.0, 10.0),
            count: 0.0,
            rate_hz,
            effort_noise: (
                coulomb * draw.log(0.005, 0.03),
                draw.even(0.1, 0.6),
                draw.log(3e-3, 3e-2),
            ),
            count_noise: if draw.chance(0.5) {
                draw.even(0.1, 0.4)
            } else {
                0.0
            },
            jitter_s: draw.log(1e-4, 3e-3) / rate_hz,
            current_loop_s: draw.log(1e-4, 5e-4),
        };
        axis.count = axis.draw_count(draw);
        axis
    }

    /// The torque by which sizes are measured: F_C.
    pub(crate) fn scale(&self) -> f64 {
        self.friction.coulomb
    }

    /// A speed below which the log shows rest.
    pub(crate) fn rest_speed(&self) -> f64 {
        2e-3 * self.rated_speed
    }

    /// An encoder of 12 to 20 bit, or of 0.02 to 2 um, whose noise in the acceleration stays below a twentieth of F_C.
    fn draw_count(&self, draw: &mut Draw) -> f64 {
        let window = window_s(1.0 / self.rate_hz);
        // White noise through the second derivative of a Gaussian window: variance 3/(8 sqrt(pi)) s^-5 a sample rate.
        let gain = (0.2116 / (libm::pow(window, 5.0) * self.rate_hz)).sqrt();
        let coarsest = 0.05 * self.scale() / (self.inertia * gain) * 12f64.sqrt();
        if self.linear {
            let grids = [2e-6, 1e-6, 5e-7, 1e-7, 5e-8, 2e-8];
            let fit: Vec<f64> = grids.into_iter().filter(|grid| *grid <= coarsest).collect();
            return if fit.is_empty() {
                grids[5]
            } else {
                draw.pick(&fit)
            };
        }
        let fewest = (12..20)
            .find(|bits| TAU / f64::from(1 << bits) <= coarsest)
            .unwrap_or(20);
        TAU / f64::from(1u32 << (fewest + draw.below(21 - fewest as usize) as u32))
    }
}

fn friction(
    draw: &mut Draw,
    wanted: &Wanted,
    coulomb: f64,
    inertia: f64,
    rated_speed: f64,
) -> Friction {
    let law = if wanted.is_static || (!wanted.bristles && draw.chance(0.15)) {
        Law::Static
    } else if draw.chance(0.65) {
        Law::ElastoPlastic
    } else {
        Law::Lugre
    };
    // A natural frequency in stick of 25 to 90 Hz: with inertia and F_C it sets z_ss.
    let natural = TAU * draw.log(25.0, 90.0);
    let stiffness = inertia * natural * natural;
    let ratio = if wanted.flat {
        1.0
    } else {
        draw.even(1.1, 1.6)
    };
    let viscous = coulomb / rated_speed * draw.log(0.2, 0.9);
    Friction {
        law,
        coulomb,
        stiction: coulomb * ratio,
        stribeck_velocity: rated_speed * draw.log(0.006, 0.03),
        stiffness,
        damping: 2.0 * draw.even(0.1, 0.4) * inertia * natural,
        viscous,
        breakaway_ratio: draw.even(0.5, 0.8),
    }
}
