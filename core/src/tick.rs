//! The control tick: what the 10 kHz interrupt does between reading the encoder and writing the torque reference. Pure:
//! the host steps the same code against the virtual axis.

use core::hint::cold_path;

use crate::compensation::{self, Compensation};
use crate::control::{self, Cascade};
use crate::encoder::{self, Encoder};
use crate::error::{ParameterError, not_negative, positive, require};
use crate::experiment::{Player, Reference};
use crate::feed_forward::FeedForward;
use crate::observer::{Estimate, Luenberger, TimeFree, luenberger, time_free};
use crate::real::Real;
use crate::stribeck::Curve;

/// Samples of output delay that a [`TorquePath`] can hold.
pub const MOST_DELAY: usize = 4;

/// What lies between the torque reference and the rotor: whole samples of delay, then a first-order lag.
///
/// A converter triggered by the tick's timer puts a value out one sample after it was computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorquePath<T> {
    delay_samples: usize,
    decay: T,
    mean_of_lag: T,
}

/// Places for references under way: the newest one and [`MOST_DELAY`] older ones, up to a power of two, so that a mask
/// keeps an index inside.
const PLACES: usize = (MOST_DELAY + 1).next_power_of_two();

/// References under way, and the torque on the rotor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TorquePathState<T> {
    under_way_nm: [T; PLACES],
    newest: usize,
    torque_nm: T,
}

impl<T: Real> TorquePathState<T> {
    #[inline]
    fn put(&mut self, reference_nm: T) {
        let newest = self.newest.wrapping_add(1) % PLACES;
        self.newest = newest;
        self.under_way_nm[newest] = reference_nm;
    }

    /// So much of the newest reference does not count.
    #[inline(always)]
    fn take_off(&mut self, torque_nm: T) {
        self.under_way_nm[self.newest % PLACES] -= torque_nm;
    }
}

impl<T: Real> TorquePath<T> {
    /// Delay in samples and time constant of the drive.
    ///
    /// # Errors
    /// A delay above [`MOST_DELAY`] or a negative lag.
    pub fn new(delay_samples: usize, lag_s: T, sample_time_s: T) -> Result<Self, ParameterError> {
        positive("sample_time_s", sample_time_s)?;
        not_negative("lag_s", lag_s)?;
        let delay = delay_samples as f64;
        require(
            "delay_samples",
            delay,
            delay_samples <= MOST_DELAY,
            "at most 4",
        )?;
        let (decay, mean_of_lag) = if lag_s > T::ZERO {
            let x = sample_time_s / lag_s;
            let decay = (-x).exp();
            (decay, (T::ONE - decay) / x)
        } else {
            (T::ZERO, T::ZERO)
        };
        Ok(Self {
            delay_samples,
            decay,
            mean_of_lag,
        })
    }

    /// Takes the reference computed at the last tick and gives the mean torque on the rotor since then, N m.
    #[inline]
    pub fn step(&self, state: &mut TorquePathState<T>, reference_nm: T) -> T {
        state.put(reference_nm);
        self.felt(state)
    }

    /// The mean torque on the rotor since the tick before, N m.
    #[inline]
    fn felt(&self, state: &mut TorquePathState<T>) -> T {
        // What the rotor feels now is delay_samples older than the newest one.
        let felt = state.under_way_nm[state.newest.wrapping_sub(self.delay_samples) % PLACES];
        let start = state.torque_nm;
        state.torque_nm = felt + (start - felt) * self.decay;
        felt + (start - felt) * self.mean_of_lag
    }
}

/// Everything the tick runs; none of it changes in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick<T, C> {
    /// Counts to steps.
    pub encoder: Encoder,
    /// Reference to torque on the rotor.
    pub torque_path: TorquePath<T>,
    /// Velocity and z from torque and counts. Its friction model, count and belief are the time-free observer's too,
    /// see [`Tick::time_free`].
    pub luenberger: Luenberger<T, C>,
    /// Loops of the experiments that need them.
    pub control: Cascade<T>,
    /// What it adds for friction.
    pub compensation: Compensation<T>,
}

/// Everything a tick changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<T> {
    /// Encoder.
    pub encoder: encoder::State,
    /// Observer.
    pub luenberger: luenberger::State<T>,
    /// Observer.
    pub time_free: time_free::State<T>,
    torque_path: TorquePathState<T>,
    control: control::State<T>,
    compensation: compensation::State<T>,
    /// z_ss at the velocity of the estimate: looked up once a tick, for this one's time-free observer and the next
    /// one's Luenberger-like one.
    z_ss_rad: T,
}

impl<T: Real> State<T> {
    /// The position counts from here on, and the loops start without history. The observers go on.
    pub fn begin_experiment(&mut self) {
        self.encoder.begin_travel();
        self.control = control::State::default();
        self.compensation = compensation::State::default();
    }

    /// Says which torque is put out until the next tick: the observer believes it.
    #[inline]
    pub fn put_out(&mut self, torque_nm: T) {
        self.torque_path.put(torque_nm);
    }
}

/// What a tick saw and decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<T> {
    /// Step since the last tick in counts; zero if it was rejected.
    pub step_counts: i32,
    /// The step was too large to be motion.
    pub rejected: bool,
    /// The Luenberger-like observer's estimate.
    pub luenberger: Estimate<T>,
    /// The time-free observer's deflection, rad.
    pub time_free_z_rad: T,
    /// Torque reference for the drive, N m.
    pub torque_ref_nm: T,
}

impl<T: Real, C: Curve<T>> Tick<T, C> {
    /// Starts at rest at a counter reading.
    pub fn start(&self, raw: u32) -> State<T> {
        State {
            encoder: self.encoder.start(raw),
            luenberger: luenberger::State::default(),
            time_free: time_free::State::default(),
            torque_path: TorquePathState::default(),
            control: control::State::default(),
            compensation: compensation::State::default(),
            z_ss_rad: self.luenberger.z_ss_rad(&luenberger::State::default()),
        }
    }

    /// Goes on with a state that another set of parameters has left.
    #[inline(always)]
    pub fn take_over(&self, state: &mut State<T>) {
        state.z_ss_rad = self.luenberger.z_ss_rad(&state.luenberger);
    }

    /// The observer of z from counts; the other observer's velocity places it on the Stribeck curve.
    pub fn time_free(&self) -> TimeFree<T, C>
    where
        C: Copy,
    {
        TimeFree::beside(&self.luenberger)
    }

    /// One tick of an experiment: the counter reading in, the torque reference out.
    #[inline]
    pub fn run(&self, state: &mut State<T>, raw: u32, player: &mut Player<T>) -> Sample<T> {
        let mut sample = self.decide(state, raw, &player.next_tick(), T::of(f64::INFINITY));
        sample.torque_ref_nm = self.control.limited(sample.torque_ref_nm);
        state.put_out(sample.torque_ref_nm);
        sample
    }

    /// As [`Tick::run`], for a caller that limits the torque of an experiment without a loop, and says itself which one
    /// it puts out. Faster than `fastest_rad_s` a loop asks for no torque, as that is the end of its experiment.
    #[inline]
    pub fn decide(
        &self,
        state: &mut State<T>,
        raw: u32,
        reference: &Reference<T>,
        fastest_rad_s: T,
    ) -> Sample<T> {
        self.observe_and_control(state, raw, |control, position_rad, velocity_rad_s| {
            match *reference {
                Reference::Torque(torque_nm) => torque_nm,
                reference if velocity_rad_s.abs() <= fastest_rad_s => {
                    cold_path();
                    self.control
                        .step(control, reference, position_rad, velocity_rad_s)
                }
                _ => T::ZERO,
            }
        })
    }

    /// Between two ticks: what the loop adds for friction in the next one, of this reference. A torque in open loop stays
    /// what it is.
    #[inline(always)]
    pub(crate) fn compensate(&self, state: &mut State<T>, reference: Reference<T>) {
        let velocity_rad_s = match reference {
            Reference::Torque(_) => return,
            Reference::Velocity(velocity_rad_s) | Reference::Position { velocity_rad_s, .. } => {
                velocity_rad_s
            }
        };
        if self.compensation.is_off() {
            return;
        }
        let seen = Estimate {
            velocity_rad_s: state.luenberger.estimate.velocity_rad_s,
            z_rad: state.time_free.z_rad,
        };
        let friction = self.luenberger.friction();
        let change_nm =
            self.compensation
                .step(&mut state.compensation, friction, velocity_rad_s, seen);
        state.control.add(change_nm);
    }

    /// Between two ticks: what a table adds in the next one, of this reference, in place of what it added in the last
    /// one. It cancels what the observers do not know of, so they are not told. Gives the torque that stands now, N m.
    #[inline(always)]
    pub(crate) fn feed(
        &self,
        state: &mut State<T>,
        table: &FeedForward<T>,
        reference: &mut Reference<T>,
        before_nm: T,
    ) -> T {
        let counts = state.encoder.reading().cast_signed();
        let position_rad = T::of_count(counts) * self.luenberger.settings().rad_per_count;
        let torque_nm = table.torque_nm(position_rad, state.luenberger.estimate.velocity_rad_s);
        state.torque_path.take_off(before_nm);
        match reference {
            Reference::Torque(wanted_nm) => *wanted_nm += torque_nm,
            _ => state.control.add(torque_nm - before_nm),
        }
        torque_nm
    }

    /// One tick towards a reference that comes from elsewhere.
    #[inline]
    pub fn follow(&self, state: &mut State<T>, raw: u32, reference: Reference<T>) -> Sample<T> {
        let sample =
            self.observe_and_control(state, raw, |control, position_rad, velocity_rad_s| {
                self.control
                    .step(control, reference, position_rad, velocity_rad_s)
            });
        state.put_out(sample.torque_ref_nm);
        sample
    }

    /// One tick. `control` gives the torque for position and velocity: a reference kept in memory meanwhile would cost.
    #[inline]
    fn observe_and_control(
        &self,
        state: &mut State<T>,
        raw: u32,
        control: impl FnOnce(&mut control::State<T>, T, T) -> T,
    ) -> Sample<T> {
        let torque_nm = self.torque_path.felt(&mut state.torque_path);
        let (step_counts, rejected, time_free_z_rad) =
            match self.encoder.update(&mut state.encoder, raw) {
                Some(step) => (step, false, self.observe(state, step, torque_nm)),
                None => (0, true, state.time_free.z_rad),
            };
        let estimate = state.luenberger.estimate;
        let position_rad = self.position_rad(&state.encoder);
        let torque_ref_nm = control(&mut state.control, position_rad, estimate.velocity_rad_s);
        Sample {
            step_counts,
            rejected,
            luenberger: estimate,
            time_free_z_rad,
            torque_ref_nm,
        }
    }

    /// Both observers: what [`Luenberger::step`] and then [`TimeFree::step`] at its velocity do, with one look-up of
    /// z_ss between them. The encoder has refused what is too long for a step. Gives z of the time-free observer, rad.
    #[inline]
    fn observe(&self, state: &mut State<T>, step_counts: i32, torque_nm: T) -> T {
        let observer = &self.luenberger;
        let dq = observer.step_at(
            &mut state.luenberger,
            step_counts,
            torque_nm,
            state.z_ss_rad,
        );
        state.z_ss_rad = observer.z_ss_rad(&state.luenberger);
        let z = state.time_free.z_rad;
        if step_counts == 0 {
            // A tick with a step is the longer one, and goes straight on.
            cold_path();
            return z;
        }
        let next = time_free::follow(observer.friction(), z, step_counts, dq, state.z_ss_rad);
        state.time_free.z_rad = next;
        next
    }

    /// Position since the start, rad: exact in f32 for some hundred turns, which the position experiments stay within.
    fn position_rad(&self, state: &encoder::State) -> T {
        T::of_count(state.travel_counts()) * self.luenberger.settings().rad_per_count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_arrives_after_its_delay() {
        let path = TorquePath::new(1, 0.0_f64, 1e-4).unwrap();
        let mut state = TorquePathState::default();
        let felt = [1.0, 2.0, 3.0].map(|u| path.step(&mut state, u));
        assert_eq!(felt, [0.0, 1.0, 2.0]);
        let direct = TorquePath::new(0, 0.0_f64, 1e-4).unwrap();
        assert_eq!(direct.step(&mut state, 5.0), 5.0);
    }

    #[test]
    fn lag_gives_the_mean_over_the_sample() {
        let path = TorquePath::new(0, 2e-4_f64, 1e-4).unwrap();
        let mut state = TorquePathState::default();
        let mean = path.step(&mut state, 1.0);
        // Mean of 1 - exp(-t/T) from 0 to T/2.
        let exact = 1.0 - 2.0 * (1.0 - (-0.5_f64).exp());
        assert!((mean - exact).abs() < 1e-15);
        assert!(TorquePath::new(5, 0.0_f64, 1e-4).is_err());
    }
}
