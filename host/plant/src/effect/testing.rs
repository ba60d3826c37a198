//! What the tests of effects share: axes of 1e-4 kg m^2 with friction of 0.02 N m, in steps of 5 us at 10 kHz.

use super::{Effect, Instant, Plain};
use crate::axis::{Axis, AxisConfig};
use crate::contact::{Contact, Levels, contact};
use crate::drive::DriveConfig;
use crate::encoder::EncoderConfig;
use crate::mechanics::{Mechanics, Motion};
use bristle_core::friction::ElastoPlastic;
use bristle_core::friction::coulomb::{Coulomb, CoulombViscous};
use bristle_core::stribeck::Stribeck;

pub const SAMPLE_S: f64 = 1e-4;

/// The axis as effects are told of it.
pub const PLAIN: Plain = Plain {
    inertia_kg_m2: 1e-4,
    levels: Levels {
        creep_rad_s: 1e-9,
        stiction_nm: 0.02,
        viscous_nm_s_rad: 0.001,
        coulomb_nm: 0.02,
    },
};

/// A step somewhere at a velocity.
pub fn at(position_rad: f64, velocity_rad_s: f64) -> Instant {
    Instant {
        motion: Motion {
            position_rad,
            velocity_rad_s,
            load_position_rad: position_rad,
            load_velocity_rad_s: velocity_rad_s,
        },
        ..Instant::default()
    }
}

/// Static friction.
pub fn coulomb() -> Box<dyn Contact> {
    contact(Coulomb::new(0.02).unwrap())
}

/// Static and viscous friction.
pub fn viscous(viscous_nm_s_rad: f64) -> Box<dyn Contact> {
    contact(CoulombViscous::new(0.02, viscous_nm_s_rad).unwrap())
}

/// Elasto-plastic friction with z_ss of 2 mrad.
pub fn bristles() -> Box<dyn Contact> {
    let curve = Stribeck::constant(0.02).unwrap();
    contact(ElastoPlastic::new(curve, 10.0, 0.02, 1e-3, 0.7).unwrap())
}

/// As good as none.
pub fn free() -> Box<dyn Contact> {
    contact(Coulomb::new(1e-12).unwrap())
}

/// An axis at rest.
pub fn axis(contact: Box<dyn Contact>, effects: Vec<Box<dyn Effect>>) -> Axis {
    let config = AxisConfig {
        mechanics: Mechanics {
            inertia_kg_m2: PLAIN.inertia_kg_m2,
            load: None,
        },
        drive: DriveConfig::default(),
        encoder: EncoderConfig {
            rad_per_count: 1e-6,
            counts_per_turn: None,
            noise_rad: 0.0,
        },
        torque_noise_nm: 0.0,
        sample_time_s: SAMPLE_S,
        steps: 20,
        seed: 1,
    };
    Axis::new(config, contact, effects)
}
