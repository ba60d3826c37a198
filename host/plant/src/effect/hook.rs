//! The hooks by which an effect takes hold of an axis, and what they see. Rotary names; a linear axis reads m for rad, N
//! for N m and kg for kg m^2.

use crate::contact::{Contact, Levels};
use crate::mechanics::Motion;

/// What an effect sees of a step, or of a sample in [`Effect::sensor`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Instant {
    /// Since the start of the record, s.
    pub time_s: f64,
    /// s
    pub step_s: f64,
    /// Positions and velocities; in `sensor`, the motor position as the effects before this one left it.
    pub motion: Motion,
    /// Acceleration of the motor up to the step, rad/s^2: what friction did to it [as that is felt](FELT_S), all else at once.
    pub acceleration_rad_s2: f64,
    /// Mean torque on the rotor over the step as the effects before this one left it, N m; in `actuator` of the first
    /// effect, what the drive puts out.
    pub torque_nm: f64,
}

/// Effects feel what friction did to the acceleration with such a lag, s. A share mu of friction that depends on friction at once is its own cause:
/// bristles with stiffness sigma0 and damping sigma1 are unstable at speed where the lag is less than mu sigma1/sigma0, as for a mu of
/// 0.3 and 8 ms.
pub const FELT_S: f64 = 2.5e-3;

/// What an effect is added to: the axis without it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plain {
    /// All of it, kg m^2.
    pub inertia_kg_m2: f64,
    /// Of its friction model.
    pub levels: Levels,
}

/// Where an effect takes hold. Every hook passes on what it does not change.
///
/// The hooks serve two users: the simulated axis, and a record that is followed backwards, where motion is measured and
/// torque is what is asked for. So a hook depends on what it is given and on its own past, not on who calls it; it takes
/// steps of a whole sample of 2 ms as well as of a microsecond, and allocates nothing. What lies before the first step is
/// taken as steady.
pub trait Effect: Send {
    /// Told once, before the first step, what it acts on. An effect that is not told takes all friction for Coulomb
    /// friction, and the inertia for none.
    fn begin(&mut self, plain: &Plain) {
        let _ = plain;
    }

    /// Torque that reaches the rotor, N m.
    fn actuator(&mut self, now: &Instant) -> f64 {
        now.torque_nm
    }

    /// Torque added on the rotor, N m.
    fn mechanics(&mut self, now: &Instant) -> f64 {
        let _ = now;
        0.0
    }

    /// Inertia as a share of the believed one.
    fn inertia(&mut self, now: &Instant) -> f64 {
        let _ = now;
        1.0
    }

    /// Friction torque in sliding, N m; at rest, what is passed in and given back is the break-away torque. Called once a
    /// step.
    fn friction(&mut self, now: &Instant, friction_nm: f64) -> f64 {
        let _ = now;
        friction_nm
    }

    /// Whether it does so by the level of dry friction, which bristles then slide at; else it adds to their friction.
    fn changes_level(&self) -> bool {
        false
    }

    /// Motor position as the sensor sees it, rad.
    fn sensor(&mut self, now: &Instant) -> f64 {
        now.motion.position_rad
    }

    /// The friction model with the effect in it, for effects that change its state and not only its torque.
    fn contact(&self, inner: Box<dyn Contact>) -> Box<dyn Contact> {
        inner
    }

    /// What takes part of the inertia off the motor, given the whole of it.
    fn coupling(&self, inertia_kg_m2: f64) -> Option<Coupling> {
        let _ = inertia_kg_m2;
        None
    }

    /// The fastest rate that its torque gives an inertia, 1/s; zero where steps need not be shorter for it.
    fn fastest_rate_1_s(&self, inertia_kg_m2: f64) -> f64 {
        let _ = inertia_kg_m2;
        0.0
    }
}

/// A part of the inertia behind a spring, a damper and a play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coupling {
    /// Inertia behind it as a share of the whole, above 0 and below 1.
    pub load_share: f64,
    /// N m/rad
    pub stiffness_nm_rad: f64,
    /// N m s/rad
    pub damping_nm_s_rad: f64,
    /// Whole width of the play, rad.
    pub gap_rad: f64,
    /// Friction is before it, on the motor, and not behind it.
    pub friction_on_motor: bool,
}

impl Coupling {
    /// The least part of the inertia on either side that can be simulated.
    const LEAST_SHARE: f64 = 0.01;

    /// One of a stiffness, with the share and damping ratio kept to what can be simulated.
    pub(super) fn new(
        inertia_kg_m2: f64,
        load_share: f64,
        stiffness_nm_rad: f64,
        damping_ratio: f64,
        friction_on_motor: bool,
    ) -> Self {
        let load_share = Self::simulated(load_share);
        let reduced = Self::reduced_kg_m2(inertia_kg_m2, load_share);
        Self {
            load_share,
            stiffness_nm_rad,
            damping_nm_s_rad: 2.0 * damping_ratio.max(0.0) * (stiffness_nm_rad * reduced).sqrt(),
            gap_rad: 0.0,
            friction_on_motor,
        }
    }

    /// The inertia that both parts have against each other: the resonance is at sqrt(k/J) of it.
    pub fn reduced_kg_m2(inertia_kg_m2: f64, load_share: f64) -> f64 {
        let share = Self::simulated(load_share);
        inertia_kg_m2 * share * (1.0 - share)
    }

    /// A share of the inertia, kept to what can be simulated.
    pub fn simulated(load_share: f64) -> f64 {
        load_share.clamp(Self::LEAST_SHARE, 1.0 - Self::LEAST_SHARE)
    }
}
