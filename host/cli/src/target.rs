//! `bristle target`: orders to the firmware, each with its answer.

use crate::link::Link;
use crate::{output, source};
use bristle_core::command::{Changes, Command, Reply, parameter};
use bristle_core::experiment::{Bounds, Experiment};
use bristle_core::parameters::ENTRIES;
use bristle_core::supervisor::State;
use bristle_gap::InputError;
use std::str::FromStr;
use std::time::{Duration, Instant};

/// Ticks a second of the firmware.
const RATE_HZ: f64 = 10_000.0;
/// Time for an order to show in the samples.
const SHOWS: Duration = Duration::from_millis(500);

/// Send orders to the firmware and print its answers: arm, start, stop, disarm, parameters.
///
/// Orders are followed one after the other; the first that is refused ends it. Whoever arms has to stay: keep-alives go
/// out for the time of --hold, then the torque is taken down by a ramp and the drive disarmed, and so it is at Ctrl-C.
/// If this program dies, the firmware does the same by itself after its time-out.
#[derive(clap::Args)]
#[command(
    after_help = "Orders:\n  arm, disarm, stop, clear (a fault)\n  start       the sine experiment, see --amplitude-nm \
                        and --period-s\n  KEY=VALUE   sets a parameter; several in a row are set together or not at \
                        all\n  KEY         asks for a parameter\n\nExamples (OpenOCD: rtt server start 9091 0; rtt \
                        server start 9090 1):\n  bristle target arm start --hold 5 --to tcp:localhost:9091 --answers \
                        tcp:localhost:9090\n  bristle target l1_1_s=1500 l2=0 coulomb_nm --to tcp:localhost:9091 \
                        --answers tcp:localhost:9090"
)]
pub struct Args {
    /// Orders, see below.
    #[arg(required = true, value_name = "ORDER")]
    orders: Vec<Word>,
    /// Server of RTT down channel 0, tcp:HOST:PORT.
    #[arg(long, value_name = "SERVER", value_parser = source::tcp)]
    to: String,
    /// Server of RTT up channel 1, where that is another one.
    #[arg(long, value_name = "SERVER", value_parser = source::tcp)]
    answers: Option<String>,
    /// Time to stay armed.
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = output::not_negative)]
    hold: f64,
    /// Amplitude of the sine.
    #[arg(long, value_name = "NM", default_value_t = 0.035, value_parser = output::positive)]
    amplitude_nm: f64,
    /// Period of the sine.
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = period)]
    period_s: f64,
}

fn period(text: &str) -> Result<f64, String> {
    let period_s = output::positive(text)?;
    let ticks = (period_s * RATE_HZ).round();
    if (1.0..=f64::from(u32::MAX)).contains(&ticks) {
        Ok(period_s)
    } else {
        Err("give a time from a tick, 0.0001 s, to a day".to_owned())
    }
}

/// An order as the user gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Word {
    Arm,
    Disarm,
    Stop,
    Clear,
    Start,
    Set(u8, f32),
    Get(u8),
}

impl FromStr for Word {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |name: &str| {
            let names: Vec<&str> = ENTRIES.iter().map(|entry| entry.name).collect();
            parameter(name).ok_or_else(|| {
                format!(
                    "no order and no parameter; parameters are {}",
                    names.join(", ")
                )
            })
        };
        Ok(match text {
            "arm" => Self::Arm,
            "disarm" => Self::Disarm,
            "stop" => Self::Stop,
            "clear" => Self::Clear,
            "start" => Self::Start,
            _ => match text.split_once('=') {
                None => Self::Get(number(text)?),
                Some((name, value)) => {
                    let value = value.parse().map_err(|_| "give a number as the value")?;
                    Self::Set(number(name)?, value)
                }
            },
        })
    }
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    let orders = orders(args)?;
    source::catch_interrupts();
    let mut link = Link::new(&args.to, args.answers.as_deref(), None)?;
    let arms = args.orders.contains(&Word::Arm) || args.orders.contains(&Word::Start);
    let done = follow(&mut link, &orders).and_then(|()| {
        if arms {
            hold(&mut link, Duration::from_secs_f64(args.hold))
        } else {
            Ok(())
        }
    });
    if arms {
        // Whatever went wrong before is what the user should hear of.
        let ended = wind_down(&mut link);
        done?;
        output::print(&format!("stop, disarm: {}\n", ended?));
    } else {
        done?;
    }
    // What the last order made of it shows a millisecond or two later.
    link.listen(Duration::from_millis(50))?;
    if let Some(status) = link.status() {
        let text = |known: Option<&'static str>| known.unwrap_or("unknown");
        output::print(&format!(
            "now: {}, limited by: {}, {}\n",
            text(status.state().map(State::text)),
            text(status.limit().map(|limit| limit.text())),
            text(status.fault().map(|fault| fault.text())),
        ));
    }
    Ok(())
}

/// Commands and what to call them. Parameters in a row go together.
fn orders(args: &Args) -> Result<Vec<(String, Command)>, InputError> {
    let mut orders: Vec<(String, Command)> = Vec::new();
    for word in &args.orders {
        let command = match *word {
            Word::Arm => Command::Arm,
            Word::Disarm => Command::Disarm,
            Word::Stop => Command::Stop,
            Word::Clear => Command::ClearFault,
            Word::Start => Command::Play(
                Experiment::Sine {
                    amplitude_nm: args.amplitude_nm as f32,
                    period_ticks: (args.period_s * RATE_HZ).round() as u32,
                },
                Bounds::open(((args.hold * RATE_HZ).round() as u32).max(1)),
            ),
            Word::Get(number) => Command::Get(number),
            Word::Set(number, value) => {
                if let Some((name, Command::Set(changes))) = orders.last_mut() {
                    if !changes.add(number, value) {
                        return Err(InputError::new(
                            "target",
                            "too many parameters in a row",
                            "set them in several runs",
                        ));
                    }
                    name.push_str(&format!(", {}", name_of(number)));
                    continue;
                }
                let mut changes = Changes::default();
                changes.add(number, value);
                Command::Set(changes)
            }
        };
        let name = match *word {
            Word::Arm => "arm",
            Word::Disarm => "disarm",
            Word::Stop => "stop",
            Word::Clear => "clear",
            Word::Start => "start",
            Word::Get(number) | Word::Set(number, _) => name_of(number),
        };
        orders.push((name.to_owned(), command));
    }
    Ok(orders)
}

fn name_of(number: u8) -> &'static str {
    ENTRIES
        .get(usize::from(number))
        .map_or("unknown parameter", |entry| entry.name)
}

fn follow(link: &mut Link, orders: &[(String, Command)]) -> Result<(), InputError> {
    for (name, command) in orders {
        if matches!(command, Command::Play(..)) {
            armed(link)?;
        }
        let answer = accepted(name, link.ask(command)?)?;
        output::print(&format!("{name}: {answer}\n"));
        if *command == Command::Arm {
            armed(link)?;
        }
    }
    Ok(())
}

/// The answer in words, or why the order was refused.
pub fn accepted(name: &str, reply: Reply) -> Result<String, InputError> {
    let refused = |why: String, remedy: &str| Err(InputError::new(name, why, remedy));
    match reply {
        Reply::Accepted { parameter_version } => Ok(format!(
            "accepted, parameters of version {parameter_version}"
        )),
        Reply::Value { value, .. } => Ok(format!("{value}")),
        Reply::OutOfRange {
            parameter,
            low,
            high,
        } => refused(
            format!("refused: {} is out of range", name_of(parameter)),
            &format!("give {low} to {high}; nothing was changed"),
        ),
        Reply::Inconsistent => refused(
            "refused: the parameters do not go together".to_owned(),
            "the firmware's log says why; nothing was changed",
        ),
        Reply::Unstable { nearest_l1_1_s } if nearest_l1_1_s.is_finite() => refused(
            "refused: the observer would not be stable".to_owned(),
            &format!("the nearest l1_1_s that holds is {nearest_l1_1_s}; nothing was changed"),
        ),
        Reply::Unstable { .. } => refused(
            "refused: no observer gain holds with these parameters".to_owned(),
            "give others; nothing was changed",
        ),
        Reply::Malformed => refused(
            "not understood by the firmware".to_owned(),
            "use firmware and program of the same version",
        ),
        Reply::Busy => refused("the firmware is busy".to_owned(), "try again"),
        Reply::Refused(refusal) => refused(
            format!("refused: the experiment {}", refusal.text()),
            "give a smaller one, or raise the limit; nothing was started",
        ),
        Reply::Burst { stage, .. } => Ok(format!("the burst {}", stage.text())),
        Reply::BurstRefused { most } => refused(
            format!("refused: the burst is longer than the {most} samples that there is room for"),
            "ask for less time before or after the event; nothing was changed",
        ),
    }
}

/// Waits until the samples say that it is armed: the answer only says that the order has arrived.
pub fn armed(link: &mut Link) -> Result<(), InputError> {
    let until = Instant::now() + SHOWS;
    loop {
        link.listen(Duration::from_millis(10))?;
        let status = link.status();
        if status.is_some_and(|status| status.state() == Some(State::Armed)) {
            return Ok(());
        }
        if Instant::now() > until {
            let why = match status {
                None => "no sample has come".to_owned(),
                Some(status) => format!(
                    "the firmware is not armed but {}, {}",
                    status.state().map_or("unknown", State::text),
                    status.fault().map_or("unknown fault", |fault| fault.text())
                ),
            };
            return Err(InputError::new(
                "target",
                why,
                "give arm before start; the drive must report ready, and a fault be cleared: bristle target clear",
            ));
        }
    }
}

/// Keeps alive until the time is over, Ctrl-C, or a fault.
fn hold(link: &mut Link, time: Duration) -> Result<(), InputError> {
    let until = Instant::now() + time;
    while Instant::now() < until && !source::interrupted() {
        link.listen(Duration::from_millis(50))?;
        if let Some(status) = link.status()
            && status.state() == Some(State::Fault)
        {
            return Err(InputError::new(
                "target",
                format!(
                    "the firmware has a fault: {}",
                    status.fault().map_or("unknown", |fault| fault.text())
                ),
                "mend its cause, then: bristle target clear",
            ));
        }
    }
    Ok(())
}

/// Torque down by a ramp, then the drive away.
pub fn wind_down(link: &mut Link) -> Result<String, InputError> {
    let stopped = link.ask(&Command::Stop);
    let _ = link.listen(SHOWS);
    let disarmed = link.ask(&Command::Disarm);
    accepted("stop", stopped?)?;
    accepted("disarm", disarmed?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_orders() {
        let word = |text: &str| text.parse::<Word>();
        assert_eq!(word("arm"), Ok(Word::Arm));
        assert_eq!(word("inertia_kg_m2=2e-5"), Ok(Word::Set(0, 2e-5)));
        assert_eq!(word("inertia_kg_m2"), Ok(Word::Get(0)));
        for bad in ["", "go", "inertia_kg_m2=", "inertia=1", "=1"] {
            assert!(word(bad).is_err(), "{bad}");
        }
        assert!(period("1e9").is_err() && period("1e-5").is_err() && period("0.5").is_ok());
    }
}
