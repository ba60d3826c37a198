//! Runs the firmware's image on the virtual axis: from reset to armed, then the sine experiment of the thesis. Writes the
//! raw stream, as a debug probe would read it, to a file or, with `-`, to standard output.
//!
//! ```text
//! emulate FIRMWARE.elf trace.bin 5
//! emulate FIRMWARE.elf - 5 | bristle capture --from - --out log.csv
//! ```

use bristle_core::command::Command;
use bristle_core::experiment::Experiment;
use bristle_image::Image;
use bristle_image::host::{Session, TICKS_PER_S};
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

const SINE: Experiment<f32> = Experiment::Sine {
    amplitude_nm: 0.035,
    period_ticks: 10_000,
};

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let done = match words.as_slice() {
        [image, raw, seconds] => run(image, raw, seconds),
        _ => Err("usage: emulate FIRMWARE.elf RAW|- SECONDS".to_owned()),
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
    let raw: Box<dyn Write> = match raw {
        "-" => Box::new(io::stdout()),
        path => Box::new(File::create(path).map_err(|e| format!("{path}: {e}"))?),
    };
    let mut session = Session::new(&image, &lines)?;
    session.raw = Some(raw);
    session.arm()?;
    session.ask(&Command::Play(SINE))?;
    session.keep = false;
    for _ in 0..seconds {
        session.run(TICKS_PER_S).map_err(|e| format!("{e:?}"))?;
        let heard = &session.heard.continuity;
        eprintln!("{} samples sent, {} lost", heard.received, heard.lost);
    }
    Ok(())
}
