//! From an axis file to running things: its numbers completed with stated defaults, the simulated axis, the observers
//! and the control tick.

use crate::axis_file::{AxisFile, EffectEntry, FrictionModel, StribeckShape};
use crate::error::InputError;
use bristle_core::compensation::Compensation;
use bristle_core::control::{BANDWIDTH_RAD_S, Cascade, FIFTH};
use bristle_core::encoder::Encoder;
use bristle_core::error::ParameterError;
use bristle_core::friction::ElastoPlastic;
use bristle_core::friction::armstrong::Armstrong;
use bristle_core::friction::bliman_sorine::BlimanSorine;
use bristle_core::friction::bristle::Bristle;
use bristle_core::friction::coulomb::{Coulomb, CoulombViscous};
use bristle_core::friction::dahl::Dahl;
use bristle_core::friction::karnopp::Karnopp;
use bristle_core::friction::lugre::{Damping, LuGre};
use bristle_core::friction::stiction::{GeneralStatic, Stiction};
use bristle_core::observer::luenberger::BuildError;
use bristle_core::observer::stability::GainError;
use bristle_core::observer::{Luenberger, luenberger};
use bristle_core::parameters::BENCH;
use bristle_core::real::Real;
use bristle_core::stribeck::{Shape, Stribeck, Table};
use bristle_core::tick::{Tick, TorquePath};
use bristle_plant::Unit;
use bristle_plant::axis::{Axis, AxisConfig, steps_for};
use bristle_plant::contact::{Contact, contact};
use bristle_plant::drive::DriveConfig;
use bristle_plant::effect::{self, Effect, EffectError};
use bristle_plant::encoder::EncoderConfig;
use bristle_plant::mechanics::{Load, Mechanics};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// An axis file with every number that running it takes. Names are those of a rotary axis; a linear one reads m for
/// rad, N for N m and kg for kg m^2.
#[derive(Clone, Debug, PartialEq)]
pub struct Believed {
    /// Rotary or linear.
    pub unit: Unit,
    /// Motor inertia, or that of all where there is no load.
    pub inertia_kg_m2: f64,
    /// The load behind a compliance.
    pub load: Option<Load>,
    /// Encoder counts per turn or metre.
    pub counts_per_turn: f64,
    /// The wiring: it lies between controller and axis, and neither knows of it.
    pub wiring: Wiring,
    /// Which friction model.
    pub model: FrictionModel,
    /// F_C.
    pub coulomb_nm: f64,
    /// F_S.
    pub stiction_nm: f64,
    /// How the level falls from the one to the other.
    pub shape: Shape<f64>,
    /// Stribeck velocity.
    pub stribeck_velocity_rad_s: f64,
    /// sigma0.
    pub stiffness_nm_rad: f64,
    /// sigma1.
    pub damping_nm_s_rad: f64,
    /// sigma2.
    pub viscous_nm_s_rad: f64,
    /// z_ba/z_ss.
    pub breakaway_ratio: f64,
    /// Drive.
    pub drive: DriveConfig,
    /// Fastest that the axis may move.
    pub speed_limit_rad_s: f64,
    /// Furthest that it may move from where it stands, either way, where that is known.
    pub travel_limit_rad: Option<f64>,
    /// Samples a second of observers and control; 10 kHz, the interrupt's rate, where none is given.
    pub rate_hz: f64,
    /// l1, where it is given.
    pub l1_1_s: Option<f64>,
    /// l2.
    pub l2: f64,
    /// Effects it is believed to have.
    pub effects: Vec<EffectEntry>,
    /// What was missing and what stands in for it, a line each.
    pub assumed: Vec<String>,
    path: PathBuf,
    file: AxisFile,
}

/// Which way encoder and drive are wired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wiring {
    /// The encoder counts down as the axis moves forward.
    pub encoder_reversed: bool,
    /// The drive pushes backward at a positive reference.
    pub torque_reversed: bool,
}

impl Believed {
    /// Completes an axis file that was read from `path`.
    ///
    /// # Errors
    /// Coulomb friction that is missing or zero: nothing can stand in for it.
    pub fn new(file: &AxisFile, path: &Path) -> Result<Self, InputError> {
        let linear = file.unit == Unit::Linear;
        let mut assumed = Vec::new();
        let mut or = |value: Option<f64>, name: &str, fallback: f64, why: &str| {
            value.unwrap_or_else(|| {
                // Four digits: more would claim to be known.
                let shown: f64 = format!("{fallback:.3e}").parse().unwrap_or(fallback);
                assumed.push(format!(
                    "{}: {name} is missing, {shown} assumed ({why})",
                    path.display()
                ));
                fallback
            })
        };
        let name = |rotary: &'static str, linear_name: &'static str| {
            if linear { linear_name } else { rotary }
        };
        let friction = &file.friction;
        let coulomb_nm = match friction.coulomb {
            Some(level) if level > 0.0 => level,
            _ => {
                let key = name("coulomb_nm", "coulomb_n");
                return Err(InputError::new(
                    path,
                    format!("[friction] has no {key} above zero"),
                    "measure it: the torque that keeps the axis moving slowly",
                ));
            }
        };
        // What it takes to stop a model from guessing: the thesis's law is Gaussian, an axis without a fall has none.
        let stiction_nm = friction.stiction.unwrap_or(coulomb_nm);
        let stribeck_velocity_rad_s = if stiction_nm > coulomb_nm {
            or(
                friction.stribeck_velocity,
                name("stribeck_velocity_rad_s", "stribeck_velocity_m_s"),
                if linear { 1e-3 } else { 0.3 },
                "a common value",
            )
        } else {
            friction
                .stribeck_velocity
                .unwrap_or(if linear { 1e-3 } else { 0.3 })
        };
        let z_ss = if linear { 1e-5 } else { 1e-3 };
        let stiffness_nm_rad = or(
            friction.stiffness,
            name("stiffness_nm_rad", "stiffness_n_m"),
            coulomb_nm / z_ss,
            if linear {
                "z_ss of 10 um"
            } else {
                "z_ss of 1 mrad"
            },
        );
        let inertia = file.axis.inertia;
        let load = file.axis.load_inertia.map(|load_inertia| Load {
            inertia_kg_m2: load_inertia,
            stiffness_nm_rad: or(
                file.axis.coupling_stiffness,
                name("coupling_stiffness_nm_rad", "coupling_stiffness_n_m"),
                inertia.min(load_inertia) * (std::f64::consts::TAU * 100.0).powi(2),
                "about 100 Hz",
            ),
            damping_nm_s_rad: file.axis.coupling_damping.unwrap_or(0.0),
            gap_rad: 0.0,
            friction_on_motor: false,
        });
        let whole_inertia = inertia + load.map_or(0.0, |load| load.inertia_kg_m2);
        let damping_nm_s_rad = or(
            friction.damping,
            name("damping_nm_s_rad", "damping_n_s_m"),
            (stiffness_nm_rad * whole_inertia).sqrt(),
            "half of critical damping in stick",
        );
        let counts_per_turn = or(
            file.axis.counts_per_turn,
            name("counts_per_rev", "counts_per_m"),
            if linear { 1e8 } else { f64::from(1 << 24) },
            "fine enough to ignore",
        );
        if !(1.0..=f64::from(i32::MAX)).contains(&counts_per_turn.round()) {
            return Err(InputError::new(
                path,
                format!(
                    "{} = {counts_per_turn} is not from 1 to 2147483647",
                    name("counts_per_rev", "counts_per_m")
                ),
                "give the counts after quadrature, or leave the key out for a fine encoder",
            ));
        }
        let shape = shape(file, coulomb_nm, stiction_nm, stribeck_velocity_rad_s);
        let drive = DriveConfig {
            delay_samples: file.drive.delay_samples.unwrap_or(1) as usize,
            lag_s: file.drive.lag_s.unwrap_or(0.0),
            torque_limit_nm: file.drive.torque_limit,
        };
        let speed_limit_rad_s = file
            .drive
            .speed_limit
            .unwrap_or(if linear { 2.0 } else { 314.0 });
        if file.observer.l1_1_s.is_none() {
            assumed.push(format!(
                "{}: l1_1_s is missing, a tenth of the observer's rate assumed, or the nearest gain that holds",
                path.display()
            ));
        }
        Ok(Self {
            unit: file.unit,
            inertia_kg_m2: inertia,
            load,
            counts_per_turn,
            wiring: Wiring {
                encoder_reversed: file.axis.encoder_sign == Some(-1.0),
                torque_reversed: file.drive.torque_sign == Some(-1.0),
            },
            model: friction.model.unwrap_or(FrictionModel::ElastoPlastic),
            coulomb_nm,
            stiction_nm,
            shape,
            stribeck_velocity_rad_s,
            stiffness_nm_rad,
            damping_nm_s_rad,
            viscous_nm_s_rad: friction.viscous.unwrap_or(0.0),
            breakaway_ratio: friction.breakaway_ratio.unwrap_or(0.7),
            drive,
            speed_limit_rad_s,
            travel_limit_rad: file.drive.travel_limit,
            rate_hz: file.observer.rate_hz.unwrap_or(1e4),
            l1_1_s: file.observer.l1_1_s,
            l2: file.observer.l2.unwrap_or(0.0),
            effects: file.effects.clone(),
            assumed,
            path: path.to_path_buf(),
            file: file.clone(),
        })
    }

    /// A turn, rad; of a linear axis a metre.
    pub fn turn_rad(&self) -> f64 {
        match self.unit {
            Unit::Rotary => std::f64::consts::TAU,
            Unit::Linear => 1.0,
        }
    }

    /// Travel of one encoder count, rad.
    pub fn rad_per_count(&self) -> f64 {
        self.turn_rad() / self.counts_per_turn
    }

    /// Inertia of motor and load together.
    pub fn whole_inertia_kg_m2(&self) -> f64 {
        self.inertia_kg_m2 + self.load.map_or(0.0, |load| load.inertia_kg_m2)
    }

    /// Constant torque that the effects contain and that observers know of.
    pub fn offset_nm(&self) -> f64 {
        self.effects
            .iter()
            .filter(|effect| effect.id == "mechanics.offset")
            .flat_map(|effect| &effect.parameters)
            .map(|(_, value)| value)
            .sum()
    }

    /// Moves the fall from stiction to Coulomb friction to another Stribeck velocity.
    pub fn set_stribeck_velocity(&mut self, velocity_rad_s: f64) {
        self.stribeck_velocity_rad_s = velocity_rad_s;
        self.shape = shape(
            &self.file,
            self.coulomb_nm,
            self.stiction_nm,
            velocity_rad_s,
        );
    }

    /// A parameter that no model takes, as an error of the file.
    fn refused(&self, error: &ParameterError) -> InputError {
        InputError::new(
            &self.path,
            error.to_string(),
            "correct it, or leave it out to have the stated default",
        )
    }

    /// An effect that does not exist or lacks a parameter, as an error of the file.
    pub fn refused_effect(&self, error: &EffectError) -> InputError {
        InputError::new(&self.path, error.to_string(), "use one of these")
    }

    /// The error of a simulation whose numbers left all bounds.
    pub fn diverged(&self, time_s: f64) -> InputError {
        InputError::new(
            &self.path,
            format!("the simulation diverges at {time_s:.6} s"),
            "check inertia, stiffness and damping; the axis is stiffer than a sample can be cut into steps for",
        )
    }

    /// The Stribeck curve.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn curve(&self) -> Result<Stribeck<f64>, InputError> {
        Stribeck::new(self.coulomb_nm, self.stiction_nm, self.shape)
            .map_err(|error| self.refused(&error))
    }

    /// The elasto-plastic model, which the observers run whatever model simulates the axis.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn elasto_plastic(&self) -> Result<ElastoPlastic<f64, Stribeck<f64>>, InputError> {
        ElastoPlastic::new(
            self.curve()?,
            self.stiffness_nm_rad,
            self.damping_nm_s_rad,
            self.viscous_nm_s_rad,
            self.breakaway_ratio,
        )
        .map_err(|error| self.refused(&error))
    }

    /// The same model over a sampled curve, as the controller holds it: up to eight Stribeck velocities, where a Gaussian
    /// fall has long ended.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn tabulated<T: Real>(&self) -> Result<ElastoPlastic<T, Table<T>>, InputError> {
        self.elasto_plastic()?
            .tabulated(8.0 * self.stribeck_velocity_rad_s)
            .map_err(|error| self.refused(&error))
    }

    /// The friction model of the file, running; the LuGre model shares its parameters with the elasto-plastic one.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn contact(&self, model: FrictionModel) -> Result<Box<dyn Contact>, InputError> {
        let (coulomb, stiction) = (self.coulomb_nm, self.stiction_nm);
        let (stiffness, viscous) = (self.stiffness_nm_rad, self.viscous_nm_s_rad);
        let friction = &self.file.friction;
        let curve = self.curve()?;
        let made = match model {
            FrictionModel::Coulomb => Coulomb::new(coulomb).map(contact),
            FrictionModel::CoulombViscous => CoulombViscous::new(coulomb, viscous).map(contact),
            FrictionModel::Stiction => Stiction::new(coulomb, stiction).map(contact),
            FrictionModel::Stribeck => GeneralStatic::new(curve, viscous).map(contact),
            FrictionModel::Karnopp => {
                let band = friction
                    .rest_velocity
                    .unwrap_or(0.01 * self.stribeck_velocity_rad_s);
                Karnopp::new(coulomb, stiction, viscous, band).map(contact)
            }
            FrictionModel::Armstrong => Armstrong::<f64, 64>::new(
                stiffness,
                coulomb,
                viscous,
                stiction - coulomb,
                self.stribeck_velocity_rad_s,
                friction.friction_lag_s.unwrap_or(0.0),
                friction.dwell_s.unwrap_or(0.1),
            )
            .map(contact),
            FrictionModel::Dahl => {
                Dahl::new(stiffness, coulomb, friction.dahl_exponent.unwrap_or(1.0)).map(contact)
            }
            FrictionModel::Bristle => {
                // The mean of N bonds is N k reach/3 in sliding and N k in stick.
                const BONDS: usize = 32;
                let reach = 3.0 * coulomb / stiffness;
                Bristle::<f64, BONDS>::new(stiffness / BONDS as f64, reach, 1).map(contact)
            }
            FrictionModel::BlimanSorine => self.bliman_sorine().map(contact),
            FrictionModel::Lugre => LuGre::new(
                curve,
                stiffness,
                Damping::Constant {
                    nm_s_rad: self.damping_nm_s_rad,
                },
                viscous,
            )
            .map(contact),
            FrictionModel::ElastoPlastic => return self.elasto_plastic().map(contact),
        };
        made.map_err(|error| self.refused(&error))
    }

    /// First order without a fall from stiction; with one, second order with the slow branch that peaks at F_S.
    fn bliman_sorine(&self) -> Result<BlimanSorine<f64>, ParameterError> {
        const ETA: f64 = 0.2;
        let coulomb = self.coulomb_nm;
        let distance = coulomb / self.stiffness_nm_rad;
        if self.stiction_nm <= coulomb {
            return BlimanSorine::first_order(coulomb, distance);
        }
        let with = |slow: f64| BlimanSorine::second_order(coulomb + slow, slow, ETA, distance);
        let (mut low, mut high) = (0.0, 100.0 * self.stiction_nm);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if with(middle)?.break_away_nm() < self.stiction_nm {
                low = middle;
            } else {
                high = middle;
            }
        }
        with(low)
    }

    /// The effects of the file, running.
    ///
    /// # Errors
    /// An effect or parameter that does not exist.
    pub fn effects(&self) -> Result<Vec<Box<dyn Effect>>, InputError> {
        self.effects
            .iter()
            .map(|entry| {
                let values: BTreeMap<String, f64> = entry.parameters.iter().cloned().collect();
                effect::build(&entry.id, &values, self.unit)
                    .map_err(|error| self.refused_effect(&error))
            })
            .collect()
    }

    /// The virtual axis, sampled at `sample_time_s`.
    ///
    /// # Errors
    /// A parameter out of range, or an effect that does not exist.
    pub fn axis(
        &self,
        model: FrictionModel,
        sample_time_s: f64,
        noise: Noise,
        seed: u64,
    ) -> Result<Axis, InputError> {
        let mechanics = Mechanics {
            inertia_kg_m2: self.inertia_kg_m2,
            load: self.load,
        };
        let rubbing = self
            .load
            .map_or(self.inertia_kg_m2, |load| load.inertia_kg_m2);
        let bristles = (self.damping_nm_s_rad + self.viscous_nm_s_rad) / rubbing;
        let natural = (self.stiffness_nm_rad / rubbing).sqrt();
        let config = AxisConfig {
            mechanics,
            drive: self.drive,
            encoder: EncoderConfig {
                rad_per_count: self.rad_per_count(),
                counts_per_turn: Some(self.counts_per_turn.round() as i64),
                noise_rad: noise.position_rad,
            },
            torque_noise_nm: noise.torque_nm,
            sample_time_s,
            steps: steps_for(
                sample_time_s,
                bristles.max(natural).max(mechanics.fastest_rate_1_s()),
            ),
            seed,
        };
        Ok(Axis::new(config, self.contact(model)?, self.effects()?))
    }

    /// Settings of the Luenberger-like observer at `sample_time_s`.
    pub fn observer_settings(&self, sample_time_s: f64) -> luenberger::Settings<f64> {
        luenberger::Settings {
            inertia_kg_m2: self.whole_inertia_kg_m2(),
            rad_per_count: self.rad_per_count(),
            sample_time_s,
            l1_1_s: self.l1_1_s.unwrap_or(0.1 / sample_time_s),
            l2: self.l2,
            offset_nm: self.offset_nm(),
            max_speed_rad_s: self.speed_limit_rad_s,
            max_torque_nm: self.torque_limit_nm(),
        }
    }

    /// The drive's limit; without one, a thousand times stiction, which no drive reaches.
    pub fn torque_limit_nm(&self) -> f64 {
        self.drive
            .torque_limit_nm
            .unwrap_or(1000.0 * self.stiction_nm)
    }

    /// The controller that the interrupt runs, in the precision of `T`.
    ///
    /// # Errors
    /// Gains under which the observer's error would not die out, or a parameter out of range.
    pub fn tick<T: Real>(&self, sample_time_s: f64) -> Result<Tick<T, Table<T>>, InputError> {
        let to = T::of;
        let mut settings = self.observer_settings(sample_time_s);
        let friction = self.tabulated()?;
        let largest_step_rad = self.speed_limit_rad_s * sample_time_s;
        let largest_step = (largest_step_rad / self.rad_per_count())
            .clamp(1.0, self.counts_per_turn.round().min(f64::from(i32::MAX)));
        let mut luenberger = Luenberger::new(friction, settings.cast());
        if self.l1_1_s.is_none()
            && let Err(BuildError::Gain(GainError {
                nearest: Some(nearest),
                ..
            })) = luenberger
        {
            settings.l1_1_s = nearest;
            luenberger = Luenberger::new(friction, settings.cast());
        }
        let luenberger = luenberger.map_err(|error| {
            InputError::new(
                &self.path,
                format!("[observer] at {} Hz: {error}", 1.0 / sample_time_s),
                "change l1_1_s or rate_hz",
            )
        })?;
        let control = &self.file.control;
        // Slower where the sample rate asks for it.
        let bandwidth = BANDWIDTH_RAD_S.min(0.05 / sample_time_s);
        let cascade = Cascade::new(
            to(control.position_gain_1_s.unwrap_or(FIFTH * bandwidth)),
            to(control
                .velocity_gain
                .unwrap_or(self.whole_inertia_kg_m2() * bandwidth)),
            to(control.velocity_integral_1_s.unwrap_or(FIFTH * bandwidth)),
            to(settings.max_torque_nm),
            to(sample_time_s),
        );
        let compensation = Compensation::new(
            to(control.friction_forward.unwrap_or(0.0)),
            to(control.friction_feedback.unwrap_or(0.0)),
            to(control
                .friction_filter_s
                .unwrap_or(f64::from(BENCH.friction_filter_s))),
            to(sample_time_s),
        );
        let counts = self.counts_per_turn.round() as i32;
        Ok(Tick {
            encoder: Encoder::new(counts, largest_step as i32).map_err(|e| self.refused(&e))?,
            torque_path: TorquePath::new(
                self.drive.delay_samples,
                to(self.drive.lag_s),
                to(sample_time_s),
            )
            .map_err(|error| self.refused(&error))?,
            luenberger,
            control: cascade.map_err(|error| self.refused(&error))?,
            compensation: compensation.map_err(|error| self.refused(&error))?,
        })
    }
}

/// Noise of a virtual axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Noise {
    /// Of the torque on the rotor, N m rms per sample.
    pub torque_nm: f64,
    /// Of the position sensor before quantisation, rad rms.
    pub position_rad: f64,
}

fn shape(file: &AxisFile, coulomb: f64, stiction: f64, velocity_rad_s: f64) -> Shape<f64> {
    match file.friction.stribeck_shape {
        Some(StribeckShape::Constant) => Shape::Constant,
        Some(StribeckShape::PiecewiseLinear) => Shape::PiecewiseLinear {
            slope_nm_s_rad: (stiction - coulomb) / velocity_rad_s,
        },
        Some(StribeckShape::Exponential) => Shape::Exponential { velocity_rad_s },
        None | Some(StribeckShape::Gaussian) => Shape::Gaussian { velocity_rad_s },
        Some(StribeckShape::GeneralisedExponential) => {
            let exponent = file.friction.stribeck_exponent.unwrap_or(2.0);
            Shape::GeneralisedExponential {
                rate: velocity_rad_s.powf(-exponent),
                exponent,
            }
        }
        Some(StribeckShape::Lorentzian) => Shape::Lorentzian { velocity_rad_s },
    }
}

#[cfg(test)]
mod tests;
