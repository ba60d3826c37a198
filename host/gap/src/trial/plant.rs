//! A virtual axis by chance, and what its axis file says of it.
//!
//! Sizes are drawn for a motor that turns; a linear axis is that motor on a screw, and reads m for rad, N for N m.

use super::dice::Dice;
use crate::axis_file::{AxisFile, FrictionModel};
use bristle_plant::Unit;
use std::f64::consts::TAU;

/// An axis and how it is used and measured.
#[derive(Clone, Debug)]
pub struct Plant {
    /// What it is, but for the effects that were wanted.
    pub axis: AxisFile,
    /// Length of a sample, s.
    pub step_s: f64,
    /// Way from end to end, rad.
    pub stroke_rad: f64,
    /// Speed that the experiments stay below, rad/s.
    pub top_speed_rad_s: f64,
    /// Noise of the torque on the rotor, N m rms per sample.
    pub rotor_noise_nm: f64,
    /// Noise of the torque measurement, N m rms per sample.
    pub measured_noise_nm: f64,
    /// Positions are logged in counts.
    pub in_counts: bool,
    /// Bandwidth of the speed loop, rad/s.
    pub bandwidth_rad_s: f64,
}

/// What the friction has to be for the effects that are wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// Without bristles: the effect brings them.
    pub rigid: bool,
    /// Without a fall from stiction: the effect brings it.
    pub flat: bool,
    /// An axis that turns.
    pub rotary: bool,
}

/// Torque at the highest speed may be so many times Coulomb friction.
const MOST_VISCOUS: f64 = 1.0;
/// The speed loop turns by at most so much from delay, drive and filter where its gain is one, rad.
const MOST_LAG_RAD: f64 = 0.5;

impl Plant {
    /// Draws one.
    pub fn draw(dice: &mut Dice, needs: Needs) -> Self {
        let unit = match dice.of(&[Unit::Rotary, Unit::Linear]) {
            _ if needs.rotary => Unit::Rotary,
            unit => unit,
        };
        let lead_m = dice.decades(5e-3, 40e-3);
        // Metres of travel for a radian of the motor.
        let per_rad = match unit {
            Unit::Rotary => 1.0,
            Unit::Linear => lead_m / TAU,
        };
        let rate_hz = dice.of(&[500.0, 1000.0, 1000.0, 2000.0, 4000.0, 5000.0, 10_000.0]);
        let step_s = 1.0 / rate_hz;
        let counts = 2.0_f64.powi(12 + dice.below(9) as i32);
        let turns = dice.decades(1.5, 8.0);
        let stroke_rad = TAU * turns * per_rad;
        let top_speed_rad_s = stroke_rad * dice.between(1.0, 2.5);
        let coulomb = match unit {
            Unit::Rotary => dice.decades(0.01, 2.0),
            Unit::Linear => dice.decades(3.0, 300.0),
        };
        // What friction alone brakes it by, rad/s^2.
        let braking = dice.decades(40.0, 800.0) * per_rad;
        let inertia = coulomb / braking;
        let count_rad = TAU / counts * per_rad;
        let z_ss = (dice.decades(1e-3, 1.5e-2) * per_rad).max(4.0 * count_rad);
        let stiffness = coulomb / z_ss;
        let model = if needs.rigid {
            if needs.flat {
                FrictionModel::CoulombViscous
            } else {
                dice.of(&[FrictionModel::CoulombViscous, FrictionModel::Stribeck])
            }
        } else if dice.chance(0.7) {
            FrictionModel::ElastoPlastic
        } else {
            FrictionModel::Lugre
        };
        let flat = needs.flat || model == FrictionModel::CoulombViscous;
        let mut axis = AxisFile::new(unit, inertia);
        axis.axis.counts_per_turn = Some(match unit {
            Unit::Rotary => counts,
            Unit::Linear => (counts / lead_m).round(),
        });
        let friction = &mut axis.friction;
        friction.model = Some(model);
        friction.coulomb = Some(coulomb);
        let excess = dice.between(0.1, 0.6);
        friction.stiction = Some(coulomb * if flat { 1.0 } else { 1.0 + excess });
        friction.stribeck_velocity = Some(top_speed_rad_s * dice.decades(0.01, 0.06));
        friction.viscous = Some(MOST_VISCOUS * coulomb / top_speed_rad_s * dice.between(0.1, 1.0));
        friction.stiffness = Some(stiffness);
        friction.damping = Some((stiffness * inertia).sqrt() * dice.between(0.3, 1.0));
        friction.breakaway_ratio = Some(dice.between(0.5, 0.9));
        let lag_s = dice.decades(1e-4, 1e-3);
        axis.drive.lag_s = Some(lag_s);
        axis.drive.delay_samples = Some(1);
        // Stiff and soft alike, as far as the sample rate bears it.
        let wanted = TAU * dice.decades(3.0, 60.0);
        let bandwidth_rad_s = wanted.min(MOST_LAG_RAD / (1.5 * step_s + lag_s));
        let noise_nm = coulomb * dice.decades(0.005, 0.03);
        let (rotor, measured) = dice.of(&[(1.0, 0.0), (0.0, 1.0), (0.7, 0.7)]);
        Self {
            axis,
            step_s,
            stroke_rad,
            top_speed_rad_s,
            rotor_noise_nm: rotor * noise_nm,
            measured_noise_nm: measured * noise_nm,
            in_counts: dice.chance(0.5),
            bandwidth_rad_s,
        }
    }

    /// The axis file of someone who knows each parameter to a share of itself.
    pub fn believed(&self, dice: &mut Dice, error: f64) -> AxisFile {
        let mut axis = self.axis.clone();
        let mut off = |value: f64| value * (1.0 + error * dice.between(-1.0, 1.0));
        axis.axis.inertia = off(axis.axis.inertia);
        let friction = &mut axis.friction;
        let excess = friction
            .stiction
            .zip(friction.coulomb)
            .map(|(s, c)| s / c - 1.0);
        friction.coulomb = friction.coulomb.map(&mut off);
        let excess = excess.map(&mut off);
        friction.stiction = friction.coulomb.zip(excess).map(|(c, e)| c * (1.0 + e));
        friction.stribeck_velocity = friction.stribeck_velocity.map(&mut off);
        friction.viscous = friction.viscous.map(&mut off);
        friction.stiffness = friction.stiffness.map(&mut off);
        friction.damping = friction.damping.map(&mut off);
        friction.breakaway_ratio = friction
            .breakaway_ratio
            .map(|ratio| off(ratio).clamp(0.0, 0.95));
        axis
    }
}
