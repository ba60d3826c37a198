//! `bristle burst`: the samples about an event, kept in the firmware's memory and read out afterwards.

use crate::about;
use crate::link::Link;
use crate::output::{self, Progress};
use crate::source;
use crate::target::accepted;
use bristle_core::burst::{Quantity, Setting, Stage, Trigger};
use bristle_core::command::{Command, Reply};
use bristle_core::trace::{self, Record};
use bristle_core::wire::{Decoder, MOST_PAYLOAD_BYTES, OVERHEAD_BYTES};
use bristle_gap::InputError;
use bristle_gap::capture::{About, Layout, Recorder, Sample};
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Ticks a second of the firmware.
const RATE_HZ: f64 = 10_000.0;
/// Time between two looks at the burst.
const LOOK: Duration = Duration::from_millis(50);
/// How often a part is asked for again that found no room on the link.
const TRIES: usize = 50;

/// Keep the samples about an event in the firmware's memory, and read them out as a log.
///
/// The firmware keeps 0.15 s at 10 kHz, before and after the event. Not one of them is lost, however slow the
/// link is. Where an experiment is to bring the event about, start it from another terminal once this one waits.
#[derive(clap::Args)]
#[command(
    after_help = "Triggers:\n  command            at once\n  fault              a fault appears\n  reversal[:COUNTS]  the \
                        encoder comes back by 2 counts, or as many as given\n  break-away[:MS]    after 10 ms of rest, or as \
                        many as given, it leaves by 3 counts\n  torque>0.02        torque, velocity or z passes a level \
                        upwards; < downwards\n\nExamples (OpenOCD: rtt server start 9091 0; rtt server start 9090 1):\n  \
                        bristle burst reversal --to tcp:localhost:9091 --answers tcp:localhost:9090 --out burst.csv\n  \
                        bristle burst 'velocity<-0.5' --before 0.05 --after 0.1 --to tcp:localhost:9091 --answers \
                        tcp:localhost:9090 --out burst.csv"
)]
pub struct Args {
    /// The event, see below.
    #[arg(value_name = "TRIGGER")]
    event: Event,
    /// Server of RTT down channel 0, tcp:HOST:PORT.
    #[arg(long, value_name = "SERVER", value_parser = source::tcp)]
    to: String,
    /// Server of RTT up channel 1, where that is another one.
    #[arg(long, value_name = "SERVER", value_parser = source::tcp)]
    answers: Option<String>,
    /// Time before the event.
    #[arg(long, value_name = "S", default_value_t = 0.05, value_parser = output::not_negative)]
    before: f64,
    /// Time from the event on.
    #[arg(long, value_name = "S", default_value_t = 0.1, value_parser = output::positive)]
    after: f64,
    /// Time to wait for the event; Ctrl-C ends it too.
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = output::positive)]
    wait: f64,
    /// Log to write: CSV, packed where the name ends in .gz, or MCAP where it ends in .mcap.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// A trigger as the user gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Event(Trigger);

impl FromStr for Event {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text
            .split_once(':')
            .map_or((text, None), |(n, v)| (n, Some(v)));
        let number = |otherwise: u16, least: u16, most: u16| match value {
            None => Ok(otherwise),
            Some(value) => match value.parse() {
                Ok(number) if (least..=most).contains(&number) => Ok(number),
                _ => Err(format!("give {least} to {most} behind the colon")),
            },
        };
        Ok(Self(match name {
            "command" | "fault" if value.is_some() => {
                return Err(format!("`{name}` stands alone"));
            }
            "command" => Trigger::Command,
            "fault" => Trigger::Fault,
            "reversal" => Trigger::Reversal {
                counts: number(2, 1, u16::MAX)?,
            },
            "break-away" => Trigger::BreakAway {
                rest: number(10, 1, 6000)? * (RATE_HZ / 1000.0) as u16,
                counts: 3,
            },
            _ => level(text).ok_or(
                "give command, fault, reversal, break-away, or a level such as torque>0.02",
            )?,
        }))
    }
}

fn level(text: &str) -> Option<Trigger> {
    let place = text.find(['<', '>'])?;
    let quantity = match text.get(..place)?.trim() {
        "z" => Quantity::Deflection,
        "velocity" => Quantity::Velocity,
        "torque" => Quantity::Torque,
        _ => return None,
    };
    let level: f32 = text.get(place + 1..)?.trim().parse().ok()?;
    level.is_finite().then(|| match text.get(place..=place) {
        Some(">") => Trigger::Above(quantity, level),
        _ => Trigger::Below(quantity, level),
    })
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let samples = |seconds: f64| ((seconds * RATE_HZ).round()).min(f64::from(u16::MAX)) as u16;
    let setting = Setting {
        trigger: args.event.0,
        before: samples(args.before),
        after: samples(args.after).max(1),
    };
    // Before the event is waited for: a log that cannot be written should not cost it.
    let about = about::about(RATE_HZ, Layout::FIRMWARE.unit);
    let mut log = Recorder::create(&args.out, Layout::FIRMWARE, &about)?;
    source::catch_interrupts();
    let (send, pieces) = channel();
    let mut link = Link::new(&args.to, args.answers.as_deref(), Some(send))?;
    accepted("burst", link.ask(&Command::BurstArm(setting))?)?;
    if setting.trigger == Trigger::Command {
        accepted("burst", link.ask(&Command::BurstFire)?)?;
    }
    let (samples, event_tick) = wait(&mut link, Duration::from_secs_f64(args.wait))?;
    let records = read(&mut link, &pieces, samples)?;
    write(&mut log, &records)?;
    log.commit(&About::from([
        ("samples".to_owned(), records.len().to_string()),
        ("event_tick".to_owned(), event_tick.to_string()),
    ]))?;
    output::print(&format!(
        "{} samples, the event at {} s (tick {event_tick})\nlog: {}\n",
        records.len(),
        f64::from(event_tick) / RATE_HZ,
        args.out.display()
    ));
    Ok(())
}

/// Waits until all is there; gives how many samples, and the tick of the event.
fn wait(link: &mut Link, time: Duration) -> Result<(u16, u32), InputError> {
    let progress = Progress::counting("burst");
    let until = Instant::now() + time;
    loop {
        let Reply::Burst {
            stage,
            samples,
            event_tick,
        } = link.ask(&Command::BurstStage)?
        else {
            return Err(unknown());
        };
        progress.say(stage.text());
        if stage == Stage::Full {
            return Ok((samples, event_tick));
        }
        if Instant::now() > until || source::interrupted() {
            return Err(InputError::new(
                "burst",
                format!("the event has not come: the burst {}", stage.text()),
                "start what brings it about meanwhile, wait longer with --wait, or give another trigger",
            ));
        }
        link.listen(LOOK)?;
    }
}

fn unknown() -> InputError {
    InputError::new(
        "burst",
        "not understood by the firmware",
        "use firmware and program of the same version",
    )
}

/// Reads all samples, part by part.
fn read(
    link: &mut Link,
    pieces: &Receiver<Vec<u8>>,
    samples: u16,
) -> Result<Vec<Record>, InputError> {
    let mut frames = Box::new(Decoder::<{ MOST_PAYLOAD_BYTES + OVERHEAD_BYTES }>::new());
    let mut records = Vec::new();
    let mut tries = 0;
    while records.len() < usize::from(samples) {
        let before = records.len();
        link.ask(&Command::BurstRead(before as u16))?;
        for piece in pieces.try_iter() {
            let mut bytes = piece.as_slice();
            while !bytes.is_empty() {
                let taken = frames.feed(bytes);
                bytes = bytes.get(taken..).unwrap_or_default();
                while let Some(frame) = frames.next_frame() {
                    // A part that was asked for twice comes twice.
                    if let Some((first, part)) = trace::burst(&frame)
                        && usize::from(first) == records.len()
                    {
                        records.extend(part);
                    }
                }
            }
        }
        tries = if records.len() > before { 0 } else { tries + 1 };
        if tries > TRIES {
            return Err(InputError::new(
                "burst",
                format!("the link has no room for sample {before} of {samples}"),
                "see that all of RTT up channel 1 is read; the burst stays until the next one",
            ));
        }
    }
    Ok(records)
}

fn write(log: &mut Recorder, records: &[Record]) -> Result<(), InputError> {
    let mut last: Option<Sample> = None;
    for record in records {
        let counts = last.map_or(i64::from(record.counts), |last| {
            let step = record.counts.wrapping_sub(last.record.counts);
            last.counts + i64::from(step)
        });
        let sample = Sample {
            time_s: f64::from(record.tick) / RATE_HZ,
            counts,
            record: *record,
        };
        if record.torque_ref_nm.is_finite() && record.velocity_rad_s.is_finite() {
            log.row(&sample, None)?;
        }
        last = Some(sample);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_triggers() {
        let event = |text: &str| text.parse::<Event>().map(|event| event.0);
        assert_eq!(event("command"), Ok(Trigger::Command));
        assert_eq!(event("fault"), Ok(Trigger::Fault));
        assert_eq!(event("reversal"), Ok(Trigger::Reversal { counts: 2 }));
        assert_eq!(event("reversal:7"), Ok(Trigger::Reversal { counts: 7 }));
        let rests = |rest| Ok(Trigger::BreakAway { rest, counts: 3 });
        assert_eq!(event("break-away"), rests(100));
        assert_eq!(event("break-away:25"), rests(250));
        assert_eq!(
            event("torque>0.02"),
            Ok(Trigger::Above(Quantity::Torque, 0.02))
        );
        assert_eq!(
            event("velocity < -0.5"),
            Ok(Trigger::Below(Quantity::Velocity, -0.5))
        );
        assert_eq!(
            event("z>1e-3"),
            Ok(Trigger::Above(Quantity::Deflection, 1e-3))
        );
        for bad in [
            "",
            "turn",
            "reversal:0",
            "reversal:-1",
            "break-away:x",
            "command:1",
            "torque>",
            "torque>inf",
            "force<1",
            "break-away:60000",
        ] {
            assert!(event(bad).is_err(), "{bad}");
        }
    }
}
