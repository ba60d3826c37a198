//! Inertia, or two of them on a spring, a damper and a play.
//!
//! Source: thesis (Aktas, ITU 2002) eqs. 2.25, 2.26. The print couples both rows of the load with minus signs; by
//! Newton's third law the coupling acts on the load with the opposite sign of that on the motor.

use crate::effect::Coupling;

/// What the mechanics are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mechanics {
    /// Inertia of the motor, or of the whole axis where it is rigid, kg m^2.
    pub inertia_kg_m2: f64,
    /// A load on a flexible coupling.
    pub load: Option<Load>,
}

/// The second inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// kg m^2
    pub inertia_kg_m2: f64,
    /// Of the coupling, N m/rad.
    pub stiffness_nm_rad: f64,
    /// Of the coupling, N m s/rad.
    pub damping_nm_s_rad: f64,
    /// Whole width of the coupling's play, rad; inside it there is neither spring nor damper.
    pub gap_rad: f64,
    /// Friction acts on the motor, and not on the load.
    pub friction_on_motor: bool,
}

/// Where the mechanics are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Motor position, rad.
    pub position_rad: f64,
    /// Motor velocity, rad/s.
    pub velocity_rad_s: f64,
    /// Load position, rad; the motor's on a rigid axis.
    pub load_position_rad: f64,
    /// Load velocity, rad/s; the motor's on a rigid axis.
    pub load_velocity_rad_s: f64,
}

impl Mechanics {
    /// Inertia of motor and load together.
    pub fn whole_inertia_kg_m2(&self) -> f64 {
        self.inertia_kg_m2 + self.load.map_or(0.0, |load| load.inertia_kg_m2)
    }

    /// Inertia of the body that friction acts on.
    pub fn rubbing_kg_m2(&self) -> f64 {
        match self.load {
            Some(load) if !load.friction_on_motor => load.inertia_kg_m2,
            _ => self.inertia_kg_m2,
        }
    }

    /// What friction takes of the motor's acceleration by itself, rad/s^2, with the whole inertia `inertia_share` of what it was built with.
    pub fn motor_decelerates_rad_s2(&self, friction_nm: f64, inertia_share: f64) -> f64 {
        match self.load {
            None => friction_nm / (self.inertia_kg_m2 * inertia_share),
            Some(load) if load.friction_on_motor => friction_nm / self.inertia_kg_m2,
            Some(_) => 0.0,
        }
    }

    /// Motion as friction sees it: on the motor the load is where the motor is.
    pub fn at_friction(&self, motion: &Motion) -> Motion {
        match self.load {
            Some(load) if load.friction_on_motor => Motion {
                load_position_rad: motion.position_rad,
                load_velocity_rad_s: motion.velocity_rad_s,
                ..*motion
            },
            _ => *motion,
        }
    }

    /// The same with one more coupling. Where there is one already both sit in series in its place, and what each loses
    /// per torque adds up.
    #[must_use]
    pub fn coupled(&self, coupling: &Coupling) -> Self {
        let (k, d) = (coupling.stiffness_nm_rad, coupling.damping_nm_s_rad);
        let Some(load) = self.load else {
            let behind = coupling.load_share * self.inertia_kg_m2;
            return Self {
                inertia_kg_m2: self.inertia_kg_m2 - behind,
                load: Some(Load {
                    inertia_kg_m2: behind,
                    stiffness_nm_rad: k,
                    damping_nm_s_rad: d,
                    gap_rad: coupling.gap_rad,
                    friction_on_motor: coupling.friction_on_motor,
                }),
            };
        };
        let other = load.stiffness_nm_rad;
        let series = k * other / (k + other);
        let loss = d / (k * k) + load.damping_nm_s_rad / (other * other);
        Self {
            load: Some(Load {
                stiffness_nm_rad: series,
                damping_nm_s_rad: series * series * loss,
                gap_rad: load.gap_rad + coupling.gap_rad,
                ..load
            }),
            ..*self
        }
    }

    /// The fastest rate of the mechanics by themselves, 1/s.
    pub fn fastest_rate_1_s(&self) -> f64 {
        self.load.map_or(0.0, |load| {
            let inertia = self.inertia_kg_m2.min(load.inertia_kg_m2);
            let natural = (2.0 * load.stiffness_nm_rad / inertia).sqrt();
            natural.max(2.0 * load.damping_nm_s_rad / inertia)
        })
    }

    /// Moves both positions on by a step at their velocities.
    pub fn drift(&self, motion: &mut Motion, step_s: f64) {
        motion.position_rad += step_s * motion.velocity_rad_s;
        motion.load_position_rad += step_s * motion.load_velocity_rad_s;
    }

    /// Torque on the body that friction acts on, besides friction, given the torque on the motor.
    pub fn torque_at_friction_nm(&self, motion: &Motion, torque_nm: f64) -> f64 {
        self.load.map_or(torque_nm, |load| {
            let coupling_nm = load.coupling_nm(motion);
            if load.friction_on_motor {
                torque_nm - coupling_nm
            } else {
                coupling_nm
            }
        })
    }

    /// Changes the velocities by a step of torque on the motor and of friction. Where friction holds at rest, a body
    /// whose velocity changes sign comes to rest first. The whole inertia is `inertia_share` of what it was built with;
    /// what is more or less sits on the load.
    #[inline]
    pub fn kick(
        &self,
        motion: &mut Motion,
        torque_nm: f64,
        friction_nm: f64,
        holds_at_rest: bool,
        inertia_share: f64,
        step_s: f64,
    ) {
        let stop = |before: f64, after: f64| {
            if holds_at_rest && before * after < 0.0 {
                0.0
            } else {
                after
            }
        };
        match self.load {
            None => {
                let v = motion.velocity_rad_s;
                let inertia = self.inertia_kg_m2 * inertia_share;
                let after = v + step_s / inertia * (torque_nm - friction_nm);
                motion.velocity_rad_s = stop(v, after);
                motion.load_velocity_rad_s = motion.velocity_rad_s;
            }
            Some(load) => {
                let coupling = load.coupling_nm(motion);
                let (v, load_v) = (motion.velocity_rad_s, motion.load_velocity_rad_s);
                let added = (inertia_share - 1.0) * self.whole_inertia_kg_m2();
                // A payload taken off leaves at least a hundredth of the load.
                let inertia = (load.inertia_kg_m2 + added).max(0.01 * load.inertia_kg_m2);
                let per_motor = step_s / self.inertia_kg_m2;
                let per_load = step_s / inertia;
                if load.friction_on_motor {
                    let after = v + per_motor * (torque_nm - coupling - friction_nm);
                    motion.velocity_rad_s = stop(v, after);
                    motion.load_velocity_rad_s += per_load * coupling;
                } else {
                    motion.velocity_rad_s += per_motor * (torque_nm - coupling);
                    let after = load_v + per_load * (coupling - friction_nm);
                    motion.load_velocity_rad_s = stop(load_v, after);
                }
            }
        }
    }
}

impl Load {
    fn coupling_nm(&self, motion: &Motion) -> f64 {
        let twist = motion.position_rad - motion.load_position_rad;
        let rate = motion.velocity_rad_s - motion.load_velocity_rad_s;
        let torque = |twist| self.stiffness_nm_rad * twist + self.damping_nm_s_rad * rate;
        let half = 0.5 * self.gap_rad;
        if half <= 0.0 {
            torque(twist)
        } else if twist > half {
            // A flank pushes and never pulls.
            torque(twist - half).max(0.0)
        } else if twist < -half {
            torque(twist + half).min(0.0)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_coupling_sits_in_series() {
        let rigid = Mechanics {
            inertia_kg_m2: 1.0,
            load: None,
        };
        let coupling = Coupling {
            load_share: 0.25,
            stiffness_nm_rad: 8.0,
            damping_nm_s_rad: 0.4,
            gap_rad: 0.01,
            friction_on_motor: false,
        };
        let one = rigid.coupled(&coupling);
        assert_eq!((one.inertia_kg_m2, one.rubbing_kg_m2()), (0.75, 0.25));
        let two = one.coupled(&coupling).load.unwrap();
        assert_eq!((two.inertia_kg_m2, two.gap_rad), (0.25, 0.02));
        assert_eq!((two.stiffness_nm_rad, two.damping_nm_s_rad), (4.0, 0.2));
    }

    #[test]
    fn nothing_passes_through_a_play() {
        let load = Load {
            inertia_kg_m2: 1.0,
            stiffness_nm_rad: 10.0,
            damping_nm_s_rad: 1.0,
            gap_rad: 0.2,
            friction_on_motor: false,
        };
        let torque = |twist, rate| {
            load.coupling_nm(&Motion {
                position_rad: twist,
                velocity_rad_s: rate,
                ..Motion::default()
            })
        };
        assert_eq!((torque(0.09, 5.0), torque(-0.09, -5.0)), (0.0, 0.0));
        assert!((torque(0.3, 0.0) - 2.0).abs() < 1e-15);
        assert!((torque(-0.3, 0.0) + 2.0).abs() < 1e-15);
        assert_eq!(torque(0.11, -5.0), 0.0);
    }
}
