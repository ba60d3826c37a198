//! `bristle serve`: the virtual axis behind a link, as the firmware is.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Time in which it is there, on machines that build beside.
const PATIENCE: Duration = Duration::from_secs(60);

/// Ends with this value.
pub struct Server {
    child: Child,
    /// HOST:PORT.
    pub address: String,
}

impl Server {
    pub fn start(axis: &Path) -> Self {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = free.local_addr().unwrap().to_string();
        drop(free);
        let child = Command::new(env!("CARGO_BIN_EXE_bristle"))
            .args(["serve", "--at", &address, "--axis"])
            .arg(axis)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let until = Instant::now() + PATIENCE;
        while std::net::TcpStream::connect(&address).is_err() {
            assert!(Instant::now() < until);
            std::thread::sleep(Duration::from_millis(20));
        }
        Self { child, address }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
