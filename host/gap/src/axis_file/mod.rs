//! The axis file: what the simulator believes about an axis.
//!
//! One set of names serves rotary and linear axes: read kg for kg m^2, N for N m and m for rad where
//! [`AxisFile::unit`] is linear. A turn is then a metre. All keys and their ranges stand in [`keys`].

pub mod keys;
mod parse;
pub(crate) mod write;

use bristle_plant::Unit;

/// An axis file. Only the inertia is always there; what is `None` is identified or set to a stated default.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisFile {
    /// Rotary with `inertia_kg_m2`, linear with `mass_kg`.
    pub unit: Unit,
    /// Section `[axis]`.
    pub axis: Axis,
    /// Section `[friction]`.
    pub friction: Friction,
    /// Section `[drive]`.
    pub drive: Drive,
    /// Section `[control]`.
    pub control: Control,
    /// Section `[observer]`.
    pub observer: Observer,
    /// The `[[effect]]` entries, in their order.
    pub effects: Vec<EffectEntry>,
}

/// Inertia, encoder, gains and the load behind a compliance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// Motor side, kg m^2 or kg; the sum of both sides where no load inertia is given.
    pub inertia: f64,
    /// Encoder counts a revolution or a metre; `None`: fine enough to ignore.
    pub counts_per_turn: Option<f64>,
    /// -1 where the encoder counts down as the axis moves forward; 1 where not given.
    pub encoder_sign: Option<f64>,
    /// N m/A or N/A.
    pub torque_constant: Option<f64>,
    /// N m/V or N/V.
    pub torque_per_volt: Option<f64>,
    /// Load side, kg m^2 or kg.
    pub load_inertia: Option<f64>,
    /// Between motor and load, N m/rad or N/m.
    pub coupling_stiffness: Option<f64>,
    /// Between motor and load, N m s/rad or N s/m.
    pub coupling_damping: Option<f64>,
}

/// The friction model and its parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Friction {
    /// Which model.
    pub model: Option<FrictionModel>,
    /// Shape of the fall from stiction to Coulomb friction; Gaussian where not given.
    pub stribeck_shape: Option<StribeckShape>,
    /// F_C, N m or N.
    pub coulomb: Option<f64>,
    /// F_S, N m or N.
    pub stiction: Option<f64>,
    /// v_s, rad/s or m/s.
    pub stribeck_velocity: Option<f64>,
    /// Exponent of the generalised exponential shape.
    pub stribeck_exponent: Option<f64>,
    /// sigma_0, N m/rad or N/m.
    pub stiffness: Option<f64>,
    /// sigma_1, N m s/rad or N s/m.
    pub damping: Option<f64>,
    /// sigma_2, N m s/rad or N s/m.
    pub viscous: Option<f64>,
    /// z_ba/z_ss, from 0 (LuGre) to below 1.
    pub breakaway_ratio: Option<f64>,
    /// Exponent of the Dahl model.
    pub dahl_exponent: Option<f64>,
    /// Armstrong: delay from velocity to friction, s.
    pub friction_lag_s: Option<f64>,
    /// Armstrong: time constant of the rise of stiction at rest, s.
    pub dwell_s: Option<f64>,
    /// Karnopp: half width of the band that counts as rest, rad/s or m/s.
    pub rest_velocity: Option<f64>,
}

/// What lies between the command and the effort.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drive {
    /// Time constant of the first-order lag, s.
    pub lag_s: Option<f64>,
    /// -1 where the drive pushes backward at a positive reference; 1 where not given.
    pub torque_sign: Option<f64>,
    /// The drive's own limit, N m or N.
    pub torque_limit: Option<f64>,
    /// Fastest that the axis may move, rad/s or m/s.
    pub speed_limit: Option<f64>,
    /// Furthest that the axis may move from where it stands, either way, rad or m.
    pub travel_limit: Option<f64>,
    /// Samples from a value's calculation to its output.
    pub delay_samples: Option<u32>,
}

/// The position and velocity controller, where known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Control {
    /// Velocity reference per position error, 1/s.
    pub position_gain_1_s: Option<f64>,
    /// Effort per velocity error, N m s/rad or N s/m.
    pub velocity_gain: Option<f64>,
    /// Integral gain of the velocity loop as a part of its proportional gain, 1/s.
    pub velocity_integral_1_s: Option<f64>,
    /// Share of the friction along the reference that is fed forward.
    pub friction_forward: Option<f64>,
    /// Share of the observed friction that is taken off.
    pub friction_feedback: Option<f64>,
    /// Time constant of the observed friction's filter, s.
    pub friction_filter_s: Option<f64>,
}

/// The friction observer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observer {
    /// Steps a second, Hz.
    pub rate_hz: Option<f64>,
    /// Gain l1 on velocity, 1/s.
    pub l1_1_s: Option<f64>,
    /// Gain l2 on the bristle deflection, without unit.
    pub l2: Option<f64>,
}

/// An effect that the axis is believed to have.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EffectEntry {
    /// Such as `mechanics.offset`; whether it exists is checked by who simulates it.
    pub id: String,
    /// Parameters in the order of the file, each name once.
    pub parameters: Vec<(String, f64)>,
}

impl EffectEntry {
    /// Value of a parameter.
    pub fn parameter(&self, name: &str) -> Option<f64> {
        self.parameters
            .iter()
            .find(|(its, _)| its == name)
            .map(|(_, value)| *value)
    }
}

impl AxisFile {
    /// An axis of which only the inertia is known, kg m^2 or kg.
    pub fn new(unit: Unit, inertia: f64) -> Self {
        Self {
            unit,
            axis: Axis {
                inertia,
                ..Axis::default()
            },
            friction: Friction::default(),
            drive: Drive::default(),
            control: Control::default(),
            observer: Observer::default(),
            effects: Vec::new(),
        }
    }
}

/// An enum whose variants have names in the file.
macro_rules! named {
    ($(#[$doc:meta])* $type:ident { $($(#[$variant_doc:meta])* $variant:ident = $name:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $type {
            $($(#[$variant_doc])* $variant,)+
        }

        impl $type {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$variant,)+];

            /// Its name in the file.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name,)+
                }
            }

            /// The one of that name.
            pub fn from_name(name: &str) -> Option<Self> {
                Self::ALL.iter().copied().find(|one| one.name() == name)
            }
        }
    };
}

named! {
    /// A friction model.
    FrictionModel {
        /// F_C sgn(v).
        Coulomb = "coulomb",
        /// With a viscous part.
        CoulombViscous = "coulomb-viscous",
        /// Static friction above Coulomb friction.
        Stiction = "stiction",
        /// A steady fall from stiction to Coulomb friction.
        Stribeck = "stribeck",
        /// With a band of velocity that counts as rest.
        Karnopp = "karnopp",
        /// Seven parameters.
        Armstrong = "armstrong",
        /// One state, no Stribeck fall.
        Dahl = "dahl",
        /// Haessig and Friedland's bristles.
        Bristle = "bristle",
        /// Bliman and Sorine.
        BlimanSorine = "bliman-sorine",
        /// One state, drifts below break-away.
        Lugre = "lugre",
        /// One state, holds still below break-away.
        ElastoPlastic = "elasto-plastic",
    }
}

impl FrictionModel {
    /// Whether friction depends on a deflection of stiffness sigma0.
    pub fn has_bristles(self) -> bool {
        matches!(
            self,
            Self::Armstrong
                | Self::BlimanSorine
                | Self::Bristle
                | Self::Dahl
                | Self::ElastoPlastic
                | Self::Lugre
        )
    }

    /// Whether bristles slip however little they are bent: under a load that is shaken they drift.
    pub fn drifts(self) -> bool {
        matches!(self, Self::BlimanSorine | Self::Dahl | Self::Lugre)
    }
}

named! {
    /// How the level falls from stiction to Coulomb friction.
    StribeckShape {
        /// No fall.
        Constant = "constant",
        /// A straight line that reaches F_C at v_s.
        PiecewiseLinear = "piecewise-linear",
        /// exp(-|v|/v_s)
        Exponential = "exponential",
        /// exp(-(v/v_s)^2)
        Gaussian = "gaussian",
        /// exp(-|v/v_s|^d)
        GeneralisedExponential = "generalised-exponential",
        /// 1/(1 + (v/v_s)^2)
        Lorentzian = "lorentzian",
    }
}
