//! What an effect takes: names, roles and usual ranges of its parameters.

use super::hook::Effect;
use crate::unit::Unit;
use std::f64::consts::PI;

/// The size of an axis and of its records, from which the usual range of a parameter follows. A linear axis reads m for
/// rad and N for N m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Rotary or linear.
    pub unit: Unit,
    /// F_C.
    pub coulomb_nm: f64,
    /// All of it.
    pub inertia_kg_m2: f64,
    /// Stribeck velocity.
    pub stribeck_velocity_rad_s: f64,
    /// Bristle deflection in slow sliding.
    pub z_ss_rad: f64,
    /// Highest speed on record.
    pub top_speed_rad_s: f64,
    /// Highest torque on record.
    pub top_torque_nm: f64,
    /// Lowest position on record.
    pub lowest_rad: f64,
    /// Highest position on record.
    pub highest_rad: f64,
    /// Length of the longest record.
    pub duration_s: f64,
    /// Length of a sample.
    pub sample_time_s: f64,
    /// Travel of an encoder count.
    pub rad_per_count: f64,
}

impl Scale {
    /// Travel between the ends of the record; a count where it does not move.
    pub fn stroke_rad(&self) -> f64 {
        (self.highest_rad - self.lowest_rad).max(self.rad_per_count)
    }

    /// One of two ranges, by the kind of axis.
    pub(super) fn either(&self, rotary: [f64; 2], linear: [f64; 2]) -> [f64; 2] {
        match self.unit {
            Unit::Rotary => rotary,
            Unit::Linear => linear,
        }
    }
}

/// What role a parameter plays, for whoever searches for its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// At zero its part of the effect is not there, and near zero that grows in proportion.
    Size,
    /// A bound: the lower it is, the more of the effect; zero stands for none.
    Limit,
    /// Waves a turn, or a metre: a whole number on a rotary axis.
    Order,
    /// Phase of a wave, rad.
    Phase,
    /// A detail of a wave or a limit, not there at zero: nothing to search for before the wave or the limit is known.
    Detail,
    /// Frequency of a wave, Hz.
    Frequency,
    /// Moment from which something is different for good.
    Onset,
    /// Moment of a sudden change.
    Event,
    /// Place of a sudden change: an angle within the turn, or along a linear axis.
    Place,
    /// Place beyond which something is in the way, near an end of the travel.
    Stop,
    /// Where the effect passes through zero: its change is straight in this times its size.
    Zero,
    /// Anything else: times, speeds, exponents.
    Shape,
    /// One of two forms: its lowest or its highest value.
    Form,
    /// On which side of its place it is: its lowest or its highest value.
    Side,
    /// Where random numbers start: nothing to search for.
    Seed,
}

impl Kind {
    /// Whether it is the moment or place of a step: the size before it is of that step.
    pub const fn is_of_step(self) -> bool {
        matches!(self, Self::Event | Self::Place)
    }

    /// Whether it is a number that shapes the effect and has no scale of its own: anything but how much, waves, forms.
    pub const fn is_shape(self) -> bool {
        matches!(
            self,
            Self::Onset | Self::Event | Self::Place | Self::Stop | Self::Shape
        )
    }
}

/// A parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Name with its unit on a rotary axis.
    pub name: &'static str,
    /// Name with its unit on a linear axis.
    pub linear_name: &'static str,
    /// Value where none is given.
    pub default: f64,
    /// Its role.
    pub kind: Kind,
    /// Usual lowest and highest value on an axis of a size: a prior, not a limit. With both above zero it spans them
    /// evenly in the logarithm; where both are equal there is nothing to search for.
    pub range: fn(&Scale) -> [f64; 2],
}

impl Parameter {
    /// Phase of a wave over position or time.
    pub(super) const PHASE: Self = Self::same("phase_rad", Kind::Phase, |_| [-PI, PI]);

    /// Waves a turn, or a metre.
    pub(super) const ORDER: Self =
        Self::new(["order_per_rev", "order_per_m"], Kind::Order, |scale| {
            scale.either([1.0, 200.0], [1.0, 500.0])
        })
        .or(1.0);

    /// Turns of what turns with the motor: itself, or the screw of a linear axis with a lead of 2 to 50 mm.
    pub(super) const TURN: Self =
        Self::new(["order_per_rev", "order_per_m"], Kind::Order, |scale| {
            scale.either([1.0, 1.0], [20.0, 500.0])
        })
        .or(1.0);

    /// Where friction of a coupled axis is: 0 on the load, 1 on the motor.
    pub(super) const FRICTION_ON_MOTOR: Self =
        Self::same("friction_on_motor", Kind::Form, |_| [0.0, 1.0]);

    /// The sine of twice the angle of a wave, as a share of it.
    pub(super) const SECOND_SINE: Self =
        Self::same("second_sine_share", Kind::Detail, |_| [-0.6, 0.6]);
    /// Its cosine.
    pub(super) const SECOND_COSINE: Self =
        Self::same("second_cosine_share", Kind::Detail, |_| [-0.6, 0.6]);
    /// The sine of three times the angle.
    pub(super) const THIRD_SINE: Self =
        Self::same("third_sine_share", Kind::Detail, |_| [-0.3, 0.3]);
    /// Its cosine.
    pub(super) const THIRD_COSINE: Self =
        Self::same("third_cosine_share", Kind::Detail, |_| [-0.3, 0.3]);

    /// One with a name for each kind of axis, zero where it is not given.
    pub(super) const fn new(
        [name, linear_name]: [&'static str; 2],
        kind: Kind,
        range: fn(&Scale) -> [f64; 2],
    ) -> Self {
        Self {
            name,
            linear_name,
            default: 0.0,
            kind,
            range,
        }
    }

    /// One with the same unit on either kind of axis.
    pub(super) const fn same(
        name: &'static str,
        kind: Kind,
        range: fn(&Scale) -> [f64; 2],
    ) -> Self {
        Self::new([name, name], kind, range)
    }

    /// The same with another value where none is given.
    pub(super) const fn or(mut self, default: f64) -> Self {
        self.default = default;
        self
    }

    /// Its name on an axis.
    pub fn name(&self, unit: Unit) -> &'static str {
        match unit {
            Unit::Rotary => self.name,
            Unit::Linear => self.linear_name,
        }
    }
}

/// An effect by its id: what it takes, and how it is made from values in the order of its parameters for a rotary axis
/// or a linear one.
pub struct Entry {
    /// Id, block and name.
    pub id: &'static str,
    /// Its equation, with q, v position and velocity, u and tau torque before and after, F friction, t time.
    pub model: &'static str,
    /// What it takes.
    pub parameters: &'static [Parameter],
    /// Makes it.
    pub build: fn(&[f64], Unit) -> Box<dyn Effect>,
}

/// Effect that acts from a threshold of the effort on: it is not the mean of what it does within a sample that it does to the mean.
const THRESHOLD: &str = "actuator.deadzone";

impl Entry {
    /// Which part of the axis it sits in: the id up to its dot.
    pub fn block(&self) -> &'static str {
        self.id.split_once('.').map_or(self.id, |(block, _)| block)
    }

    /// Whether it lets effort through up to a limit.
    pub fn cuts(&self) -> bool {
        self.parameters.iter().any(|p| p.kind == Kind::Limit)
    }

    /// Whether it may act in single samples: a limit, a stop, a step, a threshold that an effort crosses.
    pub fn acts_in_moments(&self) -> bool {
        let in_moments = |kind: Kind| kind.is_of_step() || matches!(kind, Kind::Limit | Kind::Stop);
        self.id == THRESHOLD || self.parameters.iter().any(|p| in_moments(p.kind))
    }

    /// Default values in the order of its parameters.
    pub fn defaults(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.default).collect()
    }
}
