//! Every numeric key of the axis file: one table for reading, writing and suggesting.

use super::AxisFile;
use bristle_plant::Unit;

/// The values that a key may have; infinities and NaN never.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Range {
    /// Any finite number.
    Any,
    /// Any but zero: a gain whose sign is a matter of wiring.
    NotZero,
    /// Above zero.
    Positive,
    /// 1 or -1.
    Sign,
    /// Zero or above.
    NotNegative,
    /// From zero to below one.
    Part,
    /// A whole number from 0 to 1000.
    Whole,
}

impl Range {
    /// Whether `value` is in it.
    pub fn holds(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Range::Any => true,
                Range::NotZero => value != 0.0,
                Range::Positive => value > 0.0,
                Range::Sign => value.abs() == 1.0,
                Range::NotNegative => value >= 0.0,
                Range::Part => (0.0..1.0).contains(&value),
                Range::Whole => value.fract() == 0.0 && (0.0..=1000.0).contains(&value),
            }
    }

    /// What a value must be.
    pub fn rule(self) -> &'static str {
        match self {
            Range::Any => "a finite number",
            Range::NotZero => "a finite number other than zero",
            Range::Positive => "a finite number above zero",
            Range::Sign => "1 or -1",
            Range::NotNegative => "a finite number, zero or above",
            Range::Part => "from 0 to below 1",
            Range::Whole => "a whole number from 0 to 1000",
        }
    }
}

/// A numeric key.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// Its section.
    pub section: &'static str,
    /// Its name on a rotary axis.
    pub rotary: &'static str,
    /// Its name on a linear axis, often the same.
    pub linear: &'static str,
    /// What it may be.
    pub range: Range,
    pub(super) get: fn(&AxisFile) -> Option<f64>,
    pub(super) set: fn(&mut AxisFile, f64),
}

impl Key {
    /// Its name on an axis of `unit`.
    pub fn name(&self, unit: Unit) -> &'static str {
        match unit {
            Unit::Rotary => self.rotary,
            Unit::Linear => self.linear,
        }
    }
}

/// Section, rotary name, linear name, range, field.
macro_rules! keys {
    ($($section:ident $rotary:literal $linear:literal $range:ident $field:ident,)+) => {
        &[
            Key {
                section: "axis",
                rotary: INERTIA.0,
                linear: INERTIA.1,
                range: Range::Positive,
                get: |file| Some(file.axis.inertia),
                set: |file, value| file.axis.inertia = value,
            },
            Key {
                section: "drive",
                rotary: "delay_samples",
                linear: "delay_samples",
                range: Range::Whole,
                get: |file| file.drive.delay_samples.map(f64::from),
                set: |file, value| file.drive.delay_samples = Some(value as u32),
            },
            $(Key {
                section: stringify!($section),
                rotary: $rotary,
                linear: $linear,
                range: Range::$range,
                get: |file| file.$section.$field,
                set: |file, value| file.$section.$field = Some(value),
            },)+
        ]
    };
}

/// The key that makes an axis rotary, and the one that makes it linear.
pub(super) const INERTIA: (&str, &str) = ("inertia_kg_m2", "mass_kg");

/// All numeric keys, in the order in which they are written.
pub const KEYS: &[Key] = keys! {
    axis "counts_per_rev" "counts_per_m" Positive counts_per_turn,
    axis "encoder_sign" "encoder_sign" Sign encoder_sign,
    axis "torque_constant_nm_a" "force_constant_n_a" NotZero torque_constant,
    axis "torque_per_volt_nm_v" "force_per_volt_n_v" NotZero torque_per_volt,
    axis "load_inertia_kg_m2" "load_mass_kg" Positive load_inertia,
    axis "coupling_stiffness_nm_rad" "coupling_stiffness_n_m" Positive coupling_stiffness,
    axis "coupling_damping_nm_s_rad" "coupling_damping_n_s_m" NotNegative coupling_damping,
    friction "coulomb_nm" "coulomb_n" NotNegative coulomb,
    friction "stiction_nm" "stiction_n" NotNegative stiction,
    friction "stribeck_velocity_rad_s" "stribeck_velocity_m_s" Positive stribeck_velocity,
    friction "stribeck_exponent" "stribeck_exponent" Positive stribeck_exponent,
    friction "stiffness_nm_rad" "stiffness_n_m" Positive stiffness,
    friction "damping_nm_s_rad" "damping_n_s_m" NotNegative damping,
    friction "viscous_nm_s_rad" "viscous_n_s_m" NotNegative viscous,
    friction "breakaway_ratio" "breakaway_ratio" Part breakaway_ratio,
    friction "dahl_exponent" "dahl_exponent" Positive dahl_exponent,
    friction "friction_lag_s" "friction_lag_s" NotNegative friction_lag_s,
    friction "dwell_s" "dwell_s" Positive dwell_s,
    friction "rest_velocity_rad_s" "rest_velocity_m_s" Positive rest_velocity,
    drive "lag_s" "lag_s" NotNegative lag_s,
    drive "torque_sign" "force_sign" Sign torque_sign,
    drive "torque_limit_nm" "force_limit_n" Positive torque_limit,
    drive "speed_limit_rad_s" "speed_limit_m_s" Positive speed_limit,
    drive "travel_limit_rad" "travel_limit_m" Positive travel_limit,
    control "position_gain_1_s" "position_gain_1_s" NotNegative position_gain_1_s,
    control "velocity_gain_nm_s_rad" "velocity_gain_n_s_m" NotNegative velocity_gain,
    control "velocity_integral_1_s" "velocity_integral_1_s" NotNegative velocity_integral_1_s,
    control "friction_forward" "friction_forward" NotNegative friction_forward,
    control "friction_feedback" "friction_feedback" NotNegative friction_feedback,
    control "friction_filter_s" "friction_filter_s" NotNegative friction_filter_s,
    observer "rate_hz" "rate_hz" Positive rate_hz,
    observer "l1_1_s" "l1_1_s" Positive l1_1_s,
    observer "l2" "l2" Any l2,
};

/// The sections, in the order in which they are written.
pub const SECTIONS: [&str; 5] = ["axis", "friction", "drive", "control", "observer"];
/// Keys of `[friction]` that hold a name.
pub(super) const MODEL: &str = "model";
/// See [`MODEL`].
pub(super) const STRIBECK_SHAPE: &str = "stribeck_shape";

/// A linear key that can be formed in two ways from its rotary name, and the way it is written.
const ALIAS: (&str, &str) = ("torque_limit_n", "force_limit_n");

/// The name under which a key stands in the table.
pub(super) fn canonical(name: &str) -> &str {
    if name == ALIAS.0 { ALIAS.1 } else { name }
}

/// The key of a section by either of its names.
pub(super) fn find(section: &str, name: &str) -> Option<&'static Key> {
    KEYS.iter()
        .find(|key| key.section == section && (key.rotary == name || key.linear == name))
}
