//! Where the bytes of a stream come from: a file, standard input, a server, a debug probe.
//!
//! A thread reads, so that neither a silent line nor a full pipe keeps Ctrl-C from being heard.

use bristle_gap::InputError;
use std::fs::File;
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// Time for a server to answer.
const CONNECT: Duration = Duration::from_secs(5);
/// How often Ctrl-C is looked for.
const LOOK: Duration = Duration::from_millis(50);
/// Time in which what is under way still arrives after Ctrl-C.
const DRAIN: Duration = Duration::from_millis(300);
/// Pieces that wait to be decoded, of 64 KiB at most.
const PIECES: usize = 64;

/// What J-Link's server takes in the first 100 ms to send another channel than 0.
const JLINK_CHANNEL_1: &[u8] = b"$$SEGGER_TELNET_ConfigStr=RTTCh;1$$";

static STOP: AtomicBool = AtomicBool::new(false);

/// A source as the user names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// Standard input.
    Stdin,
    /// A file or a named pipe.
    File(String),
    /// An RTT server that serves up channel 1 on a port of its own.
    Tcp(String),
    /// J-Link's server, which has to be told the channel.
    Jlink(String),
}

/// Parses the address of a server.
fn server(address: &str) -> Result<String, String> {
    match address.rsplit_once(':') {
        Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok() => {
            Ok(address.to_owned())
        }
        _ => Err("give a server as HOST:PORT, such as localhost:9090".to_owned()),
    }
}

/// Parses tcp:HOST:PORT.
pub fn tcp(text: &str) -> Result<String, String> {
    server(text.strip_prefix("tcp:").ok_or("give tcp:HOST:PORT")?)
}

impl FromStr for Source {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "-" {
            Ok(Self::Stdin)
        } else if let Some(address) = text.strip_prefix("tcp:") {
            server(address).map(Self::Tcp)
        } else if let Some(address) = text.strip_prefix("jlink:") {
            server(address).map(Self::Jlink)
        } else if text.is_empty() {
            Err("give a file, `-`, tcp:HOST:PORT or jlink:HOST:PORT".to_owned())
        } else {
            Ok(Self::File(text.to_owned()))
        }
    }
}

impl Source {
    /// Name for messages.
    pub fn name(&self) -> &str {
        match self {
            Self::Stdin => "standard input",
            Self::File(name) | Self::Tcp(name) | Self::Jlink(name) => name,
        }
    }

    /// Opens it.
    pub fn open(&self) -> Result<Box<dyn Read + Send>, InputError> {
        let fail = |error: io::Error, remedy: &str| {
            InputError::new(
                self.name(),
                format!("cannot be read: {}", plain(&error)),
                remedy,
            )
        };
        match self {
            Self::Stdin => Ok(Box::new(io::stdin())),
            Self::File(name) => {
                let remedy = "name a file with the raw bytes of RTT up channel 1";
                let file = File::open(name).map_err(|error| fail(error, remedy))?;
                if file.metadata().is_ok_and(|about| about.is_dir()) {
                    return Err(fail(io::ErrorKind::IsADirectory.into(), remedy));
                }
                Ok(Box::new(file))
            }
            Self::Tcp(address) => {
                let remedy = "start its RTT server for up channel 1, such as `rtt server start 9090 1` of OpenOCD";
                connect(address, &[])
                    .map(|stream| Box::new(stream) as _)
                    .map_err(|error| fail(error, remedy))
            }
            Self::Jlink(address) => {
                let remedy = "start the J-Link software with its connection to the board";
                connect(address, JLINK_CHANNEL_1)
                    .map(|stream| Box::new(stream) as _)
                    .map_err(|error| fail(error, remedy))
            }
        }
    }
}

/// Connects to a server and says hello.
pub fn connect(address: &str, hello: &[u8]) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "no such host");
    for place in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&place, CONNECT) {
            Ok(mut stream) => {
                stream.write_all(hello)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// An error without the system's number.
pub fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or(&text).to_owned()
}

/// From here on Ctrl-C, or a request to end, only sets a mark; a second one ends the program at once.
pub fn catch_interrupts() {
    // It refuses where one of the signals is ignored: a lost terminal is, under nohup, and stays so.
    if ctrlc::try_set_handler(stop).is_err() {
        catch_the_others();
    }
}

fn stop() {
    if STOP.swap(true, Ordering::Relaxed) {
        std::process::exit(130);
    }
}

#[cfg(unix)]
fn catch_the_others() {
    use signal_hook::consts::{SIGINT, SIGTERM};
    // Where they cannot be caught, they end the program without a log: no reason not to try.
    if let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) {
        std::thread::spawn(move || signals.forever().for_each(|_| stop()));
    }
}

#[cfg(not(unix))]
fn catch_the_others() {}

/// Whether Ctrl-C was pressed.
pub fn interrupted() -> bool {
    STOP.load(Ordering::Relaxed)
}

/// Why a stream ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// It has no more.
    Finished,
    /// Ctrl-C.
    Interrupted,
    /// `take` has enough.
    Enough,
    /// It broke.
    Broken(String),
}

/// Reads until the end and gives every piece to `take`, which says whether it wants more.
pub fn pump<E>(
    reader: Box<dyn Read + Send>,
    take: impl FnMut(&[u8]) -> Result<bool, E>,
) -> Result<End, E> {
    let (give, pieces) = sync_channel(PIECES);
    let thread = std::thread::spawn(move || read(reader, &give));
    let end = follow(&pieces, take);
    drop(pieces);
    // A probe is let go of in order; a thread that waits for a silent line is left to the end of the program.
    let until = Instant::now() + DRAIN;
    while !thread.is_finished() && Instant::now() < until {
        std::thread::sleep(Duration::from_millis(5));
    }
    end
}

type Piece = io::Result<Vec<u8>>;

fn read(mut reader: Box<dyn Read + Send>, give: &SyncSender<Piece>) {
    let mut buffer = vec![0; 1 << 16];
    loop {
        let piece = match reader.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => Ok(buffer.get(..count).unwrap_or_default().to_vec()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => Err(error),
        };
        let last = piece.is_err();
        if give.send(piece).is_err() || last {
            return;
        }
    }
}

fn follow<E>(
    pieces: &Receiver<Piece>,
    mut take: impl FnMut(&[u8]) -> Result<bool, E>,
) -> Result<End, E> {
    // What is under way when Ctrl-C comes still arrives.
    let mut until = None;
    loop {
        if interrupted() && Instant::now() > *until.get_or_insert_with(|| Instant::now() + DRAIN) {
            return Ok(End::Interrupted);
        }
        match pieces.recv_timeout(LOOK) {
            Ok(Ok(piece)) => {
                if !take(&piece)? {
                    return Ok(End::Enough);
                }
            }
            Ok(Err(error)) => return Ok(End::Broken(plain(&error))),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) if interrupted() => return Ok(End::Interrupted),
            Err(RecvTimeoutError::Disconnected) => return Ok(End::Finished),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_told_apart() {
        let source = |text: &str| text.parse::<Source>();
        assert_eq!(source("-"), Ok(Source::Stdin));
        assert_eq!(source("a.bin"), Ok(Source::File("a.bin".into())));
        assert_eq!(source("tcp:[::1]:9"), Ok(Source::Tcp("[::1]:9".into())));
        assert_eq!(source("jlink:a:19021"), Ok(Source::Jlink("a:19021".into())));
        for bad in [
            "",
            "tcp:",
            "tcp:9090",
            "tcp::9090",
            "tcp:a:99999",
            "jlink:a",
        ] {
            assert!(source(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_stream_is_pumped_to_its_end_or_until_there_is_enough() {
        let bytes = vec![7; 200_000];
        let mut count = 0;
        let end = pump(Box::new(io::Cursor::new(bytes.clone())), |piece| {
            count += piece.len();
            Ok::<_, ()>(true)
        });
        assert_eq!((end, count), (Ok(End::Finished), bytes.len()));
        let end = pump(Box::new(io::Cursor::new(bytes)), |_| Ok::<_, ()>(false));
        assert_eq!(end, Ok(End::Enough));
        let end = pump(Box::new(io::empty()), |_| Err("full"));
        assert_eq!(end, Ok(End::Finished));
    }
}
