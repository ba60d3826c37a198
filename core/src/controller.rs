//! The whole of the control interrupt but for its registers: requests, observers, control, supervisor and the sample of
//! a tick. The host steps the same code.

use core::hint::cold_path;

use crate::experiment::bounds::Guard;
use crate::experiment::{Bounds, End, Experiment, Player};
use crate::parameters::Config;
use crate::supervisor::{Observation, Request, State, Supervisor};
use crate::tick;
use crate::trace::{
    END_SHIFT, FLAG_DRIVE_ENABLED, FLAG_EXPERIMENT, FLAG_INDEX_SEEN, FLAG_OVERRUN, Record, Status,
};

/// What a command asks of the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Of the supervisor.
    Request(Request),
    /// Plays a signal from its beginning within its bounds, if armed.
    Play(Experiment<f32>, Bounds<f32>),
}

/// What the hardware says at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Input {
    /// Free-running counter of the encoder.
    pub raw: u32,
    /// The counter at an index edge since the last tick.
    pub index: Option<u32>,
    /// Both encoder inputs changed at once.
    pub illegal: bool,
    /// The drive says it is well.
    pub drive_healthy: bool,
    /// The tick before this was late, lost or too long.
    pub late: bool,
    /// The sample before this found the queue full.
    pub overrun: bool,
    /// The oldest order not yet followed.
    pub order: Option<Order>,
}

/// What a tick puts out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// N m; zero unless the drive is enabled.
    pub torque_nm: f32,
    /// Whether the drive is enabled.
    pub drive_enabled: bool,
    /// The sample for the trace.
    pub record: Record,
}

/// No torque, for ever.
const SILENCE: Experiment<f32> = Experiment::Prbs {
    amplitude_nm: 0.0,
    clock_ticks: 1,
};

/// Everything that a tick changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    state: tick::State<f32>,
    player: Player<f32>,
    guard: Guard,
    /// As in the sample's flags: whether an experiment plays, and [`End`] of the last one.
    experiment: u8,
    supervisor: Supervisor,
    tick: u32,
}

impl Controller {
    /// At boot, the axis at rest at a counter reading.
    pub fn new(config: &Config, raw: u32, watchdog_reset: bool) -> Self {
        Self {
            state: config.tick.start(raw),
            player: Player::new(SILENCE, config.tick_s),
            guard: Guard::new(&Bounds::open(1), 1.0, 0, raw),
            experiment: 0,
            supervisor: Supervisor::new(watchdog_reset),
            tick: 0,
        }
    }

    /// Samples rejected by encoder, Luenberger-like and time-free observer.
    #[inline]
    pub fn rejected(&self) -> [u32; 3] {
        [
            self.state.encoder.rejected,
            self.state.luenberger.rejected,
            self.state.time_free.rejected,
        ]
    }

    /// The supervisor.
    pub fn supervisor(&self) -> &Supervisor {
        &self.supervisor
    }

    /// One tick.
    #[inline]
    pub fn step(&mut self, config: &Config, input: &Input) -> Output {
        let mut begins = false;
        let mut request = match input.order {
            Some(Order::Request(request)) => {
                cold_path();
                Some(request)
            }
            Some(Order::Play(experiment, bounds)) => {
                cold_path();
                if self.supervisor.may_start() {
                    self.player = Player::new(experiment, config.tick_s);
                    let settings = config.tick.luenberger.settings();
                    self.guard = Guard::new(&bounds, settings.rad_per_count, self.tick, input.raw);
                    self.experiment = FLAG_EXPERIMENT;
                    begins = true;
                    self.state.begin_experiment();
                }
                Some(Request::Start)
            }
            None => None,
        };
        let rejected = self.state.encoder.rejected;
        let sample = config
            .tick
            .run(&mut self.state, input.raw, &mut self.player);
        let playing = self.experiment & FLAG_EXPERIMENT != 0;
        let mut end = End::None;
        if playing {
            end = self.guard.look(
                self.tick,
                input.raw,
                sample.luenberger.velocity_rad_s,
                sample.torque_ref_nm,
            );
            if end != End::None {
                cold_path();
                self.supervisor.stop();
                if begins {
                    // Its start would end the stop.
                    request = Some(Request::KeepAlive);
                }
            }
        }
        let seen = Observation {
            wanted_nm: sample.torque_ref_nm,
            velocity_rad_s: sample.luenberger.velocity_rad_s,
            // Finite only if both are.
            z_rad: sample.luenberger.z_rad + sample.time_free_z_rad,
            step_counts: sample.step_counts,
            step_rejected: self.state.encoder.rejected != rejected,
            index: input.index,
            illegal: input.illegal,
            drive_healthy: input.drive_healthy,
            late: input.late,
            request,
        };
        let verdict = self.supervisor.step(&config.limits, &seen);
        let mut flags = self.experiment;
        // What was stopped does not resume.
        let stopped = self.supervisor.state() != State::Armed || request == Some(Request::Stop);
        if playing && (stopped || end != End::None) {
            cold_path();
            if self.supervisor.state() == State::Fault {
                end = End::Fault;
            } else if stopped {
                end = End::Stopped;
            }
            self.experiment = (end as u8) << END_SHIFT;
            // One that ends in the tick in which it begins has been seen to begin.
            flags = self.experiment | if begins { FLAG_EXPERIMENT } else { 0 };
            self.player = Player::new(SILENCE, config.tick_s);
        }
        self.state.put_out(verdict.torque_nm);
        let flag = |on: bool, flag: u8| if on { flag } else { 0 };
        flags |= flag(verdict.drive_enabled, FLAG_DRIVE_ENABLED)
            | flag(self.supervisor.index_seen(), FLAG_INDEX_SEEN)
            | flag(input.overrun, FLAG_OVERRUN);
        let record = Record {
            tick: self.tick,
            counts: input.raw.cast_signed(),
            z_luenberger_rad: sample.luenberger.z_rad,
            z_time_free_rad: sample.time_free_z_rad,
            velocity_rad_s: sample.luenberger.velocity_rad_s,
            torque_ref_nm: verdict.torque_nm,
            status: Status::new(
                self.supervisor.state(),
                verdict.limit,
                self.supervisor.fault(),
                flags,
            ),
        };
        self.tick = self.tick.wrapping_add(1);
        Output {
            torque_nm: verdict.torque_nm,
            drive_enabled: verdict.drive_enabled,
            record,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{BENCH, Parameters};
    use crate::supervisor::{Fault, Limit};
    use std::vec::Vec;

    const TICK_S: f32 = 1e-4;

    fn well(raw: u32) -> Input {
        Input {
            raw,
            drive_healthy: true,
            ..Input::default()
        }
    }

    fn ordering(raw: u32, order: Order) -> Input {
        Input {
            order: Some(order),
            ..well(raw)
        }
    }

    fn sine(amplitude_nm: f32) -> Order {
        let sine = Experiment::Sine {
            amplitude_nm,
            period_ticks: 10_000,
        };
        Order::Play(sine, Bounds::open(u32::MAX))
    }

    /// Armed at tick 200 with the axis at rest.
    fn armed(config: &Config) -> Controller {
        let mut controller = Controller::new(config, 7, false);
        for _ in 0..200 {
            controller.step(config, &well(7));
        }
        controller.step(config, &ordering(7, Order::Request(Request::Arm)));
        controller
    }

    #[test]
    fn plays_the_experiment_from_its_beginning_once_armed() {
        let config = BENCH.build(TICK_S, 1).unwrap();
        let mut controller = Controller::new(&config, 7, false);
        for _ in 0..200 {
            let output = controller.step(&config, &ordering(7, sine(0.01)));
            assert_eq!((output.torque_nm, output.drive_enabled), (0.0, false));
        }
        let mut controller = armed(&config);
        let mut player = Player::new(
            Experiment::Sine {
                amplitude_nm: 0.01,
                period_ticks: 10_000,
            },
            TICK_S,
        );
        for k in 0..3000 {
            let input = if k == 0 {
                ordering(7, sine(0.01))
            } else {
                well(7)
            };
            let output = controller.step(&config, &input);
            let crate::experiment::Reference::Torque(expected) = player.next_tick() else {
                panic!("a sine is a torque")
            };
            assert_eq!(output.torque_nm, expected);
            assert_eq!(output.record.tick, 201 + k);
            assert_eq!(output.record.status.limit(), Some(Limit::None));
        }
    }

    #[test]
    fn a_stopped_experiment_does_not_resume() {
        let config = BENCH.build(TICK_S, 1).unwrap();
        let mut controller = armed(&config);
        controller.step(&config, &ordering(7, sine(0.01)));
        for _ in 0..2000 {
            controller.step(&config, &well(7));
        }
        controller.step(&config, &ordering(7, Order::Request(Request::Stop)));
        let torques: Vec<f32> = (0..200)
            .map(|_| controller.step(&config, &well(7)).torque_nm)
            .collect();
        assert!(torques.windows(2).all(|pair| pair[1] <= pair[0]));
        assert_eq!(torques[199], 0.0);
    }

    /// Plays a sine of 0.03 N m within bounds until it ends: its ticks, why, and the torques from then on.
    fn ended(bounds: Bounds<f32>, raw: impl Fn(u32) -> u32) -> (u32, End, Vec<f32>) {
        let config = BENCH.build(TICK_S, 1).unwrap();
        let mut controller = armed(&config);
        let sine = Experiment::Sine {
            amplitude_nm: 0.03,
            period_ticks: 10_000,
        };
        let mut order = Some(Order::Play(sine, bounds));
        for k in 0..5000 {
            let input = Input {
                order: order.take(),
                ..well(raw(k))
            };
            let record = controller.step(&config, &input).record;
            if record.status.flags() & FLAG_EXPERIMENT == 0 {
                let end = record.status.ended().unwrap();
                let rest = (0..100)
                    .map(|_| controller.step(&config, &well(raw(k))))
                    .map(|output| {
                        assert_eq!(output.record.status.ended(), Some(end));
                        output.torque_nm
                    });
                let torques = core::iter::once(record.torque_ref_nm).chain(rest);
                return (k, end, torques.collect());
            }
            assert_eq!(record.status.ended(), Some(End::None));
        }
        panic!("it did not end")
    }

    #[test]
    fn a_bound_that_is_passed_ends_the_experiment_with_its_reason() {
        let open = Bounds::open(4000);
        let at_rest = |_| 7;
        let (ticks, end, torques) = ended(Bounds { ticks: 300, ..open }, at_rest);
        assert_eq!((ticks, end), (300, End::Finished));
        // Down by the ramp, 1e-4 N m a tick, from 0.03 sin(2 pi 0.03) = 5.6e-3.
        assert!(torques.windows(2).all(|pair| pair[1] <= pair[0]));
        assert!(torques[0] > 5e-3 && torques[99] == 0.0);
        // 0.03 sin(2 pi t) passes 0.01 N m at 0.0541 s; the torque itself never does.
        let torque_nm = 0.01;
        let (ticks, end, torques) = ended(Bounds { torque_nm, ..open }, at_rest);
        assert_eq!((ticks, end), (541, End::Torque));
        assert!(torques[0] <= torque_nm);
        // A count every 25 ticks: 0.1 rad are 261 counts.
        let crawl = |k: u32| 7_u32.wrapping_sub(k / 25);
        let travel_rad = 0.02;
        let (ticks, end, _) = ended(Bounds { travel_rad, ..open }, crawl);
        // 52 counts are allowed.
        assert_eq!((ticks, end), (53 * 25, End::Travel));
        // Ten counts a tick are 38 rad/s.
        let fast = |k: u32| 7 + 10 * k;
        let speed_rad_s = 5.0;
        let (_, end, _) = ended(
            Bounds {
                speed_rad_s,
                ..open
            },
            fast,
        );
        assert_eq!(end, End::Speed);
        // Ends in the tick in which it begins, which shows both.
        let mut controller = armed(&BENCH.build(TICK_S, 1).unwrap());
        let config = BENCH.build(TICK_S, 1).unwrap();
        let ladder = Experiment::SpeedLadder {
            top_rad_s: 10.0,
            ratio: 0.5,
            hold_ticks: 10,
        };
        let order = Order::Play(ladder, Bounds { torque_nm, ..open });
        let output = controller.step(&config, &ordering(7, order));
        let status = output.record.status;
        assert_eq!(status.ended(), Some(End::Torque));
        assert!(status.flags() & FLAG_EXPERIMENT != 0 && output.torque_nm == 0.0);
        let next = controller.step(&config, &well(7)).record.status;
        assert_eq!(next.ended(), Some(End::Torque));
        assert_eq!(next.flags() & FLAG_EXPERIMENT, 0);
    }

    #[test]
    fn a_stop_and_a_fault_end_an_experiment_with_their_reasons() {
        let config = BENCH.build(TICK_S, 1).unwrap();
        let mut controller = armed(&config);
        controller.step(&config, &ordering(7, sine(0.01)));
        let stopped = controller.step(&config, &ordering(7, Order::Request(Request::Stop)));
        assert_eq!(stopped.record.status.ended(), Some(End::Stopped));
        let again = controller.step(&config, &ordering(7, sine(0.01)));
        assert_eq!(again.record.status.ended(), Some(End::None));
        let fault = controller.step(&config, &well(100_000));
        assert_eq!(fault.record.status.ended(), Some(End::Fault));
    }

    #[test]
    fn new_parameters_leave_the_states_alone() {
        let config = BENCH.build(TICK_S, 1).unwrap();
        let mut controller = armed(&config);
        let mut raw = 7_u32;
        let mut last = controller.step(&config, &ordering(raw, sine(0.03))).record;
        for k in 0..2000_u32 {
            raw = raw.wrapping_add(u32::from(k % 50 == 0));
            last = controller.step(&config, &well(raw)).record;
        }
        let changed = Parameters {
            viscous_nm_s_rad: 0.003,
            l1_1_s: 1800.0,
            ..BENCH
        };
        let config = changed.build(TICK_S, 1).unwrap();
        let next = controller.step(&config, &well(raw)).record;
        // A tick's change of each, and no more: 8 rad/s^2 per mN m, and the sine's slope.
        assert!((next.velocity_rad_s - last.velocity_rad_s).abs() < 0.1);
        assert_eq!(next.z_time_free_rad, last.z_time_free_rad);
        assert!((next.torque_ref_nm - last.torque_ref_nm).abs() < 2e-5);
        assert_eq!(next.tick, last.tick + 1);
    }

    #[test]
    fn a_jump_of_the_counter_is_a_fault_and_control_goes_on() {
        let config = BENCH.build(TICK_S, 1).unwrap();
        let mut controller = armed(&config);
        controller.step(&config, &ordering(7, sine(0.03)));
        let output = controller.step(&config, &well(100_000));
        assert_eq!(output.record.status.fault(), Some(Fault::Overspeed));
        assert_eq!((output.torque_nm, output.drive_enabled), (0.0, false));
        let output = controller.step(&config, &well(100_000));
        assert_eq!(output.record.status.state(), Some(State::Fault));
        assert_eq!(controller.rejected()[0], 1);
    }
}
