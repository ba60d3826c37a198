//! The other end of the link: what a host with a debug probe does, and an image with its axis to do it to.

use crate::axis::{BenchAxis, Knobs};
use crate::elf::Image;
use crate::machine::{Machine, Stop};
use crate::rtt::Rtt;
use bristle_core::command::{Command, MOST_COMMAND_BYTES, Reply};
use bristle_core::status::Report;
use bristle_core::supervisor::{Fault, State};
use bristle_core::trace::{self, Continuity, Record};
use bristle_core::wire::{Decoder, Kind, MOST_PAYLOAD_BYTES, OVERHEAD_BYTES};
use defmt_decoder::{DecodeError, Table};
use std::cell::RefCell;
use std::io::Write;
use std::rc::Rc;

/// Core cycles of a tick.
pub const TICK_CYCLES: u64 = 17_000;
/// Ticks of a second.
pub const TICKS_PER_S: u64 = 10_000;
/// Ticks between two polls of a probe: a millisecond.
const POLL_TICKS: u64 = 10;
/// Ticks between two keep-alives.
const KEEP_ALIVE_TICKS: u64 = 500;

/// What came over the link.
#[derive(Default)]
pub struct Heard {
    /// Samples, all of them if asked to keep them, else the last.
    pub records: Vec<Record>,
    /// Numbers of the samples.
    pub continuity: Continuity,
    /// The last status.
    pub report: Option<Report>,
    /// Answers to commands.
    pub replies: Vec<(u16, Reply)>,
    /// Frames of a burst: the number of the first sample, and the samples.
    pub bursts: Vec<(u16, Vec<Record>)>,
    /// Lines of the readable trace.
    pub lines: Vec<String>,
    /// Frames of the readable trace that could not be decoded.
    pub bad_lines: u32,
}

/// An image on its axis, with a host.
pub struct Session<'a> {
    /// The chip.
    pub machine: Machine,
    /// The axis.
    pub knobs: Rc<RefCell<Knobs>>,
    /// What came over the link.
    pub heard: Heard,
    /// The host neither reads nor writes.
    pub stalled: bool,
    /// The host sends keep-alives but does not read.
    pub deaf: bool,
    /// The host sends nothing by itself: somebody else does, through [`Session::give`].
    pub quiet: bool,
    /// Keeps every sample, not the last only.
    pub keep: bool,
    /// Takes the bytes of the binary stream as they come; `bristle capture` reads them.
    pub raw: Option<Box<dyn Write>>,
    rtt: Rtt,
    log: Box<dyn defmt_decoder::StreamDecoder + Send + Sync + 'a>,
    frames: Box<Decoder<{ MOST_PAYLOAD_BYTES + OVERHEAD_BYTES }>>,
    next_number: u16,
    kept_alive: u64,
}

impl<'a> Session<'a> {
    /// At power on. The table is that of the image's log lines.
    ///
    /// # Errors
    /// An image that cannot be loaded or has no link.
    pub fn new(image: &Image, table: &'a Table) -> Result<Self, String> {
        let (world, knobs) = BenchAxis::new();
        Ok(Self {
            machine: Machine::new(image, Box::new(world))?,
            knobs,
            heard: Heard::default(),
            stalled: false,
            deaf: false,
            quiet: false,
            keep: true,
            raw: None,
            rtt: Rtt::find(image)?,
            log: table.new_stream_decoder(),
            frames: Box::default(),
            next_number: 0,
            kept_alive: 0,
        })
    }

    /// Ticks that the timer has made since power on.
    pub fn ticks(&mut self) -> u64 {
        self.machine.bus().ticks
    }

    /// Runs a number of ticks of time, with the host at work.
    ///
    /// # Errors
    /// Why the machine stopped.
    pub fn run(&mut self, ticks: u64) -> Result<(), Stop> {
        let end = self.machine.cycles() + ticks * TICK_CYCLES;
        while self.machine.cycles() < end {
            let slice = (self.machine.cycles() + POLL_TICKS * TICK_CYCLES).min(end);
            self.machine.run_until(slice)?;
            self.poll().map_err(Stop::Fault)?;
        }
        Ok(())
    }

    /// Runs until a sample of the trace fits, at most so many ticks; whether one did.
    ///
    /// # Errors
    /// Why the machine stopped.
    pub fn run_until(
        &mut self,
        ticks: u64,
        fits: impl Fn(&Record) -> bool,
    ) -> Result<Option<Record>, Stop> {
        let end = self.machine.cycles() + ticks * TICK_CYCLES;
        let mut looked = self.heard.records.len();
        while self.machine.cycles() < end {
            self.run(POLL_TICKS)?;
            let fresh = self.heard.records.get(looked..).unwrap_or_default();
            if let Some(record) = fresh.iter().find(|r| fits(r)) {
                return Ok(Some(*record));
            }
            looked = self.heard.records.len();
        }
        Ok(None)
    }

    /// What a probe does once a millisecond.
    fn poll(&mut self) -> Result<(), String> {
        if self.stalled || !self.rtt.ready(&self.machine)? {
            return Ok(());
        }
        if !self.deaf {
            self.read()?;
        }
        let ticks = self.ticks();
        if !self.quiet && ticks >= self.kept_alive + KEEP_ALIVE_TICKS {
            self.kept_alive = ticks;
            self.send(&Command::KeepAlive)?;
        }
        Ok(())
    }

    fn read(&mut self) -> Result<(), String> {
        let bytes = self.rtt.up(0).take(&mut self.machine)?;
        self.log.received(&bytes);
        loop {
            match self.log.decode() {
                Ok(frame) => self.heard.lines.push(frame.display_message().to_string()),
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) => self.heard.bad_lines += 1,
            }
        }
        let bytes = self.rtt.up(1).take(&mut self.machine)?;
        if let Some(raw) = &mut self.raw {
            raw.write_all(&bytes)
                .map_err(|e| format!("raw stream: {e}"))?;
        }
        self.take_frames(&bytes);
        Ok(())
    }

    fn take_frames(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let taken = self.frames.feed(bytes);
            bytes = &bytes[taken..];
            while let Some(frame) = self.frames.next_frame() {
                let heard = &mut self.heard;
                match frame.kind {
                    Kind::Samples => {
                        for record in trace::samples(&frame) {
                            heard.continuity.accept(record.tick);
                            if !self.keep {
                                heard.records.clear();
                            }
                            heard.records.push(record);
                        }
                    }
                    Kind::Status => heard.report = Report::read(&frame).or(heard.report),
                    Kind::Reply => heard.replies.extend(Reply::read(&frame)),
                    Kind::Burst => {
                        if let Some((first, samples)) = trace::burst(&frame) {
                            heard.bursts.push((first, samples.collect()));
                        }
                    }
                    Kind::Command => {}
                }
            }
        }
    }

    /// Sends a command and gives its number.
    ///
    /// # Errors
    /// A link that does not take it.
    pub fn send(&mut self, command: &Command) -> Result<u16, String> {
        self.next_number = self.next_number.wrapping_add(1);
        let mut buffer = [0; MOST_COMMAND_BYTES];
        let bytes = command
            .write(self.next_number, &mut buffer)
            .ok_or("command too long")?;
        self.give(bytes)?;
        Ok(self.next_number)
    }

    /// Gives bytes to the image's command channel.
    ///
    /// # Errors
    /// A link that does not take them.
    pub fn give(&mut self, bytes: &[u8]) -> Result<(), String> {
        let down = self.rtt.down(&self.machine, 0)?;
        if down.give(&mut self.machine, bytes)? {
            Ok(())
        } else {
            Err("the link is full".to_owned())
        }
    }

    /// Sends a command and waits for its answer, at most 200 ms.
    ///
    /// # Errors
    /// No answer.
    pub fn ask(&mut self, command: &Command) -> Result<Reply, String> {
        let number = self.send(command)?;
        for _ in 0..200 {
            self.run(POLL_TICKS).map_err(|e| format!("{e:?}"))?;
            if let Some((_, reply)) = self.heard.replies.iter().find(|r| r.0 == number) {
                return Ok(*reply);
            }
        }
        Err(format!("no answer to {command:?}"))
    }

    /// From reset to armed.
    ///
    /// # Errors
    /// It does not get there.
    pub fn arm(&mut self) -> Result<Record, String> {
        let state = |state| move |r: &Record| r.status.state() == Some(state);
        let text = |e: Stop| format!("{e:?}");
        // Boot computes the observers' stability in f64, which the chip does in software: 0.3 s.
        self.run_until(10_000, state(State::Idle))
            .map_err(text)?
            .ok_or("not idle")?;
        self.ask(&Command::Arm)?;
        let armed = self.run_until(1000, state(State::Armed)).map_err(text)?;
        let seen = armed.or_else(|| {
            let all = self.heard.records.iter();
            all.rev().find(|r| state(State::Armed)(r)).copied()
        });
        seen.ok_or_else(|| format!("not armed: {:?}", self.heard.records.last()))
    }

    /// The first sample with a fault at or after a tick.
    pub fn faulted(&self, from: u32) -> Option<(Record, Fault)> {
        self.heard.records.iter().find_map(|r| {
            let fault = r.status.fault().filter(|&f| f != Fault::None)?;
            (r.tick >= from).then_some((*r, fault))
        })
    }
}
