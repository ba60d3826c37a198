//! The stream through a debug probe, by the probe-rs library. The core runs on: memory is read beside it.

use crate::source::interrupted;
use bristle_gap::InputError;
use probe_rs::probe::DebugProbeSelector;
use probe_rs::probe::list::Lister;
use probe_rs::rtt::{self, Rtt, ScanRegion, try_attach_to_rtt};
use probe_rs::{Permissions, Session};
use std::io::{self, Read};
use std::time::Duration;

/// Up channel of the binary stream.
const CHANNEL: usize = 1;
/// Pause where nothing has come: the firmware sends every millisecond, and its buffer holds fifty.
const PAUSE: Duration = Duration::from_millis(2);
/// Time for the firmware to set its buffers up after a reset.
const BOOT: Duration = Duration::from_secs(3);

/// Attaches to the running firmware. An empty selector takes the one probe that is there.
pub fn open(selector: &str, chip: &str) -> Result<Box<dyn Read + Send>, InputError> {
    let fail = |message: String, remedy: &str| InputError::new("probe", message, remedy);
    let wanted = match selector {
        "" => None,
        text => Some(text.parse::<DebugProbeSelector>().map_err(|error| {
            fail(
                causes(&error),
                "give --probe VID:PID or --probe VID:PID:SERIAL, in hexadecimal",
            )
        })?),
    };
    let found = Lister::new().list(wanted.as_ref());
    let info = match found.as_slice() {
        [] => {
            return Err(fail(
                "no debug probe found".to_owned(),
                "connect the board's ST-Link by USB, and on Linux install the udev rules of probe-rs",
            ));
        }
        [one] => one,
        several => {
            let names: Vec<String> = several.iter().map(ToString::to_string).collect();
            return Err(fail(
                format!("{} probes: {}", several.len(), names.join(", ")),
                "say which by --probe VID:PID:SERIAL",
            ));
        }
    };
    let probe = info.open().map_err(|error| {
        fail(
            causes(&error),
            "end the other program that uses the probe, and look at its USB permissions",
        )
    })?;
    let mut session = probe
        .attach(chip, Permissions::default())
        .map_err(|error| fail(causes(&error), "see that the board has power, and --chip"))?;
    let mut rtt = attach(&mut session).map_err(|error| {
        fail(
            causes(&error),
            "flash the firmware first: cargo xtask flash",
        )
    })?;
    // What waits there is old: from the moment that the last reader left.
    drop_old(&mut session, &mut rtt)
        .map_err(|error| fail(causes(&error), "see that the board has power"))?;
    Ok(Box::new(Stream { session, rtt }))
}

fn attach(session: &mut Session) -> Result<Rtt, rtt::Error> {
    try_attach_to_rtt(&mut session.core(0)?, BOOT, &ScanRegion::Ram)
}

fn drop_old(session: &mut Session, rtt: &mut Rtt) -> Result<(), rtt::Error> {
    let mut core = session.core(0)?;
    let channel = rtt
        .up_channel(CHANNEL)
        .ok_or(rtt::Error::MissingChannel(CHANNEL))?;
    let mut old = vec![0; channel.buffer_size()];
    channel.read(&mut core, &mut old).map(|_| ())
}

/// An error with its causes, in one line.
fn causes(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut next = error.source();
    while let Some(error) = next {
        text.push_str(": ");
        text.push_str(&error.to_string());
        next = error.source();
    }
    text.lines().next().unwrap_or_default().to_owned()
}

struct Stream {
    session: Session,
    rtt: Rtt,
}

impl Stream {
    fn poll(&mut self, buffer: &mut [u8]) -> Result<usize, rtt::Error> {
        let channel = self
            .rtt
            .up_channel(CHANNEL)
            .ok_or(rtt::Error::MissingChannel(CHANNEL))?;
        channel.read(&mut self.session.core(0)?, buffer)
    }
}

impl Read for Stream {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let fail = |error: rtt::Error| io::Error::other(causes(&error));
        while !interrupted() {
            match self.poll(buffer) {
                Ok(0) => std::thread::sleep(PAUSE),
                Ok(count) => return Ok(count),
                // The chip was reset, and its buffers are new.
                Err(rtt::Error::ReadPointerChanged | rtt::Error::ControlBlockCorrupted(_)) => {
                    self.rtt = attach(&mut self.session).map_err(fail)?;
                }
                Err(error) => return Err(fail(error)),
            }
        }
        Ok(0)
    }
}
