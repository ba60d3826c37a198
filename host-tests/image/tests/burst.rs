//! Bursts in the image: each trigger, and samples that equal those of the stream, also where the stream lost them.

mod common;

use bristle_core::burst::{BURST_SAMPLES, Quantity, Setting, Stage, Trigger};
use bristle_core::command::{Command, Reply};
use bristle_core::experiment::{Bounds, Experiment};
use bristle_core::supervisor::Fault;
use bristle_core::trace::Record;
use bristle_image::host::Session;

const SINE: Experiment<f32> = Experiment::Sine {
    amplitude_nm: 0.035,
    period_ticks: 10_000,
};
const BEFORE: u16 = 500;
const AFTER: u16 = 1000;

fn arm(session: &mut Session<'_>, trigger: Trigger) {
    let setting = Setting {
        trigger,
        before: BEFORE,
        after: AFTER,
    };
    let reply = session.ask(&Command::BurstArm(setting)).unwrap();
    assert!(matches!(reply, Reply::Burst { .. }), "{reply:?}");
}

/// Tick of the event, and all samples.
fn read(session: &mut Session<'_>) -> (u32, Vec<Record>) {
    let reply = session.ask(&Command::BurstStage).unwrap();
    let Reply::Burst {
        stage: Stage::Full,
        samples,
        event_tick,
    } = reply
    else {
        panic!("{reply:?}")
    };
    session.heard.bursts.clear();
    let mut records = Vec::new();
    while records.len() < usize::from(samples) {
        let first = records.len() as u16;
        session.ask(&Command::BurstRead(first)).unwrap();
        let (from, part) = session.heard.bursts.pop().expect("room on the link");
        assert_eq!(from, first);
        records.extend(part);
    }
    assert_eq!(records.len(), usize::from(BEFORE + AFTER));
    let expected: Vec<u32> = (0..records.len() as u32)
        .map(|k| event_tick - u32::from(BEFORE) + k)
        .collect();
    let ticks: Vec<u32> = records.iter().map(|record| record.tick).collect();
    assert_eq!(ticks, expected);
    (event_tick, records)
}

#[test]
fn each_trigger_keeps_the_samples_about_its_event() {
    let Some(image) = common::firmware() else {
        return;
    };
    let table = common::table(&image);
    let mut session = Session::new(&image, &table).unwrap();
    session.arm().unwrap();
    let play = Command::Play(SINE, Bounds::open(u32::MAX));
    for trigger in [
        Trigger::Reversal { counts: 2 },
        Trigger::BreakAway {
            rest: 100,
            counts: 3,
        },
        Trigger::Above(Quantity::Torque, 0.02),
        Trigger::Below(Quantity::Velocity, -1.0),
        Trigger::Command,
        Trigger::Fault,
    ] {
        arm(&mut session, trigger);
        session.run(2000).unwrap();
        session.ask(&play).unwrap();
        session.run(12_000).unwrap();
        match trigger {
            Trigger::Command => {
                session.ask(&Command::BurstFire).unwrap();
            }
            Trigger::Fault => session.knobs.borrow_mut().illegal_transition = true,
            _ => {}
        }
        session.run(2000).unwrap();
        let (event, records) = read(&mut session);
        // As the stream had them.
        let stream = &session.heard.records;
        let begin = stream
            .iter()
            .position(|r| r.tick == records[0].tick)
            .unwrap();
        assert_eq!(stream[begin..begin + records.len()], records[..]);
        let (last, at) = (
            &records[usize::from(BEFORE) - 1],
            &records[usize::from(BEFORE)],
        );
        assert_eq!(at.tick, event);
        match trigger {
            Trigger::Command => {}
            Trigger::Fault => {
                assert_eq!(last.status.fault(), Some(Fault::None));
                assert_eq!(at.status.fault(), Some(Fault::EncoderIllegal));
            }
            Trigger::Above(..) => assert!(last.torque_ref_nm < 0.02 && at.torque_ref_nm >= 0.02),
            Trigger::Below(..) => assert!(last.velocity_rad_s > -1.0 && at.velocity_rad_s <= -1.0),
            // The furthest place before it is two counts away.
            Trigger::Reversal { .. } => {
                let places = || records[..usize::from(BEFORE)].iter().map(|r| r.counts);
                let (low, high) = (places().min().unwrap(), places().max().unwrap());
                assert!(at.counts == high - 2 || at.counts == low + 2, "{at:?}");
            }
            Trigger::BreakAway { .. } => {
                // Bristles may bend for a while between the rest and its third count.
                let rested = records[..usize::from(BEFORE)].windows(100).any(|rest| {
                    let rests_at = |c: &i32| rest.iter().all(|r| r.counts.abs_diff(*c) <= 1);
                    (at.counts - 10..at.counts + 10)
                        .filter(|c| at.counts.abs_diff(*c) >= 3)
                        .any(|c| rests_at(&c))
                });
                assert!(rested, "{at:?}");
            }
        }
        session.ask(&Command::Stop).unwrap();
        session.run(1500).unwrap();
        println!("{trigger:?}: {} samples about tick {event}", records.len());
    }
}

#[test]
fn what_the_link_lost_is_in_the_burst() {
    let Some(image) = common::firmware() else {
        return;
    };
    let table = common::table(&image);
    let mut session = Session::new(&image, &table).unwrap();
    session.arm().unwrap();
    session
        .ask(&Command::Play(SINE, Bounds::open(u32::MAX)))
        .unwrap();
    arm(&mut session, Trigger::Reversal { counts: 2 });
    // The host does not read for 0.8 s, in which the axis reverses; the link holds 50 ms.
    session.deaf = true;
    session.run(8000).unwrap();
    session.deaf = false;
    session.run(500).unwrap();
    let lost = session.heard.continuity.lost;
    let (event, records) = read(&mut session);
    let heard = |record: &Record| session.heard.records.iter().any(|r| r.tick == record.tick);
    let missed = records.iter().filter(|record| !heard(record)).count();
    assert!(lost > 0 && missed > 0, "{lost} lost, {missed} of the burst");
    println!("{lost} samples lost by the link, {missed} of them in the burst about tick {event}");
}

#[test]
fn a_burst_beyond_its_memory_is_refused() {
    let Some(image) = common::firmware() else {
        return;
    };
    let table = common::table(&image);
    let mut session = Session::new(&image, &table).unwrap();
    session.run(6000).unwrap();
    let setting = Setting {
        trigger: Trigger::Command,
        before: 2000,
        after: 2000,
    };
    let reply = session.ask(&Command::BurstArm(setting)).unwrap();
    assert_eq!(
        reply,
        Reply::BurstRefused {
            most: BURST_SAMPLES as u16
        }
    );
    let reply = session.ask(&Command::BurstStage).unwrap();
    assert!(
        matches!(
            reply,
            Reply::Burst {
                stage: Stage::Idle,
                ..
            }
        ),
        "{reply:?}"
    );
}
