//! The emulator of `host-tests/image` as a program of its own, which runs the firmware's image in real time.

use bristle_gap::InputError;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// Ends with this value.
pub struct Emulator {
    child: Child,
    /// Where it serves both directions, HOST:PORT.
    pub address: String,
}

impl Emulator {
    /// Starts it on an image for so many seconds at most.
    pub fn start(program: &Path, firmware: &Path, seconds: u64) -> Result<Self, InputError> {
        for (path, remedy) in [
            (
                program,
                "build it with `cargo build --release --package bristle-image --bin emulate`, or name \
                 another by --emulator",
            ),
            (
                firmware,
                "build it with `cargo xtask build-firmware`, or name another by --firmware",
            ),
        ] {
            if !path.is_file() {
                return Err(InputError::new(path, "there is no such file", remedy));
            }
        }
        let mut command = Command::new(program);
        command
            .arg(firmware)
            .arg("tcp:127.0.0.1:0")
            .arg(seconds.to_string())
            .stdin(Stdio::null())
            .stdout(Stdio::piped());
        // Ctrl-C in a terminal goes to a whole group; this one has to live until the torque is down.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let child = command.spawn().map_err(|error| {
            InputError::new(
                program,
                format!("cannot be started: {error}"),
                "see that it is a program for this machine",
            )
        })?;
        let mut emulator = Self {
            child,
            address: String::new(),
        };
        emulator.listen(program)?;
        Ok(emulator)
    }

    /// Until it says where it serves, or has ended.
    fn listen(&mut self, program: &Path) -> Result<(), InputError> {
        let mut line = String::new();
        if let Some(said) = self.child.stdout.take() {
            // What cannot be read says nothing, and is told below.
            let _ = BufReader::new(said).read_line(&mut line);
        }
        self.address = line
            .trim_end()
            .strip_prefix("serving tcp:")
            .ok_or_else(|| {
                InputError::new(
                    program,
                    "does not say where it serves",
                    "run it by hand to see why: emulate FIRMWARE.elf tcp:127.0.0.1:9090 10",
                )
            })?
            .to_owned();
        Ok(())
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
