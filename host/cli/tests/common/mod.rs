//! `bristle serve`: the virtual axis behind a link, as the firmware is.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

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
        let mut child = Command::new(env!("CARGO_BIN_EXE_bristle"))
            .args(["serve", "--at", "127.0.0.1:0", "--axis"])
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
        let mut server = Self {
            child,
            address: String::new(),
        };
        // The first line says where it listens.
        let line = told.recv_timeout(PATIENCE).expect("it listens");
        let (_, address) = line.split_once(" at tcp:").expect("its address");
        address.clone_into(&mut server.address);
        server
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
