//! `bristle serve`: the virtual axis behind a link, as the firmware is.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

/// Ports that are tried: one that was free may be taken by another test before the server listens.
const PORTS: usize = 5;

/// Ends with this value.
pub struct Server {
    child: Child,
    /// What it says; without a reader it could not.
    _said: BufReader<ChildStdout>,
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
        let mut said = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        // It says so once it listens, or ends.
        said.read_line(&mut line).unwrap();
        if line.starts_with("serving ") {
            Some(Self {
                child,
                _said: said,
                address,
            })
        } else {
            child.wait().unwrap();
            None
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
