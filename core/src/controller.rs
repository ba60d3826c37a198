//! The whole of the control interrupt but for its registers: requests, observers, control, supervisor and the sample of
//! a tick. The host steps the same code.

use core::hint::cold_path;

use crate::experiment::bounds::Begin;
use crate::experiment::{Bounds, End, Guard, Player, Reference};
use crate::feed_forward::FeedForward;
use crate::order::Order;
use crate::parameters::Config;
use crate::real::Real;
use crate::supervisor::{
    Alarms, Fault, Limit, Observation, Request, State, Supervisor, Usual, Verdict,
};
use crate::tick;
use crate::trace::{
    END_SHIFT, FLAG_DRIVE_ENABLED, FLAG_EXPERIMENT, FLAG_INDEX_SEEN, FLAG_OVERRUN, Record, Status,
};

/// What the hardware says at a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Input {
    /// Free-running counter of the encoder.
    pub raw: u32,
    /// The counter at an index edge since the last tick.
    pub index: Option<u32>,
    /// What speaks against the tick: illegal transition, unwell drive, lateness.
    pub alarms: Alarms,
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

/// Everything that a tick changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    state: tick::State<f32>,
    player: Player<f32>,
    /// What the player asks of the tick to come.
    reference: Reference<f32>,
    /// What of it a table has added, N m.
    fed_nm: f32,
    guard: Guard,
    begin: Begin,
    /// Largest speed and torque that neither the guard nor the supervisor has to look at.
    usual_speed_rad_s: f32,
    usual_torque_nm: f32,
    /// As in the sample's flags: whether an experiment plays, and [`End`] of the last one.
    experiment: u8,
    /// [`FLAG_OVERRUN`] if the last sample was lost.
    lost: u8,
    supervisor: Supervisor,
    /// Of a tick to which the supervisor has nothing to say.
    usual_status: Status,
}

impl Controller {
    /// At boot, the axis at rest at a counter reading.
    pub fn new(config: &Config, raw: u32, watchdog_reset: bool) -> Self {
        Self {
            state: config.tick.start(raw),
            player: Player::silent(),
            reference: Reference::Torque(0.0),
            fed_nm: 0.0,
            guard: Guard::new(&Bounds::open(u32::MAX), 1.0),
            begin: Begin::default(),
            usual_speed_rad_s: config.limits.speed_rad_s,
            usual_torque_nm: config.limits.torque_nm,
            experiment: 0,
            lost: 0,
            supervisor: Supervisor::new(watchdog_reset),
            usual_status: Status::default(),
        }
    }

    #[inline(always)]
    fn flags(&self, drive_enabled: bool) -> u8 {
        let flag = |on: bool, flag: u8| u8::from(on) * flag;
        self.experiment
            | flag(drive_enabled, FLAG_DRIVE_ENABLED)
            | flag(self.supervisor.index_seen(), FLAG_INDEX_SEEN)
    }

    #[inline(always)]
    fn is_playing(&self) -> bool {
        self.experiment & FLAG_EXPERIMENT != 0
    }

    /// Prepares what a usual tick uses.
    #[inline(always)]
    fn prepare(&mut self, config: &Config) {
        let flags = self.flags(true);
        self.usual_status = Status::new(State::Armed, Limit::None, Fault::None, flags);
        let limits = &config.limits;
        let (mut speed_rad_s, mut torque_nm) = (limits.speed_rad_s, limits.torque_nm);
        if self.is_playing() {
            speed_rad_s = speed_rad_s.least(self.guard.speed_rad_s);
            torque_nm = torque_nm.least(self.guard.torque_nm);
        }
        self.usual_speed_rad_s = speed_rad_s;
        self.usual_torque_nm = torque_nm;
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
    #[inline(always)]
    pub fn step(&mut self, config: &Config, input: &Input) -> Output {
        self.step_with(config, None, input)
    }

    /// One tick with a table.
    #[inline(always)]
    pub fn step_with(
        &mut self,
        config: &Config,
        table: Option<&FeedForward<f32>>,
        input: &Input,
    ) -> Output {
        let output = self.react(config, input);
        self.look_ahead(config, table);
        output
    }

    /// What of a tick depends on what the hardware says at it.
    #[inline(always)]
    pub fn react(&mut self, config: &Config, input: &Input) -> Output {
        let mut alarms = input.alarms;
        if let Some(index) = input.index {
            if !self.supervisor.index_seen() {
                cold_path();
                self.usual_status = self.usual_status.with(FLAG_INDEX_SEEN);
            }
            if !self.supervisor.index_fits(&config.limits, index) {
                cold_path();
                alarms = alarms.and(Alarms::INDEX);
            }
        }
        let mut usual_speed_rad_s = self.usual_speed_rad_s;
        if self.supervisor.is_held_or(alarms) {
            cold_path();
            // No speed is usual in it.
            usual_speed_rad_s = -1.0;
            if self.supervisor.is_against(&config.limits, alarms) {
                // A fault if something plays: its torque would not be put out, and the tick has more to do than others.
                self.reference = Reference::Torque(0.0);
            }
        }
        let sample = config.tick.decide(
            &mut self.state,
            input.raw,
            &self.reference,
            self.usual_speed_rad_s,
        );
        let seen = Observation {
            wanted_nm: sample.torque_ref_nm,
            velocity_rad_s: sample.luenberger.velocity_rad_s,
            // Finite only if both are.
            z_rad: sample.luenberger.z_rad + sample.time_free_z_rad,
            step_counts: sample.step_counts,
            alarms: alarms.and(Alarms::REJECTED.when(sample.rejected)),
        };
        let tick = self.supervisor.tick();
        let usual = if self.guard.is_near(&self.begin, input.raw) {
            let usual = Usual {
                speed_rad_s: usual_speed_rad_s,
                torque_nm: self.usual_torque_nm,
            };
            // Up to the guard's bound a torque is limited, beyond it ends what plays.
            let (guard, playing) = (&self.guard, self.experiment & FLAG_EXPERIMENT != 0);
            let may_be_limited = |torque_nm: f32| playing && torque_nm.abs() <= guard.torque_nm;
            self.supervisor
                .usual(&config.limits, &usual, &seen, may_be_limited)
        } else {
            cold_path();
            None
        };
        let (verdict, status) = if let Some(verdict) = usual {
            (verdict, self.usual_status.limited(verdict.limit))
        } else {
            cold_path();
            self.unusual(config, input.raw, &seen)
        };
        self.state.put_out(verdict.torque_nm);
        let record = Record {
            tick,
            counts: input.raw.cast_signed(),
            z_luenberger_rad: sample.luenberger.z_rad,
            z_time_free_rad: sample.time_free_z_rad,
            velocity_rad_s: sample.luenberger.velocity_rad_s,
            torque_ref_nm: verdict.torque_nm,
            status,
        };
        Output {
            torque_nm: verdict.torque_nm,
            drive_enabled: verdict.drive_enabled,
            record,
        }
    }

    /// The sample of the tick was lost, which the next one says.
    #[inline(always)]
    pub fn lose_sample(&mut self) {
        self.lost = FLAG_OVERRUN;
        self.supervisor.hold();
    }

    /// What remains of a tick: finds the reference of the next one with what is added to it, from a table too if there is
    /// one, and whether its number makes it an unusual one.
    #[inline(always)]
    pub fn look_ahead(&mut self, config: &Config, table: Option<&FeedForward<f32>>) {
        self.reference = self.player.next_tick();
        config.tick.compensate(&mut self.state, self.reference);
        if let Some(table) = table {
            cold_path();
            if self.is_playing() {
                let (state, reference) = (&mut self.state, &mut self.reference);
                self.fed_nm = config.tick.feed(state, table, reference, self.fed_nm);
            }
        }
        self.look_at_number(config);
    }

    /// As [`Self::look_ahead`] without a table, if a sine or nothing plays; false if something else does.
    #[inline(always)]
    pub fn look_ahead_in_sine(&mut self, config: &Config) -> bool {
        let Some(torque_nm) = self.player.next_tick_of_sine() else {
            cold_path();
            return false;
        };
        self.reference = Reference::Torque(torque_nm);
        self.look_at_number(config);
        true
    }

    #[inline(always)]
    fn look_at_number(&mut self, config: &Config) {
        if !self.supervisor.is_due() {
            return;
        }
        cold_path();
        if self.is_playing() && self.guard.over(&self.begin) == self.supervisor.tick() {
            self.end(End::Finished);
            self.supervisor.stop();
            self.supervisor.renew(&config.limits);
        } else {
            self.supervisor.time_out(&config.limits);
        }
    }
}

impl Controller {
    /// A tick in which guard or supervisor may have something to say.
    #[inline(always)]
    fn unusual(&mut self, config: &Config, raw: u32, seen: &Observation) -> (Verdict, Status) {
        let tick = self.supervisor.tick();
        let mut end = End::None;
        let playing = self.is_playing();
        if playing {
            cold_path();
            let (velocity, wanted) = (seen.velocity_rad_s, seen.wanted_nm);
            end = self.guard.look(&self.begin, tick, raw, velocity, wanted);
            if end != End::None {
                self.supervisor.stop();
            }
        }
        let verdict = self.supervisor.unusual(&config.limits, seen);
        let mut flags = 0;
        if playing {
            if verdict.state == State::Fault {
                end = End::Fault;
            }
            if end != End::None {
                cold_path();
                self.end(end);
                if self.begin.tick == tick {
                    // One that ends in the tick in which it begins has been seen to begin.
                    flags = FLAG_EXPERIMENT;
                }
            }
        }
        flags |= self.flags(verdict.drive_enabled);
        let lost = core::mem::take(&mut self.lost);
        let status = Status::new(verdict.state, verdict.limit, verdict.fault, flags);
        if verdict.limit == Limit::Ramp && verdict.torque_nm == 0.0 && !playing {
            // Nothing is asked for until a request comes, so that the ticks until then are usual ones.
            self.supervisor.rest();
            self.usual_status = status;
        }
        (verdict, status.with(lost))
    }

    /// What plays has ended, and does not resume.
    #[inline(always)]
    fn end(&mut self, why: End) {
        self.experiment = (why as u8) << END_SHIFT;
        self.player.silence();
        self.reference = Reference::Torque(0.0);
    }

    /// Takes a request, between two ticks.
    #[inline(always)]
    pub fn ask(&mut self, config: &Config, request: Request) {
        self.supervisor.ask(&config.limits, request);
        match request {
            Request::Stop | Request::Disarm if self.is_playing() => self.end(End::Stopped),
            // Torque may flow from here on.
            Request::Start => self.prepare(config),
            _ => {}
        }
    }

    /// Takes an order, between two ticks. What begins to play brings its first reference, and where none may begin nothing
    /// plays: without a table the tick before it needs no [`Self::look_ahead`].
    #[inline(always)]
    pub fn obey(&mut self, config: &Config, order: &Order) {
        match order {
            Order::Request(request) => self.ask(config, *request),
            Order::Play(first, player, guard) => {
                if !self.supervisor.may_start() {
                    cold_path();
                    // Refused, and counted.
                    self.supervisor.ask(&config.limits, Request::Start);
                    return;
                }
                self.reference = *first;
                self.fed_nm = 0.0;
                self.player = *player;
                self.guard = *guard;
                let raw = self.state.encoder.reading();
                self.begin = guard.begin(self.supervisor.tick(), raw);
                self.supervisor.watch(guard.over(&self.begin));
                self.state.begin_experiment();
                self.supervisor.ask(&config.limits, Request::Start);
                self.experiment = FLAG_EXPERIMENT;
                self.prepare(config);
            }
        }
    }

    /// Goes on with other parameters, before the first step with them.
    #[inline(always)]
    pub fn take_over(&mut self, config: &Config) {
        config.tick.take_over(&mut self.state);
        self.supervisor.renew(&config.limits);
        self.supervisor.rest_no_more();
        self.look_at_number(config);
        self.prepare(config);
    }
}

#[cfg(test)]
mod tests;
