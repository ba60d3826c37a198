//! Gains for the position and speed loop of `core::control`, from inertia, lag, delay, encoder and friction, with the
//! margins that they leave; and a run of the whole controller with them on the virtual axis.
//!
//! Open speed loop, PI on an inertia behind the drive: L(s) = k (1 + i/s)/(J s) e^(-s T_d)/(1 + lag s), where T_d is the
//! output's delay and half a sample of holding. Position loop around it: p/s L/(1 + L). Margins as usual: phase above
//! -180 degrees where the loop's gain is 1, gain below 1 where the phase is -180 degrees. The observer's velocity follows
//! the torque, so that it adds no lag of its own while its inertia is right. A linear axis reads m for rad.

use crate::axis_file::AxisFile;
use crate::believed::{Believed, Noise};
use crate::error::InputError;
use crate::experiments::Named;
use crate::plan::Step;
use crate::run::{Bench, Virtual};
use bristle_core::control::FIFTH;
use bristle_core::experiment::fields::in_single_precision;
use bristle_core::experiment::{Bounds, End};
use nalgebra::Complex;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// Phase that the speed loop keeps, degrees.
pub const KEEPS_DEG: f64 = 60.0;
/// A count may make so much of Coulomb friction as torque: less than what moves bristles past break-away.
const COUNT_SHARE: f64 = 0.25;

/// Gains, and what they leave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuned {
    /// Crossover of the speed loop that was wanted or allowed, rad/s.
    pub bandwidth_rad_s: f64,
    /// What allowed no more.
    pub limited_by: LimitedBy,
    /// Position gain, 1/s.
    pub position_gain_1_s: f64,
    /// Speed gain, N m s/rad.
    pub velocity_gain_nm_s_rad: f64,
    /// Integral rate of the speed loop, 1/s.
    pub velocity_integral_1_s: f64,
    /// Phase margin of the speed loop, degrees.
    pub speed_phase_deg: f64,
    /// Factor by which its gain may grow before it swings.
    pub speed_gain: f64,
    /// Phase margin of the position loop, degrees.
    pub position_phase_deg: f64,
}

/// What sets the bandwidth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitedBy {
    /// The user wants no more.
    Wanted,
    /// Lag and delay.
    Phase,
    /// A count of the encoder makes as much torque as it may.
    Encoder,
}

impl LimitedBy {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wanted => "as wanted",
            Self::Phase => "lag and delay: more would leave less than 60 degrees",
            Self::Encoder => {
                "the encoder: more would make torque of a quarter of Coulomb friction from one count"
            }
        }
    }
}

/// What the loops see of an axis.
struct Plant {
    inertia: f64,
    lag_s: f64,
    delay_s: f64,
}

impl Plant {
    fn of(axis: &Believed) -> Self {
        Self {
            inertia: axis.whole_inertia_kg_m2(),
            lag_s: axis.drive.lag_s,
            delay_s: (axis.drive.delay_samples as f64 + 0.5) / axis.rate_hz,
        }
    }

    /// Phase of the open speed loop, rad.
    fn phase(&self, omega: f64, integral: f64) -> f64 {
        -PI + (omega / integral).atan() - (omega * self.lag_s).atan() - omega * self.delay_s
    }

    fn speed_loop(&self, omega: f64, gain: f64, integral: f64) -> Complex<f64> {
        let s = Complex::new(0.0, omega);
        let one = Complex::new(1.0, 0.0);
        let pi = (one + integral / s) * gain;
        let lags = (-s * self.delay_s).exp() / (one + s * self.lag_s);
        pi * lags / (s * self.inertia)
    }

    /// The frequency at which a falling function passes a value, rad/s.
    fn passes(falls: impl Fn(f64) -> f64, value: f64) -> f64 {
        let (mut low, mut high) = (1e-3, 1e7);
        // A thousandth of a per cent after so many halvings of its logarithm.
        for _ in 0..60 {
            let middle = f64::sqrt(low * high);
            if falls(middle) > value {
                low = middle;
            } else {
                high = middle;
            }
        }
        f64::sqrt(low * high)
    }
}

/// Gains for a wanted crossover of the speed loop, or for the largest that keeps [`KEEPS_DEG`] and a quiet torque.
pub fn tune(axis: &Believed, wanted_rad_s: Option<f64>) -> Tuned {
    let plant = Plant::of(axis);
    let phase_left = |omega: f64| PI + plant.phase(omega, FIFTH * omega);
    let by_phase = Plant::passes(phase_left, KEEPS_DEG.to_radians());
    let l1 = axis.l1_1_s.unwrap_or(0.1 * axis.rate_hz);
    let by_count = COUNT_SHARE * axis.coulomb_nm / (plant.inertia * l1 * axis.rad_per_count());
    let (bandwidth, limited_by) = match wanted_rad_s {
        Some(wanted) => (wanted, LimitedBy::Wanted),
        None if by_phase < by_count => (by_phase, LimitedBy::Phase),
        None => (by_count, LimitedBy::Encoder),
    };
    let (integral, position) = (FIFTH * bandwidth, FIFTH * bandwidth);
    let gain = plant.inertia * bandwidth;
    let speed = |omega: f64| plant.speed_loop(omega, gain, integral);
    let crossover = Plant::passes(|omega| speed(omega).norm(), 1.0);
    // Beyond the hump of the integral the phase only falls.
    let swings = Plant::passes(|omega| plant.phase(omega.max(integral), integral), -PI);
    let outer = |omega: f64| {
        let inner = speed(omega);
        let s = Complex::new(0.0, omega);
        inner / (inner + 1.0) * position / s
    };
    let outer_crossover = Plant::passes(|omega| outer(omega).norm(), 1.0);
    Tuned {
        bandwidth_rad_s: bandwidth,
        limited_by,
        position_gain_1_s: position,
        velocity_gain_nm_s_rad: gain,
        velocity_integral_1_s: integral,
        speed_phase_deg: (PI + plant.phase(crossover, integral)).to_degrees(),
        speed_gain: 1.0 / speed(swings).norm(),
        position_phase_deg: (PI + wrapped(outer(outer_crossover).arg())).to_degrees(),
    }
}

/// An angle of a lagging loop, from -3/2 pi to pi/2.
fn wrapped(angle: f64) -> f64 {
    if angle > FRAC_PI_2 {
        angle - 2.0 * PI
    } else {
        angle
    }
}

impl Tuned {
    /// The axis file with these gains.
    #[must_use]
    pub fn into_file(&self, file: &AxisFile) -> AxisFile {
        let mut file = file.clone();
        file.control.position_gain_1_s = Some(self.position_gain_1_s);
        file.control.velocity_gain = Some(self.velocity_gain_nm_s_rad);
        file.control.velocity_integral_1_s = Some(self.velocity_integral_1_s);
        file
    }

    /// The same with the speed loop's gain, and with it its integral, times a factor.
    #[must_use]
    pub fn times(mut self, factor: f64) -> Self {
        self.velocity_gain_nm_s_rad *= factor;
        self
    }
}

/// What a run showed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tried {
    /// Why it ended.
    pub end: End,
    /// Root-mean-square of the position's error, rad.
    pub error_rad: f64,
    /// Largest error of position, rad.
    pub most_rad: f64,
    /// Root-mean-square of the torque's change from tick to tick, N m: what a loop that swings makes large.
    pub restless_nm: f64,
}

/// Runs the whole controller with the gains of an axis file on its virtual axis: the moves of `bristle run moves`.
///
/// # Errors
/// A parameter out of range.
pub fn try_out(file: &AxisFile, path: &Path) -> Result<Tried, InputError> {
    let axis = Believed::new(file, path)?;
    let step = Step::new(Named::Moves, &axis);
    let bounds = Bounds {
        travel_rad: step.bounds.travel_rad as f32,
        speed_rad_s: step.bounds.speed_rad_s as f32,
        torque_nm: step.bounds.torque_nm as f32,
        ticks: step.bounds.ticks,
    };
    let mut bench = Virtual::new(&axis, &axis, Noise::default(), 1)?;
    let mut player = bristle_core::experiment::Player::new(step.experiment, 1.0 / axis.rate_hz);
    let (mut first, mut last) = (None, None);
    let (mut squares, mut most, mut changes, mut samples) = (0.0, 0.0_f64, 0.0, 0.0);
    let seen = bench.play(
        &in_single_precision(&step.experiment),
        &bounds,
        &mut |sample, _| {
            let bristle_core::experiment::Reference::Position { position_rad, .. } =
                player.next_tick()
            else {
                return Ok(true);
            };
            let way = (sample.counts - *first.get_or_insert(sample.counts)) as f64;
            let error = position_rad - way * axis.rad_per_count();
            let torque = f64::from(sample.record.torque_ref_nm);
            let change = torque - last.replace(torque).unwrap_or(torque);
            squares += error * error;
            most = most.max(error.abs());
            changes += change * change;
            samples += 1.0;
            Ok(true)
        },
    )?;
    Ok(Tried {
        end: seen.end,
        error_rad: f64::sqrt(squares / samples),
        most_rad: most,
        restless_nm: f64::sqrt(changes / samples),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis_file(lag_s: f64) -> AxisFile {
        let text = include_str!("../../../axes/bench.toml");
        let mut file = AxisFile::parse(text, "bench.toml").unwrap();
        file.drive.lag_s = Some(lag_s);
        // So fine that only lag and delay limit it.
        file.axis.counts_per_turn = Some(4_194_304.0);
        file.observer.l1_1_s = None;
        file
    }

    fn believed(file: &AxisFile) -> Believed {
        Believed::new(file, Path::new("bench.toml")).unwrap()
    }

    #[test]
    fn margins_are_those_of_the_textbook() {
        let axis = believed(&axis_file(0.0));
        let tuned = tune(&axis, Some(1000.0));
        assert_eq!(tuned.limited_by, LimitedBy::Wanted);
        // A PI on an inertia at 1000 rad/s: |L| = 1 at w^2 = (1 + sqrt(1 + 4 x 0.04))/2 of its square.
        let omega = 1000.0 * f64::sqrt(0.5 * (1.0 + f64::sqrt(1.16)));
        let phase = (omega / 200.0).atan() - omega * 1.5e-4;
        assert!((tuned.speed_phase_deg - phase.to_degrees()).abs() < 1e-3);
        // Without more lag than the delay, and hardly any integral, it swings at a quarter period of delay.
        let limit = FRAC_PI_2 / 1.5e-4;
        let near = tuned.speed_gain / (limit / 1000.0);
        assert!((0.95..1.0).contains(&near), "{near}");
        let free = tune(&axis, None);
        assert_eq!(free.limited_by, LimitedBy::Phase);
        assert!((free.speed_phase_deg - KEEPS_DEG).abs() < 1.0, "{free:?}");
    }

    #[test]
    fn a_coarse_encoder_limits_the_bandwidth() {
        let mut file = axis_file(0.0);
        file.axis.counts_per_turn = Some(16_384.0);
        file.observer.l1_1_s = Some(1700.0);
        let tuned = tune(&believed(&file), None);
        assert_eq!(tuned.limited_by, LimitedBy::Encoder);
        // 0.25 x 0.020/(2.5246e-5 x 1700 x 2 pi/16384).
        assert!((tuned.bandwidth_rad_s - 303.8).abs() < 0.1, "{tuned:?}");
    }

    #[test]
    fn on_the_virtual_axis_the_gain_margin_is_where_it_is_said_to_be() {
        for lag_s in [0.0, 1e-3] {
            let file = axis_file(lag_s);
            let tuned = tune(&believed(&file), None);
            let run = |factor: f64| {
                let file = tuned.times(factor).into_file(&file);
                try_out(&file, Path::new("bench.toml")).unwrap()
            };
            let calm = run(1.0);
            assert_eq!(calm.end, End::Finished, "{calm:?}");
            assert!(calm.error_rad < 0.01, "{calm:?}");
            // The margin is of the inertia alone; what friction damps besides moves it by less than these factors.
            let (inside, beyond) = (0.6 * tuned.speed_gain, 1.6 * tuned.speed_gain);
            // A torque in proportion to its gain is calm; one that swings grows to what friction or the limit leaves it.
            let restless = |factor: f64| run(factor).restless_nm / (factor * calm.restless_nm);
            let (inside, beyond) = (restless(inside), restless(beyond));
            println!("lag {lag_s}: {tuned:?}, {inside:.1} inside, {beyond:.0} beyond");
            assert!(inside < 10.0 && beyond > 30.0, "{inside} {beyond}");
        }
    }
}
