//! `bristle scope` in a real terminal: tmux starts it, presses its keys and reads the screen. Skipped, loudly, where
//! there is no tmux.

#![cfg(unix)]

mod common;
#[path = "common/on_image.rs"]
mod on_image;

use common::Server;
use on_image::on_image;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

const BRISTLE: &str = env!("CARGO_BIN_EXE_bristle");
/// Screens are waited for on machines that build beside.
const PATIENCE: Duration = Duration::from_secs(60);

fn axis_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes/bench.toml")
}

/// A terminal of 120 x 36 characters with a server of its own; ends with this value.
struct Terminal {
    socket: String,
}

impl Terminal {
    fn start(folder: &Path, name: &str, command: &str) -> Option<Self> {
        if Command::new("tmux").arg("-V").output().is_err() {
            eprintln!("SKIPPED: no tmux; install it to have the scope driven in a terminal");
            return None;
        }
        let terminal = Self {
            socket: format!("bristle-{name}-{}", std::process::id()),
        };
        let started = terminal.tmux(&[
            "-f",
            "/dev/null",
            "new-session",
            "-d",
            "-x",
            "120",
            "-y",
            "36",
            "-c",
            folder.to_str().unwrap(),
            &format!("{command}; echo EXIT $?; sleep 600"),
        ]);
        assert!(started.status.success(), "{started:?}");
        Some(terminal)
    }

    fn tmux(&self, words: &[&str]) -> Output {
        Command::new("tmux")
            .args(["-L", &self.socket])
            .args(words)
            .env("LC_ALL", "C.UTF-8")
            .output()
            .unwrap()
    }

    fn keys(&self, keys: &[&str]) {
        assert!(self.tmux(&[&["send-keys"], keys].concat()).status.success());
    }

    fn screen(&self) -> String {
        let output = self.tmux(&["capture-pane", "-p"]);
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    /// The screen once it shows some words.
    fn shows(&self, words: &str) -> String {
        let until = Instant::now() + PATIENCE;
        loop {
            let screen = self.screen();
            if screen.contains(words) {
                return screen;
            }
            assert!(
                Instant::now() < until,
                "no `{words}` on the screen:\n{screen}"
            );
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.tmux(&["kill-server"]);
    }
}

/// Keeps a screen where the docs say how they are made, if asked for.
fn keep(name: &str, screen: &str) {
    if let Some(folder) = std::env::var_os("BRISTLE_SCREENS") {
        std::fs::write(Path::new(&folder).join(name), screen).unwrap();
    }
}

#[test]
fn it_arms_plays_records_sets_and_triggers_in_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let Some(terminal) = Terminal::start(folder.path(), "drive", &format!("{BRISTLE} scope"))
    else {
        return;
    };
    terminal.shows("idle  limited by: not armed");
    terminal.keys(&["a"]);
    terminal.shows("arm: accepted");
    terminal.shows("armed  limited by:");
    terminal.keys(&["r"]);
    terminal.shows("REC");
    terminal.keys(&["s"]);
    terminal.shows("sine: accepted");
    terminal.shows("experiment plays");
    std::thread::sleep(Duration::from_secs(3));
    keep("sine.txt", &terminal.screen());
    terminal.keys(&["t"]);
    terminal.shows("trigger: reversal");
    terminal.keys(&["+", "+", "Tab", "Tab"]);
    terminal.shows("F over v");
    std::thread::sleep(Duration::from_secs(1));
    keep("trigger.txt", &terminal.screen());
    terminal.keys(&["Tab", "Tab", "-", "-", "t", "t", "t", "t", "t"]);
    terminal.keys(&["p"]);
    for _ in 0..8 {
        terminal.keys(&["Down"]);
    }
    terminal.keys(&["0.5", "Enter"]);
    terminal.shows("breakaway_ratio: accepted, parameters of version 1");
    keep(
        "parameters.txt",
        &terminal.shows("breakaway_ratio                   0.5"),
    );
    terminal.keys(&["9", "Enter"]);
    keep(
        "refused.txt",
        &terminal.shows("breakaway_ratio is out of range"),
    );
    terminal.keys(&["p", "q"]);
    let screen = terminal.shows("EXIT 0");
    assert!(
        screen.contains("scope.mcap:") && screen.contains(" 0 lost"),
        "{screen}"
    );
    let bytes = std::fs::read(folder.path().join("scope.mcap")).unwrap();
    assert!(bytes.len() > 10_000, "{}", bytes.len());
}

#[test]
fn on_the_image_the_scope_watches_and_records() {
    let Some((_alone, image)) = on_image() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let axis = axis_path();
    let command = format!(
        "{BRISTLE} scope {} --axis {}",
        image.join(" "),
        axis.display()
    );
    let Some(terminal) = Terminal::start(folder.path(), "image", &command) else {
        return;
    };
    terminal.shows("emulated firmware");
    terminal.shows("idle  limited by: not armed");
    terminal.keys(&["a"]);
    terminal.shows("armed  limited by:");
    terminal.keys(&["r"]);
    terminal.shows("REC");
    terminal.keys(&["s"]);
    terminal.shows("experiment plays");
    std::thread::sleep(Duration::from_secs(2));
    keep("image.txt", &terminal.screen());
    terminal.keys(&["q"]);
    let screen = terminal.shows("EXIT 0");
    assert!(screen.contains(" 0 lost, 0 faults"), "{screen}");
    let log = bristle_gap::Log::read(folder.path().join("scope.mcap")).unwrap();
    assert!(log.gaps().is_empty());
    // What it was recorded with: the image, and the parameters that it runs on.
    assert_eq!(log.about["firmware_sha256"].len(), 64);
    assert_eq!(log.about["parameter coulomb_nm"], "0.02");
    assert_eq!(log.about["lost"], "0");
}

#[test]
fn what_is_no_terminal_is_refused_in_a_line() {
    let output = Command::new(BRISTLE).arg("scope").output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(
        text.starts_with("scope: needs a terminal to draw in; "),
        "{text}"
    );
}

/// Seconds of processor time that a process has taken, of all its threads.
#[cfg(target_os = "linux")]
fn processor_s(process: &str) -> f64 {
    let text = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    // The name is in brackets and may hold blanks.
    let after = text.rsplit_once(')').unwrap().1;
    let ticks: Vec<f64> = after
        .split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect();
    // From the state, which is no number, on: fields 14 and 15 of the file, a hundredth of a second each.
    (ticks[10] + ticks[11]) / 100.0
}

/// At 10,000 samples a second, recording: a fifth of a core at the most.
#[cfg(target_os = "linux")]
#[test]
fn it_takes_little_of_a_core() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(&axis_path());
    let command = format!(
        "exec {BRISTLE} scope --on target --to tcp:{} --record",
        server.address
    );
    let Some(terminal) = Terminal::start(folder.path(), "load", &format!("sh -c '{command}'"))
    else {
        return;
    };
    terminal.shows("idle");
    terminal.keys(&["a"]);
    terminal.shows("armed  limited by:");
    terminal.keys(&["s"]);
    terminal.shows("experiment plays");
    let found = Command::new("pgrep")
        .args([
            "-f",
            &format!("^{BRISTLE} scope --on target --to tcp:{}", server.address),
        ])
        .output()
        .unwrap();
    let process = String::from_utf8_lossy(&found.stdout);
    let process = process.lines().next().unwrap();
    let recorded = |screen: &str| -> f64 {
        let after = screen.split("REC ").nth(1).unwrap();
        after.split_whitespace().next().unwrap().parse().unwrap()
    };
    let begun = (processor_s(process), recorded(&terminal.screen()));
    std::thread::sleep(Duration::from_secs(10));
    let (taken, samples) = (
        processor_s(process) - begun.0,
        recorded(&terminal.screen()) - begun.1,
    );
    // Per second of the stream, so that a machine that is late does not look idle.
    let share = taken / (samples / 1e4);
    println!(
        "scope: {samples} samples, {:.1} % of a core at 10,000 samples a second",
        100.0 * share
    );
    assert!(samples > 10_000.0, "{samples}");
    assert!(share <= 0.2, "{share}");
}
