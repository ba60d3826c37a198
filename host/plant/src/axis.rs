//! The virtual axis: one sample of torque reference in, one encoder reading out, and the truth beside it.
//!
//! A sample is cut into steps. In each, positions drift at the velocities for half of it, torques change the velocities, and
//! positions drift for the other half; with the friction models' implicit step that is symplectic in stick and bounded in slip.
//! Damping acts with the velocity before the step, so that it is of first order: halving the step halves what is left, see the
//! test `halving_the_step`.

use crate::affected::Affected;
use crate::contact::{Contact, Levels};
use crate::drive::{Drive, DriveConfig};
use crate::effect::{Effect, FELT_S, Instant, Plain};
use crate::encoder::{EncoderConfig, Reading};
use crate::mechanics::{Mechanics, Motion};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

/// Everything an axis is, but for its friction and effects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisConfig {
    /// Inertia.
    pub mechanics: Mechanics,
    /// Drive.
    pub drive: DriveConfig,
    /// Encoder.
    pub encoder: EncoderConfig,
    /// Torque noise on the rotor, N m rms per sample.
    pub torque_noise_nm: f64,
    /// Length of a sample, s.
    pub sample_time_s: f64,
    /// Steps in a sample, at least: effects may ask for more.
    pub steps: u32,
    /// Seed of all noise.
    pub seed: u64,
}

/// An axis in operation.
pub struct Axis {
    config: AxisConfig,
    drive: Drive,
    keeps: f64,
    /// Part of what effects feel of friction that is still felt a step later.
    still_felt: f64,
    contact: Affected,
    effects: Vec<Box<dyn Effect>>,
    motion: Motion,
    reading: Option<Reading>,
    random: ChaCha8Rng,
    samples: u64,
    friction_nm: f64,
    /// By friction, as effects feel it.
    deceleration_rad_s2: f64,
    acceleration_rad_s2: f64,
    mean_torque_nm: f64,
}

/// What only a simulation knows, at the end of a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Truth {
    /// s
    pub time_s: f64,
    /// Positions and velocities.
    pub motion: Motion,
    /// Bristle deflection, rad.
    pub z_rad: f64,
    /// Friction torque, N m.
    pub friction_nm: f64,
    /// Mean torque that the drive put out during the sample, before what actuator effects and noise make of it, N m: what
    /// a measured current stands for.
    pub torque_nm: f64,
}

/// Steps a sample so that the fastest rate of the axis moves by at most 2 % of itself in a step.
pub fn steps_for(sample_time_s: f64, fastest_rate_1_s: f64) -> u32 {
    (sample_time_s * fastest_rate_1_s / 0.02)
        .ceil()
        .clamp(4.0, 1000.0) as u32
}

/// Steps that the effects need besides those that the axis was cut into, where friction acted on `rubbing_kg_m2`.
fn steps_with(
    config: &AxisConfig,
    rubbing_kg_m2: f64,
    contact: &dyn Contact,
    effects: &[Box<dyn Effect>],
) -> u32 {
    let mechanics = &config.mechanics;
    let mut steps = config.steps;
    let behind = mechanics.rubbing_kg_m2();
    if behind != rubbing_kg_m2 {
        // No rate of friction grows faster than the inertia under it shrinks.
        let lighter = (rubbing_kg_m2 / behind).max(1.0);
        steps = (f64::from(steps) * lighter).ceil().min(1000.0) as u32;
        steps = steps.max(steps_for(
            config.sample_time_s,
            mechanics.fastest_rate_1_s(),
        ));
    }
    let rates = effects
        .iter()
        .map(|effect| effect.fastest_rate_1_s(mechanics.inertia_kg_m2));
    let fastest = rates.fold(contact.fastest_rate_1_s(behind), f64::max);
    if fastest > 0.0 {
        steps = steps.max(steps_for(config.sample_time_s, fastest));
    }
    steps
}

/// What the drive keeps of its torque, and what is still felt of friction, a step later.
fn of_a_step(config: &AxisConfig, drive: &Drive) -> (f64, f64) {
    let step_s = config.sample_time_s / f64::from(config.steps);
    (drive.keeps(step_s), (-step_s / FELT_S).exp())
}

impl Axis {
    /// An axis at rest at position zero. Effects may take part of its inertia behind a coupling and ask for more steps.
    pub fn new(
        mut config: AxisConfig,
        mut contact: Box<dyn Contact>,
        mut effects: Vec<Box<dyn Effect>>,
    ) -> Self {
        let rubbing = config.mechanics.rubbing_kg_m2();
        let plain = Plain {
            inertia_kg_m2: config.mechanics.whole_inertia_kg_m2(),
            levels: Levels::of(contact.as_ref()),
        };
        for effect in &mut effects {
            effect.begin(&plain);
            contact = effect.contact(contact);
            if let Some(coupling) = effect.coupling(plain.inertia_kg_m2) {
                config.mechanics = config.mechanics.coupled(&coupling);
            }
        }
        if !effects.is_empty() {
            config.steps = steps_with(&config, rubbing, contact.as_ref(), &effects);
        }
        let drive = Drive::new(config.drive);
        let (keeps, still_felt) = of_a_step(&config, &drive);
        Self {
            config,
            keeps,
            still_felt,
            drive,
            contact: Affected::new(contact, &effects),
            effects,
            motion: Motion::default(),
            reading: None,
            random: ChaCha8Rng::seed_from_u64(config.seed),
            samples: 0,
            friction_nm: 0.0,
            deceleration_rad_s2: 0.0,
            acceleration_rad_s2: 0.0,
            mean_torque_nm: 0.0,
        }
    }

    /// The same axis at another position and velocity; the bristles stay without load.
    #[must_use]
    pub fn starting_at(mut self, position_rad: f64, velocity_rad_s: f64) -> Self {
        self.motion = Motion {
            position_rad,
            velocity_rad_s,
            load_position_rad: position_rad,
            load_velocity_rad_s: velocity_rad_s,
        };
        self
    }

    /// The same axis in the middle of a record: so many samples after its start, its friction under the load that a
    /// torque puts on bristles of a stiffness.
    #[must_use]
    pub fn resumed(mut self, samples: u64, torque_nm: f64, stiffness_nm_rad: f64) -> Self {
        self.samples = samples;
        let dt_s = self.config.sample_time_s;
        self.friction_nm = self.contact.bear(torque_nm, stiffness_nm_rad, dt_s);
        self
    }

    /// The same axis before its first sample, in at most so many steps a sample: a stiff effect may ask for more than
    /// what it is simulated for tells apart.
    #[must_use]
    pub fn in_at_most(mut self, steps: u32) -> Self {
        self.config.steps = self.config.steps.min(steps);
        (self.keeps, self.still_felt) = of_a_step(&self.config, &self.drive);
        self
    }

    /// What it is.
    pub fn config(&self) -> &AxisConfig {
        &self.config
    }

    /// The last encoder reading; before the first sample that of the start, which no index pulse belongs to.
    pub fn reading(&mut self) -> Reading {
        if let Some(reading) = self.reading {
            return reading;
        }
        let seen_rad = self.seen_rad();
        let mut reading = self.config.encoder.read(seen_rad, 0);
        reading.index = false;
        self.reading = Some(reading);
        reading
    }

    /// Where the sensor's effects make the motor seem to be, rad.
    fn seen_rad(&mut self) -> f64 {
        let mut now = Instant {
            time_s: self.samples as f64 * self.config.sample_time_s,
            step_s: self.config.sample_time_s,
            motion: self.motion,
            acceleration_rad_s2: self.acceleration_rad_s2,
            torque_nm: self.mean_torque_nm,
        };
        for effect in &mut self.effects {
            now.motion.position_rad = effect.sensor(&now);
        }
        now.motion.position_rad
    }

    /// What only a simulation knows.
    pub fn truth(&self) -> Truth {
        Truth {
            time_s: self.samples as f64 * self.config.sample_time_s,
            motion: self.motion,
            z_rad: self.contact.deflection_rad(),
            friction_nm: self.friction_nm,
            torque_nm: self.mean_torque_nm,
        }
    }

    /// Runs one sample with a new torque reference and reads the encoder at its end.
    pub fn advance(&mut self, torque_ref_nm: f64) -> Reading {
        let last_counts = self.reading().counts;
        let step_s = self.config.sample_time_s / f64::from(self.config.steps);
        let noise_nm = self.config.torque_noise_nm * self.normal(self.config.torque_noise_nm);
        let holds = self.contact.holds_at_rest();
        let start_s = self.samples as f64 * self.config.sample_time_s;
        self.drive.accept(torque_ref_nm);
        let mut sum = 0.0;
        for step in 0..self.config.steps {
            // Torque acts half-way through a step: positions that went on by all of it first would lag by half a one.
            self.config.mechanics.drift(&mut self.motion, 0.5 * step_s);
            let mut now = Instant {
                time_s: start_s + (f64::from(step) + 0.5) * step_s,
                step_s,
                motion: self.motion,
                acceleration_rad_s2: self.acceleration_rad_s2,
                torque_nm: self.drive.advance(step_s, self.keeps),
            };
            sum += now.torque_nm;
            for effect in &mut self.effects {
                now.torque_nm = effect.actuator(&now);
            }
            let mut torque = now.torque_nm + noise_nm;
            let mut inertia_share = 1.0;
            for effect in &mut self.effects {
                torque += effect.mechanics(&now);
                inertia_share *= effect.inertia(&now);
            }
            let applied = self
                .config
                .mechanics
                .torque_at_friction_nm(&self.motion, torque);
            now.motion = self.config.mechanics.at_friction(&self.motion);
            let friction = self.contact.step(&mut self.effects, &now, applied);
            let before = self.motion.velocity_rad_s;
            self.config.mechanics.kick(
                &mut self.motion,
                torque,
                friction,
                holds,
                inertia_share,
                step_s,
            );
            self.config.mechanics.drift(&mut self.motion, 0.5 * step_s);
            let deceleration_rad_s2 = self
                .config
                .mechanics
                .motor_decelerates_rad_s2(friction, inertia_share);
            self.deceleration_rad_s2 = deceleration_rad_s2
                + self.still_felt * (self.deceleration_rad_s2 - deceleration_rad_s2);
            self.acceleration_rad_s2 = (self.motion.velocity_rad_s - before) / step_s
                + deceleration_rad_s2
                - self.deceleration_rad_s2;
            self.friction_nm = friction;
        }
        self.mean_torque_nm = sum / f64::from(self.config.steps);
        self.samples += 1;
        let seen_rad = self.seen_rad();
        let noise = self.config.encoder.noise_rad * self.normal(self.config.encoder.noise_rad);
        let reading = self.config.encoder.read(seen_rad + noise, last_counts);
        self.reading = Some(reading);
        reading
    }

    /// A standard normal number, or zero without drawing one where the noise it is for is zero.
    fn normal(&mut self, rms: f64) -> f64 {
        if rms > 0.0 {
            StandardNormal.sample(&mut self.random)
        } else {
            0.0
        }
    }
}
