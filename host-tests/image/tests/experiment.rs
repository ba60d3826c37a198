//! The sine experiment of the thesis on the image, from reset to log.

mod common;

use bristle_core::command::{Command, Reply};
use bristle_core::controller::{Controller, Input, Order};
use bristle_core::experiment::Experiment;
use bristle_core::parameters::BENCH;
use bristle_core::supervisor::{Request, State};
use bristle_core::trace::{FLAG_EXPERIMENT, Record};
use bristle_image::host::Session;
use std::fmt::Write;
use std::time::Instant;

/// The experiment: 0.035 N m, 1 s.
const SINE: Experiment<f32> = Experiment::Sine {
    amplitude_nm: 0.035,
    period_ticks: 10_000,
};

/// The host's run of `core` on the counts that the image saw, with the orders at the ticks at which they show.
fn on_the_host(records: &[Record], counts: &[u32]) -> Vec<Record> {
    let config = BENCH.build(1e-4, 1).unwrap();
    let mut controller = Controller::new(&config, 0, false);
    let armed = |r: &Record| r.status.state() == Some(State::Armed);
    let plays = |r: &Record| r.status.flags() & FLAG_EXPERIMENT != 0;
    let arm = records.iter().position(armed);
    let play = records.iter().position(plays);
    let step = |(i, &raw): (usize, &u32)| {
        let order = if Some(i) == arm {
            Some(Order::Request(Request::Arm))
        } else if Some(i) == play {
            Some(Order::Play(SINE))
        } else {
            // Only so that it does not time out; when they come makes no difference.
            (i % 500 == 0).then_some(Order::Request(Request::KeepAlive))
        };
        let input = Input {
            raw,
            drive_healthy: true,
            order,
            ..Input::default()
        };
        controller.step(&config, &input).record
    };
    counts.iter().enumerate().map(step).collect()
}

fn csv(records: &[Record]) -> String {
    let mut text = "time_s,torque_ref_nm,position_counts,z_rad,velocity_rad_s\n".to_owned();
    for r in records {
        let _ = writeln!(
            text,
            "{},{},{},{},{}",
            f64::from(r.tick) * 1e-4,
            r.torque_ref_nm,
            r.counts,
            r.z_time_free_rad,
            r.velocity_rad_s
        );
    }
    text
}

#[test]
fn sine_from_reset_to_log_equals_the_host() {
    let Some(image) = common::firmware() else {
        return;
    };
    let table = common::table(&image);
    let mut session = Session::new(&image, &table).unwrap();
    let armed = session.arm().unwrap();
    let reply = session.ask(&Command::Play(SINE)).unwrap();
    assert!(matches!(reply, Reply::Accepted { .. }), "{reply:?}");
    let begun = Instant::now();
    let first = session.ticks();
    session.run(50_000).unwrap();
    let speed = (session.ticks() - first) as f64 / begun.elapsed().as_secs_f64();

    let heard = &session.heard;
    println!("{}", heard.lines[..heard.lines.len().min(5)].join("\n"));
    println!("armed at tick {}", armed.tick);
    assert_eq!((heard.continuity.lost, heard.bad_lines), (0, 0));
    let records = &heard.records;
    assert_eq!(records[0].tick, 0);
    let counts = &session.knobs.borrow().counts[..records.len()];
    // The image read what the axis gave.
    assert!(
        records
            .iter()
            .zip(counts)
            .all(|(r, &c)| r.counts == c.cast_signed())
    );
    let host = on_the_host(records, counts);
    let moved = records.iter().map(|r| r.counts.abs()).max().unwrap();
    assert_eq!(host.len(), records.len());
    let mut differences = 0;
    for (image, host) in records.iter().zip(&host) {
        let bits = |r: &Record| {
            [
                r.z_luenberger_rad,
                r.z_time_free_rad,
                r.velocity_rad_s,
                r.torque_ref_nm,
            ]
            .map(f32::to_bits)
        };
        if bits(image) != bits(host) || image.status.state() != host.status.state() {
            differences += 1;
            if differences < 5 {
                println!("tick {}: {image:?}\n  host: {host:?}", image.tick);
            }
        }
    }
    assert_eq!(differences, 0);
    println!(
        "{} ticks: z, velocity and torque equal to the host's bit for bit; largest travel {moved} counts",
        records.len()
    );
    // The sine breaks away: z_ss is five counts, and this is two hundred times that.
    assert!(moved > 1000, "{moved} counts");

    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("sine.csv");
    std::fs::write(&path, csv(records)).unwrap();
    let log = bristle_gap::log::Log::read(&path).unwrap();
    assert_eq!((log.len(), log.gaps().len()), (records.len(), 0));
    println!("log of {} samples; {speed:.0} ticks/s", log.len());
    // Real time.
    assert!(speed > 10_000.0, "{speed:.0} ticks/s");
}
