//! The firmware behind a link as a bench, on its board or in the emulator: orders down, every sample up.

use crate::about;
use crate::link::Link;
use crate::target::{accepted, armed, wind_down};
use bristle_core::command::{Changes, Command, PART_POINTS, Reply, TablePart, parameter};
use bristle_core::experiment::{Bounds, Experiment};
use bristle_core::feed_forward::Span;
use bristle_core::supervisor::{Fault, State};
use bristle_gap::believed::Wiring;
use bristle_gap::capture::{About, Capture, Sample};
use bristle_gap::feed_forward::Table;
use bristle_gap::run::{Bench, Phase, Seen, Take};
use bristle_gap::{Believed, InputError, Unit};
use std::convert::Infallible;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Ticks a second of the firmware.
pub const RATE_HZ: f64 = 10_000.0;
/// Time between two looks at what has come.
const LOOK: Duration = Duration::from_millis(20);
/// Time in which a running firmware has sent something, and an order shows.
const PATIENCE: Duration = Duration::from_secs(5);

/// The link, and what came over it.
pub struct Remote {
    name: String,
    link: Link,
    pieces: Receiver<Vec<u8>>,
    capture: Capture,
    /// Samples that came since they were last looked at.
    fresh: Vec<Sample>,
    last: Option<Sample>,
    heard: Instant,
    /// Somebody stands beside the axis who can turn it.
    pub by_hand: bool,
}

impl Remote {
    /// Connects and arms. The firmware must be of the same encoder as `axis`.
    pub fn new(to: &str, answers: Option<&str>, axis: &Believed) -> Result<Self, InputError> {
        check(axis)?;
        let (send, pieces) = channel();
        let mut remote = Self {
            name: to.to_owned(),
            link: Link::new(to, answers, Some(send))?,
            pieces,
            capture: Capture::new(RATE_HZ),
            fresh: Vec::new(),
            last: None,
            heard: Instant::now(),
            by_hand: false,
        };
        // The state, and the form of the link, which comes ten times a second.
        let state = |remote: &Self| remote.link.status().and_then(|status| status.state());
        let begun = Instant::now();
        while matches!(state(&remote), None | Some(State::Boot))
            || remote.capture.summary().report.is_none()
        {
            remote.listen()?;
            if begun.elapsed() > PATIENCE {
                return Err(InputError::new(
                    to,
                    "samples come, but no status of the firmware",
                    "see that all of RTT up channel 1 is served, byte for byte",
                ));
            }
        }
        remote.agrees(axis)?;
        if state(&remote) == Some(State::Idle) {
            accepted("arm", remote.link.ask(&Command::Arm)?)?;
        }
        armed(&mut remote.link)?;
        Ok(remote)
    }

    /// Whether the firmware counts as the axis file says.
    fn agrees(&mut self, axis: &Believed) -> Result<(), InputError> {
        let expected = axis.counts_per_turn;
        let value = self.parameter("counts_per_rev")?;
        if f64::from(value) == expected {
            return Ok(());
        }
        Err(InputError::new(
            &self.name,
            format!("the firmware has {value} counts a turn, and the axis file {expected}"),
            "mend the axis file, or: bristle target counts_per_rev=...",
        ))
    }

    /// Takes what has come, and keeps the firmware alive.
    fn listen(&mut self) -> Result<(), InputError> {
        self.link.listen(LOOK)?;
        let before = self.fresh.len();
        for piece in self.pieces.try_iter() {
            let fresh = &mut self.fresh;
            let taken = self.capture.feed(&piece, |sample| {
                fresh.push(*sample);
                Ok::<(), Infallible>(())
            });
            match taken {
                Ok(()) => {}
            }
        }
        self.last = self.fresh.last().copied().or(self.last);
        if self.fresh.len() > before {
            self.heard = Instant::now();
        } else if self.heard.elapsed() > PATIENCE {
            return Err(InputError::new(
                &self.name,
                format!("no sample within {} s", PATIENCE.as_secs()),
                "see that it serves RTT up channel 1 and that the firmware runs",
            ));
        }
        Ok(())
    }

    /// Changes parameters of the firmware.
    pub fn set(&mut self, changes: &Changes) -> Result<(), InputError> {
        accepted("parameters", self.link.ask(&Command::Set(*changes))?).map(|_| ())
    }

    /// Whether the firmware gives so much torque.
    pub fn gives(&mut self, torque_nm: f64) -> Result<(), InputError> {
        let limit = self.parameter("torque_limit_nm")?;
        if torque_nm as f32 <= limit {
            return Ok(());
        }
        Err(InputError::new(
            format!("--torque-nm {torque_nm}"),
            format!("is more than the firmware's torque_limit_nm, {limit}"),
            format!("give {limit} or less, or raise the limit: bristle target torque_limit_nm=..."),
        ))
    }

    /// Parameters of the firmware as they are, to be set again.
    pub fn get(&mut self, names: &[&str]) -> Result<Changes, InputError> {
        let mut changes = Changes::default();
        for name in names {
            let value = self.parameter(name)?;
            changes.add(parameter(name).unwrap_or(u8::MAX), value);
        }
        Ok(changes)
    }

    /// Has the firmware use a feed-forward table, or none.
    pub fn use_table(&mut self, table: Option<&Table>) -> Result<(), InputError> {
        let ask = |link: &mut Link, command: Command| accepted("table", link.ask(&command)?);
        let Some(table) = table else {
            return ask(&mut self.link, Command::TableDrop).map(|_| ());
        };
        for (backward, torques) in [(false, &table.forward_nm), (true, &table.backward_nm)] {
            for (number, part) in torques.chunks_exact(PART_POINTS).enumerate() {
                let part = TablePart {
                    backward,
                    first: (number * PART_POINTS) as u16,
                    torques_nm: std::array::from_fn(|i| part[i] as f32),
                };
                ask(&mut self.link, Command::TablePut(part))?;
            }
        }
        let span = match table.span {
            Span::Period(period) => Span::Period(period as f32),
            Span::Stroke(from, to) => Span::Stroke(from as f32, to as f32),
        };
        let command = Command::TableUse(span, table.speed_band_rad_s as f32);
        ask(&mut self.link, command).map(|_| ())
    }

    /// Does something without a guess of break-away in the firmware: torque without a count is no fault meanwhile.
    pub fn without_break_away<T>(
        &mut self,
        go: impl FnOnce(&mut Self) -> Result<T, InputError>,
    ) -> Result<T, InputError> {
        let before = self.parameter("stuck_torque_nm")?;
        let limit = self.parameter("torque_limit_nm")?;
        self.set_one("stuck_torque_nm", limit)?;
        let done = go(self);
        // Whatever went wrong before is what the user should hear of.
        let restored = self.set_one("stuck_torque_nm", before);
        done.and_then(|done| restored.map(|()| done))
    }

    /// The parameters that the firmware runs on, by name.
    pub fn parameters(&mut self) -> Result<About, InputError> {
        let mut asked = About::new();
        about::parameters(&mut asked, |command| self.link.ask(command))?;
        Ok(asked)
    }

    fn parameter(&mut self, name: &str) -> Result<f32, InputError> {
        let number = parameter(name).unwrap_or(u8::MAX);
        match self.link.ask(&Command::Get(number))? {
            Reply::Value { value, .. } => Ok(value),
            reply => Err(InputError::new(
                &self.name,
                format!("no value of {name}: {}", accepted(name, reply)?),
                "use firmware and program of the same version",
            )),
        }
    }

    fn set_one(&mut self, name: &str, value: f32) -> Result<(), InputError> {
        let mut changes = Changes::default();
        changes.add(parameter(name).unwrap_or(u8::MAX), value);
        self.set(&changes)
    }

    /// Torque down by a ramp, then the drive away.
    pub fn finish(mut self) -> Result<(), InputError> {
        wind_down(&mut self.link).map(|_| ())
    }
}

/// Whether the firmware can be of this axis at all.
pub fn check(axis: &Believed) -> Result<(), InputError> {
    if axis.unit == Unit::Linear {
        return Err(InputError::new(
            "axis file",
            "is of a linear axis, and the firmware knows rotary ones",
            "give one with inertia_kg_m2, or use --on virtual",
        ));
    }
    if axis.wiring != Wiring::default() {
        return Err(InputError::new(
            "axis file",
            "has a sign of -1, and the firmware has none",
            "swap the encoder's lines A and B, or the sense of the drive, and leave encoder_sign and torque_sign out",
        ));
    }
    if axis.rate_hz != RATE_HZ {
        return Err(InputError::new(
            "axis file",
            format!(
                "has rate_hz = {}, and the firmware runs at {RATE_HZ}",
                axis.rate_hz
            ),
            "write rate_hz = 10000, or leave it out",
        ));
    }
    Ok(())
}

impl Bench for Remote {
    fn play(
        &mut self,
        experiment: &Experiment<f32>,
        bounds: &Bounds<f32>,
        take: &mut Take<'_>,
    ) -> Result<Seen, InputError> {
        accepted(
            "start",
            self.link.ask(&Command::Play(*experiment, *bounds))?,
        )?;
        let asked = Instant::now();
        let mut seen = Seen::default();
        let mut stops = false;
        loop {
            // First of all: what was seen last may be from before the drive was armed.
            self.listen()?;
            for sample in std::mem::take(&mut self.fresh) {
                match seen.sample(&sample, RATE_HZ) {
                    Phase::Over => return Ok(seen),
                    Phase::Plays => {
                        if !take(&sample, None)? && !stops {
                            stops = true;
                            accepted("stop", self.link.ask(&Command::Stop)?)?;
                        }
                    }
                    Phase::Before => {}
                }
            }
            let status = self
                .last
                .map(|sample| sample.record.status)
                .unwrap_or_default();
            if seen.samples == 0
                && (status.state() != Some(State::Armed) || asked.elapsed() > PATIENCE)
            {
                let fault = status.fault().unwrap_or_default();
                let why = if fault == Fault::None {
                    status.state().map_or("unknown", State::text)
                } else {
                    fault.text()
                };
                return Err(InputError::new(
                    &self.name,
                    format!("the experiment does not begin; the firmware says: {why}"),
                    "mend its cause, then: bristle target clear",
                ));
            }
        }
    }

    fn rest(&mut self, ticks: u32, go_on: &dyn Fn() -> bool) -> Result<(), InputError> {
        let time_s = |remote: &Self| remote.last.map_or(0.0, |sample| sample.time_s);
        let until_s = time_s(self) + f64::from(ticks) / RATE_HZ;
        while time_s(self) < until_s && go_on() {
            self.listen()?;
            self.fresh.clear();
        }
        Ok(())
    }

    fn turned_by_hand(
        &mut self,
        turns: f64,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Option<i64>, InputError> {
        if !self.by_hand {
            return Ok(None);
        }
        accepted("disarm", self.link.ask(&Command::Disarm)?)?;
        eprintln!(
            "turn the axis forward by hand, {turns} turns from mark to mark, then press Enter"
        );
        let (done, enter) = channel();
        std::thread::spawn(move || {
            let read = std::io::stdin().read_line(&mut String::new());
            // Who waited may have given up.
            let _ = done.send(read.is_ok());
        });
        self.listen()?;
        let from = self.counts();
        while go_on() && enter.try_recv().is_err() {
            self.listen()?;
            self.fresh.clear();
        }
        let counts = self.counts() - from;
        if !go_on() {
            return Ok(Some(counts));
        }
        accepted("arm", self.link.ask(&Command::Arm)?)?;
        armed(&mut self.link)?;
        Ok(Some(counts))
    }

    fn counts(&self) -> i64 {
        self.last.map_or(0, |sample| sample.counts)
    }
}
