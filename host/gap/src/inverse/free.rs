//! A parameter that a fit may move, whose it is, and what is believed of it.
//!
//! A parameter that must stay above zero is fitted as its logarithm; every other as it is. Ranges are hard: without them a
//! dead zone or a limit explains everything by removing all torque.

use bristle_plant::Unit;

/// A parameter of the simulator itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Own {
    /// J.
    Inertia,
    /// F_C.
    Coulomb,
    /// sigma2.
    Viscous,
    /// (F_S - F_C)/F_C.
    StictionExcess,
    /// v_s.
    StribeckVelocity,
    /// sigma0.
    Stiffness,
    /// sigma1.
    Damping,
    /// z_ba/z_ss.
    BreakawayRatio,
    /// Of the drive, s.
    DriveLag,
    /// How much later than recorded the effort acts, s: timing of the recorder, not of the axis.
    Skew,
}

impl Own {
    /// Its name as in the axis file, or of its own.
    pub fn name(self, unit: Unit) -> &'static str {
        let linear = unit == Unit::Linear;
        let choose = |rotary, other| if linear { other } else { rotary };
        match self {
            Self::Inertia => choose("inertia_kg_m2", "mass_kg"),
            Self::Coulomb => choose("coulomb_nm", "coulomb_n"),
            Self::Viscous => choose("viscous_nm_s_rad", "viscous_n_s_m"),
            Self::StictionExcess => "stiction_excess",
            Self::StribeckVelocity => choose("stribeck_velocity_rad_s", "stribeck_velocity_m_s"),
            Self::Stiffness => choose("stiffness_nm_rad", "stiffness_n_m"),
            Self::Damping => choose("damping_nm_s_rad", "damping_n_s_m"),
            Self::BreakawayRatio => "breakaway_ratio",
            Self::DriveLag => "lag_s",
            Self::Skew => "skew_s",
        }
    }
}

/// Whose parameter it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// The simulator's.
    Own(Own),
    /// The parameter of an effect, both by their place.
    Effect(usize, usize),
    /// The parameter of an effect on one record alone: effect, parameter and record by their place. A record's clock
    /// says nothing of the phase of what repeats in time.
    OnRecord(usize, usize, usize),
}

/// A parameter that may move, and what is believed of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Free {
    /// Whose it is.
    pub owner: Owner,
    /// Its name, with its unit.
    pub name: String,
    /// Value to start from.
    pub start: f64,
    /// Lowest and highest value.
    pub range: [f64; 2],
    /// Fitted as its logarithm.
    pub logarithmic: bool,
    /// Standard deviation of the prior about `center`, in the fitted coordinate.
    pub spread: f64,
    /// Middle of the prior, in the fitted coordinate.
    pub center: f64,
}

impl Free {
    /// A parameter about `start`, by a factor of some 1 + `relative` either way.
    pub fn about(owner: Owner, name: &str, start: f64, relative: f64, range: [f64; 2]) -> Self {
        Self {
            owner,
            name: name.to_string(),
            start,
            range,
            logarithmic: true,
            spread: relative,
            center: start.ln(),
        }
    }

    /// A parameter that may be zero or negative.
    pub fn linear(owner: Owner, name: &str, start: f64, spread: f64, range: [f64; 2]) -> Self {
        Self {
            owner,
            name: name.to_string(),
            start,
            range,
            logarithmic: false,
            spread,
            center: start,
        }
    }

    /// The fitted coordinate of a value.
    pub fn coordinate(&self, value: f64) -> f64 {
        let value = value.clamp(self.range[0], self.range[1]);
        if self.logarithmic { value.ln() } else { value }
    }

    /// The value at a fitted coordinate.
    pub fn value(&self, coordinate: f64) -> f64 {
        let value = if self.logarithmic {
            coordinate.exp()
        } else {
            coordinate
        };
        value.clamp(self.range[0], self.range[1])
    }
}
