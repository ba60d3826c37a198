//! Where samples come from, and where orders go: one decoder for a probe, a server, the emulator and the virtual axis.

use crate::link::Link;
use crate::source::{self, End};
use crate::target::accepted;
use bristle_core::command::{Command, Reply};
use bristle_core::parameters::ENTRIES;
use bristle_gap::InputError;
use bristle_gap::capture::{Capture, Sample, Summary};
use std::convert::Infallible;
use std::io::Read;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

/// How long the link is listened to between two orders.
const LISTENS: Duration = Duration::from_millis(20);

/// Longest time that samples are taken between two pictures, on a machine that is late.
const TAKES: Duration = Duration::from_millis(100);

/// An order, and what to call it.
pub struct Ask {
    /// For the answer.
    pub name: String,
    /// The order itself.
    pub command: Command,
}

/// What comes back.
pub enum Answer {
    /// In words; `Err` where it was refused or the link is lost.
    Said(Result<String, String>),
    /// The value of a parameter, by its number.
    Value(u8, f32),
}

/// A stream of samples, and perhaps a way back.
pub struct Feed {
    pieces: Receiver<Vec<u8>>,
    capture: Capture,
    orders: Option<Sender<Ask>>,
    answers: Receiver<Answer>,
}

impl Feed {
    /// Only listens.
    pub fn listening(reader: Box<dyn Read + Send>, rate_hz: f64) -> Self {
        let (send, pieces) = channel();
        let (tell, answers) = channel();
        std::thread::spawn(move || {
            let end = source::pump(reader, |bytes| {
                Ok::<_, Infallible>(send.send(bytes.to_vec()).is_ok())
            });
            let said = match end {
                Ok(End::Broken(why)) => Err(format!("the stream broke: {why}")),
                _ => Ok("the stream has ended".to_owned()),
            };
            // Who asked may have gone.
            let _ = tell.send(Answer::Said(said));
        });
        Self {
            pieces,
            capture: Capture::new(rate_hz),
            orders: None,
            answers,
        }
    }

    /// Over a link, which takes orders too, and is asked for every parameter at once.
    pub fn over(to: &str, answers: Option<&str>, rate_hz: f64) -> Result<Self, InputError> {
        let (send, pieces) = channel();
        let link = Link::new(to, answers, Some(send))?;
        let (orders, asked) = channel();
        let (tell, answers) = channel();
        for number in 0..ENTRIES.len() as u8 {
            let name = ENTRIES[usize::from(number)].name.to_owned();
            let command = Command::Get(number);
            let _ = orders.send(Ask { name, command });
        }
        std::thread::spawn(move || follow(link, &asked, &tell));
        Ok(Self {
            pieces,
            capture: Capture::new(rate_hz),
            orders: Some(orders),
            answers,
        })
    }

    /// Sends an order; its answer comes later. False where there is no way back.
    pub fn ask(&self, name: &str, command: Command) -> bool {
        let name = name.to_owned();
        self.orders
            .as_ref()
            .is_some_and(|orders| orders.send(Ask { name, command }).is_ok())
    }

    /// Whether orders go anywhere.
    pub fn takes_orders(&self) -> bool {
        self.orders.is_some()
    }

    /// Gives every sample that has come; what a machine that is late does not get to comes the next time.
    pub fn samples(&mut self, mut take: impl FnMut(&Sample)) {
        let begun = Instant::now();
        while begun.elapsed() < TAKES
            && let Ok(piece) = self.pieces.try_recv()
        {
            let taken = self.capture.feed(&piece, |sample| {
                take(sample);
                Ok::<(), Infallible>(())
            });
            match taken {
                Ok(()) => {}
            }
        }
    }

    /// Gives every answer that has come.
    pub fn answers(&self) -> impl Iterator<Item = Answer> + '_ {
        self.answers.try_iter()
    }

    /// What was seen so far.
    pub fn summary(&self) -> Summary {
        self.capture.summary()
    }
}

/// Follows orders, and keeps the link alive between them.
fn follow(mut link: Link, asked: &Receiver<Ask>, tell: &Sender<Answer>) {
    loop {
        match asked.try_recv() {
            Ok(Ask { name, command }) => {
                let answer = match link.ask(&command) {
                    Ok(Reply::Value { parameter, value }) => Answer::Value(parameter, value),
                    Ok(reply) => {
                        let said = accepted(&name, reply).map_err(|error| error.to_string());
                        Answer::Said(said.map(|answer| format!("{name}: {answer}")))
                    }
                    Err(error) => {
                        let _ = tell.send(Answer::Said(Err(error.to_string())));
                        return;
                    }
                };
                if tell.send(answer).is_err() {
                    return;
                }
            }
            Err(TryRecvError::Empty) => {
                if let Err(error) = link.listen(LISTENS) {
                    let _ = tell.send(Answer::Said(Err(error.to_string())));
                    return;
                }
            }
            // The scope has gone.
            Err(TryRecvError::Disconnected) => return,
        }
    }
}
