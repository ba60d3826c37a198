//! Inertia, or two of them on a spring and a damper.
//!
//! Source: thesis (Aktas, ITU 2002) eqs. 2.25, 2.26. The print couples both rows of the load with minus signs; by
//! Newton's third law the coupling acts on the load with the opposite sign of that on the motor.

/// What the mechanics are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mechanics {
    /// Inertia of the motor, or of the whole axis where it is rigid, kg m^2.
    pub inertia_kg_m2: f64,
    /// A load on a flexible coupling; friction then acts on the load.
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
        self.load.map_or(torque_nm, |load| load.coupling_nm(motion))
    }

    /// Changes the velocities by a step of torque on the motor and of friction. Where friction holds at rest, a body
    /// whose velocity changes sign comes to rest first.
    pub fn kick(
        &self,
        motion: &mut Motion,
        torque_nm: f64,
        friction_nm: f64,
        holds_at_rest: bool,
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
                let after = v + step_s / self.inertia_kg_m2 * (torque_nm - friction_nm);
                motion.velocity_rad_s = stop(v, after);
                motion.load_velocity_rad_s = motion.velocity_rad_s;
            }
            Some(load) => {
                let coupling = load.coupling_nm(motion);
                let v = motion.load_velocity_rad_s;
                motion.velocity_rad_s += step_s / self.inertia_kg_m2 * (torque_nm - coupling);
                let after = v + step_s / load.inertia_kg_m2 * (coupling - friction_nm);
                motion.load_velocity_rad_s = stop(v, after);
            }
        }
    }
}

impl Load {
    fn coupling_nm(&self, motion: &Motion) -> f64 {
        self.stiffness_nm_rad * (motion.position_rad - motion.load_position_rad)
            + self.damping_nm_s_rad * (motion.velocity_rad_s - motion.load_velocity_rad_s)
    }
}
