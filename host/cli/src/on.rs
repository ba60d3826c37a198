//! What a command runs on: the virtual axis, the emulated firmware or the board.

use crate::about;
use crate::image::Emulator;
use crate::output::short;
use crate::source;
use bristle_gap::InputError;
use bristle_gap::capture::About;
use clap::ValueEnum;
use std::path::{Path, PathBuf};

/// Where `cargo` puts the emulator and the firmware, from the root of the sources.
pub const EMULATOR: &str = "target/release/emulate";
pub const FIRMWARE: &str = "firmware/target/thumbv7em-none-eabihf/release/bristle-firmware";

/// On what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum On {
    /// The simulated axis of the axis file.
    Virtual,
    /// The firmware's image in the emulator, on the axis of axes/bench.toml.
    Image,
    /// The firmware on its board, through RTT servers.
    Target,
}

impl On {
    /// Its name on the command line.
    pub fn name(self) -> String {
        self.to_possible_value()
            .map_or(String::new(), |value| value.get_name().to_owned())
    }
}

/// What it is, and how to reach it.
#[derive(clap::Args)]
pub struct Place {
    /// On what.
    #[arg(long, value_enum, default_value_t = On::Virtual)]
    pub on: On,
    /// With --on target: server of RTT down channel 0, tcp:HOST:PORT.
    #[arg(long, value_name = "SERVER", value_parser = source::tcp)]
    to: Option<String>,
    /// With --on target: server of RTT up channel 1, where that is another one.
    #[arg(long, value_name = "SERVER", value_parser = source::tcp)]
    answers: Option<String>,
    /// The firmware's image: what --on image runs, and whose hash a log in MCAP has.
    #[arg(long, value_name = "FILE")]
    firmware: Option<PathBuf>,
    /// With --on image: the emulator.
    #[arg(long, value_name = "FILE", default_value = EMULATOR)]
    emulator: PathBuf,
}

impl Place {
    /// Options that belong together.
    pub fn consistent(&self) -> Result<(), InputError> {
        if self.on == On::Target {
            return match self.to {
                Some(_) => Ok(()),
                None => Err(InputError::new(
                    "--on target",
                    "needs the server of the board's link",
                    "give --to tcp:HOST:PORT, such as OpenOCD's `rtt server start 9091 0`",
                )),
            };
        }
        only(self.to.is_some(), "--to", "target")?;
        only(self.answers.is_some(), "--answers", "target")
    }

    /// Server of the orders.
    pub fn to(&self) -> &str {
        self.to.as_deref().unwrap_or_default()
    }

    /// Server of the answers, where that is another one.
    pub fn answers(&self) -> Option<&str> {
        self.answers.as_deref()
    }

    /// Starts the emulator for so many seconds at most.
    pub fn emulator(&self, seconds: u64) -> Result<Emulator, InputError> {
        Emulator::start(&self.emulator, self.firmware(), seconds)
    }

    /// What a log says of the firmware that it came from, where that is known.
    pub fn describe(&self, about: &mut About) -> Result<(), InputError> {
        let image = self.firmware();
        // The emulator says what is wrong with an image that is not there.
        if self.firmware.is_some() || (self.on == On::Image && image.is_file()) {
            about::firmware(about, image)?;
        }
        Ok(())
    }

    /// The image to run.
    fn firmware(&self) -> &Path {
        self.firmware.as_deref().unwrap_or(Path::new(FIRMWARE))
    }
}

/// Asks whether a real axis may move; what is no yes, an end of input too, is a no.
pub fn may_move(torque: &str, travel_rad: f64) -> bool {
    eprint!(
        "the axis will move: {torque}, up to {} rad either way. Is nobody in its reach, and a stop at hand? [y/N] ",
        short(travel_rad)
    );
    let mut answer = String::new();
    let read = std::io::stdin().read_line(&mut answer);
    read.is_ok() && matches!(answer.trim().to_lowercase().as_str(), "y" | "yes")
}

/// Refuses an option that is for another place.
pub fn only(given: bool, option: &str, on: &str) -> Result<(), InputError> {
    if given {
        Err(InputError::new(
            option,
            format!("is for --on {on} only"),
            "leave it out",
        ))
    } else {
        Ok(())
    }
}
