//! `bristle target` against a stand-in for the firmware behind a server.

use bristle_core::command::{Command as Order, MOST_COMMAND_BYTES, Reply};
use bristle_core::supervisor::{Fault, Limit, State};
use bristle_core::trace::{self, Record, Status};
use bristle_core::wire::Decoder;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Output};
use std::thread::JoinHandle;

/// Answers every order, follows arm and disarm, and gives what it was asked for, without keep-alives.
fn firmware(mut link: TcpStream) -> Vec<Order> {
    let mut heard = Vec::new();
    let mut frames = Decoder::<MOST_COMMAND_BYTES>::new();
    let mut state = State::Idle;
    let mut bytes = [0; 64];
    while let Ok(count @ 1..) = link.read(&mut bytes) {
        let mut rest = &bytes[..count];
        while !rest.is_empty() {
            let taken = frames.feed(rest);
            rest = &rest[taken..];
            while let Some(frame) = frames.next_frame() {
                let (number, order) = Order::read(&frame);
                let order = order.unwrap();
                match order {
                    Order::Arm => state = State::Armed,
                    Order::Disarm => state = State::Idle,
                    _ => {}
                }
                if order != Order::KeepAlive {
                    heard.push(order);
                }
                answer(&mut link, number, order, state);
            }
        }
    }
    heard
}

fn answer(link: &mut TcpStream, number: u16, order: Order, state: State) {
    let reply = match order {
        Order::Set(changes) if changes.iter().any(|(_, value)| value > 1e6) => Reply::OutOfRange {
            parameter: 0,
            low: 1e-7,
            high: 10.0,
        },
        Order::Get(parameter) => Reply::Value {
            parameter,
            value: 0.02,
        },
        _ => Reply::Accepted {
            parameter_version: 4,
        },
    };
    let mut buffer = [0; MOST_COMMAND_BYTES];
    // A program that has gone away reads no more.
    let _ = link.write_all(reply.write(number, &mut buffer).unwrap());
    let mut frame = trace::begin(&mut buffer);
    let record = Record {
        status: Status::new(state, Limit::None, Fault::None, 0),
        ..Record::default()
    };
    trace::put(&mut frame, &record);
    let _ = link.write_all(frame.finish(1).unwrap());
}

fn run(words: &[&str]) -> (Output, Vec<Order>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("tcp:{}", listener.local_addr().unwrap());
    let server: JoinHandle<_> = std::thread::spawn(move || firmware(listener.accept().unwrap().0));
    let output = Command::new(env!("CARGO_BIN_EXE_bristle"))
        .arg("target")
        .args(words)
        .args(["--to", &address])
        .output()
        .unwrap();
    (output, server.join().unwrap())
}

#[test]
fn whoever_arms_stops_and_disarms_at_the_end() {
    let (output, heard) = run(&["arm", "start", "--hold", "0.1"]);
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        text.contains("arm: accepted, parameters of version 4"),
        "{text}"
    );
    assert!(text.contains("now: idle"), "{text}");
    assert_eq!(heard.len(), 4);
    assert_eq!(
        (heard[0], heard[2], heard[3]),
        (Order::Arm, Order::Stop, Order::Disarm)
    );
    assert!(matches!(heard[1], Order::Play(..)));
}

#[test]
fn a_refusal_ends_it_and_still_disarms() {
    let (output, heard) = run(&["arm", "inertia_kg_m2=1e9", "start"]);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{text}");
    assert!(
        text.contains("inertia_kg_m2 is out of range; give 0.0000001 to 10;"),
        "{text}"
    );
    assert_eq!(text.lines().count(), 1, "{text}");
    assert_eq!(heard.last(), Some(&Order::Disarm));
    assert!(!heard.iter().any(|order| matches!(order, Order::Play(..))));
}

#[test]
fn parameters_in_a_row_go_together() {
    let (output, heard) = run(&["l2=0", "l1_1_s=1500", "coulomb_nm"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("l2, l1_1_s: accepted"), "{text}");
    assert!(text.contains("coulomb_nm: 0.02"), "{text}");
    let [Order::Set(changes), Order::Get(_)] = heard.as_slice() else {
        panic!("{heard:?}");
    };
    assert_eq!(
        changes.iter().map(|(_, value)| value).collect::<Vec<_>>(),
        [0.0, 1500.0]
    );
}
