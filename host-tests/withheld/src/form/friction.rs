//! Listed effects of friction.

use super::{Body, Built, Entry, Form, NO_WISH, Now, SMALL, Shape, Wave, built, order};
use crate::axis::{Axis, Wanted};
use crate::friction::{Law, Level};
use std::f64::consts::PI;

const BRISTLES: Wanted = Wanted {
    bristles: true,
    ..NO_WISH
};

const fn entry(
    id: &'static str,
    wanted: Wanted,
    shown_by: &'static [&'static str],
    build: fn(f64, &Shape, &Axis) -> Built,
) -> Entry {
    Entry {
        id,
        block: "friction",
        resembles: None,
        wanted,
        shown_by,
        smallest: SMALL,
        build,
    }
}

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "friction.stribeck",
        Wanted {
            flat: true,
            ..NO_WISH
        },
        &["ladder", "sine", "moves"],
        stribeck,
    ),
    Entry {
        // Below a twentieth of what other axes have it cannot be told from a static law.
        smallest: 0.05,
        ..entry(
            "friction.presliding",
            Wanted {
                is_static: true,
                ..NO_WISH
            },
            &["breakaway"],
            presliding,
        )
    },
    entry(
        "friction.asymmetry",
        NO_WISH,
        &["ladder", "sine"],
        asymmetry,
    ),
    entry(
        "friction.position",
        NO_WISH,
        &["ladder", "sine", "moves"],
        position,
    ),
    entry("friction.load", NO_WISH, &["moves", "multisine"], load),
    entry(
        "friction.thermal",
        NO_WISH,
        &["sine", "ladder", "moves"],
        thermal,
    ),
    entry("friction.dwell", BRISTLES, &["breakaway", "moves"], dwell),
    entry("friction.lag", NO_WISH, &["sine", "multisine"], lag),
    entry("friction.nonlocal", BRISTLES, &["breakaway"], nonlocal),
    entry(
        "friction.quadratic",
        NO_WISH,
        &["ladder", "moves", "sine"],
        quadratic,
    ),
];

/// A hump that falls with a power of speed, not as a Gaussian.
struct Stribeck {
    rise: f64,
    velocity: f64,
}

impl Form for Stribeck {
    fn level(&self, now: &Now, level: &mut Level) {
        let share = now.v.abs() / self.velocity;
        level.rise += self.rise / (1.0 + share * share.sqrt());
    }
}

fn stribeck(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let velocity = axis.rated_speed * (0.01 + 0.03 * shape[0]);
    let rise = size * axis.scale();
    built(
        Stribeck { rise, velocity },
        &[("rise_share", size), ("stribeck_velocity_rad_s", velocity)],
    )
}

/// Bristles, and a law that creeps in half of the cases.
struct Presliding {
    z_ss: f64,
    law: Law,
}

impl Form for Presliding {
    fn configure(&self, body: &mut Body) {
        let friction = &mut body.friction;
        let stiffness = friction.coulomb / self.z_ss;
        // The damping ratio in stick stays what it was.
        friction.damping *= (stiffness / friction.stiffness).sqrt();
        friction.stiffness = stiffness;
        friction.law = self.law;
    }
}

fn presliding(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let z_ss = 5.0 * size * axis.scale() / axis.friction.stiffness;
    let law = if shape[0] < 0.5 {
        Law::ElastoPlastic
    } else {
        Law::Lugre
    };
    built(Presliding { z_ss, law }, &[("z_ss_rad", z_ss)])
}

/// Dry and viscous friction differ by direction, each by a share of its own.
struct Asymmetry {
    share: f64,
    viscous: f64,
    edge: f64,
}

impl Form for Asymmetry {
    fn level(&self, now: &Now, level: &mut Level) {
        let direction = libm::tanh(now.v / self.edge);
        level.coulomb *= 1.0 + self.share * direction;
        level.viscous *= 1.0 + self.viscous * direction;
    }
}

fn asymmetry(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let share = 0.5 * size * if shape[0] < 0.5 { -1.0 } else { 1.0 };
    let viscous = share * (0.5 + shape[1]);
    let edge = axis.rest_speed();
    built(
        Asymmetry {
            share,
            viscous,
            edge,
        },
        &[("share", share)],
    )
}

/// A wave with harmonics over position, or one tight place in the stroke that comes again each turn.
struct Position {
    share: f64,
    wave: Wave,
    bump: bool,
}

impl Form for Position {
    fn level(&self, now: &Now, level: &mut Level) {
        let shape = if self.bump {
            let x = libm::sin(0.5 * (self.wave.order * now.q + self.wave.phase));
            2.0 * libm::exp(-6.0 * x * x) - 0.5
        } else {
            self.wave.at(now.q)
        };
        level.coulomb *= 1.0 + self.share * shape;
    }
}

fn position(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let (per_rad, per_turn) = if axis.linear {
        // One to four waves over the stroke: a bent screw or rail.
        let per_m = (1.0 + (shape[3] * 4.0).floor()) / (2.0 * axis.travel);
        (2.0 * PI * per_m, per_m)
    } else {
        order(axis, shape[3], &[1.0, 1.0, 2.0, 3.0, 4.0])
    };
    let share = 0.6 * size;
    let form = Position {
        share,
        wave: Wave::new(per_rad, shape),
        bump: shape[4] < 0.4,
    };
    built(
        form,
        &[("amplitude_share", share), ("order_per_rev", per_turn)],
    )
}

/// Friction of a gear that grows with the torque it passes on, rounded near zero.
struct Load {
    mu: f64,
    edge: f64,
}

impl Form for Load {
    fn level(&self, now: &Now, level: &mut Level) {
        level.rise += self.mu * ((now.u * now.u + self.edge * self.edge).sqrt() - self.edge);
    }
}

fn load(size: f64, _: &Shape, axis: &Axis) -> Built {
    let mu = 0.35 * size;
    built(
        Load {
            mu,
            edge: 0.2 * axis.scale(),
        },
        &[("mu", mu)],
    )
}

/// Friction falls with the heat that it makes and that flows off.
struct Thermal {
    fall: f64,
    power: f64,
    time_s: f64,
    heat: f64,
}

impl Form for Thermal {
    fn reset(&mut self, _: &Axis) {
        self.heat = 0.0;
    }
    fn level(&self, _: &Now, level: &mut Level) {
        let factor = 1.0 - self.fall * self.heat / (0.5 + self.heat);
        level.coulomb *= factor;
        level.viscous *= factor;
    }
    fn advance(&mut self, now: &Now) {
        let power = (now.friction * now.v).abs() / self.power;
        self.heat += now.h * (power - self.heat) / self.time_s;
    }
}

fn thermal(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let fall = 0.9 * size;
    let time_s = 3.0 + 10.0 * shape[0];
    let form = Thermal {
        fall,
        power: 0.2 * axis.scale() * axis.rated_speed,
        time_s,
        heat: 0.0,
    };
    built(form, &[("fall_share", fall), ("warm_up_s", time_s)])
}

/// Break-away grows with the logarithm of the time at rest, and is forgotten over a short way.
struct Dwell {
    rise: f64,
    time_s: f64,
    way: f64,
    bond: f64,
}

impl Form for Dwell {
    fn reset(&mut self, _: &Axis) {
        self.bond = 0.0;
    }
    fn level(&self, _: &Now, level: &mut Level) {
        level.rise += self.rise * self.bond;
    }
    fn advance(&mut self, now: &Now) {
        let grown = libm::log1p(now.rest_s / self.time_s) / libm::log1p(1.0 / self.time_s);
        self.bond = self.bond.max(grown.min(1.5)) * libm::exp(-now.v.abs() * now.h / self.way);
    }
}

fn dwell(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let rise = 1.2 * size * axis.scale();
    let time_s = 0.03 + 0.3 * shape[0];
    let way = (2.0 + 4.0 * shape[1]) * axis.scale() / axis.friction.stiffness;
    built(
        Dwell {
            rise,
            time_s,
            way,
            bond: 0.0,
        },
        &[("rise_share", 1.2 * size), ("dwell_s", time_s)],
    )
}

/// Friction follows velocity through two equal lags.
struct Lag {
    time_s: f64,
    first: f64,
    second: f64,
}

impl Form for Lag {
    fn reset(&mut self, _: &Axis) {
        (self.first, self.second) = (0.0, 0.0);
    }
    fn friction_velocity(&self, _: f64) -> f64 {
        self.second
    }
    fn advance(&mut self, now: &Now) {
        let share = 1.0 - libm::exp(-2.0 * now.h / self.time_s);
        self.first += share * (now.v - self.first);
        self.second += share * (self.first - self.second);
    }
}

fn lag(size: f64, _: &Shape, _: &Axis) -> Built {
    let time_s = 0.06 * size;
    built(
        Lag {
            time_s,
            first: 0.0,
            second: 0.0,
        },
        &[("lag_s", time_s)],
    )
}

/// A part of the dry friction comes from eight spring-and-slip elements that let go one after the other.
struct Nonlocal {
    part: f64,
    slip: [f64; 8],
    z: [f64; 8],
    at: f64,
    level: f64,
}

impl Form for Nonlocal {
    fn reset(&mut self, axis: &Axis) {
        self.z = [0.0; 8];
        self.at = 0.0;
        self.level = self.part * axis.scale() / 8.0;
    }
    fn level(&self, _: &Now, level: &mut Level) {
        level.coulomb *= 1.0 - self.part;
    }
    fn torque(&self, now: &Now) -> f64 {
        let way = now.q - self.at;
        let pull = |(z, slip): (&f64, &f64)| ((z + way) / slip).clamp(-1.0, 1.0);
        -self.level * self.z.iter().zip(&self.slip).map(pull).sum::<f64>()
    }
    fn advance(&mut self, now: &Now) {
        let way = now.q - self.at;
        for (z, slip) in self.z.iter_mut().zip(&self.slip) {
            *z = (*z + way).clamp(-slip, *slip);
        }
        self.at = now.q;
    }
}

fn nonlocal(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let z_ss = axis.scale() / axis.friction.stiffness;
    let widest = z_ss * (6.0 + 20.0 * shape[0]);
    let slip = std::array::from_fn(|i| widest * libm::pow(0.03, 1.0 - i as f64 / 7.0));
    let part = 0.9 * size;
    built(
        Nonlocal {
            part,
            slip,
            z: [0.0; 8],
            at: 0.0,
            level: 0.0,
        },
        &[],
    )
}

/// Drag with a power of speed near two.
struct Quadratic {
    at_rated: f64,
    rated: f64,
    power: f64,
}

impl Form for Quadratic {
    fn torque(&self, now: &Now) -> f64 {
        -self.at_rated * libm::pow(now.v.abs() / self.rated, self.power) * now.v.signum()
    }
}

fn quadratic(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let at_rated = 3.0 * size * axis.scale();
    let form = Quadratic {
        at_rated,
        rated: axis.rated_speed,
        power: 1.85 + 0.4 * shape[0],
    };
    built(
        form,
        &[(
            "drag_nm_s2_rad2",
            at_rated / (axis.rated_speed * axis.rated_speed),
        )],
    )
}
