//! Commands from the host: read, checked, answered; what concerns the tick is handed to it.
//!
//! Runs in the executor's thread, below everything else. Building observers from new parameters takes long (their
//! stability check works in f64), and nothing waits for it.

use bristle_core::burst::BURST_SAMPLES;
use bristle_core::command::{Changes, Command, MOST_COMMAND_BYTES, Reply};
use bristle_core::observer::luenberger::BuildError;
use bristle_core::order::Order;
use bristle_core::parameters::Parameters;
use bristle_core::supervisor::Request;
use bristle_core::wire::Decoder;
use core::sync::atomic::Ordering;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

use crate::exchange::News;
use crate::link::send;
use crate::rtt::Down;
use crate::trace::PARAMETER_VERSION;
use crate::{burst, exchange, timing};

/// Signalled by the spare interrupt, every millisecond.
pub static WAKE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// The command task's state.
pub struct Commands {
    link: Down,
    news: exchange::NewsIn,
    parameters: Parameters,
}

impl Commands {
    /// With the parameters that the tick started on.
    pub fn new(link: Down, news: exchange::NewsIn, parameters: Parameters) -> Self {
        Self {
            link,
            news,
            parameters,
        }
    }

    /// Follows commands for ever.
    pub async fn run(mut self) -> ! {
        let mut decoder = Decoder::<MOST_COMMAND_BYTES>::new();
        let mut bytes = [0; 64];
        loop {
            WAKE.wait().await;
            loop {
                let count = self.link.read(&mut bytes);
                let mut rest = bytes.get(..count).unwrap_or_default();
                if rest.is_empty() {
                    break;
                }
                while !rest.is_empty() {
                    let taken = decoder.feed(rest);
                    rest = rest.get(taken..).unwrap_or_default();
                    while let Some(frame) = decoder.next_frame() {
                        let (number, command) = Command::read(&frame);
                        let reply = match command {
                            Some(command) => self.follow(command).await,
                            None => Reply::Malformed,
                        };
                        let mut buffer = [0; MOST_COMMAND_BYTES];
                        if let Some(bytes) = reply.write(number, &mut buffer) {
                            send(bytes);
                        }
                    }
                }
            }
        }
    }

    async fn follow(&mut self, command: Command) -> Reply {
        let order = match command {
            Command::KeepAlive => Order::Request(Request::KeepAlive),
            Command::Arm => Order::Request(Request::Arm),
            Command::Disarm => Order::Request(Request::Disarm),
            Command::Stop => Order::Request(Request::Stop),
            Command::ClearFault => Order::Request(Request::ClearFault),
            Command::Play(experiment, bounds) => {
                let limits = self.parameters.limits(timing::TICK_S);
                match bounds.admit(&experiment, &limits, timing::TICK_S) {
                    Ok(()) => {
                        let rad_per_count = self.parameters.rad_per_count();
                        Order::play(experiment, &bounds, timing::TICK_S, rad_per_count)
                    }
                    Err(refusal) => return Reply::Refused(refusal),
                }
            }
            Command::Set(changes) => return self.set(&changes).await,
            Command::BurstArm(setting) => {
                return if burst::with(|burst| burst.arm(setting)) {
                    burst::reply()
                } else {
                    Reply::BurstRefused {
                        most: BURST_SAMPLES as u16,
                    }
                };
            }
            Command::BurstFire => {
                burst::with(|burst| burst.fire());
                return burst::reply();
            }
            Command::BurstStage => return burst::reply(),
            Command::BurstRead(first) => {
                burst::read(first);
                return burst::reply();
            }
            Command::TablePut(part) => {
                let first = usize::from(part.first);
                let put = exchange::free_table().put(part.backward, first, &part.torques_nm);
                return if put { accepted() } else { Reply::Malformed };
            }
            Command::TableUse(span, speed_band_rad_s) => {
                let table = exchange::free_table();
                return match table.lay(span, speed_band_rad_s) {
                    Ok(()) => {
                        exchange::use_table(Some(table));
                        accepted()
                    }
                    Err(error) => {
                        defmt::warn!("{=str} must be {=str}", error.name, error.must_be);
                        Reply::Inconsistent
                    }
                };
            }
            Command::TableDrop => {
                exchange::use_table(None);
                return accepted();
            }
            Command::Get(parameter) => {
                return match self.parameters.get(parameter) {
                    Some(value) => Reply::Value { parameter, value },
                    None => Reply::Malformed,
                };
            }
        };
        if self.news.put(News::Order(order)) {
            accepted()
        } else {
            Reply::Busy
        }
    }

    /// Takes all changes or none. Answers when the tick runs on them.
    async fn set(&mut self, changes: &Changes) -> Reply {
        let parameters = match changes.apply(&self.parameters) {
            Ok(parameters) => parameters,
            Err(reply) => return reply,
        };
        let config = match parameters.build(timing::TICK_S, timing::OUTPUT_DELAY_SAMPLES) {
            Ok(config) => config,
            Err(error) => {
                if let BuildError::Parameter(error) = &error {
                    defmt::warn!("{=str} must be {=str}", error.name, error.must_be);
                }
                return Reply::to_parameters(&error);
            }
        };
        if !exchange::offer(&mut self.news, &config) {
            return Reply::Busy;
        }
        while exchange::offer_is_pending() {
            WAKE.wait().await;
        }
        self.parameters = parameters;
        PARAMETER_VERSION.fetch_add(1, Ordering::Relaxed);
        accepted()
    }
}

fn accepted() -> Reply {
    Reply::Accepted {
        parameter_version: PARAMETER_VERSION.load(Ordering::Relaxed),
    }
}
