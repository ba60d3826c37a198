//! Identification step by step: each step takes the experiment made for it, gives its parameters with an interval and a
//! verdict, and says when the data cannot support it.
//!
//! Source of the three steps: thesis (Aktas, ITU 2002), chapter 2.5. Friction is positive against positive velocity, and
//! the offset F_G stands on its side: torque = J a + F + F_G. A linear axis reads m for rad and N for N m.

pub mod dahl_curve;
pub mod joint;
mod linear;
pub mod presliding;
mod record;
pub mod steady;

use bristle_plant::Unit;

/// Confidence of every interval.
pub const LEVEL: f64 = 0.90;

/// Half an interval within a fifth of the value: a model so parametrised predicts its part of the torque to a fifth.
const IDENTIFIED_SHARE: f64 = 0.2;

/// What a step can identify.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// F_G, on the side of friction.
    Offset,
    /// F_C.
    Coulomb,
    /// F_S.
    Stiction,
    /// v_s; of the piecewise line, the speed at which it ends.
    StribeckVelocity,
    /// d of the generalised exponential curve.
    StribeckExponent,
    /// sigma2.
    Viscous,
    /// sigma0.
    Stiffness,
    /// sigma1 + sigma2.
    PreslidingDamping,
    /// J.
    Inertia,
    /// g(v) at the one slow speed of a Dahl curve: F_S, where that speed is far below v_s.
    SlowLevel,
}

impl Parameter {
    /// Its name with its unit.
    pub fn name(self, unit: Unit) -> &'static str {
        let (rotary, linear) = match self {
            Self::Offset => ("offset_nm", "offset_n"),
            Self::Coulomb => ("coulomb_nm", "coulomb_n"),
            Self::Stiction => ("stiction_nm", "stiction_n"),
            Self::StribeckVelocity => ("stribeck_velocity_rad_s", "stribeck_velocity_m_s"),
            Self::StribeckExponent => ("stribeck_exponent", "stribeck_exponent"),
            Self::Viscous => ("viscous_nm_s_rad", "viscous_n_s_m"),
            Self::Stiffness => ("stiffness_nm_rad", "stiffness_n_m"),
            Self::PreslidingDamping => {
                ("damping_and_viscous_nm_s_rad", "damping_and_viscous_n_s_m")
            }
            Self::Inertia => ("inertia_kg_m2", "mass_kg"),
            Self::SlowLevel => ("slow_level_nm", "slow_level_n"),
        };
        match unit {
            Unit::Rotary => rotary,
            Unit::Linear => linear,
        }
    }
}

/// How far an estimate may be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Half its interval is within a fifth of the value.
    Identified,
    /// The interval is bounded and wider than that.
    Weak,
    /// The interval has no bound, or the value itself lies within it from zero.
    NotIdentified,
}

impl Verdict {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Identified => "identified",
            Self::Weak => "weak",
            Self::NotIdentified => "not identifiable",
        }
    }
}

/// A parameter with its interval at [`LEVEL`].
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Which.
    pub parameter: Parameter,
    /// Best value. Where the verdict is [`Verdict::NotIdentified`] it is one of many.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end; infinite where the data set none.
    pub high: f64,
    /// The judgement.
    pub verdict: Verdict,
    /// Which experiment would narrow it; none where it is identified.
    pub advice: Option<String>,
}

impl Estimate {
    /// An estimate judged against `scale`, its own size for most; an offset, which may be zero, against friction.
    fn judged(
        parameter: Parameter,
        value: f64,
        [low, high]: [f64; 2],
        scale: f64,
        advice: impl FnOnce() -> String,
    ) -> Self {
        let half = 0.5 * (high - low);
        let verdict = if half <= IDENTIFIED_SHARE * scale.abs() {
            Verdict::Identified
        } else if half < scale.abs() {
            Verdict::Weak
        } else {
            Verdict::NotIdentified
        };
        Self {
            parameter,
            value,
            low,
            high,
            verdict,
            advice: (verdict != Verdict::Identified).then(advice),
        }
    }

    /// Whether the interval contains a value.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// The estimate of a parameter among those of a step.
pub fn find(estimates: &[Estimate], parameter: Parameter) -> Option<&Estimate> {
    estimates
        .iter()
        .find(|estimate| estimate.parameter == parameter)
}
