//! Listed effects of the mechanics, and the disturbance.

use super::{
    ANY, Body, Built, Coupling, Entry, Form, NO_WISH, Now, ROTARY, SMALL, Shape, built, ramp,
};
use crate::axis::{Axis, Wanted};
use std::f64::consts::TAU;

const fn entry(
    id: &'static str,
    wanted: Wanted,
    shown_by: &'static [&'static str],
    build: fn(f64, &Shape, &Axis) -> Built,
) -> Entry {
    Entry {
        id,
        block: "mechanics",
        resembles: None,
        wanted,
        shown_by,
        smallest: SMALL,
        build,
    }
}

pub(super) const ENTRIES: &[Entry] = &[
    Entry {
        // 300 Hz.
        smallest: 2.5e-3,
        ..entry(
            "mechanics.compliance",
            NO_WISH,
            &["multisine", "moves"],
            compliance,
        )
    },
    Entry {
        // A play of 0.02 deg, or of 2 um.
        smallest: 4e-3,
        ..entry(
            "mechanics.backlash",
            NO_WISH,
            &["multisine", "moves", "sine"],
            backlash,
        )
    },
    entry(
        "mechanics.unbalance",
        ROTARY,
        &["sine", "ladder", "moves"],
        unbalance,
    ),
    entry(
        "mechanics.spring",
        NO_WISH,
        &["sine", "ladder", "moves"],
        spring,
    ),
    entry(
        "mechanics.offset",
        NO_WISH,
        &["ladder", "sine", "breakaway"],
        offset,
    ),
    entry("mechanics.end_stop", NO_WISH, &["sine", "moves"], end_stop),
    entry(
        "mechanics.inertia_change",
        NO_WISH,
        &["multisine", "moves", "sine"],
        inertia_change,
    ),
    Entry {
        block: "disturbance",
        ..entry("disturbance.periodic", NO_WISH, ANY, periodic)
    },
];

/// A spring that hardens, with damping, before a part of the inertia.
struct Elastic {
    load_share: f64,
    stiffness: f64,
    damping: f64,
    hard: f64,
    play: f64,
}

impl Form for Elastic {
    fn configure(&self, body: &mut Body) {
        let Self {
            load_share,
            stiffness,
            damping,
            hard,
            play,
        } = *self;
        let torque: Box<dyn Fn(f64, f64) -> f64 + Send> = if play > 0.0 {
            let edge = 0.03 * play;
            Box::new(move |x, v| {
                let twist = ramp(x - 0.5 * play, edge) - ramp(-x - 0.5 * play, edge);
                // A tooth that touches neither side is not damped.
                let touch = (twist.abs() / edge).min(1.0);
                stiffness * twist + touch * damping * v
            })
        } else {
            Box::new(move |x, v| stiffness * x * (1.0 + (x / hard) * (x / hard)) + damping * v)
        };
        body.coupling = Some(Coupling { load_share, torque });
    }
}

fn elastic(
    axis: &Axis,
    load_share: f64,
    frequency_hz: f64,
    damping_ratio: f64,
    play: f64,
) -> Elastic {
    let reduced = axis.inertia * load_share * (1.0 - load_share);
    let natural = TAU * frequency_hz;
    let stiffness = reduced * natural * natural;
    Elastic {
        load_share,
        stiffness,
        damping: 2.0 * damping_ratio * reduced * natural,
        hard: 6.0 * axis.scale() / stiffness,
        play,
    }
}

fn compliance(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let frequency_hz = 15.0 / size.sqrt();
    let load_share = 0.3 + 0.4 * shape[0];
    let form = elastic(axis, load_share, frequency_hz, 0.02 + 0.08 * shape[1], 0.0);
    let stiffness = form.stiffness;
    built(
        form,
        &[
            ("compliance_rad_nm", 1.0 / stiffness),
            ("load_share", load_share),
        ],
    )
}

fn backlash(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let play = size * if axis.linear { 5e-4 } else { 0.09 };
    let load_share = 0.3 + 0.4 * shape[0];
    let form = elastic(
        axis,
        load_share,
        200.0 + 100.0 * shape[2],
        0.1 + 0.1 * shape[1],
        play,
    );
    built(form, &[("gap_rad", play), ("load_share", load_share)])
}

/// A mass off the axis, with a little of twice a turn.
struct Unbalance {
    amplitude: f64,
    phase: f64,
}

impl Form for Unbalance {
    fn torque(&self, now: &Now) -> f64 {
        self.amplitude * (libm::sin(now.q + self.phase) + 0.08 * libm::sin(2.0 * now.q))
    }
}

fn unbalance(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let amplitude = 2.0 * size * axis.scale();
    built(
        Unbalance {
            amplitude,
            phase: TAU * shape[0],
        },
        &[("amplitude_nm", amplitude)],
    )
}

/// A cable chain: a spring about its own zero that hardens outwards.
struct Spring {
    stiffness: f64,
    zero: f64,
    travel: f64,
}

impl Form for Spring {
    fn torque(&self, now: &Now) -> f64 {
        let x = now.q - self.zero;
        let share = x / self.travel;
        // Rotary axes may run far: the spring stops hardening there.
        -self.stiffness * x * (1.0 + 0.2 * (share * share).min(4.0))
    }
}

fn spring(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let stiffness = 2.0 * size * axis.scale() / axis.travel;
    let zero = axis.travel * 0.2 * (shape[0] - 0.5);
    built(
        Spring {
            stiffness,
            zero,
            travel: axis.travel,
        },
        &[("stiffness_nm_rad", stiffness)],
    )
}

/// A weight, or an amplifier's offset, that is not quite the same all along.
struct Offset {
    torque: f64,
    travel: f64,
}

impl Form for Offset {
    fn torque(&self, now: &Now) -> f64 {
        self.torque * (1.0 + 0.05 * libm::sin(now.q / self.travel))
    }
}

fn offset(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let torque = 0.6 * size * axis.scale() * if shape[0] < 0.5 { -1.0 } else { 1.0 };
    built(
        Offset {
            torque,
            travel: axis.travel,
        },
        &[("torque_nm", torque)],
    )
}

/// A contact after Hertz at one end, damped while it is pressed in.
struct EndStop {
    place: f64,
    side: f64,
    stiffness: f64,
    depth: f64,
    damping: f64,
}

impl Form for EndStop {
    fn torque(&self, now: &Now) -> f64 {
        let into = self.side * now.q - self.place;
        if into <= 0.0 {
            return 0.0;
        }
        let share = into / self.depth;
        let press = self.stiffness * share * share.sqrt() * self.depth
            + self.damping * share.min(1.0) * self.side * now.v;
        -self.side * press.max(0.0)
    }
}

fn end_stop(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let place = axis.travel * (1.05 - 0.95 * size);
    let side = if shape[0] < 0.5 { -1.0 } else { 1.0 };
    let depth = 0.02 * axis.travel;
    let stiffness = (3.0 + 5.0 * shape[1]) * axis.scale() / depth;
    let damping = 0.3 * (stiffness * axis.inertia).sqrt();
    built(
        EndStop {
            place,
            side,
            stiffness,
            depth,
            damping,
        },
        &[("position_rad", side * place)],
    )
}

/// A payload taken up during the record, or an inertia that goes with position.
enum InertiaChange {
    Payload {
        share: f64,
        from_s: f64,
        over_s: f64,
    },
    Crank {
        share: f64,
        per_rad: f64,
        phase: f64,
    },
}

impl Form for InertiaChange {
    fn inertia(&self, now: &Now) -> (f64, f64) {
        match *self {
            Self::Payload {
                share,
                from_s,
                over_s,
            } => {
                let x = ((now.t - from_s) / over_s).clamp(0.0, 1.0);
                (1.0 + share * x * x * (3.0 - 2.0 * x), 0.0)
            }
            Self::Crank {
                share,
                per_rad,
                phase,
            } => {
                let x = per_rad * now.q + phase;
                let (sin, cos) = (libm::sin(x), libm::cos(x));
                // 1 + share (0.5 + 0.5 cos x + 0.1 cos 2x)
                let factor = 1.0 + share * (0.5 + 0.5 * cos + 0.1 * (2.0 * cos * cos - 1.0));
                (factor, -share * per_rad * (0.5 * sin + 0.4 * sin * cos))
            }
        }
    }
}

fn inertia_change(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let share = 1.5 * size;
    let form = if shape[0] < 0.5 {
        InertiaChange::Payload {
            share,
            from_s: 1.5 + 3.0 * shape[1],
            over_s: 0.03 + 0.1 * shape[2],
        }
    } else {
        let per_rad = if axis.linear {
            2.0 / axis.travel
        } else {
            1.0 + (shape[1] * 2.0).floor()
        };
        InertiaChange::Crank {
            share,
            per_rad,
            phase: TAU * shape[2],
        }
    };
    let name = match form {
        InertiaChange::Payload { .. } => ("share", share),
        InertiaChange::Crank { .. } => ("amplitude_share", 0.5 * share),
    };
    built(form, &[name])
}

/// A line in time with a third harmonic.
struct Periodic {
    amplitude: f64,
    frequency_hz: f64,
    phase: f64,
}

impl Form for Periodic {
    fn torque(&self, now: &Now) -> f64 {
        let x = TAU * self.frequency_hz * now.t + self.phase;
        self.amplitude * (libm::sin(x) + 0.2 * libm::sin(3.0 * x))
    }
}

fn periodic(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let amplitude = size * axis.scale();
    let frequency_hz = 0.8 * libm::pow(30.0, shape[0]);
    let form = Periodic {
        amplitude,
        frequency_hz,
        phase: TAU * shape[1],
    };
    built(
        form,
        &[("amplitude_nm", amplitude), ("frequency_hz", frequency_hz)],
    )
}
