//! `bristle run` on the virtual axis, and over a link to the control interrupt in a thread of this test.

use bristle_core::command::{Command as Order, MOST_COMMAND_BYTES, Reply};
use bristle_core::controller::{self, Controller, Input};
use bristle_core::parameters::{BENCH, Config, Parameters};
use bristle_core::status::{PROTOCOL_VERSION, Report};
use bristle_core::supervisor::Request;
use bristle_core::trace;
use bristle_core::wire::Decoder;
use bristle_gap::believed::Noise;
use bristle_gap::{AxisFile, Believed, Log};
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

fn axis_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../axes/bench.toml")
}

fn bristle(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bristle"));
    command
        .current_dir(folder)
        .arg("run")
        .args(words)
        .arg("--axis")
        .arg(axis_path());
    command
}

fn run(folder: &Path, words: &[&str]) -> Output {
    bristle(folder, words).output().unwrap()
}

fn header(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().next().unwrap().to_owned()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

const PLAN: &str = "[plan]\nrest_s = 0.1\n\
    [[experiment]]\nkind = \"prbs\"\nseconds = 0.5\n\
    [[experiment]]\nkind = \"sine\"\nseconds = 1\nmost_travel_rad = 0.3\n\
    [[experiment]]\nkind = \"moves\"\nmove_s = 0.2\nseconds = 0.5\n";

#[test]
fn a_plan_of_three_leaves_three_logs_and_their_results() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("plan.toml"), PLAN).unwrap();
    let output = run(folder.path(), &["plan.toml", "--out", "logs"]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        text.contains("3 of 3 experiments") && text.contains("travel bound"),
        "{text}"
    );
    let logs = folder.path().join("logs");
    let expected = ["01-prbs.csv", "02-sine.csv", "03-moves.csv", "run.json"];
    assert_eq!(names(&logs), expected);
    let json = std::fs::read(logs.join("run.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["planned"], 3);
    let first = header(&logs.join("01-prbs.csv"));
    for (i, (name, ended)) in [
        ("01-prbs.csv", "time is over"),
        ("02-sine.csv", "travel bound"),
        ("03-moves.csv", "time is over"),
    ]
    .into_iter()
    .enumerate()
    {
        let log = Log::read(logs.join(name)).unwrap();
        let result = &json["experiments"][i];
        assert_eq!(result["samples"], log.len(), "{result}");
        assert_eq!(result["ended"], ended);
        assert_eq!(header(&logs.join(name)), first);
    }
    // The log is what the other commands take.
    let observed = Command::new(env!("CARGO_BIN_EXE_bristle"))
        .current_dir(folder.path())
        .args([
            "observe",
            "logs/03-moves.csv",
            "--out",
            "states.csv",
            "--axis",
        ])
        .arg(axis_path())
        .output()
        .unwrap();
    assert!(observed.status.success(), "{observed:?}");
}

#[test]
fn bad_words_and_plans_are_one_line_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path();
    std::fs::write(place.join("bad.toml"), "[[experiment]]\nkind = \"sinus\"\n").unwrap();
    std::fs::write(
        place.join("much.toml"),
        "[[experiment]]\nkind = \"sine\"\nmost_speed_rad_s = 1e6\n",
    )
    .unwrap();
    let before = names(place);
    for (words, expected) in [
        (
            &["bad.toml", "--out", "logs"][..],
            "bad.toml:2:8: unknown kind `sinus`; did you mean \"sine\"?",
        ),
        (
            &["much.toml", "--out", "logs"],
            "much.toml:3:20: most_speed_rad_s is 1000000.0, and the axis allows 314.0 rad/s; ",
        ),
        (
            &["nothing.toml", "--out", "logs"],
            "nothing.toml: there is no such file; ",
        ),
        (
            &["wobble", "--out", "log.csv"],
            "wobble: is no experiment, and there is no such file; ",
        ),
        (
            &["sine", "--out", "log.csv", "--on", "image", "--truth"],
            "--truth: is for --on virtual only; ",
        ),
        (
            &["sine", "--out", "log.csv", "--on", "target"],
            "--on target: needs the server of the board's link; ",
        ),
        (
            &[
                "sine",
                "--out",
                "log.csv",
                "--on",
                "image",
                "--emulator",
                "none",
            ],
            "none: there is no such file; ",
        ),
        (
            &["sine", "--out", "log.csv", "--effect", "no.such"],
            "effect no.such does not exist; ",
        ),
    ] {
        let output = run(place, words);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {text}");
        assert!(text.contains(expected), "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
        assert_eq!(names(place), before, "{words:?}");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_was_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let child = bristle(
        folder.path(),
        &["sine", "--out", "log.csv", "--seconds", "1500"],
    )
    .args(["--json", "-"])
    .stdout(Stdio::piped())
    .stderr(Stdio::piped())
    .spawn()
    .unwrap();
    // Once rows have gone to the temporary file.
    let begun = Instant::now();
    let grows = || {
        std::fs::read_dir(folder.path()).unwrap().any(|entry| {
            entry
                .unwrap()
                .metadata()
                .is_ok_and(|about| about.len() > 100_000)
        })
    };
    while !grows() {
        assert!(
            begun.elapsed() < Duration::from_secs(60),
            "no row in a minute"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    let killed = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["interrupted"], true);
    assert_eq!(json["experiments"][0]["ended"], "stopped");
    let log = Log::read(folder.path().join("log.csv")).unwrap();
    assert_eq!(json["experiments"][0]["samples"], log.len());
    assert_eq!(names(folder.path()), ["log.csv"]);
}

/// The control interrupt on the axis of axes/bench.toml, in real time, until its client goes.
fn firmware(mut link: TcpStream, parameters: &Parameters) {
    let file = AxisFile::read(axis_path()).unwrap();
    let axis = Believed::new(&file, &axis_path()).unwrap();
    let mut axis = axis.axis(axis.model, 1e-4, Noise::default(), 1).unwrap();
    let config = parameters.build(1e-4, 1).unwrap();
    let mut controller = Controller::new(&config, axis.reading().raw(), false);
    let mut frames = Decoder::<MOST_COMMAND_BYTES>::new();
    let mut orders = std::collections::VecDeque::new();
    let mut buffer = [0; 1024];
    link.set_nonblocking(true).unwrap();
    let begun = Instant::now();
    for tick in 0_u64.. {
        match link.read(&mut buffer) {
            Ok(0) => return,
            Ok(count) => assert_eq!(frames.feed(&buffer[..count]), count),
            // A client that leaves samples unread resets the connection.
            Err(error) if error.kind() == ErrorKind::ConnectionReset => return,
            Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
        }
        let mut out = Vec::new();
        while let Some(frame) = frames.next_frame() {
            let (number, order) = Order::read(&frame);
            let (reply, order) = follow(order.unwrap(), parameters, &config);
            orders.extend(order);
            let mut buffer = [0; MOST_COMMAND_BYTES];
            out.extend_from_slice(reply.write(number, &mut buffer).unwrap());
        }
        let mut frame = trace::begin(&mut buffer);
        for _ in 0..10 {
            let input = Input {
                raw: axis.reading().raw(),
                ..Input::default()
            };
            if let Some(order) = orders.pop_front() {
                controller.obey(&config, &order);
            }
            let output = controller.step(&config, &input);
            axis.advance(f64::from(output.torque_nm));
            trace::put(&mut frame, &output.record);
        }
        out.extend_from_slice(frame.finish(10).unwrap());
        if tick % 100 == 0 {
            let report = Report {
                protocol_version: PROTOCOL_VERSION,
                ..Report::default()
            };
            out.extend_from_slice(report.write(&mut buffer).unwrap());
        }
        link.set_nonblocking(false).unwrap();
        if link.write_all(&out).is_err() {
            return;
        }
        link.set_nonblocking(true).unwrap();
        std::thread::sleep(Duration::from_millis(tick).saturating_sub(begun.elapsed()));
    }
}

fn follow(
    order: Order,
    parameters: &Parameters,
    config: &Config,
) -> (Reply, Option<controller::Order>) {
    let accepted = Reply::Accepted {
        parameter_version: 0,
    };
    let request = |request| (accepted, Some(controller::Order::Request(request)));
    match order {
        Order::KeepAlive => request(Request::KeepAlive),
        Order::Arm => request(Request::Arm),
        Order::Disarm => request(Request::Disarm),
        Order::Stop => request(Request::Stop),
        Order::ClearFault => request(Request::ClearFault),
        Order::Play(experiment, bounds) => {
            match bounds.admit(&experiment, &parameters.limits(1e-4), 1e-4) {
                Ok(()) => (accepted, Some(config.play(experiment, &bounds))),
                Err(refusal) => (Reply::Refused(refusal), None),
            }
        }
        Order::Get(parameter) => {
            let value = parameters.get(parameter).unwrap();
            (Reply::Value { parameter, value }, None)
        }
        other => panic!("nobody asks for {other:?}"),
    }
}

/// Runs over a link to the interrupt.
fn over_a_link(folder: &Path, words: &[&str], parameters: Parameters) -> Output {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", listener.local_addr().unwrap());
    let server = std::thread::spawn(move || firmware(listener.accept().unwrap().0, &parameters));
    let output = bristle(folder, words)
        .args(["--on", "target", "--to", &address])
        .output()
        .unwrap();
    server.join().unwrap();
    output
}

#[test]
fn over_a_link_the_log_is_that_of_the_virtual_axis() {
    let folder = tempfile::tempdir().unwrap();
    let (linked, alone) = ("linked.csv", "alone.csv");
    let output = over_a_link(
        folder.path(),
        &["sine", "--seconds", "1.5", "--out", linked],
        BENCH,
    );
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("time is over"), "{text}");
    let output = run(folder.path(), &["sine", "--seconds", "1.5", "--out", alone]);
    assert!(output.status.success(), "{output:?}");
    let [linked, alone] = [linked, alone].map(|name| folder.path().join(name));
    assert_eq!(header(&linked), header(&alone));
    let [linked, alone] = [linked, alone].map(|path| Log::read(path).unwrap());
    assert_eq!(linked.len(), 15_000);
    // In open loop from rest the axis does the same, count by count.
    assert_eq!(linked.position, alone.position);
    assert_eq!(linked.efforts, alone.efforts);
    assert!(linked.gaps().is_empty());
    // It has moved: 1.35 times stiction breaks away.
    assert!(linked.position.values.iter().any(|&counts| counts > 300.0));
}

#[test]
fn over_a_link_a_plan_runs_and_a_bound_ends_an_experiment() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("plan.toml"), PLAN).unwrap();
    let output = over_a_link(folder.path(), &["plan.toml", "--out", "logs"], BENCH);
    assert!(output.status.success(), "{output:?}");
    let json = std::fs::read(folder.path().join("logs/run.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let ends: Vec<_> = (0..3).map(|i| &json["experiments"][i]["ended"]).collect();
    assert_eq!(ends, ["time is over", "travel bound", "time is over"]);
    assert_eq!(json["experiments"][0]["samples"], 5000);
    assert_eq!(json["experiments"][2]["samples"], 5000);
    assert_eq!(json["experiments"][2]["lost"], 0);
}

#[test]
fn over_a_link_what_does_not_fit_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["sine", "--seconds", "1", "--out", "log.csv"];
    let weak = Parameters {
        torque_limit_nm: 0.03,
        ..BENCH
    };
    let output = over_a_link(folder.path(), &words, weak);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(
        text.starts_with("start: refused: the experiment asks for more torque than its bound or the controller's limit; "),
        "{text}"
    );
    let coarse = Parameters {
        counts_per_rev: 4096.0,
        ..BENCH
    };
    let output = over_a_link(folder.path(), &words, coarse);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(
        text.contains("the firmware has 4096 counts a turn, and the axis file 16384; "),
        "{text}"
    );
    assert!(names(folder.path()).is_empty());
}

#[test]
fn over_a_link_every_experiment_makes_a_log_that_identify_and_diagnose_take() {
    let folder = tempfile::tempdir().unwrap();
    let kinds = [
        "sine",
        "pulse",
        "reversals",
        "ladder",
        "prbs",
        "dahl-ramp",
        "break-away",
        "multisine",
        "moves",
    ];
    let steps = kinds.map(|kind| format!("[[experiment]]\nkind = \"{kind}\"\nseconds = 1.5\n"));
    let plan = format!("[plan]\nrest_s = 0.1\n{}", steps.concat());
    std::fs::write(folder.path().join("plan.toml"), plan).unwrap();
    let output = over_a_link(folder.path(), &["plan.toml", "--out", "linked"], BENCH);
    assert!(output.status.success(), "{output:?}");
    let output = run(folder.path(), &["plan.toml", "--out", "alone"]);
    assert!(output.status.success(), "{output:?}");
    let logs = |place: &str| {
        (1..)
            .zip(kinds)
            .map(|(n, kind)| format!("{place}/{n:02}-{kind}.csv"))
            .collect::<Vec<_>>()
    };
    for (linked, alone) in logs("linked").iter().zip(&logs("alone")) {
        let [linked, alone] = [linked, alone].map(|log| folder.path().join(log));
        assert_eq!(header(&linked), header(&alone));
        assert_eq!(
            Log::read(&linked).unwrap().len(),
            15_000,
            "{}",
            linked.display()
        );
    }
    for (command, out, logs) in [
        ("identify", "--out", &logs("linked")[6..]),
        ("diagnose", "--report", &logs("linked")[7..]),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_bristle"))
            .current_dir(folder.path())
            .args([command, out, "result", "--json", "result.json", "--axis"])
            .arg(axis_path())
            .args(logs)
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        let json = std::fs::read(folder.path().join("result.json")).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
        assert_eq!(json["schema"], 1, "{command}");
    }
}
