//! The sine experiment of the thesis on the image, from reset to log.

mod common;
#[path = "common/reference.rs"]
mod reference;

use bristle_core::command::{Command, Reply};
use bristle_core::experiment::Bounds;
use bristle_core::parameters::BENCH;
use bristle_core::trace::Record;
use bristle_image::host::Session;
use reference::{SINE, bits, on_the_host};
use std::fmt::Write;
use std::time::Instant;

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
    let reply = session
        .ask(&Command::Play(SINE, Bounds::open(u32::MAX)))
        .unwrap();
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
    let host = on_the_host(
        &BENCH,
        None,
        records,
        counts,
        &[(SINE, Bounds::open(u32::MAX))],
    );
    let moved = records.iter().map(|r| r.counts.abs()).max().unwrap();
    assert_eq!(host.len(), records.len());
    let mut differences = 0;
    for (image, host) in records.iter().zip(&host) {
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
