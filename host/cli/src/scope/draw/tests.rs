//! Pictures as text, of streams that are made up.

use super::super::trigger::On;
use super::super::*;
use super::draw;
use bristle_core::supervisor::{Fault, Limit};
use bristle_core::trace::{self, MOST_SAMPLES, Record, SAMPLE_BYTES, Status};
use bristle_core::wire::OVERHEAD_BYTES;
use clap::Parser;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers};

#[derive(Parser)]
struct Only {
    #[command(flatten)]
    args: Args,
}

/// A second of a sine; ten ticks are missing, and at 0.9 s there is a fault.
fn stream() -> Vec<u8> {
    let record = |tick: u32| {
        let phase = f64::from(tick) * 1e-3;
        let (limit, fault) = if tick < 9000 {
            (Limit::Slew, Fault::None)
        } else {
            (Limit::Disarmed, Fault::Overspeed)
        };
        Record {
            tick,
            counts: tick as i32,
            velocity_rad_s: phase.cos() as f32,
            torque_ref_nm: phase.sin() as f32,
            z_luenberger_rad: 1e-3,
            z_time_free_rad: -1e-3,
            status: Status::new(State::Armed, limit, fault, 0),
        }
    };
    let ticks: Vec<u32> = (0..10_000)
        .filter(|tick| !(70..80).contains(tick))
        .collect();
    let frames = ticks.chunks(MOST_SAMPLES).map(|ticks| {
        let mut buffer = [0; MOST_SAMPLES * SAMPLE_BYTES + OVERHEAD_BYTES];
        let mut frame = trace::begin(&mut buffer);
        for &tick in ticks {
            trace::put(&mut frame, &record(tick));
        }
        frame.finish(ticks.len() as u8).unwrap().to_vec()
    });
    frames.collect::<Vec<_>>().concat()
}

/// A scope that has heard the stream to its end.
fn scope(words: &[&str]) -> Scope {
    let args = Only::parse_from([&["scope"], words].concat()).args;
    let setup = Setup::new(None).unwrap();
    let feed = Feed::listening(Box::new(io::Cursor::new(stream())), 1e4);
    let mut scope = Scope::new(&args, &setup, feed, "made up".to_owned(), About::new());
    let until = Instant::now() + Duration::from_secs(20);
    let ended = |scope: &Scope| {
        scope
            .buffer
            .last()
            .is_some_and(|point| point.time_s >= 0.9999)
    };
    while (scope.said.0.is_empty() || !ended(&scope)) && Instant::now() < until {
        scope.listen();
        std::thread::sleep(Duration::from_millis(5));
    }
    scope
}

fn picture(scope: &Scope) -> String {
    let mut terminal = Terminal::new(TestBackend::new(120, 36)).unwrap();
    terminal.draw(|frame| draw(frame, scope)).unwrap();
    terminal.backend().to_string()
}

fn press(scope: &mut Scope, keys: &[KeyCode]) {
    for &key in keys {
        scope.event(&Event::Key(KeyEvent::new(key, KeyModifiers::NONE)));
    }
}

#[test]
fn losses_state_limit_and_fault_are_said_in_words() {
    let scope = scope(&[]);
    let picture = picture(&scope);
    for words in [
        "made up  1.00 s  9990 samples, 10 lost",
        "armed  limited by: not armed  fault 3: overspeed",
        "the stream has ended",
        "velocity, rad/s",
        "torque, N m",
        "z over v, rad",
        "F over v, N m",
        "F over x, N m",
        "this source only sends",
    ] {
        assert!(picture.contains(words), "{words}\n{picture}");
    }
    // Braille: something is drawn.
    assert!(
        picture
            .chars()
            .any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)),
        "{picture}"
    );
}

#[test]
fn keys_pause_zoom_scroll_and_trigger() {
    let mut scope = scope(&["--window", "0.5"]);
    assert_eq!(scope.window(), [0.9999 - 0.5, 0.9999]);
    press(&mut scope, &[KeyCode::Char(' '), KeyCode::Left]);
    assert!((scope.window()[1] - 0.9499).abs() < 1e-9);
    assert!(picture(&scope).contains("PAUSED"));
    press(&mut scope, &[KeyCode::Char(' '), KeyCode::Char('+')]);
    assert!((scope.window()[0] - (0.9999 - 0.5 / 1.5)).abs() < 1e-9);
    // An order on a source without a way back is refused in words.
    press(&mut scope, &[KeyCode::Char('a')]);
    assert!(picture(&scope).contains("arm: this source only sends"));
    for _ in 0..5 {
        press(&mut scope, &[KeyCode::Char('t')]);
    }
    assert_eq!(scope.trigger.on, On::Fault);
    press(&mut scope, &[KeyCode::Tab, KeyCode::Char('q')]);
    assert!(scope.quits && scope.plots == Plots::DeflectionOverVelocity);
    assert!(!picture(&scope).contains("F over x"));
}

#[test]
fn the_panel_has_every_parameter_and_takes_numbers() {
    let mut scope = scope(&[]);
    scope.panel.take(0, 2.5246e-5);
    press(&mut scope, &[KeyCode::Char('p')]);
    let shown = picture(&scope);
    assert!(
        shown.contains("inertia_kg_m2") && shown.contains("0.000025246"),
        "{shown}"
    );
    // While it is open, digits are typed, and the other keys do what they do.
    press(
        &mut scope,
        &[KeyCode::Down, KeyCode::Char('4'), KeyCode::Char('0')],
    );
    assert!(picture(&scope).contains("40_"));
    press(&mut scope, &[KeyCode::Enter]);
    assert!(picture(&scope).contains("counts_per_rev: this source only sends"));
    press(&mut scope, &[KeyCode::Esc, KeyCode::Char('q')]);
    assert!(scope.quits);
}

#[test]
fn a_small_terminal_and_no_sample_are_no_reason_to_panic() {
    let args = Only::parse_from(["scope"]).args;
    let setup = Setup::new(None).unwrap();
    let feed = Feed::listening(Box::new(io::empty()), 1e4);
    let mut scope = Scope::new(&args, &setup, feed, String::new(), About::new());
    press(
        &mut scope,
        &[KeyCode::Left, KeyCode::Char(' '), KeyCode::Char('p')],
    );
    for (width, height) in [(1, 1), (20, 5), (300, 100)] {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, &scope)).unwrap();
    }
}

#[test]
fn a_recording_holds_every_sample_of_the_stream() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("seen.csv");
    let args = Only::parse_from(["scope", "--out", path.to_str().unwrap()]).args;
    let setup = Setup::new(None).unwrap();
    let feed = Feed::listening(Box::new(io::Cursor::new(stream())), 1e4);
    let mut scope = Scope::new(&args, &setup, feed, String::new(), About::new());
    press(&mut scope, &[KeyCode::Char('r')]);
    let until = Instant::now() + Duration::from_secs(20);
    while scope
        .buffer
        .last()
        .is_none_or(|point| point.time_s < 0.9999)
        && Instant::now() < until
    {
        scope.listen();
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(picture(&scope).contains("REC 9990 samples"));
    scope.leave().unwrap();
    assert!(
        scope.farewell().contains("seen.csv: 9990 samples, 10 lost"),
        "{}",
        scope.farewell()
    );
    let log = bristle_gap::Log::read(path).unwrap();
    assert_eq!((log.len(), log.gaps().len()), (9990, 1));
}
