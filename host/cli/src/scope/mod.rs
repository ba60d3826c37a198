//! `bristle scope`: a live view of the axis in the terminal.

mod buffer;
mod draw;
mod feed;
mod keys;
mod panel;
mod recording;
mod trigger;

use crate::about;
use crate::on::{On, Place, only};
use crate::output;
use crate::serve::Served;
use crate::setup::{Real, Setup};
use crate::source::{self, Source, plain};
use bristle_core::command::Command;
use bristle_core::supervisor::State;
use bristle_gap::capture::About;
use bristle_gap::experiments::Named;
use bristle_gap::{Believed, InputError};
use buffer::{Buffer, Point};
use feed::{Answer, Feed};
use panel::Panel;
use ratatui::crossterm::event;
use recording::Recording;
use std::io::{self, IsTerminal};
use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use trigger::Trigger;

/// Time between two pictures.
const FRAME: Duration = Duration::from_millis(80);
/// Time in which a stop and a disarm go out at the end.
const LEAVES: Duration = Duration::from_millis(400);
/// Shortest and longest window, s.
const WINDOWS_S: [f64; 2] = [0.005, 40.0];

/// Watch the axis live: velocity, torque, deflection, friction, state and limits, losses; stop it, start it, record it.
///
/// The samples are those of every tick, from the board, the emulated firmware, the virtual axis or a recorded stream;
/// what is shown is thinned so that no peak is lost, what is recorded is all of them. F in the plots is friction by the
/// observer: stiffness times z and viscous friction times velocity, by the axis file. Leaving the scope stops and
/// disarms what it armed.
#[derive(clap::Args)]
#[command(
    after_help = "Keys:\n  q quit   space pause   +/- zoom   left/right scroll   tab plots   t trigger   [ ] level\n  \
                        a arm   e choose an experiment   s start it   x stop   d disarm   c clear a fault\n  r record   p \
                        parameters: up/down choose, a number and Enter set\n\nExamples:\n  bristle scope\n  bristle scope \
                        --on image --axis axes/bench.toml\n  bristle scope --on target --to tcp:localhost:9091 --answers \
                        tcp:localhost:9090 --axis axis.toml --out run.mcap\n  bristle scope --from trace.bin"
)]
pub struct Args {
    /// Axis file; the built-in bench axis where left out.
    #[arg(long, value_name = "FILE")]
    axis: Option<PathBuf>,
    #[command(flatten)]
    place: Place,
    /// Only watch: raw bytes of RTT up channel 1 from a file, `-`, tcp:HOST:PORT or jlink:HOST:PORT.
    #[arg(long, value_name = "SOURCE", conflicts_with = "on")]
    from: Option<Source>,
    #[command(flatten)]
    real: Real,
    /// Time on the screen to begin with.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = output::positive)]
    window: f64,
    /// Recording: CSV, or MCAP where the name ends in .mcap; a further one gets a number.
    #[arg(long, value_name = "FILE", default_value = "scope.mcap")]
    out: PathBuf,
    /// Record from the first sample on.
    #[arg(long)]
    record: bool,
    /// Ends after so much time.
    #[arg(long, value_name = "S", value_parser = output::positive)]
    seconds: Option<f64>,
}

/// Runs the subcommand.
pub fn run(args: &Args) -> Result<(), InputError> {
    if args.place.on != On::Virtual || args.from.is_some() {
        only(args.real.is_given(), "--effect or noise", "virtual")?;
    }
    args.place.consistent()?;
    if !io::stdout().is_terminal() {
        return Err(InputError::new(
            "scope",
            "needs a terminal to draw in",
            "run it in one, or use `bristle capture`",
        ));
    }
    let setup = Setup::new(args.axis.as_ref())?;
    source::catch_interrupts();
    let mut about = about::about(setup.believed.rate_hz, setup.believed.unit);
    about::axis(&mut about, &setup.file);
    args.place.describe(&mut about)?;
    let (feed, name, _emulator) = open(args, &setup)?;
    let mut scope = Scope::new(args, &setup, feed, name, about);
    if args.record {
        scope.record();
    }
    let shown =
        ratatui::try_init().and_then(|mut terminal| scope.show(&mut terminal, args.seconds));
    ratatui::restore();
    let left = scope.leave();
    shown.map_err(|error| {
        InputError::new(
            "scope",
            format!("the terminal does not do as it is told: {}", plain(&error)),
            "see that TERM names it",
        )
    })?;
    output::print(&format!("{}\n", scope.farewell()));
    left
}

/// Where the samples come from, its name, and the emulator that has to live as long.
fn open(
    args: &Args,
    setup: &Setup,
) -> Result<(Feed, String, Option<crate::image::Emulator>), InputError> {
    let axis = &setup.believed;
    if let Some(from) = &args.from {
        let feed = Feed::listening(from.open()?, axis.rate_hz);
        return Ok((feed, from.name().to_owned(), None));
    }
    match args.place.on {
        On::Virtual => {
            let real = args.real.axis(axis)?;
            let served = Served::new(axis, &real, args.real.noise(), args.real.seed())?;
            let failed = |error: io::Error| {
                InputError::new(
                    "127.0.0.1",
                    format!("no port is free: {}", plain(&error)),
                    "end what holds them",
                )
            };
            let listener = TcpListener::bind("127.0.0.1:0").map_err(failed)?;
            let address = listener.local_addr().map_err(failed)?.to_string();
            std::thread::spawn(move || {
                listener
                    .accept()
                    .map(|(client, _)| served.serve(client))
                    .is_ok()
            });
            let feed = Feed::over(&address, None, axis.rate_hz)?;
            Ok((feed, format!("virtual axis, {}", setup.name), None))
        }
        On::Image => {
            let seconds = args
                .seconds
                .map_or(86_400, |seconds| seconds.ceil() as u64 + 60);
            let emulator = args.place.emulator(seconds)?;
            let feed = Feed::over(&emulator.address, None, axis.rate_hz)?;
            Ok((feed, "emulated firmware".to_owned(), Some(emulator)))
        }
        On::Target => {
            let feed = Feed::over(args.place.to(), args.place.answers(), axis.rate_hz)?;
            Ok((feed, args.place.to().to_owned(), None))
        }
    }
}

/// Which plots stand beside the curves over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Plots {
    All,
    DeflectionOverVelocity,
    FrictionOverVelocity,
    FrictionOverPosition,
}

/// Everything that is shown.
struct Scope {
    name: String,
    axis: Believed,
    feed: Feed,
    buffer: Buffer,
    trigger: Trigger,
    panel: Panel,
    plots: Plots,
    experiment: usize,
    window_s: f64,
    /// End of the window, s, while the picture stands.
    paused_s: Option<f64>,
    /// What was said last, and whether it is bad news.
    said: (String, bool),
    recording: Option<Recording>,
    recordings: usize,
    out: PathBuf,
    about: About,
    /// This scope armed it.
    armed: bool,
    quits: bool,
}

impl Scope {
    fn new(args: &Args, setup: &Setup, feed: Feed, name: String, about: About) -> Self {
        let axis = setup.believed.clone();
        Self {
            name,
            axis,
            feed,
            buffer: Buffer::default(),
            trigger: Trigger::default(),
            panel: Panel::default(),
            plots: Plots::All,
            experiment: 0,
            window_s: args.window.clamp(WINDOWS_S[0], WINDOWS_S[1]),
            paused_s: None,
            said: (String::new(), false),
            recording: None,
            recordings: 0,
            out: args.out.clone(),
            about,
            armed: false,
            quits: false,
        }
    }

    fn show(
        &mut self,
        terminal: &mut ratatui::DefaultTerminal,
        seconds: Option<f64>,
    ) -> io::Result<()> {
        // Whoever reads from a terminal that is gone never comes back; then the rest still ends as it should.
        let (send, events) = channel();
        std::thread::spawn(move || {
            while let Ok(event) = event::read()
                && send.send(event).is_ok()
            {}
        });
        let begun = Instant::now();
        let over = |begun: Instant| seconds.is_some_and(|s| begun.elapsed().as_secs_f64() > s);
        while !self.quits && !source::interrupted() && !over(begun) {
            self.listen();
            terminal.draw(|frame| draw::draw(frame, self))?;
            let until = Instant::now() + FRAME;
            while let Some(left) = until.checked_duration_since(Instant::now())
                && !self.quits
            {
                match events.recv_timeout(left) {
                    Ok(event) => self.event(&event),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => self.quits = true,
                }
            }
        }
        Ok(())
    }

    /// Takes what has come.
    fn listen(&mut self) {
        let (buffer, trigger, window_s) = (&mut self.buffer, &mut self.trigger, self.window_s);
        let recording = &mut self.recording;
        let mut failed = None;
        self.feed.samples(|sample| {
            let point = Point::from(sample);
            trigger.sample(&point, window_s);
            buffer.push(point);
            if let Some(its) = recording
                && let Err(error) = its.sample(sample)
            {
                failed = Some(error.to_string());
                *recording = None;
            }
        });
        if let Some(error) = failed {
            self.say(error, true);
        }
        let answers: Vec<Answer> = self.feed.answers().collect();
        for answer in answers {
            match answer {
                Answer::Value(number, value) => self.panel.take(number, value),
                Answer::Said(Ok(text)) => self.say(text, false),
                Answer::Said(Err(text)) => self.say(text, true),
            }
        }
    }

    fn say(&mut self, text: impl Into<String>, bad: bool) {
        self.said = (text.into(), bad);
    }

    /// Sends an order, or says that there is no way back.
    fn order(&mut self, name: &str, command: Command) {
        if !self.feed.ask(name, command) {
            self.say(format!("{name}: this source only sends"), true);
        }
    }

    fn experiment(&self) -> Named {
        Named::ALL[self.experiment % Named::ALL.len()]
    }

    /// The window on the screen, s: where the picture stands, at the trigger's event, or the newest samples.
    fn window(&self) -> [f64; 2] {
        let newest_s = self.buffer.last().map_or(0.0, |point| point.time_s);
        let end_s = self
            .paused_s
            .or_else(|| self.trigger.window_end_s(self.window_s))
            .unwrap_or(newest_s);
        [end_s - self.window_s, end_s]
    }

    /// Begins a recording, or ends the one that runs.
    fn record(&mut self) {
        if let Some(recording) = self.recording.take() {
            let said = recording.end(&self.feed.summary(), self.panel.named().collect());
            return match said {
                Ok(text) => self.say(text, false),
                Err(error) => self.say(error.to_string(), true),
            };
        }
        self.recordings += 1;
        let path = recording::numbered(&self.out, self.recordings);
        let mut about = self.about.clone();
        about.extend(self.panel.named());
        let lost = self.feed.summary().lost;
        match Recording::begin(path, &about, lost) {
            Ok(recording) => {
                self.say(
                    format!("records into {}", recording.path().display()),
                    false,
                );
                self.recording = Some(recording);
            }
            Err(error) => self.say(error.to_string(), true),
        }
    }

    /// Ends the recording, stops and disarms what this scope armed.
    fn leave(&mut self) -> Result<(), InputError> {
        if self.armed && self.state() == Some(State::Armed) {
            self.feed.ask("stop", Command::Stop);
            std::thread::sleep(LEAVES);
            self.feed.ask("disarm", Command::Disarm);
            std::thread::sleep(LEAVES / 2);
        }
        self.listen();
        match self.recording.take() {
            Some(recording) => recording
                .end(&self.feed.summary(), self.panel.named().collect())
                .map(|text| self.say(text, false)),
            None => Ok(()),
        }
    }

    fn state(&self) -> Option<State> {
        self.buffer.last().and_then(|point| point.status.state())
    }

    fn farewell(&self) -> String {
        let summary = self.feed.summary();
        let mut text = format!(
            "{} samples, {} lost, {} faults",
            summary.samples, summary.lost, summary.faults_in_all
        );
        for fault in &summary.faults {
            text += &format!(
                "\nfault {} at {} s: {}",
                fault.number, fault.time_s, fault.text
            );
        }
        if !self.said.0.is_empty() {
            text += &format!("\n{}", self.said.0);
        }
        text
    }
}
