//! Runs the firmware's image on the virtual axis, with the raw stream as a debug probe would read it.
//!
//! To a file, or with `-` to standard output: from reset to armed, then the sine experiment of the thesis. As a server:
//! in real time from reset on, and whoever connects sends the orders. Its first line says where; port 0 takes a free one.
//!
//! ```text
//! emulate FIRMWARE.elf trace.bin 5
//! emulate FIRMWARE.elf - 5 | bristle capture --from - --out log.csv
//! emulate FIRMWARE.elf tcp:127.0.0.1:9090 60 & bristle target arm start --hold 5 --to tcp:127.0.0.1:9090
//! ```

use bristle_core::command::Command;
use bristle_core::experiment::{Bounds, Experiment};
use bristle_image::Image;
use bristle_image::host::{Session, TICKS_PER_S};
use std::cell::RefCell;
use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::ExitCode;
use std::rc::Rc;
use std::time::{Duration, Instant};

const SINE: Experiment<f32> = Experiment::Sine {
    amplitude_nm: 0.035,
    period_ticks: 10_000,
};

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let done = match words.as_slice() {
        [image, raw, seconds] => run(image, raw, seconds),
        _ => Err("usage: emulate FIRMWARE.elf RAW|-|tcp:HOST:PORT SECONDS".to_owned()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(image: &str, raw: &str, seconds: &str) -> Result<(), String> {
    let seconds: u32 = seconds
        .parse()
        .map_err(|_| format!("{seconds}: give whole seconds"))?;
    let image = Image::read(Path::new(image))?;
    let lines = defmt_decoder::Table::parse(image.bytes())
        .map_err(|e| e.to_string())?
        .ok_or("the image does not log")?;
    if let Some(address) = raw.strip_prefix("tcp:") {
        return serve(&mut Session::new(&image, &lines)?, address, seconds);
    }
    let raw: Box<dyn Write> = match raw {
        "-" => Box::new(io::stdout()),
        path => Box::new(File::create(path).map_err(|e| format!("{path}: {e}"))?),
    };
    let mut session = Session::new(&image, &lines)?;
    session.raw = Some(raw);
    session.arm()?;
    session.ask(&Command::Play(SINE, Bounds::open(u32::MAX)))?;
    session.keep = false;
    for _ in 0..seconds {
        session.run(TICKS_PER_S).map_err(|e| format!("{e:?}"))?;
        let ticks = session.ticks();
        let heard = &session.heard.continuity;
        eprintln!(
            "{ticks} ticks since power on, {} samples sent, {} lost",
            heard.received, heard.lost
        );
    }
    Ok(())
}

/// Ticks between two looks at the connections: a millisecond, as a probe polls.
const LOOK_TICKS: u64 = 10;

/// Bytes of orders that are given to the image at once.
const PIECE: usize = 16;

/// Connections: what the image says goes to all of them.
#[derive(Clone, Default)]
struct Clients(Rc<RefCell<Vec<TcpStream>>>);

impl Write for Clients {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // One that is gone, or too slow to take it all, is let go.
        let mut clients = self.0.borrow_mut();
        clients.retain_mut(|client| client.write_all(bytes).is_ok());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Runs in real time and passes on what comes from either side.
fn serve(session: &mut Session<'_>, address: &str, seconds: u32) -> Result<(), String> {
    let text = |e: io::Error| format!("{address}: {e}");
    let listener = TcpListener::bind(address).map_err(text)?;
    listener.set_nonblocking(true).map_err(text)?;
    println!("serving tcp:{}", listener.local_addr().map_err(text)?);
    let clients = Clients::default();
    session.keep = false;
    session.quiet = true;
    session.raw = Some(Box::new(clients.clone()));
    let begun = Instant::now();
    let end = u64::from(seconds) * TICKS_PER_S;
    let mut orders = Vec::new();
    for ticks in (0..end).step_by(LOOK_TICKS as usize) {
        if let Ok((client, _)) = listener.accept() {
            client.set_nonblocking(true).map_err(text)?;
            clients.0.borrow_mut().push(client);
        }
        // What the image has no room for yet, as before its link is up, waits, and what comes after it with it.
        if orders.is_empty() {
            clients.0.borrow_mut().retain_mut(|client| {
                let mut bytes = [0; 256];
                match client.read(&mut bytes) {
                    Ok(0) => false,
                    Ok(count) => {
                        orders.extend_from_slice(&bytes[..count]);
                        true
                    }
                    Err(error) => error.kind() == ErrorKind::WouldBlock,
                }
            });
        }
        while let Some(piece) = orders.chunks(PIECE).next()
            && session.give(piece).is_ok()
        {
            orders.drain(..piece.len());
        }
        session.run(LOOK_TICKS).map_err(|e| format!("{e:?}"))?;
        let due = Duration::from_micros((ticks + LOOK_TICKS) * 100);
        std::thread::sleep(due.saturating_sub(begun.elapsed()));
    }
    Ok(())
}
