//! A minute with the trace on and a host that stalls now and then: no tick is missed, and no sample is lost without
//! being counted.

mod common;

use bristle_core::command::Command;
use bristle_core::experiment::{Bounds, Experiment};
use bristle_core::supervisor::{Fault, State};
use bristle_image::host::Session;
use std::time::Instant;

/// Ticks of a minute.
const MINUTE: u64 = 600_000;
/// Ticks between two stalls of the host.
const BETWEEN: u64 = 20_000;

#[test]
fn a_minute_with_a_stalling_host() {
    let Some(image) = common::firmware() else {
        return;
    };
    let table = common::table(&image);
    let mut session = Session::new(&image, &table).unwrap();
    session.arm().unwrap();
    let sine = Experiment::Sine {
        amplitude_nm: 0.035,
        period_ticks: 10_000,
    };
    session
        .ask(&Command::Play(sine, Bounds::open(u32::MAX)))
        .unwrap();
    session.keep = false;
    let begun = Instant::now();
    let first = session.ticks();
    let mut stalled = 0;
    let mut round = 0;
    while session.ticks() - first < MINUTE {
        session.run(BETWEEN).unwrap();
        // 10 ms to 900 ms: from what the link holds to just below the command time-out of 1 s.
        let ticks = [100, 400, 700, 2_000, 9_000][round % 5];
        round += 1;
        session.stalled = true;
        session.run(ticks).unwrap();
        session.stalled = false;
        stalled += ticks;
    }
    // What is still in the image comes out within two wake-ups.
    session.run(30).unwrap();
    let speed = (session.ticks() - first) as f64 / begun.elapsed().as_secs_f64();

    let ticks = session.ticks();
    let handled = session.machine.cost(55).runs;
    let last = *session.heard.records.last().unwrap();
    let report = session.heard.report.unwrap();
    let continuity = session.heard.continuity;
    println!(
        "{ticks} ticks, {handled} handled, host stalled for {stalled}; {} samples received, {} lost and counted, \
         {} frames dropped, {} queue overruns; latency at most {}, handler with its follower at most {} estimated \
         cycles; {speed:.0} ticks/s",
        continuity.received,
        continuity.lost,
        report.frames_dropped,
        report.queue_overruns,
        report.latency_cycles[1],
        report.run_cycles[1]
    );
    assert_eq!(handled, ticks);
    assert_eq!(last.status.fault(), Some(Fault::None));
    assert_eq!(last.status.state(), Some(State::Armed));
    assert_eq!(report.queue_overruns, 0);
    // By the samples' own numbers: what did not arrive is known to be missing.
    let seen = continuity.received + continuity.lost;
    assert_eq!(seen, u64::from(last.tick) + 1);
    // All but the last wake-up's samples.
    assert!(ticks - seen <= 20, "{} samples under way", ticks - seen);
    assert!(
        continuity.lost > 0,
        "the stalls were too short to test anything"
    );
    assert_eq!(continuity.restarts, 0);
    // By the image's own count: ten samples to a frame, and the frames that hold none beside them.
    let frames = u64::from(report.frames_dropped);
    assert!(10 * frames >= continuity.lost, "{frames} frames");
    assert_eq!(session.heard.bad_lines, 0);
    assert!(speed > 10_000.0, "{speed:.0} ticks/s");
}
