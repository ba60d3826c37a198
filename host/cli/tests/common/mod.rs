//! `bristle serve`: the virtual axis behind a link, as the firmware is.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

/// Time in which it is there, on machines that build beside.
const PATIENCE: Duration = Duration::from_secs(60);
/// Ports that are tried: one that was free may be taken by another test before the server listens.
const PORTS: usize = 5;

/// Ends with this value.
pub struct Server {
    child: Child,
    /// HOST:PORT.
    pub address: String,
}

impl Server {
    pub fn start(axis: &Path) -> Self {
        (0..PORTS)
            .find_map(|_| Self::at_free_port(axis))
            .expect("a port that stays free")
    }

    /// None where the server could not listen.
    fn at_free_port(axis: &Path) -> Option<Self> {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = free.local_addr().unwrap().to_string();
        drop(free);
        let mut child = Command::new(env!("CARGO_BIN_EXE_bristle"))
            .args(["serve", "--at", &address, "--axis"])
            .arg(axis)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let said = BufReader::new(child.stdout.take().unwrap());
        let (tell, told) = mpsc::channel();
        // Reads on, so that the server can say what it likes.
        std::thread::spawn(move || {
            said.lines()
                .map_while(Result::ok)
                .try_for_each(|line| tell.send(line))
        });
        let server = Self { child, address };
        // It says so once it listens, or ends.
        match told.recv_timeout(PATIENCE) {
            Ok(line) => {
                assert!(line.starts_with("serving "), "{line}");
                Some(server)
            }
            Err(mpsc::RecvTimeoutError::Disconnected) => None,
            Err(mpsc::RecvTimeoutError::Timeout) => panic!("it neither listens nor ends"),
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
