//! The emulator of `host-tests/image` as a program of its own, which runs the firmware's image in real time.

use bristle_gap::InputError;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Time in which it is there.
const BEGINS: Duration = Duration::from_secs(20);

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
        let address = free_address()?;
        let mut command = Command::new(program);
        command
            .arg(firmware)
            .arg(format!("tcp:{address}"))
            .arg(seconds.to_string())
            .stdin(Stdio::null())
            .stdout(Stdio::null());
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
        let mut emulator = Self { child, address };
        emulator.wait(program)?;
        Ok(emulator)
    }

    /// Until it listens. A connection that is dropped again does not disturb it.
    fn wait(&mut self, program: &Path) -> Result<(), InputError> {
        let until = Instant::now() + BEGINS;
        while TcpStream::connect(&self.address).is_err() {
            let ended = self.child.try_wait().ok().flatten();
            if ended.is_some() || Instant::now() > until {
                let why = ended.map_or("does not answer".to_owned(), |status| {
                    format!("ended: {status}")
                });
                return Err(InputError::new(
                    program,
                    why,
                    "run it by hand to see why: emulate FIRMWARE.elf tcp:127.0.0.1:9090 10",
                ));
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(())
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A port that nobody uses now.
fn free_address() -> Result<String, InputError> {
    TcpListener::bind("127.0.0.1:0")
        .and_then(|listener| listener.local_addr())
        .map(|address| address.to_string())
        .map_err(|error| {
            InputError::new(
                "127.0.0.1",
                format!("no port is free: {error}"),
                "end what holds them",
            )
        })
}
