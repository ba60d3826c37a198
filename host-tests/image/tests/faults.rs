//! Each fault injected once into the running image: what it makes of it, and how fast.
//!
//! Latency counts ticks from the first tick that could see the fault: 0 is that tick itself. The drive is looked at
//! at its pin.

mod common;

use bristle_core::command::{Changes, Command, Reply};
use bristle_core::experiment::{Bounds, Experiment};
use bristle_core::parameters::ENTRIES;
use bristle_core::supervisor::{Fault, State};
use bristle_image::Stop;
use bristle_image::clocks::Cause;
use bristle_image::host::{Session, TICK_CYCLES};

/// A sine of position over two turns and a half, so that the index passes several times a second; at most 8 rad/s.
const SWEEP: Experiment<f32> = Experiment::Reversals {
    amplitude_rad: 8.0,
    period_ticks: 10_000,
};
const SINE: Experiment<f32> = Experiment::Sine {
    amplitude_nm: 0.035,
    period_ticks: 10_000,
};

/// What came of a fault.
struct Outcome {
    name: &'static str,
    seen: String,
    /// Ticks to the latched fault, or to the answer where there is none.
    ticks: u64,
    /// Ticks to the drive's disabling.
    drive_off: Option<u64>,
}

/// A session with an experiment under way for 12,500 ticks, in which both experiments pass all they have.
fn playing<'a>(
    image: &bristle_image::Image,
    table: &'a defmt_decoder::Table,
    experiment: Experiment<f32>,
) -> (Session<'a>, u64) {
    let mut session = Session::new(image, table).unwrap();
    session.arm().unwrap();
    let reply = session
        .ask(&Command::Play(experiment, Bounds::open(u32::MAX)))
        .unwrap();
    assert!(matches!(reply, Reply::Accepted { .. }), "{reply:?}");
    session.run(12_500).unwrap();
    assert_eq!(session.faulted(0), None);
    let now = session.ticks();
    let mut knobs = session.knobs.borrow_mut();
    assert!(knobs.enabled);
    // The tick that could see a fault from now on is number `now`, and ends with the axis's tick after that.
    knobs.watch_from = now + 1;
    drop(knobs);
    (session, now)
}

/// Runs on and takes what the trace and the drive's pin say.
fn outcome(session: &mut Session<'_>, name: &'static str, now: u64, expected: Fault) -> Outcome {
    let (record, fault) = session
        .faulted(now as u32)
        .unwrap_or_else(|| panic!("{name}: no fault"));
    assert_eq!(fault, expected, "{name}");
    assert_eq!(record.status.state(), Some(State::Fault), "{name}");
    let knobs = session.knobs.borrow();
    assert!(!knobs.enabled, "{name}: drive on");
    assert_eq!(knobs.torque_nm, 0.0, "{name}: torque");
    Outcome {
        name,
        seen: format!("fault {}: {}", fault as u8, fault.text()),
        ticks: u64::from(record.tick) - now,
        drive_off: knobs.disabled_at.map(|at| at - now - 2),
    }
}

fn table(outcomes: &[Outcome]) {
    println!("| injected | outcome | ticks to it | ticks to drive off |");
    println!("|---|---|---:|---:|");
    for o in outcomes {
        let off = o.drive_off.map_or("stays on".to_owned(), |t| t.to_string());
        println!("| {} | {} | {} | {off} |", o.name, o.seen, o.ticks);
    }
}

#[test]
fn each_fault_once() {
    let Some(image) = common::firmware() else {
        return;
    };
    let lines = common::table(&image);
    let start = |experiment| playing(&image, &lines, experiment);
    let mut all = Vec::new();

    let (mut s, now) = start(SWEEP);
    s.knobs.borrow_mut().lost_counts = 20;
    s.run(10_000).unwrap();
    let o = outcome(&mut s, "20 counts lost", now, Fault::IndexMismatch);
    // A period of the sweep passes the index at least once.
    assert!(o.ticks < 10_000);
    all.push(o);

    let (mut s, now) = start(SINE);
    s.knobs.borrow_mut().illegal_transition = true;
    s.run(100).unwrap();
    let o = outcome(&mut s, "illegal transition", now, Fault::EncoderIllegal);
    // The tick that reads the flag acts on it.
    assert_eq!((o.ticks, o.drive_off), (0, Some(0)));
    all.push(o);

    let (mut s, now) = start(SINE);
    s.knobs.borrow_mut().stuck = true;
    s.run(15_000).unwrap();
    let o = outcome(&mut s, "stuck encoder", now, Fault::StuckEncoder);
    // Half a period to the torque at which it must move, and the 50 ms that it may take.
    assert!(o.ticks <= 5_500, "{}", o.ticks);
    all.push(o);

    let (mut s, now) = start(SINE);
    s.knobs.borrow_mut().runs_away_nm = Some(2.0);
    s.run(1_000).unwrap();
    let o = outcome(&mut s, "runaway, 2 N m", now, Fault::Overspeed);
    // 2 N m on 2.5e-5 kg m^2 make 314 rad/s in 5 ms against this friction; the observer lags by 1 ms and less.
    assert!(o.ticks <= 100, "{}", o.ticks);
    all.push(o);

    let (mut s, now) = start(SINE);
    s.knobs.borrow_mut().healthy = false;
    s.run(100).unwrap();
    let o = outcome(&mut s, "drive fault", now, Fault::DriveFault);
    assert_eq!((o.ticks, o.drive_off), (0, Some(0)));
    all.push(o);

    all.push(stalled_host(start(SINE)));
    all.push(flooded_trace(start(SINE)));

    let (mut s, now) = start(SINE);
    // A fifth of a tick is allowed; this is a quarter after the next update.
    let next = s.machine.bus().next_tick().unwrap();
    s.machine.bus().hold_tick_until(next + TICK_CYCLES / 4);
    s.run(100).unwrap();
    let o = outcome(&mut s, "tick a quarter late", now, Fault::DeadlineMissed);
    assert_eq!((o.ticks, o.drive_off), (0, Some(0)));
    all.push(o);

    all.push(nan_parameter(start(SINE)));
    all.push(unstable_gain(start(SINE)));
    all.push(watchdog(start(SINE)));
    table(&all);
}

/// No keep-alives and no reading: torque ramps to zero, and control goes on.
fn stalled_host((mut s, now): (Session<'_>, u64)) -> Outcome {
    s.stalled = true;
    s.run(15_000).unwrap();
    s.stalled = false;
    s.run(2_000).unwrap();
    let mut o = outcome(&mut s, "stalled host", now, Fault::CommandTimeout);
    let off = o.drive_off.unwrap();
    // A second without a command, of which up to 50 ms had passed, and at most 90 ms of ramp.
    assert!((9_400..=10_900).contains(&off), "{off}");
    o.ticks = off;
    let ticks = s.ticks();
    assert!(s.heard.continuity.lost > 0);
    // Control never stopped: every tick of the timer was taken.
    assert_eq!(s.machine.cost(55).runs, ticks);
    o.seen += &format!(
        "; torque ramped down, {} samples lost and counted",
        s.heard.continuity.lost
    );
    o
}

/// The host keeps the image armed but does not read: the trace fills, the torque goes on.
fn flooded_trace((mut s, now): (Session<'_>, u64)) -> Outcome {
    s.deaf = true;
    s.run(15_000).unwrap();
    s.deaf = false;
    s.run(3_000).unwrap();
    let report = s.heard.report.unwrap();
    let knobs = s.knobs.borrow();
    assert!(knobs.enabled && knobs.disabled_at.is_none());
    assert_eq!(s.faulted(now as u32), None);
    assert_eq!(report.queue_overruns, 0);
    assert!(report.frames_dropped > 0);
    Outcome {
        name: "flooded trace, 1.5 s",
        seen: format!(
            "{} frames dropped and counted, {} samples missing by number",
            report.frames_dropped, s.heard.continuity.lost
        ),
        ticks: 0,
        drive_off: None,
    }
}

/// Refused with the range; the experiment goes on.
fn nan_parameter((mut s, now): (Session<'_>, u64)) -> Outcome {
    let mut changes = Changes::default();
    changes.add(0, f32::NAN);
    let reply = s.ask(&Command::Set(changes)).unwrap();
    let answered = s.ticks() - now;
    let entry = &ENTRIES[0];
    let refused = Reply::OutOfRange {
        parameter: 0,
        low: entry.low,
        high: entry.high,
    };
    assert_eq!(reply, refused);
    s.run(1_000).unwrap();
    assert_eq!(s.faulted(now as u32), None);
    assert!(s.knobs.borrow().enabled);
    Outcome {
        name: "NaN parameter",
        seen: format!("refused: {} to {}", entry.low, entry.high),
        ticks: answered,
        drive_off: None,
    }
}

/// Refused with the nearest gain that passes, soon enough that no keep-alive is missed; the experiment goes on.
fn unstable_gain((mut s, now): (Session<'_>, u64)) -> Outcome {
    let number = ENTRIES.iter().position(|entry| entry.name == "l1_1_s");
    let mut changes = Changes::default();
    changes.add(number.unwrap() as u8, 10.0);
    let reply = s.ask(&Command::Set(changes)).unwrap();
    let answered = s.ticks() - now;
    let Reply::Unstable { nearest_l1_1_s } = reply else {
        panic!("{reply:?}")
    };
    // Keep-alives wait meanwhile: half of their time-out leaves room for one that is late.
    assert!(answered < 5_000, "{answered}");
    s.run(12_000).unwrap();
    assert_eq!(s.faulted(now as u32), None);
    assert!(s.knobs.borrow().enabled);
    let mut mended = Changes::default();
    mended.add(number.unwrap() as u8, nearest_l1_1_s);
    let reply = s.ask(&Command::Set(mended)).unwrap();
    assert!(matches!(reply, Reply::Accepted { .. }), "{reply:?}");
    Outcome {
        name: "unstable gain, l1 = 10 1/s",
        seen: format!("refused: the nearest that passes is {nearest_l1_1_s}"),
        ticks: answered,
        drive_off: None,
    }
}

/// The tick stops coming: the watchdog resets the chip, and the next boot says so.
fn watchdog((mut s, _): (Session<'_>, u64)) -> Outcome {
    let begun = s.machine.cycles();
    // Until the reset, and not into the next boot, which would be reset again.
    s.machine.bus().hold_tick_until(begun + 205 * TICK_CYCLES);
    assert_eq!(s.run(1_000), Err(Stop::Reset(Cause::Watchdog)));
    let ticks = (s.machine.cycles() - begun) / TICK_CYCLES;
    // 161 counts at 8 kHz after the last feed.
    assert!((190..=202).contains(&ticks), "{ticks}");
    s.heard.records.clear();
    // Boot and some ticks.
    s.run(5_000).unwrap();
    let (record, fault) = s.faulted(0).unwrap();
    assert_eq!((fault, record.tick), (Fault::WatchdogReset, 0));
    let knobs = s.knobs.borrow();
    assert!(!knobs.enabled && knobs.disabled_at.is_some());
    Outcome {
        name: "watchdog: tick held",
        seen: format!("reset, then fault {}: {}", fault as u8, fault.text()),
        ticks,
        // The pin has a pull-down, so that a reset is enough.
        drive_off: Some(ticks),
    }
}
