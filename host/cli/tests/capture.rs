//! `bristle capture` from every source that needs no board.

use bristle_core::supervisor::{Fault, Limit, State};
use bristle_core::trace::{self, MOST_SAMPLES, Record, SAMPLE_BYTES, Status};
use bristle_core::wire::OVERHEAD_BYTES;
use bristle_gap::Log;
use std::io::Write;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

fn bristle(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bristle"));
    command.current_dir(folder).arg("capture");
    command
}

fn run(folder: &Path, words: &[&str]) -> Output {
    bristle(folder).args(words).output().unwrap()
}

/// The stream of some ticks, ten to a frame.
fn stream(ticks: std::ops::Range<u32>) -> Vec<u8> {
    let ticks: Vec<u32> = ticks.collect();
    let frames = ticks.chunks(10).map(|ticks| {
        let mut buffer = [0; MOST_SAMPLES * SAMPLE_BYTES + OVERHEAD_BYTES];
        let mut frame = trace::begin(&mut buffer);
        for &tick in ticks {
            let fault = if tick < 500 {
                Fault::None
            } else {
                Fault::DriveFault
            };
            trace::put(
                &mut frame,
                &Record {
                    tick,
                    counts: tick as i32,
                    torque_ref_nm: 0.01,
                    status: Status::new(State::Armed, Limit::None, fault, 0),
                    ..Record::default()
                },
            );
        }
        frame.finish(ticks.len() as u8).unwrap().to_vec()
    });
    frames.collect::<Vec<_>>().concat()
}

/// Names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn a_file_becomes_a_log_with_its_losses_and_faults_told() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = [stream(0..400), stream(420..600)].concat();
    bytes[300] ^= 1;
    std::fs::write(folder.path().join("trace.bin"), bytes).unwrap();
    let words = ["--from", "trace.bin", "--out", "log.csv.gz", "--json", "-"];
    let output = run(folder.path(), &words);
    assert!(output.status.success(), "{output:?}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["samples"], &json["lost"]), (&570.into(), &30.into()));
    assert_eq!(
        (&json["gaps"], &json["damaged_frames"]),
        (&2.into(), &1.into())
    );
    assert_eq!(json["faults"][0]["tick"], 500);
    assert_eq!(json["faults"][0]["text"], "drive reports a fault");
    let log = Log::read(folder.path().join("log.csv.gz")).unwrap();
    assert_eq!((log.len(), log.gaps().len()), (570, 2));

    let words = [
        "--from",
        "trace.bin",
        "--out",
        "log.csv",
        "--seconds",
        "0.01",
    ];
    let output = run(folder.path(), &words);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("as long as asked for"), "{text}");
    assert_eq!(Log::read(folder.path().join("log.csv")).unwrap().len(), 90);
}

#[test]
fn standard_input_is_a_source() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = bristle(folder.path())
        .args(["--from", "-", "--out", "log.csv"])
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    child
        .stdin
        .take()
        .unwrap()
        .write_all(&stream(0..100))
        .unwrap();
    assert!(child.wait().unwrap().success());
    assert_eq!(Log::read(folder.path().join("log.csv")).unwrap().len(), 100);
}

#[test]
fn a_server_is_a_source_and_jlink_is_told_the_channel() {
    for (kind, hello) in [
        ("tcp", ""),
        ("jlink", "$$SEGGER_TELNET_ConfigStr=RTTCh;1$$"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("{kind}:{}", listener.local_addr().unwrap());
        let server = std::thread::spawn(move || {
            let (mut link, _) = listener.accept().unwrap();
            let mut heard = vec![0; hello.len()];
            std::io::Read::read_exact(&mut link, &mut heard).unwrap();
            link.write_all(b"SEGGER J-Link V8 - Real time terminal output\r\n")
                .unwrap();
            for piece in stream(0..300).chunks(333) {
                link.write_all(piece).unwrap();
            }
            heard
        });
        let output = run(folder.path(), &["--from", &address, "--out", "log.csv"]);
        assert!(output.status.success(), "{output:?}");
        assert_eq!(server.join().unwrap(), hello.as_bytes());
        assert_eq!(Log::read(folder.path().join("log.csv")).unwrap().len(), 300);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_what_came() {
    for (signal, hang_up) in [("-INT", false), ("-TERM", false), ("-INT", true)] {
        let folder = tempfile::tempdir().unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = format!("tcp:{}", listener.local_addr().unwrap());
        let mut command = if hang_up {
            // Under nohup a lost terminal is ignored, and goes on being so.
            let mut command = Command::new("nohup");
            command
                .current_dir(folder.path())
                .args([env!("CARGO_BIN_EXE_bristle"), "capture"]);
            command
        } else {
            bristle(folder.path())
        };
        let child = command
            .args(["--from", &address, "--out", "log.csv.gz"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (mut link, _) = listener.accept().unwrap();
        // Ends in the midst of a frame, and the line stays open.
        let bytes = stream(0..200);
        link.write_all(&bytes[..bytes.len() - 20]).unwrap();
        std::thread::sleep(Duration::from_millis(300));
        assert!(!names(folder.path()).contains(&"log.csv.gz".to_owned()));
        let kill = |signal: &str| {
            let words = [signal, &child.id().to_string()];
            assert!(Command::new("kill").args(words).status().unwrap().success());
        };
        if hang_up {
            kill("-HUP");
            std::thread::sleep(Duration::from_millis(100));
        }
        kill(signal);
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{output:?}");
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(text.contains("until interrupted"), "{text}");
        assert_eq!(names(folder.path()), ["log.csv.gz"]);
        assert_eq!(
            Log::read(folder.path().join("log.csv.gz")).unwrap().len(),
            190
        );
    }
}

#[test]
fn what_is_no_stream_is_one_line_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("text.bin"), "no frames here").unwrap();
    std::fs::write(folder.path().join("short.bin"), stream(0..1)).unwrap();
    // Bound and dropped: nobody listens there.
    let closed = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let cases = [
        ("text.bin", "text.bin: no sample in 14 bytes;"),
        ("short.bin", "short.bin: one sample only in 38 bytes;"),
        ("none.bin", "none.bin: cannot be read:"),
        (".", ".: cannot be read:"),
        (
            &format!("tcp:{closed}"),
            "cannot be read: Connection refused;",
        ),
    ];
    for (source, line) in cases {
        let output = run(folder.path(), &["--from", source, "--out", "log.csv"]);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{source}: {text}");
        assert!(text.contains(line), "{source}: {text}");
        assert_eq!(text.lines().count(), 1, "{source}: {text}");
        assert_eq!(names(folder.path()), ["short.bin", "text.bin"]);
    }
}

#[test]
fn without_a_probe_it_says_so() {
    let folder = tempfile::tempdir().unwrap();
    // No probe has these numbers, so that one that is plugged in is left alone.
    let output = run(folder.path(), &["--probe", "0001:0002", "--out", "log.csv"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert_eq!(text.lines().count(), 1, "{text}");
    let expected = if cfg!(feature = "probe") {
        "probe: no debug probe found;"
    } else {
        "--probe: this build has no support for debug probes;"
    };
    assert!(text.starts_with(expected), "{text}");
    assert!(names(folder.path()).is_empty());
}

/// Reads an MCAP file with the format's own Python library: messages of each topic, the last tick and position, and what
/// the file says of its losses.
const READ_MCAP: &str = r#"
import json, sys
from mcap.reader import make_reader
with open(sys.argv[1], "rb") as file:
    reader = make_reader(file)
    counts, last = {}, None
    for schema, channel, message in reader.iter_messages():
        counts[channel.topic] = counts.get(channel.topic, 0) + 1
        assert schema.encoding == "jsonschema" and channel.message_encoding == "json"
        if channel.topic == "/axis":
            last = json.loads(message.data)
            assert set(last) == set(json.loads(schema.data)["properties"])
    about = {record.name: record.metadata for record in reader.iter_metadata()}
    assert reader.get_summary().statistics.message_count == sum(counts.values())
print(counts["/axis"], last["tick"], last["position_counts"], about["result"]["samples lost, by their numbers"],
      about["capture"]["firmware_sha256"][:8])
"#;

#[test]
fn mcap_is_read_by_the_formats_own_python_library() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = [stream(0..30_000), stream(30_100..40_000)].concat();
    std::fs::write(folder.path().join("trace.bin"), bytes).unwrap();
    std::fs::write(folder.path().join("image.elf"), "abc").unwrap();
    let words = [
        "--from",
        "trace.bin",
        "--out",
        "log.mcap",
        "--firmware",
        "image.elf",
    ];
    let output = run(folder.path(), &words);
    assert!(output.status.success(), "{output:?}");
    let python = std::env::var("BRISTLE_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has = Command::new(&python).args(["-c", "import mcap"]).output();
    if !has.is_ok_and(|has| has.status.success()) {
        eprintln!("SKIPPED: no Python with the package mcap; name one by BRISTLE_PYTHON");
        return;
    }
    let read = Command::new(python)
        .args(["-c", READ_MCAP, "log.mcap"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&read.stdout);
    // SHA-256 of "abc" begins so, by FIPS 180-2.
    assert_eq!(text.trim(), "39900 39999 39999 100 ba7816bf", "{read:?}");
}
