//! The command link to the firmware over RTT servers: orders down channel 0, answers up channel 1.

use crate::source::{connect, plain};
use bristle_core::command::{Command, MOST_COMMAND_BYTES, Reply};
use bristle_core::status::PROTOCOL_VERSION;
use bristle_core::trace::{self, Status};
use bristle_core::wire::{Decoder, Kind, MOST_PAYLOAD_BYTES, OVERHEAD_BYTES, Reader};
use bristle_gap::InputError;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// The firmware drops an armed drive after a second without a command.
const KEEP_ALIVE: Duration = Duration::from_millis(200);
/// Time for an answer. New parameters are checked in software floating point, which takes a third of a second.
const ANSWER: Duration = Duration::from_secs(5);
/// Pause before a busy firmware is asked again.
const AGAIN: Duration = Duration::from_millis(50);

/// What comes up.
enum Heard {
    Reply(u16, Reply),
    Status(Status),
    /// Firmware of another form of the link.
    Foreign(u32),
}

/// A link.
pub struct Link {
    name: String,
    down: TcpStream,
    heard: Receiver<Heard>,
    next_number: u16,
    sent: Instant,
    /// Orders without an answer yet.
    open: u32,
    status: Option<Status>,
}

impl Link {
    /// Connects. Without a server of their own, answers come over the same connection. `pieces` gets everything that
    /// comes, byte for byte.
    pub fn new(
        to: &str,
        answers: Option<&str>,
        pieces: Option<Sender<Vec<u8>>>,
    ) -> Result<Self, InputError> {
        let open = |address: &str| {
            connect(address, &[]).map_err(|error| {
                InputError::new(
                    address,
                    format!("cannot be reached: {}", plain(&error)),
                    "start the RTT server, such as `rtt server start 9091 0` of OpenOCD",
                )
            })
        };
        let down = open(to)?;
        let up = match answers {
            Some(address) => open(address)?,
            None => down.try_clone().map_err(|error| lost(to, &plain(&error)))?,
        };
        let (tell, heard) = channel();
        std::thread::spawn(move || read(up, &tell, pieces.as_ref()));
        Ok(Self {
            name: to.to_owned(),
            down,
            heard,
            // Answers to another run's orders may still be under way.
            next_number: std::process::id() as u16,
            sent: Instant::now(),
            open: 0,
            status: None,
        })
    }

    /// What the last sample said.
    pub fn status(&self) -> Option<Status> {
        self.status
    }

    fn send(&mut self, command: &Command) -> Result<u16, InputError> {
        self.next_number = self.next_number.wrapping_add(1);
        let mut buffer = [0; MOST_COMMAND_BYTES];
        let bytes = command
            .write(self.next_number, &mut buffer)
            .ok_or_else(|| lost(&self.name, "an order is too long for a frame"))?;
        self.down
            .write_all(bytes)
            .map_err(|error| lost(&self.name, &plain(&error)))?;
        // A question or new parameters are no sign of life to the firmware's time-out.
        if !matches!(command, Command::Get(_) | Command::Set(_)) {
            self.sent = Instant::now();
        }
        self.open += 1;
        Ok(self.next_number)
    }

    /// Sends an order and waits for its answer.
    pub fn ask(&mut self, command: &Command) -> Result<Reply, InputError> {
        let until = Instant::now() + ANSWER;
        let mut number = self.send(command)?;
        while Instant::now() < until {
            match self.hear(AGAIN)? {
                Some((answered, Reply::Busy)) if answered == number => {
                    self.listen(AGAIN)?;
                    number = self.send(command)?;
                }
                Some((answered, reply)) if answered == number => return Ok(reply),
                _ => {}
            }
        }
        Err(InputError::new(
            &self.name,
            format!("no answer within {} s", ANSWER.as_secs()),
            "see that it serves RTT down channel 0 and --answers up channel 1; the firmware may still be checking parameters",
        ))
    }

    /// Keeps the firmware alive for a while.
    pub fn listen(&mut self, time: Duration) -> Result<(), InputError> {
        let until = Instant::now() + time;
        while let Some(left) = until.checked_duration_since(Instant::now()) {
            self.hear(left)?;
        }
        Ok(())
    }

    /// Waits for the next answer, sending keep-alives meanwhile.
    fn hear(&mut self, time: Duration) -> Result<Option<(u16, Reply)>, InputError> {
        // Behind an order that takes long one waits already, and more would fill the channel.
        if self.sent.elapsed() >= KEEP_ALIVE && self.open < 2 {
            self.send(&Command::KeepAlive)?;
        }
        match self.heard.recv_timeout(time.min(KEEP_ALIVE)) {
            Ok(Heard::Reply(number, reply)) => {
                self.open = self.open.saturating_sub(1);
                Ok(Some((number, reply)))
            }
            Ok(Heard::Status(status)) => {
                self.status = Some(status);
                Ok(None)
            }
            Ok(Heard::Foreign(version)) => Err(InputError::new(
                &self.name,
                format!(
                    "the firmware speaks form {version} of the link, and this program knows {PROTOCOL_VERSION}"
                ),
                "use firmware and program of the same version",
            )),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(lost(&self.name, "it was closed")),
        }
    }
}

fn lost(name: &str, why: &str) -> InputError {
    InputError::new(
        name,
        format!("the link is lost: {why}"),
        "an armed firmware takes the torque down by itself after its time-out",
    )
}

/// Tells of every answer and every change of status.
fn read(mut up: TcpStream, tell: &Sender<Heard>, pieces: Option<&Sender<Vec<u8>>>) {
    let mut frames = Box::new(Decoder::<{ MOST_PAYLOAD_BYTES + OVERHEAD_BYTES }>::new());
    let mut buffer = vec![0; 1 << 14];
    let mut last = None;
    loop {
        let count = match up.read(&mut buffer) {
            Ok(0) | Err(_) => return,
            Ok(count) => count,
        };
        let mut bytes = buffer.get(..count).unwrap_or_default();
        if let Some(pieces) = pieces
            && pieces.send(bytes.to_vec()).is_err()
        {
            return;
        }
        while !bytes.is_empty() {
            let taken = frames.feed(bytes);
            bytes = bytes.get(taken..).unwrap_or_default();
            while let Some(frame) = frames.next_frame() {
                let heard = match frame.kind {
                    Kind::Reply => Reply::read(&frame).map(|(n, reply)| Heard::Reply(n, reply)),
                    Kind::Samples => {
                        let status = trace::samples(&frame).last().map(|record| record.status);
                        let changed = status.filter(|_| status != last);
                        last = status.or(last);
                        changed.map(Heard::Status)
                    }
                    Kind::Status => Reader(frame.payload)
                        .u32()
                        .filter(|&version| version != PROTOCOL_VERSION)
                        .map(Heard::Foreign),
                    Kind::Command | Kind::Burst => None,
                };
                if let Some(heard) = heard
                    && tell.send(heard).is_err()
                {
                    return;
                }
            }
        }
    }
}
