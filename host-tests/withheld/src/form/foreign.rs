//! Effects that no list has, for the verdict that it is none of those known.

use super::{Built, Entry, Form, NO_WISH, Now, SMALL, Shape, built, randomness};
use crate::axis::Axis;
use crate::friction::Level;

const fn entry(
    id: &'static str,
    block: &'static str,
    resembles: Option<&'static str>,
    shown_by: &'static [&'static str],
    build: fn(f64, &Shape, &Axis) -> Built,
) -> Entry {
    Entry {
        id,
        block,
        resembles,
        wanted: NO_WISH,
        shown_by,
        smallest: SMALL,
        build,
    }
}

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "foreign.iron_hysteresis",
        "actuator",
        Some("actuator.deadzone"),
        &["multisine"],
        iron_hysteresis,
    ),
    entry(
        "foreign.rubbing_brake",
        "friction",
        Some("friction.thermal"),
        &["sine", "ladder"],
        rubbing_brake,
    ),
    entry(
        "foreign.thick_grease",
        "friction",
        Some("friction.dwell"),
        &["moves"],
        thick_grease,
    ),
    entry(
        "foreign.cable_hysteresis",
        "mechanics",
        Some("mechanics.spring"),
        &["sine", "moves"],
        cable_hysteresis,
    ),
    entry(
        "foreign.supply_sag",
        "actuator",
        Some("actuator.gain"),
        &["moves", "sine"],
        supply_sag,
    ),
    entry(
        "foreign.speed_resonance",
        "friction",
        Some("friction.quadratic"),
        &["ladder", "sine", "moves"],
        speed_resonance,
    ),
    entry(
        "foreign.notches",
        "mechanics",
        Some("actuator.cogging"),
        &["sine", "moves", "ladder"],
        notches,
    ),
    entry(
        "foreign.brush_tilt",
        "actuator",
        None,
        &["sine", "moves"],
        brush_tilt,
    ),
];

/// Torque lags behind current by play, whatever the time: six play operators (Prandtl and Ishlinskii).
struct IronHysteresis {
    share: f64,
    widths: [f64; 6],
    plays: [f64; 6],
}

impl Form for IronHysteresis {
    fn reset(&mut self, _: &Axis) {
        self.plays = [0.0; 6];
    }
    fn actuator(&mut self, _: &Now, u: f64) -> f64 {
        let mut mean = 0.0;
        for (play, width) in self.plays.iter_mut().zip(&self.widths) {
            *play = play.clamp(u - width, u + width);
            mean += *play / 6.0;
        }
        u + self.share * (mean - u)
    }
}

fn iron_hysteresis(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let widest = axis.scale() * (1.5 + 1.5 * shape[0]);
    let form = IronHysteresis {
        share: 0.9 * size,
        widths: std::array::from_fn(|i| widest * (i as f64 + 0.5) / 6.0),
        plays: [0.0; 6],
    };
    built(form, &[])
}

/// A brake that rubs now and then, at times of its own.
struct RubbingBrake {
    share: f64,
    /// Start and end of each time it rubs.
    spells: Vec<(f64, f64)>,
}

impl Form for RubbingBrake {
    fn level(&self, now: &Now, level: &mut Level) {
        let depth = self
            .spells
            .iter()
            .map(|(from, to)| {
                let edge = 0.05;
                ((now.t - from) / edge)
                    .min((to - now.t) / edge)
                    .clamp(0.0, 1.0)
            })
            .fold(0.0, f64::max);
        level.coulomb *= 1.0 + self.share * depth;
    }
}

fn rubbing_brake(size: f64, shape: &Shape, _: &Axis) -> Built {
    let mut draw = randomness(shape);
    let mut spells = Vec::new();
    let mut t = draw.even(0.3, 2.0);
    while t < 20.0 {
        let length = draw.log(0.2, 1.5);
        spells.push((t, t + length));
        t += length + draw.log(0.5, 3.0);
    }
    built(
        RubbingBrake {
            share: 1.2 * size,
            spells,
        },
        &[],
    )
}

/// Grease that stands thick after rest and is stirred thin by way, not by time.
struct ThickGrease {
    share: f64,
    way: f64,
    time_s: f64,
    stirred: f64,
}

impl Form for ThickGrease {
    fn reset(&mut self, _: &Axis) {
        self.stirred = 0.0;
    }
    fn level(&self, _: &Now, level: &mut Level) {
        level.viscous *= 1.0 + self.share * libm::exp(-self.stirred);
    }
    fn advance(&mut self, now: &Now) {
        self.stirred += now.v.abs() * now.h / self.way - now.h * self.stirred / self.time_s;
    }
}

fn thick_grease(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let form = ThickGrease {
        share: 8.0 * size,
        way: axis.travel * (0.3 + 0.5 * shape[0]),
        time_s: 0.4 + shape[1],
        stirred: 0.0,
    };
    built(form, &[])
}

/// A cable chain whose layers slip on each other over much of the stroke.
struct CableHysteresis {
    torque: f64,
    slip: [f64; 5],
    z: [f64; 5],
    at: f64,
}

impl Form for CableHysteresis {
    fn reset(&mut self, _: &Axis) {
        self.z = [0.0; 5];
        self.at = 0.0;
    }
    fn torque(&self, now: &Now) -> f64 {
        let way = now.q - self.at;
        let pull = |(z, slip): (&f64, &f64)| ((z + way) / slip).clamp(-1.0, 1.0);
        -self.torque / 5.0 * self.z.iter().zip(&self.slip).map(pull).sum::<f64>()
    }
    fn advance(&mut self, now: &Now) {
        let way = now.q - self.at;
        for (z, slip) in self.z.iter_mut().zip(&self.slip) {
            *z = (*z + way).clamp(-slip, *slip);
        }
        self.at = now.q;
    }
}

fn cable_hysteresis(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let widest = axis.travel * (0.4 + 0.6 * shape[0]);
    let form = CableHysteresis {
        torque: 1.5 * size * axis.scale(),
        slip: std::array::from_fn(|i| widest * (i as f64 + 1.0) / 5.0),
        z: [0.0; 5],
        at: 0.0,
    };
    built(form, &[])
}

/// A supply that sags under power and recovers: less torque for the same current reference.
struct SupplySag {
    share: f64,
    power: f64,
    time_s: f64,
    sag: f64,
}

impl Form for SupplySag {
    fn reset(&mut self, _: &Axis) {
        self.sag = 0.0;
    }
    fn actuator(&mut self, _: &Now, u: f64) -> f64 {
        u * (1.0 - self.share * self.sag / (1.0 + self.sag))
    }
    fn advance(&mut self, now: &Now) {
        let power = (now.u * now.v).max(0.0) / self.power;
        self.sag += now.h * (power - self.sag) / self.time_s;
    }
}

fn supply_sag(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let form = SupplySag {
        share: 0.8 * size,
        power: 0.3 * axis.scale() * axis.rated_speed,
        time_s: 0.1 + 0.5 * shape[0],
        sag: 0.0,
    };
    built(form, &[])
}

/// A cover that is shaken at one speed and takes power there.
struct SpeedResonance {
    torque: f64,
    speed: f64,
    width: f64,
}

impl Form for SpeedResonance {
    fn level(&self, now: &Now, level: &mut Level) {
        let x = (now.v.abs() - self.speed) / self.width;
        level.rise += self.torque * libm::exp(-0.5 * x * x);
    }
}

fn speed_resonance(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let speed = axis.rated_speed * (0.12 + 0.2 * shape[0]);
    let form = SpeedResonance {
        torque: 1.5 * size * axis.scale(),
        speed,
        width: speed * (0.12 + 0.15 * shape[1]),
    };
    built(form, &[])
}

/// Dents in a track: each pulls into itself, at places without a period.
struct Notches {
    torque: f64,
    width: f64,
    places: [f64; 5],
}

impl Form for Notches {
    fn torque(&self, now: &Now) -> f64 {
        // Deepest slope 1 at one width from the middle.
        let pull = |place: &f64| {
            let x = (now.q - place) / self.width;
            x * libm::exp(0.5 - 0.5 * x * x)
        };
        -self.torque * self.places.iter().map(pull).sum::<f64>()
    }
}

fn notches(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let mut draw = randomness(shape);
    let form = Notches {
        torque: 2.5 * size * axis.scale(),
        width: axis.travel * (0.015 + 0.02 * shape[0]),
        places: std::array::from_fn(|_| axis.travel * draw.even(-0.8, 0.8)),
    };
    built(form, &[])
}

/// Brushes that tilt at each reversal: less torque until they have run in the new direction.
struct BrushTilt {
    share: f64,
    way: f64,
    run: f64,
    direction: f64,
}

impl Form for BrushTilt {
    fn reset(&mut self, _: &Axis) {
        (self.run, self.direction) = (0.0, 1.0);
    }
    fn actuator(&mut self, _: &Now, u: f64) -> f64 {
        u * (1.0 - self.share * libm::exp(-self.run / self.way))
    }
    fn advance(&mut self, now: &Now) {
        if now.v * self.direction < 0.0 {
            self.direction = now.v.signum();
            self.run = 0.0;
        }
        self.run += (now.v * now.h).abs();
    }
}

fn brush_tilt(size: f64, shape: &Shape, axis: &Axis) -> Built {
    let form = BrushTilt {
        share: 0.6 * size,
        way: axis.travel * (0.1 + 0.2 * shape[0]),
        run: 0.0,
        direction: 1.0,
    };
    built(form, &[])
}
