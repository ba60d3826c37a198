//! The numbers that the host may change while the controller runs: one table with name, range and value of each, and
//! what is built from them.
//!
//! A set is refused or taken as a whole. It is compiled outside the interrupt into a [`Config`], which the interrupt
//! takes over between two ticks; states stay as they are, so that nothing jumps.

use crate::compensation::Compensation;
use crate::control::{BANDWIDTH_RAD_S, Cascade, FIFTH};
use crate::encoder::Encoder;
use crate::error::{ParameterError, require};
use crate::experiment::{Bounds, Experiment};
use crate::friction::ElastoPlastic;
use crate::observer::Luenberger;
use crate::observer::luenberger::{BuildError, Settings};
use crate::order::Order;
use crate::stribeck::{Shape, Stribeck, Table};
use crate::supervisor::Limits;
use crate::tick::{Tick, TorquePath};

/// Name and range of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Name with unit.
    pub name: &'static str,
    /// Least value.
    pub low: f32,
    /// Largest value.
    pub high: f32,
}

macro_rules! parameters {
    ($($(#[$doc:meta])* $name:ident: $low:literal to $high:literal,)+) => {
        /// Everything the host may set.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Parameters {
            $($(#[$doc])* pub $name: f32,)+
        }

        /// Names and ranges; the place is the number of the parameter on the wire.
        pub const ENTRIES: &[Entry] = &[
            $(Entry { name: stringify!($name), low: $low, high: $high },)+
        ];

        impl Parameters {
            /// The value with a number.
            pub fn get(&self, number: u8) -> Option<f32> {
                [$(self.$name,)+].get(usize::from(number)).copied()
            }

            fn place(&mut self, number: u8) -> Option<&mut f32> {
                [$(&mut self.$name,)+].into_iter().nth(usize::from(number))
            }
        }
    };
}

parameters! {
    /// J, kg m^2.
    inertia_kg_m2: 1e-7 to 10.0,
    /// Counts of a turn.
    counts_per_rev: 16.0 to 8_388_608.0,
    /// Coulomb friction, N m.
    coulomb_nm: 1e-6 to 1000.0,
    /// Friction at rest, N m.
    stiction_nm: 1e-6 to 1000.0,
    /// Speed over which friction falls from rest to Coulomb as a Gaussian, rad/s.
    stribeck_velocity_rad_s: 1e-4 to 1000.0,
    /// sigma0, N m/rad.
    stiffness_nm_rad: 1e-3 to 1e7,
    /// sigma1, N m s/rad.
    damping_nm_s_rad: 0.0 to 1e4,
    /// sigma2, N m s/rad.
    viscous_nm_s_rad: 0.0 to 1e4,
    /// z_ba/z_ss.
    breakaway_ratio: 0.0 to 0.99,
    /// l1, 1/s.
    l1_1_s: 0.0 to 20_000.0,
    /// l2.
    l2: -1000.0 to 1000.0,
    /// Torque besides the drive's, such as gravity, N m.
    offset_nm: -1000.0 to 1000.0,
    /// First-order lag of the drive, s.
    drive_lag_s: 0.0 to 0.1,
    /// Torque at full deflection of the output, N m.
    full_scale_nm: 1e-3 to 1000.0,
    /// Largest torque, N m.
    torque_limit_nm: 1e-4 to 1000.0,
    /// Largest rate of torque, N m/s.
    slew_limit_nm_s: 1e-2 to 1e7,
    /// Rate of torque of a stop, N m/s.
    ramp_nm_s: 1e-3 to 1e7,
    /// Largest speed, rad/s.
    max_speed_rad_s: 0.1 to 10_000.0,
    /// Time at torque or slew limit after which it is a fault, s.
    limit_time_s: 1e-3 to 100.0,
    /// Time without a command after which an armed drive is stopped, s.
    command_timeout_s: 0.01 to 60.0,
    /// Torque above which the axis must move, N m.
    stuck_torque_nm: 1e-5 to 1000.0,
    /// Time above that torque without a count after which the encoder counts as stuck, s.
    stuck_time_s: 1e-3 to 10.0,
    /// Counts by which an index may be off.
    index_tolerance_counts: 0.0 to 1000.0,
    /// Position gain, 1/s.
    position_gain_1_s: 0.0 to 1e4,
    /// Speed gain, N m s/rad.
    velocity_gain_nm_s_rad: 0.0 to 1e4,
    /// Rate of the speed loop's integral, 1/s.
    velocity_integral_1_s: 0.0 to 1e4,
    /// Share of the friction along a loop's reference that is fed forward.
    friction_forward: 0.0 to 1.0,
    /// Share of the observed friction that a loop takes off; see [`crate::compensation`] for its limit.
    friction_feedback: 0.0 to 0.6,
    /// Time constant of the observed friction's filter, s.
    friction_filter_s: 0.0 to 0.1,
}

const BENCH_INERTIA_KG_M2: f64 = 2.5246e-5;

/// The virtual axis of `axes/bench.toml` at its sources; what that file does not hold is reasoned for here.
pub const BENCH: Parameters = Parameters {
    inertia_kg_m2: BENCH_INERTIA_KG_M2 as f32,
    counts_per_rev: 16384.0,
    coulomb_nm: 0.020,
    stiction_nm: 0.026,
    stribeck_velocity_rad_s: 0.3,
    stiffness_nm_rad: 10.53,
    damping_nm_s_rad: 0.076,
    viscous_nm_s_rad: 0.0029,
    breakaway_ratio: 0.7,
    l1_1_s: 1700.0,
    l2: 0.0,
    offset_nm: 0.0,
    drive_lag_s: 0.0,
    // Three times the torque of the sine experiment, 0.035 N m.
    full_scale_nm: 0.1,
    torque_limit_nm: 0.09,
    // Zero to the limit in 0.9 ms, as a drive's current loop. A count makes 5 mN m through the speed loop in a tick; a
    // limit below that is a lag within the loop, which swings in the rests of a compensated axis.
    slew_limit_nm_s: 100.0,
    // The limit to zero in 90 ms.
    ramp_nm_s: 1.0,
    // The sine reaches 5 rad/s; 50 turns a second are what the encoder's input filter can follow.
    max_speed_rad_s: 314.0,
    // Half a period of the sine experiment: longer than any peak.
    limit_time_s: 0.5,
    // Twenty keep-alives of a host that sends them every 50 ms.
    command_timeout_s: 1.0,
    // 1.2 times friction at rest. The sine is above it for 150 ms at a time.
    stuck_torque_nm: 0.0312,
    // At that torque the axis makes the first count within 2 ms.
    stuck_time_s: 0.05,
    // The index edge lies a count or two apart in the two directions, and the copy is taken behind the input filter.
    index_tolerance_counts: 4.0,
    // As any axis whose file gives no gains.
    position_gain_1_s: (FIFTH * BANDWIDTH_RAD_S) as f32,
    velocity_gain_nm_s_rad: (BENCH_INERTIA_KG_M2 * BANDWIDTH_RAD_S) as f32,
    velocity_integral_1_s: (FIFTH * BANDWIDTH_RAD_S) as f32,
    // Off; `bristle compensate` shows what it does.
    friction_forward: 0.0,
    friction_feedback: 0.0,
    // At the slowest reversals a count comes every few ms; the loops answer within 3 ms.
    friction_filter_s: 0.001,
};

/// What the interrupt runs on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Config {
    /// Observers and control.
    pub tick: Tick<f32, Table<f32>>,
    /// Limits of the supervisor.
    pub limits: Limits,
    /// Length of a tick, s.
    pub tick_s: f32,
    /// Torque at full deflection of the output, N m.
    pub full_scale_nm: f32,
    /// Deflections of the output per N m: one over the full scale.
    pub deflection_1_nm: f32,
}

impl Config {
    /// The order to play an experiment within bounds.
    pub fn play(&self, experiment: Experiment<f32>, bounds: &Bounds<f32>) -> Order {
        let rad_per_count = self.tick.luenberger.settings().rad_per_count;
        Order::play(experiment, bounds, self.tick_s, rad_per_count)
    }
}

/// Multiples of the Stribeck velocity that the table spans: beyond 8 the Gaussian is zero to within f32.
const TABLE_SPAN: f32 = 8.0;

/// Share of the speed limit up to which the observer believes an estimate; the supervisor has to see one beyond it.
const BELIEVED_SPEED: f32 = 1.5;

impl Parameters {
    /// Sets a value.
    ///
    /// # Errors
    /// The entry whose range does not hold it, or `None` if there is no such parameter.
    pub fn set(&mut self, number: u8, value: f32) -> Result<(), Option<&'static Entry>> {
        let entry = ENTRIES.get(usize::from(number)).ok_or(None)?;
        // Written so that a NaN fails it.
        if !(value >= entry.low && value <= entry.high) {
            return Err(Some(entry));
        }
        *self.place(number).ok_or(None)? = value;
        Ok(())
    }

    /// Angle of a count of the encoder.
    pub fn rad_per_count(&self) -> f32 {
        core::f32::consts::TAU / self.counts_per_rev
    }

    /// Builds what the interrupt runs on.
    ///
    /// # Errors
    /// Values that do not go together, or observer gains under which the error does not die out.
    pub fn build(&self, tick_s: f32, output_delay_samples: usize) -> Result<Config, BuildError> {
        require(
            "torque_limit_nm",
            self.torque_limit_nm,
            self.torque_limit_nm <= self.full_scale_nm,
            "at most full_scale_nm",
        )?;
        let counts_per_turn = self.counts_per_rev as i32;
        let rad_per_count = self.rad_per_count();
        let believed_rad_s = self.max_speed_rad_s * BELIEVED_SPEED;
        let largest_step_rad = believed_rad_s * tick_s;
        let largest_step = ((largest_step_rad / rad_per_count) as i32)
            .max(1)
            .min(counts_per_turn);
        let friction = ElastoPlastic::new(
            self.curve()?,
            self.stiffness_nm_rad,
            self.damping_nm_s_rad,
            self.viscous_nm_s_rad,
            self.breakaway_ratio,
        )?;
        let settings = Settings {
            inertia_kg_m2: self.inertia_kg_m2,
            rad_per_count,
            sample_time_s: tick_s,
            l1_1_s: self.l1_1_s,
            l2: self.l2,
            offset_nm: self.offset_nm,
            max_speed_rad_s: believed_rad_s,
            max_torque_nm: self.full_scale_nm,
        };
        let tick = Tick {
            encoder: Encoder::new(counts_per_turn, largest_step)?,
            torque_path: TorquePath::new(output_delay_samples, self.drive_lag_s, tick_s)?,
            luenberger: Luenberger::new(friction, settings)?,
            control: Cascade::new(
                self.position_gain_1_s,
                self.velocity_gain_nm_s_rad,
                self.velocity_integral_1_s,
                self.torque_limit_nm,
                tick_s,
            )?,
            compensation: Compensation::new(
                self.friction_forward,
                self.friction_feedback,
                self.friction_filter_s,
                tick_s,
            )?,
        };
        Ok(Config {
            tick,
            limits: self.limits(tick_s).checked()?,
            tick_s,
            full_scale_nm: self.full_scale_nm,
            deflection_1_nm: 1.0 / self.full_scale_nm,
        })
    }

    fn curve(&self) -> Result<Table<f32>, ParameterError> {
        let shape = Shape::Gaussian {
            velocity_rad_s: self.stribeck_velocity_rad_s,
        };
        let curve = Stribeck::new(self.coulomb_nm, self.stiction_nm, shape)?;
        Table::new(&curve, TABLE_SPAN * self.stribeck_velocity_rad_s)
    }

    /// What the supervisor allows.
    pub fn limits(&self, tick_s: f32) -> Limits {
        let ticks = |seconds: f32| ((seconds / tick_s + 0.5) as u32).max(1);
        Limits {
            torque_nm: self.torque_limit_nm,
            slew_nm: self.slew_limit_nm_s * tick_s,
            ramp_nm: self.ramp_nm_s * tick_s,
            speed_rad_s: self.max_speed_rad_s,
            limit_ticks: ticks(self.limit_time_s),
            command_ticks: ticks(self.command_timeout_s),
            stuck_nm: self.stuck_torque_nm,
            stuck_ticks: ticks(self.stuck_time_s),
            counts_per_turn: self.counts_per_rev as i32,
            index_counts: self.index_tolerance_counts as i32,
            // Twenty times what the input filters take, and the first index edge after power-up with it.
            boot_ticks: ticks(0.01),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn bench_is_within_its_ranges_and_builds() {
        let mut copy = BENCH;
        for number in 0..ENTRIES.len() as u8 {
            let value = BENCH.get(number).unwrap();
            assert_eq!(
                copy.set(number, value),
                Ok(()),
                "{:?}",
                ENTRIES[usize::from(number)]
            );
        }
        assert_eq!(copy, BENCH);
        let config = BENCH.build(1e-4, 1).unwrap();
        assert_eq!(config.limits.stuck_ticks, 500);
        assert_eq!(config.limits.command_ticks, 10_000);
    }

    #[test]
    fn the_encoders_longest_step_is_one_that_the_observer_believes() {
        for counts_per_rev in [4096.0, 16384.0, 20_000.0, 65_536.0] {
            let parameters = Parameters {
                counts_per_rev,
                ..BENCH
            };
            let encoder = parameters.build(1e-4, 1).unwrap().tick.encoder;
            // A tick at half above the speed limit; what is left of a count is no step.
            let counts = 1.5 * parameters.max_speed_rad_s * 1e-4 / parameters.rad_per_count();
            let (most, mut state) = (counts as u32, encoder.start(0));
            assert_eq!(encoder.update(&mut state, most), Some(most as i32));
            assert_eq!(encoder.update(&mut state, 2 * most + 1), None, "{counts}");
        }
    }

    #[test]
    fn out_of_range_is_refused_with_the_range() {
        for (number, entry) in ENTRIES.iter().enumerate() {
            let mut parameters = BENCH;
            let below = if entry.low < 0.0 { 2.0 } else { 0.5 } * entry.low - 1e-9;
            for bad in [
                f32::NAN,
                f32::INFINITY,
                -f32::INFINITY,
                below,
                entry.high * 1.01,
            ] {
                assert_eq!(parameters.set(number as u8, bad), Err(Some(entry)), "{bad}");
            }
            assert_eq!(parameters, BENCH);
        }
        let mut parameters = BENCH;
        assert_eq!(parameters.set(ENTRIES.len() as u8, 1.0), Err(None));
    }

    #[test]
    fn what_does_not_go_together_is_refused_with_a_reason() {
        let cases = [
            (
                Parameters {
                    stiction_nm: 0.01,
                    ..BENCH
                },
                "stiction_nm",
            ),
            (
                Parameters {
                    torque_limit_nm: 0.2,
                    ..BENCH
                },
                "full_scale_nm",
            ),
            (
                Parameters {
                    l1_1_s: 100.0,
                    ..BENCH
                },
                "l1_1_s",
            ),
        ];
        for (parameters, word) in cases {
            let error = parameters.build(1e-4, 1).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
