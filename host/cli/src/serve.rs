//! `bristle serve`: the virtual axis behind a link, as the firmware is: the same frames up, the same commands down.

use crate::output;
use crate::setup::{Real, Setup};
use crate::source::{self, plain};
use bristle_core::burst::{BURST_SAMPLES, Burst};
use bristle_core::command::{Command, MOST_COMMAND_BYTES, Reply};
use bristle_core::control::BANDWIDTH_RAD_S;
use bristle_core::controller::{Controller, Input};
use bristle_core::feed_forward::FeedForward;
use bristle_core::observer::luenberger::BuildError;
use bristle_core::order::Order;
use bristle_core::parameters::{BENCH, Config, Parameters};
use bristle_core::status::{PROTOCOL_VERSION, Report};
use bristle_core::supervisor::Request;
use bristle_core::trace::{self, MOST_SAMPLES};
use bristle_core::wire::Decoder;
use bristle_gap::believed::Noise;
use bristle_gap::{Believed, InputError, Unit};
use bristle_plant::axis::Axis;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Ticks of a frame: a millisecond, as the firmware sends them.
const FRAME_TICKS: u64 = 10;
/// Frames between two status frames.
const STATUS_FRAMES: u64 = 100;

/// Serve the virtual axis over TCP, in real time, as an RTT server serves the firmware.
///
/// `bristle target`, `run --on target`, `scope --on target`, `capture --from` and `commission --on target` then work on
/// it, with no board. It boots anew for every client, one at a time.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  bristle serve --axis axes/bench.toml --at 127.0.0.1:9090 &\n  bristle scope --on target \
                        --to tcp:127.0.0.1:9090 --axis axes/bench.toml"
)]
pub struct Args {
    /// Axis file; the built-in bench axis where left out.
    #[arg(long, value_name = "FILE")]
    axis: Option<PathBuf>,
    /// Where to listen; with port 0 where a port is free, which the first line says.
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:9090")]
    at: String,
    #[command(flatten)]
    real: Real,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let setup = Setup::new(args.axis.as_ref())?;
    let real = args.real.axis(&setup.believed)?;
    let served = Served::new(&setup.believed, &real, args.real.noise(), args.real.seed())?;
    let (listener, address) = TcpListener::bind(&args.at)
        .and_then(|listener| listener.local_addr().map(|at| (listener, at)))
        .map_err(|error| {
            InputError::new(
                &args.at,
                format!("cannot be listened at: {}", plain(&error)),
                "give a HOST:PORT that is free",
            )
        })?;
    source::catch_interrupts();
    output::print(&format!("serving {} at tcp:{address}\n", setup.name));
    // So that Ctrl-C is heard between clients too.
    let set = listener.set_nonblocking(true);
    while set.is_ok() && !source::interrupted() {
        match listener.accept() {
            Ok((client, _)) => served.serve(client)?,
            Err(_) => std::thread::sleep(Duration::from_millis(50)),
        }
    }
    Ok(())
}

/// What is served.
pub struct Served {
    real: Believed,
    parameters: Parameters,
    noise: Noise,
    seed: u64,
    rate_hz: f64,
}

impl Served {
    /// The controller believes in `believed`, the axis is `real`.
    pub fn new(
        believed: &Believed,
        real: &Believed,
        noise: Noise,
        seed: u64,
    ) -> Result<Self, InputError> {
        if believed.unit == Unit::Linear {
            return Err(InputError::new(
                "axis file",
                "is of a linear axis, and the firmware's link knows rotary ones",
                "give one with inertia_kg_m2, or use `bristle run`",
            ));
        }
        let served = Self {
            real: real.clone(),
            parameters: parameters(believed)?,
            noise,
            seed,
            rate_hz: believed.rate_hz,
        };
        // Before anybody connects: what cannot be built is said now.
        served.axis()?;
        Ok(served)
    }

    /// Serves one client, from boot until it goes or Ctrl-C.
    pub fn serve(&self, link: TcpStream) -> Result<(), InputError> {
        let config = build(&self.parameters, self.rate_hz).map_err(|error| refused(&error))?;
        let mut axis = self.axis()?;
        let mut session = Session {
            controller: Controller::new(&config, axis.reading().raw(), false),
            config,
            parameters: self.parameters,
            version: 0,
            rate_hz: self.rate_hz,
            orders: Vec::new(),
            burst: Box::new(Burst::new()),
            free_table: Box::new(FeedForward::EMPTY),
            table: None,
        };
        // A client that goes is no error.
        let _ = session.run(link, &mut axis);
        Ok(())
    }

    fn axis(&self) -> Result<Axis, InputError> {
        let model = self.real.model;
        self.real
            .axis(model, 1.0 / self.rate_hz, self.noise, self.seed)
    }
}

fn build(parameters: &Parameters, rate_hz: f64) -> Result<Config, BuildError> {
    parameters.build((1.0 / rate_hz) as f32, 1)
}

fn refused(error: &BuildError) -> InputError {
    InputError::new(
        "axis file",
        error.to_string(),
        "correct it: the firmware would refuse it too",
    )
}

/// What the firmware would run on for this axis; what the file does not say is as in the firmware's image.
fn parameters(axis: &Believed) -> Result<Parameters, InputError> {
    let single = |value: f64| value as f32;
    let limit = axis.drive.torque_limit_nm.unwrap_or(3.5 * axis.stiction_nm);
    let mut parameters = Parameters {
        inertia_kg_m2: single(axis.whole_inertia_kg_m2()),
        counts_per_rev: single(axis.counts_per_turn),
        coulomb_nm: single(axis.coulomb_nm),
        stiction_nm: single(axis.stiction_nm),
        stribeck_velocity_rad_s: single(axis.stribeck_velocity_rad_s),
        stiffness_nm_rad: single(axis.stiffness_nm_rad),
        damping_nm_s_rad: single(axis.damping_nm_s_rad),
        viscous_nm_s_rad: single(axis.viscous_nm_s_rad),
        breakaway_ratio: single(axis.breakaway_ratio),
        l1_1_s: single(axis.l1_1_s.unwrap_or(0.1 * axis.rate_hz)),
        l2: single(axis.l2),
        offset_nm: single(axis.offset_nm()),
        drive_lag_s: single(axis.drive.lag_s),
        full_scale_nm: single(1.1 * limit),
        torque_limit_nm: single(limit),
        slew_limit_nm_s: single(1000.0 * limit),
        ramp_nm_s: single(10.0 * limit),
        max_speed_rad_s: single(axis.speed_limit_rad_s),
        stuck_torque_nm: single(1.2 * axis.stiction_nm + axis.offset_nm().abs()),
        velocity_gain_nm_s_rad: single(BANDWIDTH_RAD_S * axis.whole_inertia_kg_m2()),
        ..BENCH
    };
    match build(&parameters, axis.rate_hz) {
        Ok(_) => Ok(parameters),
        Err(BuildError::Gain(error)) if axis.l1_1_s.is_none() && error.nearest.is_some() => {
            parameters.l1_1_s = single(error.nearest.unwrap_or_default());
            build(&parameters, axis.rate_hz).map_err(|error| refused(&error))?;
            Ok(parameters)
        }
        Err(error) => Err(refused(&error)),
    }
}

/// A client's.
struct Session {
    controller: Controller,
    config: Config,
    parameters: Parameters,
    version: u32,
    rate_hz: f64,
    orders: Vec<Order>,
    burst: Box<Burst<BURST_SAMPLES>>,
    /// The table that is being filled, and the one in use.
    free_table: Box<FeedForward<f32>>,
    table: Option<Box<FeedForward<f32>>>,
}

impl Session {
    fn run(&mut self, mut link: TcpStream, axis: &mut Axis) -> std::io::Result<()> {
        let mut frames = Decoder::<MOST_COMMAND_BYTES>::new();
        let mut buffer = [0; 1024];
        let begun = Instant::now();
        let mut out = Vec::new();
        for number in 0_u64.. {
            if source::interrupted() {
                return Ok(());
            }
            out.clear();
            link.set_nonblocking(true)?;
            match link.read(&mut buffer) {
                Ok(0) => return Ok(()),
                Ok(count) => self.hear(
                    &mut frames,
                    buffer.get(..count).unwrap_or_default(),
                    &mut out,
                ),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(error) => return Err(error),
            }
            link.set_nonblocking(false)?;
            self.frame(axis, &mut out);
            if number % STATUS_FRAMES == 0 {
                self.status(&mut out);
            }
            link.write_all(&out)?;
            let due = (number + 1) as f64 * FRAME_TICKS as f64 / self.rate_hz;
            std::thread::sleep(Duration::from_secs_f64(due).saturating_sub(begun.elapsed()));
        }
        Ok(())
    }

    /// Runs the ticks of a frame.
    fn frame(&mut self, axis: &mut Axis, out: &mut Vec<u8>) {
        let mut buffer = [0; 1024];
        let mut frame = trace::begin(&mut buffer);
        for _ in 0..FRAME_TICKS {
            let input = Input {
                raw: axis.reading().raw(),
                ..Input::default()
            };
            if !self.orders.is_empty() {
                let order = self.orders.remove(0);
                self.controller.obey(&self.config, &order);
            }
            let table = self.table.as_deref();
            let output = self.controller.step_with(&self.config, table, &input);
            axis.advance(f64::from(output.torque_nm));
            self.burst.take(&output.record);
            trace::put(&mut frame, &output.record);
        }
        out.extend_from_slice(frame.finish(FRAME_TICKS as u8).unwrap_or_default());
    }

    fn status(&self, out: &mut Vec<u8>) {
        let report = Report {
            protocol_version: PROTOCOL_VERSION,
            tick: self.controller.supervisor().tick(),
            parameter_version: self.version,
            rejected: self.controller.rejected(),
            requests_refused: self.controller.supervisor().refused(),
            ..Report::default()
        };
        let mut buffer = [0; 128];
        out.extend_from_slice(report.write(&mut buffer).unwrap_or_default());
    }

    fn hear(
        &mut self,
        frames: &mut Decoder<MOST_COMMAND_BYTES>,
        mut bytes: &[u8],
        out: &mut Vec<u8>,
    ) {
        while !bytes.is_empty() {
            let taken = frames.feed(bytes);
            bytes = bytes.get(taken..).unwrap_or_default();
            while let Some(frame) = frames.next_frame() {
                let (number, command) = Command::read(&frame);
                if let Some(Command::BurstRead(first)) = command {
                    self.read_burst(first, out);
                }
                let reply = command.map_or(Reply::Malformed, |command| self.follow(command));
                let mut buffer = [0; MOST_COMMAND_BYTES];
                out.extend_from_slice(reply.write(number, &mut buffer).unwrap_or_default());
            }
        }
    }

    fn follow(&mut self, command: Command) -> Reply {
        let order = match command {
            Command::KeepAlive => Order::Request(Request::KeepAlive),
            Command::Arm => Order::Request(Request::Arm),
            Command::Disarm => Order::Request(Request::Disarm),
            Command::Stop => Order::Request(Request::Stop),
            Command::ClearFault => Order::Request(Request::ClearFault),
            Command::Play(experiment, bounds) => {
                match bounds.admit(&experiment, &self.config.limits, self.config.tick_s) {
                    Ok(()) => self.config.play(experiment, &bounds),
                    Err(refusal) => return Reply::Refused(refusal),
                }
            }
            Command::Set(changes) => {
                return match changes.apply(&self.parameters) {
                    Ok(parameters) => self.set(parameters),
                    Err(reply) => reply,
                };
            }
            Command::BurstArm(setting) => {
                return if self.burst.arm(setting) {
                    Reply::to_burst(&self.burst)
                } else {
                    Reply::BurstRefused {
                        most: BURST_SAMPLES as u16,
                    }
                };
            }
            Command::BurstFire => {
                self.burst.fire();
                return Reply::to_burst(&self.burst);
            }
            Command::BurstStage | Command::BurstRead(_) => return Reply::to_burst(&self.burst),
            Command::TablePut(part) => {
                let first = usize::from(part.first);
                let put = self.free_table.put(part.backward, first, &part.torques_nm);
                return if put {
                    self.accepted()
                } else {
                    Reply::Malformed
                };
            }
            Command::TableUse(span, speed_band_rad_s) => {
                if self.free_table.lay(span, speed_band_rad_s).is_err() {
                    return Reply::Inconsistent;
                }
                let empty = Box::new(FeedForward::EMPTY);
                self.table = Some(std::mem::replace(&mut self.free_table, empty));
                return self.accepted();
            }
            Command::TableDrop => {
                self.table = None;
                return self.accepted();
            }
            Command::Get(parameter) => {
                return match self.parameters.get(parameter) {
                    Some(value) => Reply::Value { parameter, value },
                    None => Reply::Malformed,
                };
            }
        };
        self.orders.push(order);
        self.accepted()
    }

    /// Takes all changes or none.
    fn set(&mut self, parameters: Parameters) -> Reply {
        match build(&parameters, self.rate_hz) {
            Ok(config) => {
                self.config = config;
                self.controller.take_over(&self.config);
                self.parameters = parameters;
                self.version += 1;
                self.accepted()
            }
            Err(error) => Reply::to_parameters(&error),
        }
    }

    /// The samples of the burst from a number on, as many as a frame holds.
    fn read_burst(&self, first: u16, out: &mut Vec<u8>) {
        let mut buffer = [0; 1024];
        let mut frame = trace::begin_burst(&mut buffer, first);
        let mut count = 0;
        let samples = usize::from(first)..self.burst.samples();
        for record in samples
            .filter_map(|number| self.burst.sample(number))
            .take(MOST_SAMPLES)
        {
            trace::put(&mut frame, record);
            count += 1;
        }
        out.extend_from_slice(frame.finish(count).unwrap_or_default());
    }

    fn accepted(&self) -> Reply {
        Reply::Accepted {
            parameter_version: self.version,
        }
    }
}
