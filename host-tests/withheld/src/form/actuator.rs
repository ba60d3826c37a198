//! Listed effects of the actuator: between the torque that the drive measures and the one that reaches the rotor.

use super::{Built, Entry, Form, History, NO_WISH, Now, SMALL, Shape, Wave, built, order, ramp};
use crate::axis::Axis;

const fn entry(
    id: &'static str,
    shown_by: &'static [&'static str],
    build: fn(f64, &Shape, &Axis) -> Built,
) -> Entry {
    Entry {
        id,
        block: "actuator",
        resembles: None,
        wanted: NO_WISH,
        shown_by,
        smallest: SMALL,
        build,
    }
}

pub(super) const ENTRIES: &[Entry] = &[
    entry("actuator.cogging", &["ladder", "sine", "moves"], cogging),
    entry("actuator.ripple", &["moves", "sine"], ripple),
    entry("actuator.lag", &["multisine", "moves"], lag),
    entry("actuator.delay", &["multisine", "moves"], delay),
    entry("actuator.saturation", &["multisine", "moves"], saturation),
    entry("actuator.deadzone", &["multisine", "breakaway"], deadzone),
    entry("actuator.gain", &["multisine", "moves"], gain),
    entry("actuator.voltage_limit", &["moves"], voltage_limit),
];

/// Torque over angle with harmonics, whatever the current.
struct Cogging {
    amplitude: f64,
    wave: Wave,
}

impl Form for Cogging {
    fn torque(&self, now: &Now) -> f64 {
        self.amplitude * self.wave.at(now.q)
    }
}

fn cogging(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let (per_rad, per_turn) = order(
        axis,
        shape[3],
        &[6.0, 7.0, 8.0, 12.0, 14.0, 18.0, 24.0, 36.0],
    );
    let amplitude = size * axis.scale();
    built(
        Cogging {
            amplitude,
            wave: Wave::new(per_rad, shape),
        },
        &[("amplitude_nm", amplitude), ("order_per_rev", per_turn)],
    )
}

/// A torque constant that goes with angle.
struct Ripple {
    share: f64,
    wave: Wave,
}

impl Form for Ripple {
    fn actuator(&mut self, now: &Now, u: f64) -> f64 {
        u * (1.0 + self.share * self.wave.at(now.q))
    }
}

fn ripple(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let (per_rad, per_turn) = order(axis, shape[3], &[4.0, 6.0, 8.0, 12.0, 24.0]);
    let share = 0.5 * size;
    built(
        Ripple {
            share,
            wave: Wave::new(per_rad, shape),
        },
        &[("amplitude_share", share), ("order_per_rev", per_turn)],
    )
}

/// Two equal lags that add up to one time.
struct Lag {
    time_s: f64,
    first: f64,
    second: f64,
}

impl Form for Lag {
    fn reset(&mut self, _: &Axis) {
        (self.first, self.second) = (0.0, 0.0);
    }
    fn actuator(&mut self, now: &Now, u: f64) -> f64 {
        // The second one is short, so that the sum stays a lag and does not become a delay.
        let share = |time_s: f64| 1.0 - libm::exp(-now.h / time_s);
        self.first += share(0.85 * self.time_s) * (u - self.first);
        self.second += share(0.15 * self.time_s) * (self.first - self.second);
        self.second
    }
}

fn lag(size: f64, _: &Shape, _: &Axis) -> Built {
    let time_s = 0.012 * size;
    built(
        Lag {
            time_s,
            first: 0.0,
            second: 0.0,
        },
        &[("lag_s", time_s)],
    )
}

/// A bus that is late, and not always by the same.
struct Delay {
    time_s: f64,
    history: History,
}

impl Form for Delay {
    fn reset(&mut self, _: &Axis) {
        self.history = History::new();
    }
    fn actuator(&mut self, now: &Now, u: f64) -> f64 {
        let wander = 1.0 + 0.04 * libm::sin(2.4 * now.t);
        self.history.delayed(u, self.time_s * wander, now.h)
    }
}

fn delay(size: f64, _: &Shape, _: &Axis) -> Built {
    let time_s = 0.012 * size;
    built(
        Delay {
            time_s,
            history: History::new(),
        },
        &[("delay_s", time_s)],
    )
}

/// `value` bent towards `limit` with a knee.
fn bent(value: f64, limit: f64, sharpness: f64) -> f64 {
    let share = (value / limit).abs();
    value / libm::pow(1.0 + libm::pow(share, sharpness), 1.0 / sharpness)
}

/// An end of the torque with a knee.
struct Saturation {
    limit: f64,
    sharpness: f64,
}

impl Form for Saturation {
    fn actuator(&mut self, _: &Now, u: f64) -> f64 {
        bent(u, self.limit, self.sharpness)
    }
}

fn saturation(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let limit = axis.scale() * (1.3 + 4.0 * (1.0 - size));
    built(
        Saturation {
            limit,
            sharpness: 10.0 + 15.0 * shape[0],
        },
        &[("limit_nm", limit)],
    )
}

/// No torque near zero, with rounded edges.
struct Deadzone {
    half: f64,
}

impl Form for Deadzone {
    fn actuator(&mut self, _: &Now, u: f64) -> f64 {
        let edge = 0.08 * self.half;
        ramp(u - self.half, edge) - ramp(-u - self.half, edge)
    }
}

fn deadzone(size: f64, _: &Shape, axis: &Axis) -> Built {
    let half = 0.6 * size * axis.scale();
    built(Deadzone { half }, &[("width_nm", half)])
}

/// A torque constant that falls as the iron fills.
struct Gain {
    fall: f64,
    knee: f64,
}

impl Form for Gain {
    fn actuator(&mut self, _: &Now, u: f64) -> f64 {
        let share = u / self.knee;
        u * (1.0 - self.fall * share * share / (1.0 + share * share))
    }
}

fn gain(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let fall = 0.4 * size;
    built(
        Gain {
            fall,
            knee: axis.scale() * (2.0 + 2.0 * shape[0]),
        },
        &[],
    )
}

/// Less torque near the speed at which the voltage is used up; braking is not limited.
struct VoltageLimit {
    torque: f64,
    speed: f64,
}

impl Form for VoltageLimit {
    fn actuator(&mut self, now: &Now, u: f64) -> f64 {
        if u * now.v <= 0.0 {
            return u;
        }
        let left = self.torque * (1.0 - now.v.abs() / self.speed);
        bent(u, left.max(0.05 * self.torque), 12.0)
    }
}

fn voltage_limit(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let speed = axis.rated_speed * (0.5 + 0.3 / size);
    built(
        VoltageLimit {
            torque: axis.torque_limit * (0.6 + 0.4 * shape[0]),
            speed,
        },
        &[("no_load_rad_s", speed)],
    )
}
