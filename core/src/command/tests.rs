use super::*;
use crate::experiment::fields::is_playable;
use crate::wire::Decoder;
use proptest::prelude::*;

fn there_and_back(command: Command) -> (u16, Option<Command>) {
    let mut buffer = [0; MOST_COMMAND_BYTES];
    let mut decoder = Decoder::<MOST_COMMAND_BYTES>::new();
    decoder.feed(command.write(513, &mut buffer).unwrap());
    Command::read(&decoder.next_frame().unwrap())
}

#[test]
fn every_command_comes_back() {
    let mut changes = Changes::default();
    for number in 0..MOST_CHANGES as u8 {
        assert!(changes.add(number, f32::from(number) * 0.1));
    }
    assert!(!changes.add(0, 0.0));
    let mut commands = std::vec![
        Command::KeepAlive,
        Command::Arm,
        Command::Disarm,
        Command::Stop,
        Command::ClearFault,
        Command::Set(changes),
        Command::Set(Changes::default()),
        Command::Get(3),
        Command::BurstFire,
        Command::BurstStage,
        Command::BurstRead(500),
        Command::TablePut(TablePart {
            backward: true,
            first: 480,
            torques_nm: core::array::from_fn(|i| i as f32),
        }),
        Command::TableUse(Span::Period(6.25), 0.1),
        Command::TableUse(Span::Stroke(-1.0, 2.5), 0.2),
        Command::TableDrop,
    ];
    for trigger in [
        Trigger::Command,
        Trigger::Fault,
        Trigger::Reversal { counts: 300 },
        Trigger::BreakAway {
            rest: 301,
            counts: 3,
        },
        Trigger::Above(Quantity::Deflection, 1e-3),
        Trigger::Above(Quantity::Velocity, -2.0),
        Trigger::Below(Quantity::Torque, 0.5),
    ] {
        commands.push(Command::BurstArm(Setting {
            trigger,
            before: 400,
            after: 600,
        }));
    }
    let bounds = Bounds {
        travel_rad: 1.0,
        speed_rad_s: 2.0,
        torque_nm: 3.0,
        ticks: 4,
    };
    for experiment in [
        Experiment::Sine {
            amplitude_nm: 0.035,
            period_ticks: 10_000,
        },
        Experiment::PulseThenOscillation {
            pulse_nm: 1.0,
            pulse_ticks: 2,
            mean_nm: 3.0,
            amplitude_nm: 4.0,
            period_ticks: 5,
        },
        Experiment::Reversals {
            amplitude_rad: 1.0,
            period_ticks: 2,
        },
        Experiment::SpeedLadder {
            top_rad_s: 1.0,
            ratio: 0.5,
            hold_ticks: 3,
        },
        Experiment::Prbs {
            amplitude_nm: 1.0,
            clock_ticks: 2,
        },
        Experiment::DahlRamp {
            amplitude_rad: 1.0,
            period_ticks: 2,
        },
        Experiment::RestAndBreakAway {
            peak_nm: 1.0,
            ramp_ticks: 2,
            dwell_ticks: 3,
        },
        Experiment::Multisine {
            amplitude_nm: 1.0,
            period_ticks: 2000,
        },
        Experiment::Moves {
            length_rad: 1.0,
            move_ticks: 2,
            pause_ticks: 3,
            pauses: 4,
        },
    ] {
        assert!(is_playable(&experiment));
        commands.push(Command::Play(experiment, bounds));
    }
    for command in commands {
        assert_eq!(there_and_back(command), (513, Some(command)));
    }
}

#[test]
fn every_reply_comes_back() {
    for reply in [
        Reply::Accepted {
            parameter_version: 9,
        },
        Reply::OutOfRange {
            parameter: 2,
            low: -1.0,
            high: 1.0,
        },
        Reply::Inconsistent,
        Reply::Unstable {
            nearest_l1_1_s: 900.0,
        },
        Reply::Malformed,
        Reply::Busy,
        Reply::Value {
            parameter: 1,
            value: 2.0,
        },
        Reply::Refused(Refusal::Torque),
        Reply::Burst {
            stage: Stage::Taking,
            samples: 1000,
            event_tick: 70_000,
        },
        Reply::BurstRefused { most: 1024 },
    ] {
        let mut buffer = [0; MOST_COMMAND_BYTES];
        let mut decoder = Decoder::<MOST_COMMAND_BYTES>::new();
        decoder.feed(reply.write(7, &mut buffer).unwrap());
        let frame = decoder.next_frame().unwrap();
        assert_eq!(Reply::read(&frame), Some((7, reply)));
        assert_eq!(Command::read(&frame).1, None);
    }
}

#[test]
fn parameters_are_found_by_name() {
    assert_eq!(parameter("inertia_kg_m2"), Some(0));
    assert_eq!(parameter("nothing"), None);
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(payload in proptest::collection::vec(any::<u8>(), 0..200)) {
        for kind in [Kind::Command, Kind::Reply, Kind::Status, Kind::Samples, Kind::Burst] {
            let frame = Frame { kind, count: 1, payload: &payload };
            let (number, command) = Command::read(&frame);
            let _ = Reply::read(&frame);
            let _ = crate::status::Report::read(&frame);
            let _ = crate::trace::samples(&frame).count();
            let _ = crate::trace::burst(&frame).map(|(_, samples)| samples.count());
            // What is read is written the same way again, NaN payloads and all.
            if let Some(command) = command {
                let mut buffer = [0; MOST_COMMAND_BYTES];
                let written = command.write(number, &mut buffer).unwrap();
                prop_assert_eq!(&written[6..written.len() - 4], &payload[..]);
            }
        }
    }

    #[test]
    fn any_operation_with_any_body_is_safe(
        operation in 0_u8..16, body in proptest::collection::vec(any::<u8>(), 0..40),
    ) {
        let payload = [&[1, 2, operation], &body[..]].concat();
        let frame = Frame { kind: Kind::Command, count: 1, payload: &payload };
        let (number, _) = Command::read(&frame);
        prop_assert_eq!(number, 0x0201);
    }
}
